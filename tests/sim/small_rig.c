#include "small_rig.h"

#include <stdio.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

static const char scene[] =
    "scene: small\n"
    "lights:\n"
    "  - {name: day, ambient: 0.30}\n"
    "lamps:\n"
    "  - {light: day, position_m: [-1.3, -1.9, -0.2], power: 2.4}\n"
    "materials:\n"
    "  - {name: paper, pattern: blobs, albedo: 0.45, contrast: 0.7, cell_mm: 200,\n"
    "     colour: [0.62, 0.60, 0.50]}\n"
    "  - {name: print, pattern: cells, albedo: 0.30, contrast: 0.9, cell_mm: 150,\n"
    "     colour: [0.75, 0.38, 0.30]}\n"
    "objects:\n"
    "  - {name: wall, shape: wall, material: paper, position_m: [0, 2.2, 3.0],\n"
    "     size_m: [6, 4.4, 0.001]}\n"
    "  - {name: box, shape: box, material: print, position_m: [0.1, 0.4, 1.6],\n"
    "     size_m: [0.5, 0.7, 0.4], yaw_deg: 20}\n";

const char *small_rig_scene(void)
{
    static char path[4200];
    struct shef_error err;

    if (path[0] == '\0') {
        snprintf(path, sizeof path, "%s", shef_test_temp_path("small.yaml"));
        TEST_ASSERT_EQUAL_INT_MESSAGE(SHEF_OK, shef_file_replace(path, scene, strlen(scene), &err),
                                      err.text);
    }
    return path;
}

struct sim_rig_settings small_rig_settings(void)
{
    struct sim_rig_settings settings = {
        .scene = small_rig_scene(),
        .light = "day",
        .path = "circle",
        .speed_m_s = 0.1,
        .path_size_m = 0.15,
        .seconds = 0.12,
        .seed = 7,
        .fps = 40,
        .blink_hz = 5,
        .frame_tick_ns = 1,
    };

    TEST_ASSERT_TRUE(sim_event_sensor_preset("typical", &settings.sensor));
    return settings;
}

struct sim_rig_report small_rig_render(const struct sim_rig_settings *settings, const char *out,
                                       int32_t n_threads, uint32_t features)
{
    const struct sim_rig_render_config config = { .out = out, .truth_every = 1 };
    struct shef_error err;
    struct shef_workers *workers = shef_workers_create(n_threads, &err);
    struct sim_rig *rig = NULL;
    struct sim_rig_report report;

    TEST_ASSERT_NOT_NULL(workers);
    TEST_ASSERT_EQUAL_INT_MESSAGE(SHEF_OK, sim_rig_create(&rig, settings, features, workers, &err),
                                  err.text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(SHEF_OK, sim_rig_render(rig, &config, &report, &err), err.text);
    sim_rig_destroy(rig);
    shef_workers_destroy(workers);
    return report;
}
