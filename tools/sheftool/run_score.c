#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "sheftool/run_score_internal.h"

#define CONFIDENT 0.75

const char *shef_run_direction_name(enum shef_run_direction direction)
{
    static const char *const names[SHEF_RUN_N_DIRECTIONS] = {
        [SHEF_RUN_LEFT] = "left", [SHEF_RUN_RIGHT] = "right", [SHEF_RUN_UP] = "up",
        [SHEF_RUN_DOWN] = "down", [SHEF_RUN_STILL] = "still",
    };

    return names[direction];
}

static bool is_same_view(const struct shef_rectification *a, const struct shef_rectification *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* The third row of R_true^T R_own, times a ray: how z changes from one rectified view's axes to the
 * other's. */
static double z_factor(const struct shef_rectification *truth, const struct shef_rectification *own,
                       double x_px, double y_px)
{
    const double ray[3] = { (x_px - own->cx_px) / own->f_px, (y_px - own->cy_px) / own->f_px, 1 };
    double z = 0;

    for (int i = 0; i < 3; i++) {
        const double *row = own->r_camera_rectified + (ptrdiff_t)3 * i;

        z += truth->r_camera_rectified[3 * i + 2] *
             (row[0] * ray[0] + row[1] * ray[1] + row[2] * ray[2]);
    }
    return z;
}

static enum shef_err make_lookups(struct shef_run_scorer *scorer,
                                  const struct shef_rectification *own, struct shef_error *err)
{
    const struct shef_rectification *truth = &scorer->truth.left;
    struct lookup *lookup;

    if (is_same_view(truth, own))
        return SHEF_OK;
    scorer->lookups = shef_memory_create((size_t)truth->width_px * (size_t)truth->height_px,
                                         sizeof *scorer->lookups);
    lookup = scorer->lookups;
    if (!lookup)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "score: out of memory");
    for (int32_t y = 0; y < truth->height_px; y++)
        for (int32_t x = 0; x < truth->width_px; x++, lookup++) {
            double sensor_x, sensor_y, own_x, own_y;

            lookup->at = -1;
            if (!shef_rectification_project(truth, x, y, &sensor_x, &sensor_y) ||
                !shef_rectification_unproject(own, sensor_x, sensor_y, &own_x, &own_y))
                continue;
            const long column = lrint(own_x);
            const long row = lrint(own_y);

            if (column < 0 || column >= own->width_px || row < 0 || row >= own->height_px)
                continue;
            lookup->at = (int32_t)(row * own->width_px + column);
            lookup->z_factor = (float)z_factor(truth, own, own_x, own_y);
        }
    return SHEF_OK;
}

static enum shef_err create_pictures(struct shef_run_scorer *scorer, struct shef_error *err)
{
    const struct shef_rectification *left = &scorer->truth.left;
    const uint32_t format = shef_recorded_frames_format(scorer->frames)->pixel_format;
    const enum shef_frame_pixels pixels =
        format == SHEF_PFNC_MONO8 ? SHEF_FRAME_MONO8 : SHEF_FRAME_BAYER8;
    const struct shef_frame_edges_params params = shef_frame_edges_default_params();
    const size_t n = (size_t)left->width_px * (size_t)left->height_px;
    enum shef_err code =
        shef_frame_rectify_create(&scorer->rectify, left, pixels, shef_cpu_features(), err);

    if (code == SHEF_OK)
        code =
            shef_frame_edges_create(&scorer->edges, left, shef_frame_rectify_valid(scorer->rectify),
                                    &params, shef_cpu_features(), err);
    if (code == SHEF_OK)
        code = shef_edge_map_create(&scorer->map, SHEF_EDGE_UNSIGNED, left->width_px,
                                    left->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_u8(&scorer->picture, left->width_px, left->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(&scorer->scored_truth, left->width_px, left->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(&scorer->estimate, left->width_px, left->height_px, err);
    scorer->pixels = shef_memory_create(n, sizeof *scorer->pixels);
    scorer->near_jump = shef_memory_create(n, 1);
    if (code == SHEF_OK && (!scorer->pixels || !scorer->near_jump))
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "score: out of memory");
    return code;
}

/* The true left view is made of the recording's frames. */
static enum shef_err check_size(const struct shef_run_scorer *scorer, const char *recording,
                                struct shef_error *err)
{
    const struct shef_frame_part *frames = shef_recorded_frames_format(scorer->frames);
    const struct shef_rectification *left = &scorer->truth.left;

    if ((int32_t)frames->width_px == left->sensor_width_px &&
        (int32_t)frames->height_px == left->sensor_height_px)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "'%s' has frames of %u x %u px, but its truth is for %d x %d px: it belongs "
                     "to another recording",
                     recording, frames->width_px, frames->height_px, left->sensor_width_px,
                     left->sensor_height_px);
}

enum shef_err shef_run_scorer_open(struct shef_run_scorer **out_scorer, const char *recording,
                                   const struct shef_calibration *calibration, const char *profile,
                                   struct shef_error *err)
{
    struct shef_run_scorer *scorer = shef_memory_create(1, sizeof *scorer);
    struct shef_rectification own;
    struct shef_rectification right;

