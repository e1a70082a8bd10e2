#include "record/recorded_truth.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"

#define MAX_README_BYTES (64u << 10)
#define MAX_TABLE_BYTES  (1u << 30)
#define MAX_COLUMNS      12
#define MAX_TIME_US      9e15
#define MAX_POSITION_M   1e6

static void path_of(const struct shef_recorded_truth *truth, const char *name, char out_path[4200])
{
    snprintf(out_path, 4200, "%.4095s/%.100s", truth->folder, name);
}

/* Takes "key: value" out of the README. */
static void take_line(const char *text, const char *key, char *out_value, size_t value_bytes)
{
    const char *at = strstr(text, key);

    if (at)
        snprintf(out_value, value_bytes, "%.*s", (int)strcspn(at + strlen(key), "\n"),
                 at + strlen(key));
}

static enum shef_err read_readme(struct shef_recorded_truth *truth, const char *recording,
                                 struct shef_error *err)
{
    char path[4200];
    uint8_t *bytes;
    size_t n_bytes;
    unsigned version = 0;

    path_of(truth, "README", path);

    const enum shef_err code = shef_file_read(path, MAX_README_BYTES, &bytes, &n_bytes, err);

    if (code == SHEF_ERR_NOT_FOUND)
        return shef_fail(err, code,
                         "'%s' has no ground truth, or it was not written to its end: there is no "
                         "'%s'; only simulated recordings have it",
                         recording, path);
    if (code != SHEF_OK)
        return code;
    if (sscanf((const char *)bytes, "shef-truth %u", &version) == 1 &&
        version <= SHEF_TRUTH_VERSION) {
        take_line((const char *)bytes, "\nprofile: ", truth->profile, sizeof truth->profile);
        take_line((const char *)bytes, "\nsource: ", truth->source, sizeof truth->source);
    }
    free(bytes);
    if (version == 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s' does not begin with 'shef-truth 1'", path);
    return version <= SHEF_TRUTH_VERSION
               ? SHEF_OK
               : shef_fail(err, SHEF_ERR_UNSUPPORTED,
                           "'%s' is of version %u, this program reads up to %d; use a newer one",
                           path, version, SHEF_TRUTH_VERSION);
}

static enum shef_err read_calibration(struct shef_recorded_truth *truth, struct shef_error *err)
{
    char path[4200];

    path_of(truth, "calibration.yaml", path);

    const enum shef_err code = shef_calibration_read(path, &truth->calibration, err);

    return code == SHEF_OK
               ? shef_rectification_pair(&truth->calibration, truth->profile, &truth->left,
                                         &truth->right, &truth->baseline_m, err)
               : code;
}

/* A row of a table: its columns as texts and, but for the first one, as numbers. */
struct row {
    const char *texts[MAX_COLUMNS];
    double values[MAX_COLUMNS];
    int n;
};

static bool parse_row(char *line, struct row *row)
{
    char *rest = line;

    row->n = 0;
    for (char *column; (column = strsep(&rest, ","));) {
        char *end;

        if (row->n == MAX_COLUMNS)
            return false;
        row->texts[row->n] = column;
        row->values[row->n] = strtod(column, &end);
        if ((end == column || *end != '\0') && row->n > 0)
            return false;
        row->n++;
    }
    return true;
}

static int64_t ns_of(double us)
{
    return llround(us * 1000.0);
}

/* A pose from x, y, z and a quaternion. Returns false if it is none. */
static bool rigid_of(const double *values, struct shef_rigid *out_t)
{
    const double *q = values + 3;
    const double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];

    for (int i = 0; i < 3; i++)
        if (!(fabs(values[i]) <= MAX_POSITION_M))
            return false;
    if (!(fabs(length2 - 1) <= 1e-6))
        return false;
    *out_t = shef_rigid_from_quaternion(q, values);
    return true;
}

static bool is_time(double us)
{
    return fabs(us) <= MAX_TIME_US;
}

static bool take_pose(const struct row *row, void *out_item)
{
    struct shef_truth_pose *pose = out_item;

    pose->time.ns = is_time(row->values[0]) ? ns_of(row->values[0]) : 0;
    return row->n == 8 && is_time(row->values[0]) && rigid_of(row->values + 1, &pose->t_world_hand);
}

