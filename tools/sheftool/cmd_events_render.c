/* sheftool events render: the filtered image and its edges, as pictures or as a video. */
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "core/cpu.h"
#include "core/png_io.h"
#include "sheftool/command.h"
#include "sheftool/events_frame.h"
#include "sheftool/events_moments.h"
#include "sheftool/events_video.h"
#include "sheftool/output_folder.h"

struct settings {
    const char *in;
    const char *out;
    double rate_hz;
    bool at_triggers;
    int64_t channel;
    double exposure_ms;
    double from_s;
    double to_s;
    int32_t show;
    int32_t edges;
    int32_t read;
    double cutoff_rad_s;
    bool keep_hot;
    double range_c;
    double fps;
};

#define MAX_AHEAD_RATE_HZ 250 /* snapshots that look ahead overlap; the schedule holds eight */

static const struct shef_option options[] = {
    SHEF_OPT_WORD("SOURCE", struct settings, in, true,
                  "a RAW file, a DAT file, or the folder of a recording"),
    SHEF_OPT_WORD("RESULT", struct settings, out, true,
                  "a folder for PNG files, or a name that ends in .mp4"),
    SHEF_OPT_REAL("rate", struct settings, rate_hz, "54", 0.001, 10000, "Hz",
                  "pictures a second of event time, from the first event on"),
    SHEF_OPT_FLAG("triggers", struct settings, at_triggers,
                  "instead: one at the middle of each exposure that the trigger input shows"),
    SHEF_OPT_INT("channel", struct settings, channel, "0", 0, 31, NULL, "the trigger input"),
    SHEF_OPT_REAL("exposure", struct settings, exposure_ms, "5", 0, 1000, "ms",
                  "exposure where no falling edge tells it"),
    SHEF_OPT_REAL("from", struct settings, from_s, "0", 0, 1e9, "s",
                  "start here, counted from the first event"),
    SHEF_OPT_REAL("to", struct settings, to_s, "1e9", 0, 1e9, "s", "end here"),
    SHEF_OPT_CHOICE("show", struct settings, show, "both|image|edges", "both",
                    "the filtered image, its edges, or both side by side"),
    SHEF_OPT_CHOICE("edges", struct settings, edges, "signed|graded|thick|thin", "signed",
                    "kind of edges; thick is the paper's"),
    SHEF_OPT_CHOICE("read", struct settings, read, "at-mid|late|centred", "centred",
                    "how the filter is read: at the instant, with the trail behind moving edges, "
                    "or later, or with a trail on both sides"),
    SHEF_OPT_REAL("cutoff", struct settings, cutoff_rad_s, "120", 8, 2000, "rad/s",
                  "of the filter"),
    SHEF_OPT_FLAG("keep-hot", struct settings, keep_hot, "do not mask hot pixels"),
    SHEF_OPT_REAL("range", struct settings, range_c, "3", 0.01, 100, "contrast steps",
                  "what is white in the filtered image"),
    SHEF_OPT_REAL("fps", struct settings, fps, "25", 1, 240, "Hz",
                  "pictures a second that the video shows"),
    SHEF_OPT_END,
};

/* What is written: pictures into a folder, or a video. */
struct output {
    const struct settings *settings;
    bool is_video;
    struct shef_frame frame;
    struct shef_output_folder folder;
    struct shef_video *video;
    json_t *list; /* of the pictures */
    uint64_t n;
    uint64_t n_predicted; /* of them: their trigger was lost */
};

static bool is_video_name(const char *path)
{
    const size_t n = strlen(path);

    return n > 4 && strcasecmp(path + n - 4, ".mp4") == 0;
}

/* Names that ask for a file of a kind that is not written; a folder would surprise. */
static bool is_other_file_name(const char *path)
{
    static const char *const endings[] = { ".avi", ".gif", ".jpg", ".jpeg", ".m4v",
                                           ".mkv", ".mov", ".mpg", ".png",  ".webm" };
    const char *dot = strrchr(path, '.');

    for (size_t i = 0; dot && i < sizeof endings / sizeof endings[0]; i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return true;
    return false;
}

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    if (is_other_file_name(settings->out))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s': the result is a folder of PNG files or a video in .mp4; name one "
                         "of these",
                         settings->out);
    if (settings->to_s < settings->from_s)
        return shef_fail(err, SHEF_ERR_INVALID, "--to %g lies before --from %g", settings->to_s,
                         settings->from_s);
    if (!settings->at_triggers && settings->rate_hz > MAX_AHEAD_RATE_HZ &&
        settings->read != SHEF_SNAPSHOT_AT_MID)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "--rate %g: above %d Hz only --read at-mid is possible, which does not "
                         "look ahead",
                         settings->rate_hz, MAX_AHEAD_RATE_HZ);
    return SHEF_OK;
}

static enum shef_err open_output(struct output *output, uint32_t width_px, uint32_t height_px,
                                 struct shef_error *err)
{
    const struct settings *settings = output->settings;
    const struct shef_frame_params params = {
        .show = (enum shef_frame_show)settings->show,
        .edges = (enum shef_frame_edges)settings->edges,
        .range_c = settings->range_c,
        .width_px = (int32_t)width_px,
        .height_px = (int32_t)height_px,
    };
    enum shef_err code = shef_frame_create(&output->frame, &params, err);

    if (code != SHEF_OK)
        return code;
    output->list = json_array();
    output->is_video = is_video_name(settings->out);
    if (output->is_video)
        return shef_video_create(&output->video, settings->out, output->frame.picture.width_px,
                                 output->frame.picture.height_px, settings->fps, err);
    return shef_output_folder_open(&output->folder, settings->out, "render.json", err);
}

