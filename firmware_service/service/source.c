#include "service/source.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/frame.h"
#include "record/recording.h"
#include "service/wiring.h"

static int64_t max_i64(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static enum shef_err fail_folder(const char *path, int os_errno, struct shef_error *err)
{
    if (os_errno == EACCES)
        return shef_fail(err, SHEF_ERR_PERMISSION,
                         "play '%s': Permission denied; shefd runs as user %u, who must be able to "
                         "read the folder and all above it",
                         path, (unsigned)geteuid());
    if (os_errno == ENOENT &&
        (strncmp(path, "/tmp/", 5) == 0 || strncmp(path, "/var/tmp/", 9) == 0))
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "play '%s': shefd sees no such folder; as a service it has a /tmp of its "
                         "own, so put the recording elsewhere",
                         path);
    return shef_fail_os(err, os_errno, "play '%s'", path);
}

/* A name that leads nowhere, or where this user may not look, is not the same as a folder that is
 * no recording. */
static enum shef_err check_folder(const char *path, struct shef_error *err)
{
    DIR *folder = opendir(path);

    if (!folder)
        return fail_folder(path, errno, err);
    closedir(folder);
    return SHEF_OK;
}

/* Truth is for comparisons, nobody plays it. */
static bool is_played(const char *file)
{
    return strncmp(file, "truth/", 6) != 0;
}

/* The manifest of a closed recording knows how long its files were. */
static void warn_of_short_files(struct shef_source *source, const struct shef_manifest *manifest)
{
    size_t n_short = 0;

    for (size_t i = 0; i < manifest->n_files; i++) {
        const struct shef_manifest_file *file = &manifest->files[i];
        char path[sizeof source->path + SHEF_MANIFEST_PATH_BYTES];
        struct stat info;
        int64_t n_bytes = 0;

        snprintf(path, sizeof path, "%s/%s", source->path, file->path);
        if (stat(path, &info) == 0)
            n_bytes = (int64_t)info.st_size;
        if (!is_played(file->path) || n_bytes >= (int64_t)file->n_bytes || n_short++ > 0)
            continue;
        snprintf(source->warning, sizeof source->warning,
                 "of %s %" PRId64 " of %" PRIu64 " bytes are there; what is there is played",
                 file->path, n_bytes, file->n_bytes);
    }
    if (n_short > 1) {
        const size_t used = strlen(source->warning);

        snprintf(source->warning + used, sizeof source->warning - used,
                 " (%zu files are too short or missing)", n_short);
    }
}

static enum shef_err read_manifest(struct shef_source *source, struct shef_error *err)
{
    struct shef_recording recording;
    enum shef_err code = check_folder(source->path, err);

    if (code == SHEF_OK)
        code = shef_recording_inspect(source->path, &recording, err);
    if (code != SHEF_OK)
        return code;
    if (!recording.has_manifest) {
        snprintf(source->warning, sizeof source->warning, "its manifest cannot be read: %.400s",
                 recording.manifest_trouble);
    } else {
        memcpy(source->session, recording.manifest.session, sizeof source->session);
        source->utc_minus_host_ns = recording.manifest.utc_minus_host_ns;
        source->event_camera = recording.manifest.events.camera;
        if (!recording.manifest.is_closed)
            snprintf(source->warning, sizeof source->warning,
                     "the recording was cut short before it was closed; what is there is played");
        else
            warn_of_short_files(source, &recording.manifest);
    }
    memcpy(&source->session_id, source->session, sizeof source->session_id);
    source->session_id &= INT64_MAX;
    shef_recording_free(&recording);
    return SHEF_OK;
}

static enum shef_err open_events(struct shef_source *source, bool with_buffers,
                                 struct shef_error *err)
{
    const struct shef_replay_config config = {
        .pace = SHEF_REPLAY_FAST,
        .n_buffers = !with_buffers ? 1 : SHEF_RING_EVENTS + SHEF_RING_RECORD_EVENTS / 4,
    };
    enum shef_err code = shef_replay_create(source->path, &config, &source->events, err);

