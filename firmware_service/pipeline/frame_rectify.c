#include "pipeline/frame_rectify.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/frame.h"
#include "core/memory.h"
#include "pipeline/kernels/rectify.h"

#define ONE          (1 << SHEF_RECTIFY_FRACTION_BITS)
#define MAX_COLUMN   6   /* a half reads 8 columns, two for each pixel */
#define AVERAGE_FROM 1.5 /* raw pixels per rectified one from which cells of 2 x 2 are better */

/* The cells that the table reads. */
struct extent {
    int32_t first_x, end_x;
    int32_t first_y, end_y;
};

struct shef_frame_rectify {
    /* Set by create, then read-only. */
    int32_t width_px, height_px;
    int32_t sensor_width_px, sensor_height_px;
    int32_t cell_px;
    const struct shef_rectify_kernels *kernels;
    int32_t n_segments;                    /* of a row, the last one possibly beyond its end */
    struct shef_rectify_segment *segments; /* columns count from the extent's first one */
    struct shef_rectify_position *scattered;
    int32_t *last_cell_row; /* by output row: the last row of cells read so far */
    struct extent extent;
    struct shef_image_u8 valid;
    bool is_complete;
    /* A ring of rows of cells. */
    uint16_t *cells;
    uint16_t **rows; /* by the cells' y, two more than there are */
};

static enum shef_err check(const struct shef_rectification *r, struct shef_error *err)
{
    if (r->sensor_width_px < 2 || r->sensor_height_px < 2)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification of %d x %d px frames: sides must be at least 2",
                         r->sensor_width_px, r->sensor_height_px);
    return shef_rectification_check(r, err);
}

/* A raw coordinate among n cells, in 1/4096; -1: not between their centres. */
static int32_t cell_position(double raw_px, int32_t cell_px, int32_t n)
{
    const double position = ((raw_px - (cell_px - 1) / 2.0) / cell_px) * ONE;

    /* NaN from a broken lens model fails this, too. */
    if (!(position > -0.5 && position < (n - 1) * (double)ONE + 0.5))
        return -1;
    return (int32_t)lrint(position);
}

static struct shef_rectify_position position_of(const struct shef_frame_rectify *rectify,
                                                const struct shef_rectification *r, int32_t x,
                                                int32_t y)
{
    struct shef_rectify_position p = { -1, -1 };
    double raw_x;
    double raw_y;

    if (!shef_rectification_project(r, x, y, &raw_x, &raw_y))
        return p;
    p.x = cell_position(raw_x, rectify->cell_px, r->sensor_width_px / rectify->cell_px);
    p.y = cell_position(raw_y, rectify->cell_px, r->sensor_height_px / rectify->cell_px);
    if (p.y < 0)
        p.x = -1;
    return p;
}

static void extend(struct extent *extent, struct shef_rectify_position p)
{
    const int32_t x = p.x / ONE;
    const int32_t y = p.y / ONE;

    extent->first_x = x < extent->first_x ? x : extent->first_x;
    extent->end_x = x + 2 > extent->end_x ? x + 2 : extent->end_x;
    extent->first_y = y < extent->first_y ? y : extent->first_y;
    extent->end_y = y + 2 > extent->end_y ? y + 2 : extent->end_y;
}

/* The simple form of a segment, if it has one. */
static bool fill_simple(struct shef_rectify_segment *out, const struct shef_rectify_position *p,
                        int32_t origin_x)
{
    struct shef_rectify_segment segment = { .form = SHEF_RECTIFY_TWO_ROWS };
    int32_t first_y = INT32_MAX;
    int32_t first_x[2] = { INT32_MAX, INT32_MAX };

    for (int32_t j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++) {
        int32_t *first = &first_x[j / SHEF_RECTIFY_HALF_PX];

        if (p[j].x < 0)
            return false;
        *first = p[j].x / ONE < *first ? p[j].x / ONE : *first;
        first_y = p[j].y / ONE < first_y ? p[j].y / ONE : first_y;
    }
    for (int32_t j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++) {
        const int32_t x = p[j].x - first_x[j / SHEF_RECTIFY_HALF_PX] * ONE;
        const int32_t y = p[j].y - first_y * ONE;

        if (x / ONE > MAX_COLUMN || y / ONE > 1)
            return false;
        if (y / ONE == 1)
            segment.form = SHEF_RECTIFY_THREE_ROWS;
        segment.x[j] = (uint16_t)x;
        segment.y[j] = (uint16_t)y;
    }
    segment.at.first_x[0] = (int16_t)(first_x[0] - origin_x);
    segment.at.first_x[1] = (int16_t)(first_x[1] - origin_x);
    segment.first_y = (int16_t)first_y;
    *out = segment;
    return true;
}

