#include "service/live.h"

#include <string.h>

#include "publish/encoder.h"

enum shef_depth_mode shef_live_mode_of(const char *name)
{
    int mode = 0;

    while (mode < SHEF_DEPTH_N_MODES &&
           strcmp(name, shef_depth_mode_name((enum shef_depth_mode)mode)) != 0)
        mode++;
    return (enum shef_depth_mode)mode;
}

static uint32_t outputs_of(const struct shef_config *config)
{
    return (config->lcm.disparity ? SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY) : 0) |
           (config->lcm.depth ? SHEF_OUTPUT(SHEF_CHANNEL_DEPTH) : 0) |
           (config->lcm.dense ? SHEF_OUTPUT(SHEF_CHANNEL_DENSE) : 0) |
           (config->lcm.cloud ? SHEF_OUTPUT(SHEF_CHANNEL_CLOUD) : 0) |
           (config->lcm.pose ? SHEF_OUTPUT(SHEF_CHANNEL_POSE) : 0) |
           (config->lcm.status ? SHEF_OUTPUT(SHEF_CHANNEL_STATUS) : 0);
}

void shef_live_apply(struct shef_live *live, const struct shef_config *config)
{
    const int32_t after_ms[SHEF_SHED_LEVELS] = { config->shed.dense_ms, config->shed.cloud_ms,
                                                 config->shed.full_grid_ms, config->shed.range_ms,
                                                 config->shed.frame_ms };

    for (int i = 0; i < SHEF_SHED_LEVELS; i++)
        atomic_store_explicit(&live->shed_after_ms[i], after_ms[i], memory_order_relaxed);
    atomic_store_explicit(&live->outputs, outputs_of(config), memory_order_relaxed);
    atomic_store_explicit(&live->grid_step, config->lcm.grid == SHEF_GRID_HALF ? 2 : 1,
                          memory_order_relaxed);
    atomic_store_explicit(&live->mode, (int32_t)shef_live_mode_of(config->depth.mode),
                          memory_order_relaxed);
}

void shef_live_init(struct shef_live *live, const struct shef_config *config)
{
    shef_live_apply(live, config);
    atomic_store_explicit(&live->drag_us, 0, memory_order_relaxed);
}
