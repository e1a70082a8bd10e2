#include "sheftool/events_frame.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "sheftool/picture.h"

#define HEAD_PX   28 /* a line on the moment, one on each image */
#define CAPTION_Y 16
#define GAP_PX    8 /* between the images */
#define LETTER_PX 6

static const struct shef_rgb8 paper = { 36, 38, 42 };
static const struct shef_rgb8 ink = { 235, 235, 235 };
static const struct shef_rgb8 alarm = { 255, 120, 90 };
static const struct shef_rgb8 rising = { 86, 156, 255 };
static const struct shef_rgb8 falling = { 255, 140, 50 };
static const struct shef_rgb8 unsigned_edge = { 240, 240, 240 };

static struct shef_event_edges_params edge_params(enum shef_frame_edges edges)
{
    static const enum shef_edge_kind kinds[] = {
        [SHEF_FRAME_EDGES_SIGNED] = SHEF_EDGE_TERNARY,
        [SHEF_FRAME_EDGES_GRADED] = SHEF_EDGE_GRADED,
        [SHEF_FRAME_EDGES_THICK] = SHEF_EDGE_UNSIGNED,
        [SHEF_FRAME_EDGES_THIN] = SHEF_EDGE_UNSIGNED,
    };
    struct shef_event_edges_params params = shef_event_edges_default_params(kinds[edges]);

    params.is_thin = edges == SHEF_FRAME_EDGES_THIN;
    return params;
}

/* A profile that is the sensor itself. */
static struct shef_rectification sensor_itself(const struct shef_frame_params *params)
{
    struct shef_rectification same = shef_rectification_wide();

    same.width_px = params->width_px;
    same.height_px = params->height_px;
    same.cx_px = (params->width_px - 1) / 2.0;
    same.cy_px = (params->height_px - 1) / 2.0;
    same.sensor_width_px = params->width_px;
    same.sensor_height_px = params->height_px;
    same.camera.cx_px = same.cx_px;
    same.camera.cy_px = same.cy_px;
    return same;
}

enum shef_err shef_frame_create(struct shef_frame *frame, const struct shef_frame_params *params,
                                struct shef_error *err)
{
    const struct shef_rectification rectification = sensor_itself(params);
    const struct shef_event_edges_params edges = edge_params(params->edges);
    const int32_t n_images = params->show == SHEF_SHOW_BOTH ? 2 : 1;
    const int32_t width_px = n_images * params->width_px + (n_images - 1) * GAP_PX;
    const int32_t height_px = HEAD_PX + params->height_px;

    *frame = (struct shef_frame){ .params = *params };

    enum shef_err code = shef_image_create_rgb8(&frame->picture, width_px + width_px % 2,
                                                height_px + height_px % 2, err);

    if (code == SHEF_OK)
        code = shef_warp_map_create(&frame->map, &rectification, err);
    if (code == SHEF_OK)
        code =
            shef_event_edges_create(&frame->maker, &frame->map, &edges, shef_cpu_features(), err);
    if (code == SHEF_OK)
        code = shef_edge_map_create(&frame->edges, edges.kind, params->width_px, params->height_px,
                                    err);
    if (code != SHEF_OK)
        shef_frame_destroy(frame);
    return code;
}

void shef_frame_destroy(struct shef_frame *frame)
{
    shef_edge_map_destroy(&frame->edges);
    shef_event_edges_destroy(frame->maker);
    shef_warp_map_destroy(&frame->map);
    shef_image_destroy_rgb8(&frame->picture);
    frame->maker = NULL;
}

/* Mid-grey is no change, white a rise, black a fall. */
static void draw_values(struct shef_frame *frame, struct shef_image_i16 values, int32_t x0)
{
    const double unit = 127.0 / (frame->params.range_c * SHEF_FILTER_VALUE_STEP);

    for (int32_t y = 0; y < values.height_px; y++) {
        const int16_t *row = shef_row_i16(values, y);
        struct shef_rgb8 *out = shef_row_rgb8(frame->picture, HEAD_PX + y) + x0;

        for (int32_t x = 0; x < values.width_px; x++) {
            const double shade = 128 + unit * row[x];
            const uint8_t grey = shade < 0 ? 0 : shade > 255 ? 255 : (uint8_t)shade;

            out[x] = (struct shef_rgb8){ grey, grey, grey };
        }
    }
}

static uint8_t dim(uint8_t colour, int strength)
{
    return (uint8_t)(colour * strength / 127);
}