/* All positions of the profile; beyond a row's end they repeat its last one. */
static struct shef_rectify_position *make_positions(struct shef_frame_rectify *rectify,
                                                    const struct shef_rectification *r)
{
    const int32_t row_px = rectify->n_segments * SHEF_RECTIFY_SEGMENT_PX;
    struct shef_rectify_position *positions =
        shef_memory_create((size_t)row_px * (size_t)r->height_px, sizeof *positions);

    if (!positions)
        return NULL;
    rectify->extent = (struct extent){ INT32_MAX, 0, INT32_MAX, 0 };
    rectify->is_complete = true;
    for (int32_t y = 0; y < r->height_px; y++) {
        struct shef_rectify_position *row = positions + (size_t)y * (size_t)row_px;

        for (int32_t x = 0; x < row_px; x++) {
            row[x] = x < r->width_px ? position_of(rectify, r, x, y) : row[r->width_px - 1];
            if (row[x].x < 0)
                rectify->is_complete = false;
            else
                extend(&rectify->extent, row[x]);
            if (x < r->width_px)
                shef_row_u8(rectify->valid, y)[x] = row[x].x < 0 ? 0 : 255;
        }
    }
    return positions;
}

/* Fills the segments. Returns how many are scattered; their positions are kept if out is not
 * NULL, with columns from the extent's first one on. */
static int32_t fill_segments(struct shef_frame_rectify *rectify,
                             const struct shef_rectify_position *positions,
                             struct shef_rectify_position *out_scattered)
{
    const int32_t n = rectify->n_segments * rectify->height_px;
    int32_t n_scattered = 0;

    for (int32_t s = 0; s < n; s++) {
        const struct shef_rectify_position *p = positions + (size_t)s * SHEF_RECTIFY_SEGMENT_PX;

        if (fill_simple(&rectify->segments[s], p, rectify->extent.first_x))
            continue;
        rectify->segments[s] = (struct shef_rectify_segment){
            .at.scattered = n_scattered * SHEF_RECTIFY_SEGMENT_PX,
            .form = SHEF_RECTIFY_SCATTERED,
        };
        for (int32_t j = 0; out_scattered && j < SHEF_RECTIFY_SEGMENT_PX; j++) {
            struct shef_rectify_position *to =
                &out_scattered[n_scattered * SHEF_RECTIFY_SEGMENT_PX + j];

            *to = p[j];
            if (to->x >= 0)
                to->x -= rectify->extent.first_x * ONE;
        }
        n_scattered++;
    }
    return n_scattered;
}

/* For each output row the last row of cells that it or one before it reads.
 * Returns how many rows of cells have to be kept at a time. */
static int32_t fill_last_rows(struct shef_frame_rectify *rectify,
                              const struct shef_rectify_position *positions)
{
    const int32_t row_px = rectify->n_segments * SHEF_RECTIFY_SEGMENT_PX;
    int32_t last = rectify->extent.first_y - 1;
    int32_t n_kept = 1;

    for (int32_t y = 0; y < rectify->height_px; y++) {
        const struct shef_rectify_position *row = positions + (size_t)y * (size_t)row_px;
        int32_t first = INT32_MAX;

        for (int32_t x = 0; x < row_px; x++)
            if (row[x].x >= 0) {
                last = row[x].y / ONE + 1 > last ? row[x].y / ONE + 1 : last;
                first = row[x].y / ONE < first ? row[x].y / ONE : first;
            }
        rectify->last_cell_row[y] = last;
        if (first <= last && last - first + 1 > n_kept)
            n_kept = last - first + 1;
    }
    return n_kept;
}