    if (code == SHEF_ERR_NOT_FOUND)
        return shef_fail(err, code,
                         "play '%s': it holds no events, without which there is no depth",
                         source->path);
    if (code == SHEF_OK) {
        const struct shef_event_part *part = shef_replay_part(source->events);

        /* The index vouches, the manifest is for people. */
        source->event_camera.format = part->format;
        source->event_camera.width_px = part->width_px;
        source->event_camera.height_px = part->height_px;
        code = shef_recorded_clock_read(source->path, &source->clock, err);
    }
    if (code == SHEF_OK && !source->clock.is_known)
        code =
            shef_fail(err, SHEF_ERR_FORMAT,
                      "play '%s': the events' index does not say when they arrived", source->path);
    return code;
}

static void note_text(struct shef_source *source, const char *key, char out_text[64])
{
    snprintf(out_text, 64, "%.63s", shef_recorded_frames_text(source->frames, key));
}

static enum shef_err open_frames(struct shef_source *source, bool with_buffers,
                                 struct shef_error *err)
{
    const enum shef_err code = shef_recorded_frames_open(source->path, &source->frames, err);

    if (code == SHEF_ERR_NOT_FOUND || code == SHEF_ERR_EMPTY)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "play '%s': it holds no frames, without which there is no depth",
                         source->path);
    if (code != SHEF_OK)
        return code;
    note_text(source, "vendor", source->frame_camera.vendor);
    note_text(source, "model", source->frame_camera.model);
    note_text(source, "serial", source->frame_camera.serial);
    source->n_frames = shef_recorded_frames_count(source->frames);
    if (!with_buffers)
        return SHEF_OK;
    source->frame_pool =
        shef_pool_create(SHEF_SOURCE_FRAMES, shef_recorded_frames_max_bytes(source->frames), err);
    return source->frame_pool ? SHEF_OK : SHEF_ERR_NO_MEMORY;
}

static enum shef_err read_calibration(struct shef_source *source, const char *path,
                                      struct shef_error *err)
{
    char *own = source->calibration_path;

    if (*path) {
        snprintf(own, sizeof source->calibration_path, "%s", path);
        return shef_calibration_read(path, &source->calibration, err) == SHEF_OK
                   ? SHEF_OK
                   : shef_fail_context(err, "calibration.file");
    }
    snprintf(own, sizeof source->calibration_path, "%s/calibration.yaml", source->path);
    if (access(own, F_OK) != 0)
        return shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "play '%s': it has no calibration.yaml, without which there is no depth; "
                         "name one with the setting calibration.file",
                         source->path);
    return shef_calibration_read(own, &source->calibration, err);
}

static enum shef_err check_size(const struct shef_source *source, const char *what,
                                uint32_t width_px, uint32_t height_px,
                                const struct shef_calibrated_camera *camera, struct shef_error *err)
{
    if ((int32_t)width_px == camera->width_px && (int32_t)height_px == camera->height_px)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "play '%s': it has %s of %u x %u px, but the calibration is for %d x %d px; "
                     "name the right one with the setting calibration.file",
                     source->path, what, width_px, height_px, camera->width_px, camera->height_px);
}

static enum shef_err check_format(struct shef_source *source, struct shef_error *err)
{
    const struct shef_frame_part *frames = shef_recorded_frames_format(source->frames);
    const struct shef_event_part *events = shef_replay_part(source->events);
    enum shef_err code = check_size(source, "frames", frames->width_px, frames->height_px,
                                    &source->calibration.frame, err);

    if (code == SHEF_OK)
        code = check_size(source, "events", events->width_px, events->height_px,
                          &source->calibration.event, err);
    if (code != SHEF_OK)
        return code;
    if (!shef_frame_pixels_of(frames->pixel_format, &source->pixels))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "play '%s': its frames have the pixel format 0x%08x; Mono8 and Bayer of 8 "
                         "bits can be processed",
                         source->path, frames->pixel_format);
    return SHEF_OK;
}

static enum shef_err read_poses(struct shef_source *source, struct shef_error *err)
{
    const enum shef_err code =
        shef_pose_track_read(source->path, source->calibration.robot_delay.ns, &source->poses, err);

    /* Without poses the direction of motion is found from the pictures. */
    return code == SHEF_ERR_NOT_FOUND ? SHEF_OK : code;
}

/* Nothing is processed with them, so nothing fails for want of them. */
static enum shef_err read_edges(struct shef_source *source, struct shef_error *err)
{
    struct shef_error trouble;
    const enum shef_err code = shef_edge_track_read(source->path, &source->edges, &trouble);

