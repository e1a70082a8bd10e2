/* How long views take, and what they look like.
 *
 *   bench_sim_view SCENE [LIGHT [ISA [PICTURE.png]]]
 *
 * Prints the best of several runs: making the scene, an event view of 640 x 480 px with 2 x 2 rays
 * per pixel, a frame view of 2048 x 1536 px with one, and depth, all on one thread. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "core/png_io.h"
#include "shefsim/scene_internal.h"
#include "shefsim/view.h"

#define N_RUNS 12

static double now_ms(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static void must(enum shef_err code, const struct shef_error *err)
{
    if (code == SHEF_OK)
        return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static struct sim_view *view_of(const struct sim_scene *scene, int32_t width, int32_t height,
                                double f_px, int32_t supersample, uint32_t features)
{
    const struct sim_view_params params = {
        .width_px = width,
        .height_px = height,
        .camera = { f_px, f_px, (width - 1) / 2.0, (height - 1) / 2.0, { -.1, .05, 0, 0, 0 } },
        .supersample = supersample,
    };
    struct sim_view *view = NULL;
    struct shef_error err;

    must(sim_view_create(&view, scene, &params, NULL, features, &err), &err);
    return view;
}

/* Best of several poses along a small motion. */
static double best_ms(struct sim_view *view, struct shef_image_f32 out, int n_poses)
{
    double best = 1e9;

    for (int run = 0; run < N_RUNS; run++) {
        struct shef_rigid poses[SIM_VIEW_MAX_INSTANTS];

        for (int i = 0; i < n_poses; i++) {
            poses[i] = shef_rigid_identity();
            poses[i].t_m[0] = .01 * run + .0005 * i;
        }

        const double start = now_ms();

        sim_view_render_exposure(view, poses, n_poses, out);
        if (now_ms() - start < best)
            best = now_ms() - start;
    }
    return best;
}

static void write_picture(const char *path, struct shef_image_f32 light)
{
    struct shef_image_u8 grey;
    struct shef_error err;

    must(shef_image_create_u8(&grey, light.width_px, light.height_px, &err), &err);
    for (int32_t y = 0; y < light.height_px; y++)
        for (int32_t x = 0; x < light.width_px; x++) {
            const double value = 255 * shef_row_f32(light, y)[x] / .6;

            shef_row_u8(grey, y)[x] = value > 255 ? 255 : (uint8_t)value;
        }
    must(shef_png_write_u8(path, grey, &err), &err);
    shef_image_destroy_u8(&grey);
}

int main(int argc, char **argv)
{
    const struct sim_scene_options options = {
        .light = argc > 2 ? argv[2] : "day",
        .seed = 1,
    };
    const uint32_t features =
        argc > 3 ? shef_cpu_features_of(argv[3]) & shef_cpu_features() : shef_cpu_features();
    const struct shef_rigid pose = shef_rigid_identity();
    struct shef_error err = { 0 };
    struct sim_scene *scene = NULL;
    int64_t n_texels = 0;
    struct shef_image_f32 event_image;
    struct shef_image_f32 frame_image;
    struct shef_image_i16 object;

    if (argc < 2) {
        fprintf(stderr, "usage: bench_sim_view SCENE [LIGHT [ISA [PICTURE.png]]]\n");
        return 2;
    }
    const double start = now_ms();

    must(sim_scene_open(&scene, argv[1], &options, &err), &err);
    printf("scene made          %8.1f ms\n", now_ms() - start);
    for (int32_t i = 0; i < scene->n_surfaces; i++)
        n_texels += (int64_t)scene->surfaces[i].texture.width * scene->surfaces[i].texture.height;
    printf("surfaces            %8d, %.1f million texels\n", scene->n_surfaces, 1e-6 * n_texels);
    must(shef_image_create_f32(&event_image, 640, 480, &err), &err);
    must(shef_image_create_f32(&frame_image, 2048, 1536, &err), &err);
    must(shef_image_create_i16(&object, 640, 480, &err), &err);

    struct sim_view *event_view = view_of(scene, 640, 480, 555, 2, features);
    struct sim_view *frame_view = view_of(scene, 2048, 1536, 1301, 1, features);

    printf("event view, 2x2     %8.2f ms\n", best_ms(event_view, event_image, 1));
    printf("frame view          %8.2f ms\n", best_ms(frame_view, frame_image, 1));
    printf("frame view, 4 times %8.2f ms\n", best_ms(frame_view, frame_image, 4));

    double best = 1e9;

    for (int run = 0; run < N_RUNS; run++) {
        const double before = now_ms();

        sim_view_depth(event_view, &pose, event_image, object);
        if (now_ms() - before < best)
            best = now_ms() - before;
    }
    printf("depth, 640 x 480    %8.2f ms\n", best);
    if (argc > 4) {
        sim_view_render(frame_view, &pose, frame_image);
        write_picture(argv[4], frame_image);
    }
    sim_view_destroy(event_view);
    sim_view_destroy(frame_view);
    sim_scene_destroy(scene);
    shef_image_destroy_f32(&event_image);
    shef_image_destroy_f32(&frame_image);
    shef_image_destroy_i16(&object);
    return 0;
}