/* A ring of n_kept rows, and the table that finds each row of cells in it. */
static bool make_ring(struct shef_frame_rectify *rectify, int32_t n_kept)
{
    const int32_t n_rows = rectify->sensor_height_px / rectify->cell_px;
    const size_t n_columns = (size_t)(rectify->extent.end_x - rectify->extent.first_x);
    const size_t stride = (n_columns + SHEF_RECTIFY_PAD_CELLS + 31) / 32 * 32;

    rectify->cells = shef_memory_create(stride * (size_t)n_kept, sizeof *rectify->cells);
    rectify->rows = shef_memory_create((size_t)n_rows + 2, sizeof *rectify->rows);
    if (!rectify->cells || !rectify->rows)
        return false;
    for (int32_t y = 0; y < n_rows + 2; y++)
        rectify->rows[y] = rectify->cells + (size_t)(y % n_kept) * stride;
    return true;
}

static enum shef_err make_tables(struct shef_frame_rectify *rectify,
                                 const struct shef_rectification *r, struct shef_error *err)
{
    const size_t n_segments = (size_t)rectify->n_segments * (size_t)r->height_px;
    enum shef_err code = shef_image_create_u8(&rectify->valid, r->width_px, r->height_px, err);

    if (code != SHEF_OK)
        return code;
    rectify->segments = shef_memory_create(n_segments, sizeof *rectify->segments);
    rectify->last_cell_row =
        shef_memory_create((size_t)r->height_px, sizeof *rectify->last_cell_row);

    struct shef_rectify_position *positions = make_positions(rectify, r);

    if (positions && rectify->extent.end_x == 0) {
        free(positions);
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification of frames: the profile shows nothing of the %d x %d px "
                         "sensor; check the calibration's rotation and principal point",
                         r->sensor_width_px, r->sensor_height_px);
    }

    bool is_made = positions && rectify->segments && rectify->last_cell_row;

    if (is_made) {
        const int32_t n_scattered = fill_segments(rectify, positions, NULL);

        rectify->scattered = shef_memory_create((size_t)n_scattered * SHEF_RECTIFY_SEGMENT_PX + 1,
                                                sizeof *rectify->scattered);
        if (rectify->scattered)
            fill_segments(rectify, positions, rectify->scattered);
        is_made = rectify->scattered && make_ring(rectify, fill_last_rows(rectify, positions));
    }
    free(positions);
    if (!is_made)
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "rectification of frames to %d x %d px: out of memory", r->width_px,
                         r->height_px);
    return SHEF_OK;
}

/* Raw pixels per rectified one at the middle of the profile, along x. */
static double scale_of(const struct shef_rectification *r)
{
    return sqrt(r->camera.fx_px * r->camera.fy_px) / r->f_px;
}

bool shef_frame_pixels_of(uint32_t pixel_format, enum shef_frame_pixels *out_pixels)
{
    switch (pixel_format) {
    case SHEF_PFNC_MONO8:
        *out_pixels = SHEF_FRAME_MONO8;
        return true;
    case SHEF_PFNC_BAYER_GR8:
    case SHEF_PFNC_BAYER_RG8:
    case SHEF_PFNC_BAYER_GB8:
    case SHEF_PFNC_BAYER_BG8:
        *out_pixels = SHEF_FRAME_BAYER8;
        return true;
    default:
        return false;
    }
}

enum shef_err shef_frame_rectify_create(struct shef_frame_rectify **out_rectify,
                                        const struct shef_rectification *rectification,
                                        enum shef_frame_pixels pixels, uint32_t cpu_features,
                                        struct shef_error *err)
{
    const struct shef_rectification *r = rectification;
    enum shef_err code = check(r, err);

    if (code != SHEF_OK)
        return code;

    struct shef_frame_rectify *rectify = calloc(1, sizeof *rectify);