static void discard_output(struct output *output)
{
    shef_video_abandon(output->video);
    shef_output_folder_discard(&output->folder);
    shef_frame_destroy(&output->frame);
    json_decref(output->list);
}

static enum shef_err write_picture(struct output *output, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];

    if (output->is_video)
        return shef_video_add(output->video, output->frame.picture, err);

    const enum shef_err code =
        shef_output_folder_add(&output->folder, path, err, "%06" PRIu64 ".png", output->n);

    return code == SHEF_OK ? shef_png_write_rgb8(path, output->frame.picture, err) : code;
}

static enum shef_err use_moment(void *context, const struct shef_moment *moment,
                                struct shef_error *err)
{
    struct output *output = context;
    const struct shef_snapshot *snapshot = moment->snapshot;
    const double threshold_c = shef_frame_draw(&output->frame, moment);
    const enum shef_err code = write_picture(output, err);

    json_array_append_new(
        output->list,
        json_pack("{s:I, s:I, s:f, s:f, s:f, s:b, s:b, s:f, s:I}", "picture", (json_int_t)output->n,
                  "snapshot", (json_int_t)snapshot->number, "since_first_s",
                  (double)moment->since_first_us / 1e6, "exposure_ms",
                  (double)snapshot->exposure_ns / 1e6, "t_err_ms", (double)snapshot->t_err_ns / 1e6,
                  "predicted", (snapshot->flags & SHEF_SNAPSHOT_PREDICTED) != 0, "late_trigger",
                  (snapshot->flags & SHEF_SNAPSHOT_LATE_TRIGGER) != 0, "edge_threshold_c",
                  threshold_c, "hot_pixels", (json_int_t)moment->n_hot));
    output->n++;
    output->n_predicted += (snapshot->flags & SHEF_SNAPSHOT_PREDICTED) != 0;
    return code;
}

/* No picture at all: why. */
static enum shef_err refuse_nothing(const struct settings *settings,
                                    const struct shef_snapshot_stats *stats, struct shef_error *err)
{
    if (settings->at_triggers && stats->n_triggers == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' has no trigger on channel %d; name another with --channel, or "
                         "leave --triggers out to render at a rate",
                         settings->in, (int)settings->channel);
    return shef_fail(err, SHEF_ERR_INVALID,
                     "'%s' has no instant to render between --from and --to; a higher --rate or "
                     "--read at-mid finds some in short streams",
                     settings->in);
}

static enum shef_err commit_output(struct output *output, struct shef_error *err)
{
    if (output->is_video) {
        struct shef_video *video = output->video;

        output->video = NULL;
        return shef_video_close(video, err);
    }

    json_t *root = json_pack("{s:s, s:O}", "kind", "event_pictures", "pictures", output->list);

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");

    const enum shef_err code = shef_output_folder_commit(&output->folder, root, err);

    json_decref(root);
    return code;
}

static void sum_up(const struct output *output, const struct shef_snapshot_stats *stats)
{
    printf("%" PRIu64 " picture%s", output->n, output->n == 1 ? "" : "s");
    if (output->n_predicted > 0)
        printf(", %" PRIu64 " of a lost trigger at the predicted instant", output->n_predicted);
    if (stats->n_lost > 0)
        printf("; %" PRIu64 " could not be taken", stats->n_lost);
    putchar('\n');
}

static enum shef_err render(const struct settings *settings, struct shef_events_source *source,
                            uint32_t width_px, uint32_t height_px, struct shef_error *err)
{
    struct output output = { .settings = settings };
    const struct shef_moments_params params = {
        .rate_hz = settings->at_triggers ? 0 : settings->rate_hz,
        .channel = (int32_t)settings->channel,
        .exposure_us = (int64_t)(1000 * settings->exposure_ms),
        .from_s = settings->from_s,
        .to_s = settings->to_s,
        .cutoff_rad_s = settings->cutoff_rad_s,
        .read = (enum shef_snapshot_read)settings->read,
        .mask_hot = !settings->keep_hot,
        .width_px = width_px,
        .height_px = height_px,
    };
    struct shef_snapshot_stats stats;
    enum shef_err code = open_output(&output, width_px, height_px, err);

    if (code == SHEF_OK)
        code = shef_moments_run(source, &params, use_moment, &output, &stats, err);
    if (code == SHEF_OK && output.n == 0)
        code = refuse_nothing(settings, &stats, err);
    if (code == SHEF_OK)
        code = commit_output(&output, err);
    if (code == SHEF_OK)
        sum_up(&output, &stats);
    discard_output(&output);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_events_source *source;
    uint32_t width_px;
    uint32_t height_px;
    enum shef_err code = shef_events_source_open(settings->in, shef_cpu_features(), &source, err);

    if (code != SHEF_OK)
        return code;
    code = shef_events_source_size(source, settings->in, &width_px, &height_px, err);
    if (code == SHEF_OK && (width_px > 2048 || height_px > 2048))
        code = shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "'%s' is of a sensor of %u x %u px; at most 2048 x 2048 can be filtered",
                         settings->in, width_px, height_px);
    if (code == SHEF_OK)
        code = render(settings, source, width_px, height_px, err);
    if (code == SHEF_OK)
        shef_events_source_print_notes(source);
    shef_events_source_close(source);
    return code;
}

const struct shef_command shef_command_events_render = {
    .name = "events render",
    .summary = "the filtered image and its edges, as pictures or video",
    .description =
        "Runs the events through the live pipeline's filter and draws what it holds, at a rate or\n"
        "in the middle of each exposure that the trigger input shows: grey, white where\n"
        "brightness rose and black where it fell, and the edges found in it, blue for rising and\n"
        "orange for falling brightness. Both are on the sensor's own pixels. A folder gets\n"
        "NNNNNN.png and render.json with the time of each; a name that ends in .mp4 a video.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
