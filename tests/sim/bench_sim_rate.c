/* How many events scenes make.
 *
 *   bench_sim_rate [SPEED_M_S [SCENE ...]]
 *
 * Prints, per scene and light, the event rate of noiseless sensors with thresholds of 0.30 and 0.20
 * on the circle, and how bright the picture is. */
#include <stdio.h>
#include <stdlib.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "shefsim/event_sensor.h"
#include "shefsim/path.h"
#include "shefsim/view.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480

static void must(enum shef_err code, const struct shef_error *err)
{
    if (code == SHEF_OK)
        return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static struct sim_event_sensor *sensor_of(double threshold)
{
    struct sim_event_sensor_params params = { 0 };
    struct sim_event_sensor *sensor = NULL;
    struct shef_error err;

    sim_event_sensor_preset("clean", &params);
    params.threshold_on = params.threshold_off = threshold;
    must(sim_event_sensor_create(&sensor, &params, WIDTH_PX, HEIGHT_PX, 1, shef_cpu_features(),
                                 NULL, &err),
         &err);
    return sensor;
}

static double mean_of(struct shef_image_f32 image)
{
    double sum = 0;

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            sum += shef_row_f32(image, y)[x];
    return sum / image.width_px / image.height_px;
}

static void measure(const char *name, const char *light, double speed_m_s)
{
    const struct sim_scene_options options = { .light = light, .seed = 1 };
    const struct sim_view_params params = {
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .camera = { 555, 555, 319.5, 239.5, { 0 } },
        .supersample = 2,
    };
    const struct sim_path_params path_params = { .name = "circle",
                                                 .size_m = SIM_PATH_SIZE_M,
                                                 .speed_m_s = speed_m_s };
    /* Half a pixel a step at 1.5 m, for a whole round. */
    const double step_s = 0.5 * 1.5 / 555 / speed_m_s;
    struct sim_event_sensor *sensors[2] = { sensor_of(.30), sensor_of(.20) };
    struct shef_image_f32 image;
    struct shef_error err = { 0 };
    struct sim_scene *scene = NULL;
    struct sim_view *view = NULL;
    struct sim_path *path = NULL;

    must(sim_scene_open(&scene, name, &options, &err), &err);
    must(sim_view_create(&view, scene, &params, NULL, shef_cpu_features(), &err), &err);
    must(sim_path_create(&path, &path_params, &err), &err);
    must(sim_path_check(path, scene, &err), &err);
    must(shef_image_create_f32(&image, WIDTH_PX, HEIGHT_PX, &err), &err);

    const int n_steps = (int)(sim_path_round_s(path) / step_s);

    for (int i = 0; i <= n_steps; i++) {
        const int64_t t_ns = (int64_t)(1e9 * step_s * i);
        const struct shef_rigid pose = sim_path_pose(path, t_ns);
        struct sim_events events;

        sim_view_render(view, &pose, image);
        for (int k = 0; k < 2; k++)
            must(sim_event_sensor_step(sensors[k], t_ns, image, &events, &err), &err);
    }
    printf("%-14s %-5s  light %.3f ", name, light, mean_of(image));
    for (int k = 0; k < 2; k++) {
        printf(" %6.2f Mev/s",
               1e-6 * (double)sim_event_sensor_stats(sensors[k]).n_signal / (step_s * n_steps));
        sim_event_sensor_destroy(sensors[k]);
    }
    printf("\n");
    sim_path_destroy(path);
    sim_view_destroy(view);
    sim_scene_destroy(scene);
    shef_image_destroy_f32(&image);
}

int main(int argc, char **argv)
{
    const double speed_m_s = argc > 1 ? atof(argv[1]) : 0.35;

    for (int i = 2; i < argc; i++)
        measure(argv[i], "day", speed_m_s);
    for (int i = 0; argc < 3 && sim_scene_names()[i]; i++) {
        measure(sim_scene_names()[i], "day", speed_m_s);
        measure(sim_scene_names()[i], "night", speed_m_s);
    }
    return 0;
}
