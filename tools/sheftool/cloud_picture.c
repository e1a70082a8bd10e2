#include "sheftool/cloud_picture.h"

#include <math.h>
#include <stdio.h>

#include "core/memory.h"
#include "sheftool/picture.h"

#define VIEW_WIDTH_PX  640
#define VIEW_HEIGHT_PX 480
#define POINT_M        0.006f /* how large a point is drawn */
#define MAX_POINT_PX   4
#define NEAREST_M      0.1f /* to the viewer */
#define HISTOGRAM_BINS 256
#define HISTOGRAM_M    16.0f

/* Where the cloud is looked at from. */
struct viewer {
    double yaw_deg;   /* to the right of the camera's own place */
    double pitch_deg; /* above it */
    double f_px;
};

static const double degree = 3.14159265358979323846 / 180;

/* Depths below which a share of the points lies. */
static float depth_quantile_m(const struct shef_point *points, int32_t n_points, double share)
{
    int32_t counts[HISTOGRAM_BINS] = { 0 };
    int32_t left = (int32_t)(share * n_points);
    int bin = 0;

    for (int32_t i = 0; i < n_points; i++) {
        const int place = (int)(points[i].z_m * (HISTOGRAM_BINS / HISTOGRAM_M));

        counts[place < HISTOGRAM_BINS ? place : HISTOGRAM_BINS - 1]++;
    }
    while (bin < HISTOGRAM_BINS - 1 && left >= counts[bin])
        left -= counts[bin++];
    return ((float)bin + 0.5f) * (HISTOGRAM_M / HISTOGRAM_BINS);
}

/* Turns about the point on the camera's axis at this depth. */
struct turn {
    float middle_m;
    float cos_yaw, sin_yaw;
    float cos_pitch, sin_pitch;
};

static void turn_point(const struct turn *turn, const struct shef_point *point, float out[3])
{
    const float z = point->z_m - turn->middle_m;
    const float x_turned = turn->cos_yaw * point->x_m + turn->sin_yaw * z;
    const float z_turned = turn->cos_yaw * z - turn->sin_yaw * point->x_m;

    out[0] = x_turned;
    out[1] = turn->cos_pitch * point->y_m + turn->sin_pitch * z_turned;
    out[2] = turn->middle_m + turn->cos_pitch * z_turned - turn->sin_pitch * point->y_m;
}

static struct shef_rgb8 tinted(const struct shef_point *point, float near_m, float far_m)
{
    const float share = (far_m - point->z_m) / (far_m - near_m);
    const struct shef_rgb8 tint =
        shef_colour_of_disparity(0.1f + 0.8f * fminf(fmaxf(share, 0), 1), 1.0f);
    const int light = 96 + point->colour.green * 159 / 255;

    return (struct shef_rgb8){ (uint8_t)(tint.red * light / 255),
                               (uint8_t)(tint.green * light / 255),
                               (uint8_t)(tint.blue * light / 255) };
}

/* A square of size px about (x, y), where nothing nearer is. */
static void draw_point(struct shef_image_rgb8 picture, struct shef_image_f32 depth,
                       const float at[3], int32_t size_px, struct shef_rgb8 colour)
{
    const int32_t x0 = (int32_t)floorf(at[0]) - size_px / 2;
    const int32_t y0 = (int32_t)floorf(at[1]) - size_px / 2;

    for (int32_t y = y0 < 0 ? 0 : y0; y < y0 + size_px && y < picture.height_px; y++)
        for (int32_t x = x0 < 0 ? 0 : x0; x < x0 + size_px && x < picture.width_px; x++) {
            float *nearest = shef_row_f32(depth, y) + x;

            if (*nearest > 0 && *nearest < at[2])
                continue;
            *nearest = at[2];
            shef_row_rgb8(picture, y)[x] = colour;
        }
}

/* The depths whose colours end the scale: but for a few points all lie between them. */
static void range_of(const struct shef_point *points, int32_t n_points, float *out_near_m,
                     float *out_far_m)
{
    *out_near_m = depth_quantile_m(points, n_points, 0.02);
    *out_far_m = depth_quantile_m(points, n_points, 0.98) + 0.1f;
}

static void draw(struct shef_image_rgb8 picture, struct shef_image_f32 depth,
                 const struct shef_point *points, int32_t n_points, const struct viewer *viewer)
{
    float near_m;
    float far_m;
    const float f_px = (float)viewer->f_px;
    const struct turn turn = {
        .middle_m = depth_quantile_m(points, n_points, 0.5),
        .cos_yaw = (float)cos(viewer->yaw_deg * degree),
        .sin_yaw = (float)sin(viewer->yaw_deg * degree),
        .cos_pitch = (float)cos(viewer->pitch_deg * degree),
        .sin_pitch = (float)sin(viewer->pitch_deg * degree),
    };

    range_of(points, n_points, &near_m, &far_m);
    for (int32_t i = 0; i < n_points; i++) {
        float at[3];

        turn_point(&turn, &points[i], at);
        if (at[2] < NEAREST_M || fabsf(at[0]) > 100 * at[2] || fabsf(at[1]) > 100 * at[2])
            continue;

        const int32_t size_px = 1 + (int32_t)(POINT_M * f_px / at[2]);

        at[0] = (float)picture.width_px / 2 + f_px * at[0] / at[2];
        at[1] = (float)picture.height_px / 2 + f_px * at[1] / at[2];
        draw_point(picture, depth, at, size_px < MAX_POINT_PX ? size_px : MAX_POINT_PX,
                   tinted(&points[i], near_m, far_m));
    }
}

enum shef_err shef_cloud_picture_create(struct shef_image_rgb8 *out_picture,
                                        const struct shef_point *points, int32_t n_points,
                                        struct shef_error *err)
{
    static const struct {
        const char *name;
        struct viewer viewer;
    } views[] = {
        { "left", { -22, 6, 480 } },
        { "right, above", { 22, 20, 480 } },
    };
    static const struct shef_rgb8 white = { 255, 255, 255 };
    struct shef_image_f32 nearest_m = { 0 };
    char colours[80] = "";
    char text[128];
    float near_m;
    float far_m;
    enum shef_err code =
        shef_image_create_rgb8(out_picture, 2 * VIEW_WIDTH_PX, VIEW_HEIGHT_PX, err);

    if (n_points > 0) {
        range_of(points, n_points, &near_m, &far_m);
        snprintf(colours, sizeof colours, ": depth %.1f m yellow, %.1f m blue", (double)near_m,
                 (double)far_m);
    }
    for (int i = 0; i < 2 && code == SHEF_OK; i++) {
        struct shef_image_rgb8 half = *out_picture;

        half.data += i * VIEW_WIDTH_PX;
        half.width_px = VIEW_WIDTH_PX;
        code = shef_image_create_f32(&nearest_m, VIEW_WIDTH_PX, VIEW_HEIGHT_PX, err);
        if (code == SHEF_OK && n_points > 0)
            draw(half, nearest_m, points, n_points, &views[i].viewer);
        snprintf(text, sizeof text, "from the %s%s", views[i].name, colours);
        shef_picture_draw_text(half, 8, 8, 1, white, text);
        shef_image_destroy_f32(&nearest_m);
    }
    if (code != SHEF_OK)
        shef_image_destroy_rgb8(out_picture);
    return code;
}