    if (!scorer)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "score: out of memory");

    enum shef_err code = shef_recorded_truth_open(recording, &scorer->truth, err);

    if (code == SHEF_OK && strcmp(scorer->truth.profile, profile) != 0)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' has its truth in the profile %s, the estimates are in %s; run with "
                         "--profile %s",
                         recording, scorer->truth.profile, profile, scorer->truth.profile);
    if (code == SHEF_OK)
        code = shef_recorded_frames_open(recording, &scorer->frames, err);
    if (code == SHEF_OK)
        code = check_size(scorer, recording, err);
    if (code == SHEF_OK)
        code =
            shef_rectification_pair(calibration, profile, &own, &right, &scorer->baseline_m, err);
    if (code == SHEF_OK) {
        scorer->f_px = own.f_px;
        code = make_lookups(scorer, &own, err);
    }
    if (code == SHEF_OK)
        code = create_pictures(scorer, err);
    if (code != SHEF_OK) {
        shef_run_scorer_close(scorer);
        return code;
    }
    *out_scorer = scorer;
    return SHEF_OK;
}

void shef_run_scorer_close(struct shef_run_scorer *scorer)
{
    if (!scorer)
        return;
    shef_truth_maps_free(&scorer->maps);
    shef_recorded_truth_close(&scorer->truth);
    shef_recorded_frames_close(scorer->frames);
    shef_frame_rectify_destroy(scorer->rectify);
    shef_frame_edges_destroy(scorer->edges);
    shef_edge_map_destroy(&scorer->map);
    shef_image_destroy_u8(&scorer->picture);
    shef_image_destroy_f32(&scorer->scored_truth);
    shef_image_destroy_f32(&scorer->estimate);
    free(scorer->lookups);
    free(scorer->pixels);
    free(scorer->near_jump);
    free(scorer);
}

/* The estimate nearest to a place, at most a pixel away where views differ. */
static int32_t find_near(struct shef_image_f32 disparity, int32_t at)
{
    static const int8_t around[8][2] = { { 0, -1 },  { 0, 1 },  { -1, 0 }, { 1, 0 },
                                         { -1, -1 }, { -1, 1 }, { 1, -1 }, { 1, 1 } };
    const int32_t x = at % disparity.width_px;
    const int32_t y = at / disparity.width_px;

    if (shef_row_f32(disparity, y)[x] > 0)
        return at;
    for (int i = 0; i < 8; i++) {
        const int32_t row = y + around[i][0];
        const int32_t column = x + around[i][1];

        if (row >= 0 && row < disparity.height_px && column >= 0 && column < disparity.width_px &&
            shef_row_f32(disparity, row)[column] > 0)
            return row * disparity.width_px + column;
    }
    return at;
}

static struct scored_pixel score(const struct shef_run_scorer *scorer,
                                 const struct shef_run_estimate *estimate, int32_t x, int32_t y,
                                 float truth_px, float *out_px)
{
    const int32_t width = scorer->scored_truth.width_px;
    const int32_t here = y * width + x;
    const double true_fb = scorer->truth.left.f_px * scorer->truth.baseline_m;
    struct scored_pixel pixel = { .error_px = INFINITY,
                                  .relative = INFINITY,
                                  .is_away = !scorer->near_jump[here] };
    int32_t at = here;
    double factor = 1;

    *out_px = 0;
    if (scorer->lookups) {
        at = scorer->lookups[here].at;
        factor = scorer->lookups[here].z_factor;
        if (at < 0)
            return pixel;
        at = find_near(estimate->disparity, at);
    }
    const float disparity = shef_row_f32(estimate->disparity, at / width)[at % width];

    if (!(disparity > 0))
        return pixel;

    const double z_m = scorer->f_px * scorer->baseline_m / disparity * factor;
    const double true_z_m = true_fb / truth_px;

    *out_px = (float)(true_fb / z_m);
    pixel.error_px = (float)((*out_px - truth_px) * FIGURE_F_PX / scorer->truth.left.f_px);
    pixel.relative = (float)((z_m - true_z_m) / true_z_m);
    if (estimate->confidence.data)
        pixel.confidence = shef_row_f32(estimate->confidence, at / width)[at % width];
    if (estimate->sigma_m.data)
        pixel.is_within_sigma =
            fabs(z_m - true_z_m) <= shef_row_f32(estimate->sigma_m, at / width)[at % width];
    return pixel;
}