    if (code == SHEF_ERR_NO_MEMORY) {
        *err = trouble;
        return code;
    }
    if (code != SHEF_OK && code != SHEF_ERR_NOT_FOUND && !*source->warning)
        snprintf(source->warning, sizeof source->warning,
                 "its sync edges cannot be read and are left out: %.400s", trouble.text);
    if (code == SHEF_OK)
        source->edges_per_pass =
            source->edges.edges[source->edges.n - 1].number - source->edges.edges[0].number + 1;
    return SHEF_OK;
}

/* What the snapshots of the last frames still need of event time: 25 ms after mid-exposure. */
#define TAIL_NS (30 * SHEF_NS_PER_MS)

/* A pass takes whole frame periods, so that the triggers' rhythm goes on, and more than any part
 * lasts, so that no time steps back. */
static void measure(struct shef_source *source)
{
    const struct shef_frame_info *first = shef_recorded_frames_info(source->frames, 0);
    const struct shef_frame_info *last =
        shef_recorded_frames_info(source->frames, source->n_frames - 1);
    const struct shef_recorded_clock *clock = &source->clock;
    const int64_t frames_ns = shef_frame_time_since(last->time, first->time);
    const int64_t period_ns =
        source->n_frames > 1 && frames_ns > 0
            ? max_i64(frames_ns / (int64_t)(source->n_frames - 1), SHEF_NS_PER_MS)
            : 100 * SHEF_NS_PER_MS;
    shef_host_time ends = clock->last_arrived;

    source->numbers_per_pass = last->number - first->number + 1;
    source->begins = clock->first_arrived;
    if (shef_host_time_before(first->arrived, source->begins))
        source->begins = first->arrived;
    if (shef_host_time_before(ends, last->arrived))
        ends = last->arrived;
    if (source->edges.n > 0 &&
        shef_host_time_before(ends, source->edges.edges[source->edges.n - 1].time))
        ends = source->edges.edges[source->edges.n - 1].time;
    source->length_ns = shef_host_time_since(ends, source->begins);
    source->pass_ns = max_i64(source->length_ns, frames_ns);
    source->pass_ns =
        max_i64(source->pass_ns, shef_event_time_since(clock->last_event, clock->event));
    source->pass_ns =
        (source->pass_ns / period_ns + 3) * period_ns / SHEF_NS_PER_US * SHEF_NS_PER_US;
    /* Not as far as the next pass: whatever lies between them is at least two periods. */
    source->tail_ns = period_ns * 3 / 2 < TAIL_NS ? period_ns * 3 / 2 : TAIL_NS;
}

static enum shef_err open_source(const char *path, const char *calibration_path, bool with_buffers,
                                 struct shef_source **out_source, struct shef_error *err)
{
    struct shef_source *source = calloc(1, sizeof *source);
    enum shef_err code;

    if (!source)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "play '%s': out of memory", path);
    snprintf(source->path, sizeof source->path, "%s", path);
    code = read_manifest(source, err);
    if (code == SHEF_OK)
        code = open_events(source, with_buffers, err);
    if (code == SHEF_OK)
        code = open_frames(source, with_buffers, err);
    if (code == SHEF_OK)
        code = read_calibration(source, calibration_path, err);
    if (code == SHEF_OK)
        code = check_format(source, err);
    if (code == SHEF_OK)
        code = shef_first_pair_find(path, source->frames, &source->clock,
                                    source->calibration.frame_delay.ns +
                                        source->calibration.event_delay.ns,
                                    &source->first_pair, err);
    if (code == SHEF_OK)
        code = read_poses(source, err);
    if (code == SHEF_OK)
        code = read_edges(source, err);
    if (code != SHEF_OK) {
        shef_source_close(source);
        return code;
    }
    measure(source);
    *out_source = source;
    return SHEF_OK;
}

enum shef_err shef_source_open(const char *path, const char *calibration_path,
                               struct shef_source **out_source, struct shef_error *err)
{
    return open_source(path, calibration_path, true, out_source, err);
}

enum shef_err shef_source_check(const char *path, const char *calibration_path,
                                struct shef_error *err)
{
    struct shef_source *source = NULL;
    const enum shef_err code = open_source(path, calibration_path, false, &source, err);

    shef_source_close(source);
    return code;
}

void shef_source_close(struct shef_source *source)
{
    if (!source)
        return;
    shef_edge_track_free(&source->edges);
    shef_pose_track_free(&source->poses);
    shef_pool_destroy(source->frame_pool);
    shef_recorded_frames_close(source->frames);
    shef_replay_destroy(source->events);
    free(source);
}