    if (!rectify)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "rectification of frames: out of memory");
    rectify->width_px = r->width_px;
    rectify->height_px = r->height_px;
    rectify->sensor_width_px = r->sensor_width_px;
    rectify->sensor_height_px = r->sensor_height_px;
    rectify->cell_px = pixels == SHEF_FRAME_BAYER8 || scale_of(r) >= AVERAGE_FROM ? 2 : 1;
    rectify->kernels = shef_rectify_pick(cpu_features);
    rectify->n_segments = (r->width_px + SHEF_RECTIFY_SEGMENT_PX - 1) / SHEF_RECTIFY_SEGMENT_PX;
    code = make_tables(rectify, r, err);
    if (code != SHEF_OK) {
        shef_frame_rectify_destroy(rectify);
        return code;
    }
    *out_rectify = rectify;
    return SHEF_OK;
}

void shef_frame_rectify_destroy(struct shef_frame_rectify *rectify)
{
    if (!rectify)
        return;
    shef_image_destroy_u8(&rectify->valid);
    free(rectify->segments);
    free(rectify->scattered);
    free(rectify->last_cell_row);
    free(rectify->cells);
    free(rectify->rows);
    free(rectify);
}

/* Makes one row of cells. Rows and columns that no cell fills keep what they have: their weight
 * is zero. */
static void make_cells(const struct shef_frame_rectify *rectify, struct shef_image_u8 raw,
                       int32_t y)
{
    const int32_t n_rows = rectify->sensor_height_px / rectify->cell_px;
    const int32_t n_columns = rectify->sensor_width_px / rectify->cell_px;
    const int32_t first_x = rectify->extent.first_x;
    const int32_t end_x = rectify->extent.end_x < n_columns ? rectify->extent.end_x : n_columns;

    if (y >= n_rows)
        return;
    if (rectify->cell_px == 2)
        rectify->kernels->sum_cells(rectify->rows[y], shef_row_u8(raw, 2 * y) + 2 * first_x,
                                    shef_row_u8(raw, 2 * y + 1) + 2 * first_x, end_x - first_x);
    else
        rectify->kernels->widen(rectify->rows[y], shef_row_u8(raw, y) + first_x, end_x - first_x);
}

void shef_frame_rectify_run(struct shef_frame_rectify *rectify, struct shef_image_u8 raw,
                            struct shef_image_u8 out)
{
    const int32_t n_whole = rectify->width_px / SHEF_RECTIFY_SEGMENT_PX;
    const int32_t n_rest = rectify->width_px % SHEF_RECTIFY_SEGMENT_PX;
    const uint16_t *const *rows = (const uint16_t *const *)rectify->rows;
    int32_t next_row = rectify->extent.first_y;

    assert(raw.width_px == rectify->sensor_width_px && raw.height_px == rectify->sensor_height_px);
    assert(out.width_px == rectify->width_px && out.height_px == rectify->height_px);
    for (int32_t y = 0; y < rectify->height_px; y++) {
        const struct shef_rectify_segment *segments =
            rectify->segments + (size_t)y * (size_t)rectify->n_segments;
        uint8_t *pixels = shef_row_u8(out, y);

        for (; next_row <= rectify->last_cell_row[y]; next_row++)
            make_cells(rectify, raw, next_row);
        rectify->kernels->row(pixels, segments, n_whole, rows, rectify->scattered);
        if (n_rest > 0) {
            uint8_t rest[SHEF_RECTIFY_SEGMENT_PX];

            rectify->kernels->row(rest, segments + n_whole, 1, rows, rectify->scattered);
            memcpy(pixels + n_whole * SHEF_RECTIFY_SEGMENT_PX, rest, (size_t)n_rest);
        }
    }
}

struct shef_image_u8 shef_frame_rectify_valid(const struct shef_frame_rectify *rectify)
{
    return rectify->valid;
}

bool shef_frame_rectify_is_complete(const struct shef_frame_rectify *rectify)
{
    return rectify->is_complete;
}

int32_t shef_frame_rectify_cell_px(const struct shef_frame_rectify *rectify)
{
    return rectify->cell_px;
}