static void part_add(struct shef_run_part *part, const struct scored_pixel *pixel)
{
    const double size = fabs((double)pixel->relative) / SHEF_RUN_ERROR_BIN;
    const double place = ((double)pixel->relative + 0.5) / SHEF_RUN_ERROR_BIN;
    const double last = SHEF_RUN_ERROR_BINS - 1;

    part->n_scored++;
    part->n_bad_1 += !(fabsf(pixel->error_px) <= 1);
    part->n_bad_2 += !(fabsf(pixel->error_px) <= 2);
    part->size[size < last ? (int)size : (int)last]++;
    if (isinf(pixel->error_px))
        return;
    part->n_found++;
    part->signed_size[place < 0 ? 0 : place < last ? (int)place : (int)last]++;
    part->sum_abs_px += fabs((double)pixel->error_px);
    if (fabsf(pixel->error_px) <= 1) {
        part->n_good++;
        part->sum_good_signed += (double)pixel->relative;
    }
}

static int more_confident(const void *a, const void *b)
{
    const float x = ((const struct scored_pixel *)a)->confidence;
    const float y = ((const struct scored_pixel *)b)->confidence;

    return (x < y) - (x > y);
}

static void tally_add(struct shef_run_tally *tally, const struct scored_pixel *pixel,
                      enum shef_run_direction direction)
{
    int bin = (int)(pixel->confidence * SHEF_RUN_N_CONFIDENCE);

    part_add(&tally->all, pixel);
    part_add(&tally->by_direction[direction], pixel);
    if (pixel->is_away)
        part_add(&tally->away, pixel);
    if (isinf(pixel->error_px))
        return;
    bin = bin < SHEF_RUN_N_CONFIDENCE ? bin : SHEF_RUN_N_CONFIDENCE - 1;
    tally->confidence[bin].n++;
    tally->confidence[bin].n_good += fabsf(pixel->error_px) <= 1;
    tally->confidence[bin].sum_confidence += (double)pixel->confidence;
    tally->n_within_sigma += fabsf(pixel->error_px) <= 1 && pixel->is_within_sigma;
}

enum shef_err shef_run_scorer_add(struct shef_run_scorer *scorer,
                                  const struct shef_run_estimate *estimate,
                                  struct shef_run_tally *tally, struct shef_error *err)
{
    int64_t n = 0;

    if (estimate->disparity.width_px != scorer->scored_truth.width_px ||
        estimate->disparity.height_px != scorer->scored_truth.height_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "the estimates are of %d x %d px, the truth of %d x %d",
                         estimate->disparity.width_px, estimate->disparity.height_px,
                         scorer->scored_truth.width_px, scorer->scored_truth.height_px);
    for (int32_t y = 0; y < scorer->scored_truth.height_px; y++) {
        const float *truth = shef_row_f32(scorer->scored_truth, y);
        float *out = shef_row_f32(scorer->estimate, y);

        for (int32_t x = 0; x < scorer->scored_truth.width_px; x++) {
            out[x] = 0;
            if (!(truth[x] > 0))
                continue;
            scorer->pixels[n] = score(scorer, estimate, x, y, truth[x], &out[x]);
            tally_add(tally, &scorer->pixels[n], scorer->direction);
            n++;
        }
    }
    qsort(scorer->pixels, (size_t)n, sizeof *scorer->pixels, more_confident);
    for (int64_t i = 0; i < (int64_t)(CONFIDENT * (double)n); i++)
        part_add(&tally->confident, &scorer->pixels[i]);
    tally->n_frames++;
    return SHEF_OK;
}

struct shef_image_f32 shef_run_scorer_truth(const struct shef_run_scorer *scorer)
{
    return scorer->scored_truth;
}

struct shef_image_f32 shef_run_scorer_everywhere(const struct shef_run_scorer *scorer)
{
    return scorer->maps.disparity;
}

struct shef_image_f32 shef_run_scorer_estimate(const struct shef_run_scorer *scorer)
{
    return scorer->estimate;
}

enum shef_run_direction shef_run_scorer_direction(const struct shef_run_scorer *scorer)
{
    return scorer->direction;
}

const double *shef_run_scorer_velocity(const struct shef_run_scorer *scorer)
{
    return scorer->velocity_m_s;
}
