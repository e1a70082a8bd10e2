#include "record/truth_writer.h"

#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "calib/rectification.h"
#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"

#define MAX_DEPTH_MM 65535.0f

/* The tables, and their first lines. */
enum table { POSES, FRAMES, CLOCKS, TABLES };

static const struct {
    const char *name;
    const char *columns;
} tables[TABLES] = {
    [POSES] = { "poses.csv", "event_us,x_m,y_m,z_m,qw,qx,qy,qz" },
    [FRAMES] = { "frames.csv", "number,rise_us,middle_us,exposure_us,x_m,y_m,z_m,qw,qx,qy,qz" },
    [CLOCKS] = { "clocks.csv", "clock,offset_ns,drift_ppm" },
};

static const char *const map_folders[SHEF_TRUTH_VIEWS][3] = {
    [SHEF_TRUTH_LEFT] = { "depth", "disparity", "mask" },
    [SHEF_TRUTH_RIGHT] = { "right_depth", "right_disparity", "right_mask" },
};

struct shef_truth_writer {
    struct shef_recording_writer *recording;
    char folder[SHEF_PART_PATH_BYTES];
    char profile[SHEF_CALIBRATION_NAME_BYTES];
    char source[256];
    int32_t width_px;
    int32_t height_px;
    FILE *files[TABLES];
    bool has_folders[SHEF_TRUTH_VIEWS];
    bool has_failed;
    struct shef_image_u16 depth_mm;
};

/* Notes an error as the recording's verdict. */
static enum shef_err failed(struct shef_truth_writer *writer, const struct shef_error *failure,
                            struct shef_error *err)
{
    writer->has_failed = true;
    shef_recording_writer_judge(writer->recording, SHEF_VERDICT_STOPPED, failure->text);
    if (err)
        *err = *failure;
    return failure->code;
}

static void path_of(const struct shef_truth_writer *writer, const char *name,
                    char out_path[SHEF_PART_PATH_BYTES + 64])
{
    snprintf(out_path, SHEF_PART_PATH_BYTES + 64, "%s/%s", writer->folder, name);
}

static enum shef_err open_tables(struct shef_truth_writer *writer, struct shef_error *err)
{
    for (int i = 0; i < TABLES; i++) {
        char path[SHEF_PART_PATH_BYTES + 64];

        path_of(writer, tables[i].name, path);
        writer->files[i] = fopen(path, "wxe");
        if (!writer->files[i])
            return shef_fail_os(err, errno, "write '%s'", path);
        fprintf(writer->files[i], "%s\n", tables[i].columns);
    }
    return SHEF_OK;
}

static enum shef_err prepare(struct shef_truth_writer *writer,
                             const struct shef_calibration *calibration, struct shef_error *err)
{
    struct shef_rectification left;
    struct shef_rectification right;
    double baseline_m;
    char path[SHEF_PART_PATH_BYTES + 64];
    enum shef_err code =
        shef_rectification_pair(calibration, writer->profile, &left, &right, &baseline_m, err);

    if (code != SHEF_OK)
        return code;
    writer->width_px = left.width_px;
    writer->height_px = left.height_px;
    code = shef_image_create_u16(&writer->depth_mm, left.width_px, left.height_px, err);
    if (code == SHEF_OK)
        code = shef_recording_writer_add_part(writer->recording, SHEF_TRUTH_FOLDER, writer->folder,
                                              err);
    if (code != SHEF_OK)
        return code;
    path_of(writer, "calibration.yaml", path);
    code = shef_calibration_write(path, calibration, err);
    return code == SHEF_OK ? open_tables(writer, err) : code;
}

static void free_writer(struct shef_truth_writer *writer)
{
    for (int i = 0; i < TABLES; i++)
        if (writer->files[i])
            fclose(writer->files[i]);
    shef_image_destroy_u16(&writer->depth_mm);
    free(writer);
}

enum shef_err shef_truth_writer_start(struct shef_recording_writer *recording,
                                      const struct shef_calibration *calibration,
                                      const char *profile, const char *source,
                                      struct shef_truth_writer **out_writer, struct shef_error *err)
{
    struct shef_truth_writer *writer = calloc(1, sizeof *writer);
    struct shef_error failure;