/* Black is no edge; graded ones are as bright as they are strong. */
static void draw_edges(struct shef_frame *frame, int32_t x0)
{
    const bool is_graded = frame->edges.kind == SHEF_EDGE_GRADED;
    const bool is_signed = frame->edges.kind != SHEF_EDGE_UNSIGNED;
    int8_t row[SHEF_IMAGE_MAX_SIDE_PX];

    for (int32_t y = 0; y < frame->edges.height_px; y++) {
        struct shef_rgb8 *out = shef_row_rgb8(frame->picture, HEAD_PX + y) + x0;

        shef_edge_map_row(&frame->edges, y, row);
        for (int32_t x = 0; x < frame->edges.width_px; x++) {
            const int size = row[x] < 0 ? -row[x] : row[x];
            const int strength = is_graded ? size : 127 * size;
            const struct shef_rgb8 colour = !is_signed   ? unsigned_edge
                                            : row[x] > 0 ? rising
                                                         : falling;

            out[x] = (struct shef_rgb8){ dim(colour.red, strength), dim(colour.green, strength),
                                         dim(colour.blue, strength) };
        }
    }
}

static void clear(struct shef_image_rgb8 picture)
{
    for (int32_t y = 0; y < picture.height_px; y++)
        for (int32_t x = 0; x < picture.width_px; x++)
            shef_row_rgb8(picture, y)[x] = paper;
}

static void draw_head(struct shef_frame *frame, const struct shef_moment *moment)
{
    const struct shef_snapshot *snapshot = moment->snapshot;
    char text[128];
    int32_t x = 4;

    snprintf(text, sizeof text, "#%" PRIu64 "  %.6f s", snapshot->number,
             (double)moment->since_first_us / 1e6);
    shef_picture_draw_text(frame->picture, x, 4, 1, ink, text);
    x += LETTER_PX * ((int32_t)strlen(text) + 2);
    if (snapshot->t_err_ns > 0) {
        snprintf(text, sizeof text, "+- %.3f ms", (double)snapshot->t_err_ns / 1e6);
        shef_picture_draw_text(frame->picture, x, 4, 1, ink, text);
        x += LETTER_PX * ((int32_t)strlen(text) + 2);
    }
    if (snapshot->flags & SHEF_SNAPSHOT_PREDICTED)
        shef_picture_draw_text(frame->picture, x, 4, 1, alarm, "trigger lost");
    else if (snapshot->flags & SHEF_SNAPSHOT_LATE_TRIGGER)
        shef_picture_draw_text(frame->picture, x, 4, 1, alarm, "trigger late");
}

/* A text above an image, as far as the image reaches. */
static void draw_caption(struct shef_frame *frame, int32_t x0, const char *caption)
{
    char text[128];
    const size_t n_fit = (size_t)(frame->params.width_px - 4) / LETTER_PX;

    snprintf(text, sizeof text, "%s", caption);
    if (n_fit < sizeof text)
        text[n_fit] = '\0';
    shef_picture_draw_text(frame->picture, x0 + 4, CAPTION_Y, 1, ink, text);
}

static void describe_values(struct shef_frame *frame, int32_t x0)
{
    char text[128];

    snprintf(text, sizeof text, "filter: black -%g to white +%g contrast steps",
             frame->params.range_c, frame->params.range_c);
    draw_caption(frame, x0, text);
}

static void describe_edges(struct shef_frame *frame, int32_t x0, double threshold_c)
{
    const bool is_signed = frame->edges.kind != SHEF_EDGE_UNSIGNED;
    char text[128];

    snprintf(text, sizeof text, "%sedges above %.2f contrast steps%s",
             frame->params.edges == SHEF_FRAME_EDGES_THIN ? "thin " : "", threshold_c,
             is_signed ? ": blue rising, orange falling" : "");
    draw_caption(frame, x0, text);
}

double shef_frame_draw(struct shef_frame *frame, const struct shef_moment *moment)
{
    const enum shef_frame_show show = frame->params.show;
    const int32_t edges_x = show == SHEF_SHOW_BOTH ? frame->params.width_px + GAP_PX : 0;
    double threshold_c = 0;

    clear(frame->picture);
    draw_head(frame, moment);
    if (show != SHEF_SHOW_EDGES) {
        draw_values(frame, moment->snapshot->values, 0);
        describe_values(frame, 0);
    }
    if (show != SHEF_SHOW_VALUES) {
        shef_event_edges_of_values(frame->maker, moment->snapshot->values, NULL, &frame->edges);
        threshold_c = shef_event_edges_threshold_c(frame->maker);
        draw_edges(frame, edges_x);
        describe_edges(frame, edges_x, threshold_c);
    }
    return threshold_c;
}