static bool take_frame(const struct row *row, void *out_item)
{
    struct shef_truth_frame *frame = out_item;
    char *end;

    if (row->n != 11 || !is_time(row->values[1]) || !is_time(row->values[2]) ||
        !is_time(row->values[3]))
        return false;
    frame->number = strtoull(row->texts[0], &end, 10);
    frame->rise.ns = ns_of(row->values[1]);
    frame->middle.ns = ns_of(row->values[2]);
    frame->exposure_ns = ns_of(row->values[3]);
    return *end == '\0' && end > row->texts[0] && rigid_of(row->values + 4, &frame->t_world_hand);
}

static bool take_clock(const struct row *row, void *out_item)
{
    struct shef_truth_clock *clock = out_item;

    if (row->n != 3 || !*row->texts[0] || !(fabs(row->values[1]) <= 9e18) ||
        !isfinite(row->values[2]))
        return false;
    snprintf(clock->name, sizeof clock->name, "%.15s", row->texts[0]);
    clock->offset_ns = strtoll(row->texts[1], NULL, 10);
    clock->drift_ppm = row->values[2];
    return true;
}

/* Reads a table of items into memory of its own. */
static enum shef_err read_table(const struct shef_recorded_truth *truth, const char *name,
                                size_t item_bytes, bool take(const struct row *row, void *out_item),
                                void **out_items, uint32_t *out_n, struct shef_error *err)
{
    char path[4200];
    uint8_t *bytes;
    size_t n_bytes;
    uint32_t n_lines = 0;
    uint32_t n = 0;

    path_of(truth, name, path);

    enum shef_err code = shef_file_read(path, MAX_TABLE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    for (size_t i = 0; i < n_bytes; i++)
        n_lines += bytes[i] == '\n';

    char *items = calloc((size_t)n_lines + 1, item_bytes);
    char *rest = (char *)bytes;

    if (!items)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "read '%s': out of memory", path);
    /* The first line names the columns. */
    (void)strsep(&rest, "\n");
    for (char *line; code == SHEF_OK && (line = strsep(&rest, "\n")) && *line;) {
        struct row row;

        if (n == n_lines || !parse_row(line, &row) || !take(&row, items + n * item_bytes))
            code = shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %u is damaged", path, n + 2);
        n++;
    }
    free(bytes);
    if (code != SHEF_OK) {
        free(items);
        return code;
    }
    *out_items = items;
    *out_n = n;
    return SHEF_OK;
}

static enum shef_err read_tables(struct shef_recorded_truth *truth, struct shef_error *err)
{
    void *clocks = NULL;
    void *poses = NULL;
    void *frames = NULL;
    enum shef_err code = read_table(truth, "poses.csv", sizeof *truth->poses, take_pose, &poses,
                                    &truth->n_poses, err);

    truth->poses = poses;
    if (code == SHEF_OK)
        code = read_table(truth, "frames.csv", sizeof *truth->frames, take_frame, &frames,
                          &truth->n_frames, err);
    truth->frames = frames;
    if (code == SHEF_OK)
        code = read_table(truth, "clocks.csv", sizeof *truth->clocks, take_clock, &clocks,
                          &truth->n_clocks, err);
    if (code != SHEF_OK)
        return code;
    if (truth->n_clocks > SHEF_TRUTH_MAX_CLOCKS)
        truth->n_clocks = SHEF_TRUTH_MAX_CLOCKS;
    memcpy(truth->clocks, clocks, truth->n_clocks * sizeof *truth->clocks);
    free(clocks);
    return SHEF_OK;
}

enum shef_err shef_recorded_truth_open(const char *path, struct shef_recorded_truth *out_truth,
                                       struct shef_error *err)
{
    struct shef_recorded_truth truth = { .n_poses = 0 };
    enum shef_err code;