    if (!writer)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write the truth: out of memory");
    writer->recording = recording;
    snprintf(writer->profile, sizeof writer->profile, "%s", profile);
    snprintf(writer->source, sizeof writer->source, "%s", source);
    for (char *at = writer->source; *at; at++)
        if (*at == '\n')
            *at = ' ';

    enum shef_err code = prepare(writer, calibration, &failure);

    if (code != SHEF_OK) {
        code = failed(writer, &failure, err);
        free_writer(writer);
        return code;
    }
    *out_writer = writer;
    return SHEF_OK;
}

/* Microseconds with the nanoseconds behind the point. */
static void write_us(FILE *file, int64_t ns)
{
    const uint64_t size_ns = ns < 0 ? -(uint64_t)ns : (uint64_t)ns;

    fprintf(file, "%s%" PRIu64 ".%03" PRIu64, ns < 0 ? "-" : "", size_ns / 1000, size_ns % 1000);
}

static void write_rigid(FILE *file, const struct shef_rigid *t)
{
    double q_wxyz[4];

    shef_rigid_quaternion(t, q_wxyz);
    fprintf(file, ",%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", t->t_m[0], t->t_m[1], t->t_m[2],
            q_wxyz[0], q_wxyz[1], q_wxyz[2], q_wxyz[3]);
}

/* After a row: what the disk refuses shows at the latest when the file is closed. */
static enum shef_err check_table(struct shef_truth_writer *writer, enum table table,
                                 struct shef_error *err)
{
    struct shef_error failure;

    if (!ferror(writer->files[table]))
        return SHEF_OK;
    (void)shef_fail_os(&failure, errno, "write '%s/%s'", writer->folder, tables[table].name);
    return failed(writer, &failure, err);
}

enum shef_err shef_truth_writer_pose(struct shef_truth_writer *writer,
                                     const struct shef_truth_pose *pose, struct shef_error *err)
{
    write_us(writer->files[POSES], pose->time.ns);
    write_rigid(writer->files[POSES], &pose->t_world_hand);
    return check_table(writer, POSES, err);
}

enum shef_err shef_truth_writer_frame(struct shef_truth_writer *writer,
                                      const struct shef_truth_frame *frame, struct shef_error *err)
{
    FILE *file = writer->files[FRAMES];

    fprintf(file, "%" PRIu64 ",", frame->number);
    write_us(file, frame->rise.ns);
    fputc(',', file);
    write_us(file, frame->middle.ns);
    fputc(',', file);
    write_us(file, frame->exposure_ns);
    write_rigid(file, &frame->t_world_hand);
    return check_table(writer, FRAMES, err);
}

enum shef_err shef_truth_writer_clock(struct shef_truth_writer *writer,
                                      const struct shef_truth_clock *clock, struct shef_error *err)
{
    fprintf(writer->files[CLOCKS], "%.15s,%" PRId64 ",%.17g\n", clock->name, clock->offset_ns,
            clock->drift_ppm);
    return check_table(writer, CLOCKS, err);
}

static enum shef_err make_map_folders(struct shef_truth_writer *writer, enum shef_truth_view view,
                                      struct shef_error *err)
{
    if (writer->has_folders[view])
        return SHEF_OK;
    for (int i = 0; i < 3; i++) {
        char path[SHEF_PART_PATH_BYTES + 64];

        path_of(writer, map_folders[view][i], path);
        if (mkdir(path, 0777) != 0)
            return shef_fail_os(err, errno, "make folder '%s'", path);
    }
    writer->has_folders[view] = true;
    return SHEF_OK;
}

static void fill_depth_mm(const struct shef_truth_writer *writer, struct shef_image_f32 depth_m)
{
    for (int32_t y = 0; y < depth_m.height_px; y++) {
        const float *from = shef_row_f32(depth_m, y);
        uint16_t *to = shef_row_u16(writer->depth_mm, y);

        for (int32_t x = 0; x < depth_m.width_px; x++) {
            const float mm = from[x] * 1000.0f + 0.5f;

            to[x] = mm >= 1.0f && mm < MAX_DEPTH_MM + 1.0f ? (uint16_t)mm : 0;
        }
    }
}

static enum shef_err write_maps(struct shef_truth_writer *writer, enum shef_truth_view view,
                                uint64_t number, struct shef_image_f32 depth_m,
                                struct shef_image_f32 disparity, struct shef_image_u8 mask,
                                struct shef_error *err)
{
    const char *const *folders = map_folders[view];
    char path[SHEF_PART_PATH_BYTES + 64];
    char name[64];
    enum shef_err code = make_map_folders(writer, view, err);

    if (code != SHEF_OK)
        return code;
    fill_depth_mm(writer, depth_m);
    snprintf(name, sizeof name, "%s/%06" PRIu64 ".png", folders[0], number);
    path_of(writer, name, path);
    code = shef_png_write_u16(path, writer->depth_mm, err);
    if (code != SHEF_OK)
        return code;
    snprintf(name, sizeof name, "%s/%06" PRIu64 ".pfm", folders[1], number);
    path_of(writer, name, path);
    code = shef_pfm_write(path, disparity, err);
    if (code != SHEF_OK)
        return code;
    snprintf(name, sizeof name, "%s/%06" PRIu64 ".png", folders[2], number);
    path_of(writer, name, path);
    return shef_png_write_u8(path, mask, err);
}

enum shef_err shef_truth_writer_maps(struct shef_truth_writer *writer, enum shef_truth_view view,
                                     uint64_t number, struct shef_image_f32 depth_m,
                                     struct shef_image_f32 disparity, struct shef_image_u8 mask,
                                     struct shef_error *err)
{
    struct shef_error failure;
    enum shef_err code;

    if (depth_m.width_px != writer->width_px || depth_m.height_px != writer->height_px ||
        disparity.width_px != writer->width_px || disparity.height_px != writer->height_px ||
        mask.width_px != writer->width_px || mask.height_px != writer->height_px)
        code = shef_fail(&failure, SHEF_ERR_INVALID,
                         "write the truth: maps of %d x %d px, but the profile '%s' has %d x %d",
                         depth_m.width_px, depth_m.height_px, writer->profile, writer->width_px,
                         writer->height_px);
    else
        code = write_maps(writer, view, number, depth_m, disparity, mask, &failure);
    return code == SHEF_OK ? SHEF_OK : failed(writer, &failure, err);
}

static enum shef_err close_tables(struct shef_truth_writer *writer, struct shef_error *err)
{
    for (int i = 0; i < TABLES; i++) {
        FILE *file = writer->files[i];

        writer->files[i] = NULL;
        if (fclose(file) != 0)
            return shef_fail_os(err, errno, "write '%s/%s'", writer->folder, tables[i].name);
    }
    return SHEF_OK;
}

static enum shef_err write_readme(const struct shef_truth_writer *writer, struct shef_error *err)
{
    char text[2048];
    char path[SHEF_PART_PATH_BYTES + 64];
    const int n = snprintf(
        text, sizeof text,
        "shef-truth %d\n"
        "profile: %s\n"
        "source: %s\n"
        "\n"
        "What the simulator knows; docs/recording.md describes the files.\n"
        "poses.csv         the tool's pose T_W_H by event time in us\n"
        "frames.csv        every frame's exposure in event time, and T_W_H at its middle\n"
        "clocks.csv        offset and drift of every clock\n"
        "calibration.yaml  the true one\n"
        "depth/N.png       of frame N at its mid-exposure, rectified left view, mm, 0: none\n"
        "disparity/N.pfm   the same in px\n"
        "mask/N.png        bit 0: seen, bit 1: not seen by the event camera\n"
        "right_*/          the same for the rectified right view\n",
        SHEF_TRUTH_VERSION, writer->profile, writer->source);

    path_of(writer, "README", path);
    return shef_file_replace(path, text, (size_t)n, err);
}

enum shef_err shef_truth_writer_stop(struct shef_truth_writer *writer, struct shef_error *err)
{
    struct shef_error failure;
    enum shef_err code = SHEF_OK;

    if (!writer->has_failed) {
        code = close_tables(writer, &failure);
        if (code == SHEF_OK)
            code = write_readme(writer, &failure);
        if (code != SHEF_OK)
            code = failed(writer, &failure, err);
    }
    free_writer(writer);
    return code;
}