    if (snprintf(truth.folder, sizeof truth.folder, "%s/" SHEF_TRUTH_FOLDER, path) >=
        (int)sizeof truth.folder)
        return shef_fail(err, SHEF_ERR_INVALID, "open '%s': the path is too long", path);
    code = read_readme(&truth, path, err);
    if (code == SHEF_OK)
        code = read_calibration(&truth, err);
    if (code == SHEF_OK)
        code = read_tables(&truth, err);
    if (code != SHEF_OK) {
        shef_recorded_truth_close(&truth);
        return code;
    }
    *out_truth = truth;
    return SHEF_OK;
}

const struct shef_truth_frame *shef_recorded_truth_frame(const struct shef_recorded_truth *truth,
                                                         uint64_t number)
{
    for (uint32_t i = 0; i < truth->n_frames; i++)
        if (truth->frames[i].number == number)
            return &truth->frames[i];
    return NULL;
}

const struct shef_truth_clock *shef_recorded_truth_clock(const struct shef_recorded_truth *truth,
                                                         const char *name)
{
    for (uint32_t i = 0; i < truth->n_clocks; i++)
        if (strcmp(truth->clocks[i].name, name) == 0)
            return &truth->clocks[i];
    return NULL;
}

static enum shef_err read_depth(const char *path, struct shef_image_f32 *out_depth_m,
                                struct shef_error *err)
{
    struct shef_image_u16 depth_mm;
    enum shef_err code = shef_png_read_u16(path, &depth_mm, err);

    if (code != SHEF_OK)
        return code;
    code = shef_image_create_f32(out_depth_m, depth_mm.width_px, depth_mm.height_px, err);
    for (int32_t y = 0; code == SHEF_OK && y < depth_mm.height_px; y++)
        for (int32_t x = 0; x < depth_mm.width_px; x++)
            shef_row_f32(*out_depth_m, y)[x] = (float)shef_row_u16(depth_mm, y)[x] / 1000.0f;
    shef_image_destroy_u16(&depth_mm);
    return code;
}

enum shef_err shef_recorded_truth_maps(const struct shef_recorded_truth *truth,
                                       enum shef_truth_view view, uint64_t number,
                                       struct shef_truth_maps *out_maps, struct shef_error *err)
{
    const char *const prefix = view == SHEF_TRUTH_LEFT ? "" : "right_";
    struct shef_truth_maps maps = { .depth_m = { .width_px = 0 } };
    char name[64];
    char path[4200];

    snprintf(name, sizeof name, "%sdepth/%06" PRIu64 ".png", prefix, number);
    path_of(truth, name, path);

    enum shef_err code = read_depth(path, &maps.depth_m, err);

    snprintf(name, sizeof name, "%sdisparity/%06" PRIu64 ".pfm", prefix, number);
    path_of(truth, name, path);
    if (code == SHEF_OK)
        code = shef_pfm_read(path, &maps.disparity, err);
    snprintf(name, sizeof name, "%smask/%06" PRIu64 ".png", prefix, number);
    path_of(truth, name, path);
    if (code == SHEF_OK)
        code = shef_png_read_u8(path, &maps.mask, err);
    if (code == SHEF_OK && (maps.depth_m.width_px != truth->left.width_px ||
                            maps.depth_m.height_px != truth->left.height_px ||
                            maps.disparity.width_px != truth->left.width_px ||
                            maps.disparity.height_px != truth->left.height_px ||
                            maps.mask.width_px != truth->left.width_px ||
                            maps.mask.height_px != truth->left.height_px))
        code = shef_fail(err, SHEF_ERR_FORMAT,
                         "the maps of frame %" PRIu64 " in '%s' are not of the profile's size",
                         number, truth->folder);
    if (code != SHEF_OK) {
        shef_truth_maps_free(&maps);
        return code;
    }
    *out_maps = maps;
    return SHEF_OK;
}

void shef_truth_maps_free(struct shef_truth_maps *maps)
{
    shef_image_destroy_f32(&maps->depth_m);
    shef_image_destroy_f32(&maps->disparity);
    shef_image_destroy_u8(&maps->mask);
}

void shef_recorded_truth_close(struct shef_recorded_truth *truth)
{
    free(truth->poses);
    free(truth->frames);
    truth->poses = NULL;
    truth->frames = NULL;
}
