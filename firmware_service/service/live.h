/* The settings that can change while the service runs, as the threads read them.
 *
 * The control thread writes; each value stands for itself and is read anew for every frame. */
#ifndef SHEF_SERVICE_LIVE_H
#define SHEF_SERVICE_LIVE_H

#include <stdatomic.h>
#include <stdint.h>

#include "config/config.h"
#include "pipeline/depth_chain.h"
#include "service/shed.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_live {
    _Atomic int32_t mode; /* enum shef_depth_mode */
    _Atomic int32_t shed_after_ms[SHEF_SHED_LEVELS];
    _Atomic uint32_t outputs; /* SHEF_OUTPUT() bits */
    _Atomic int32_t grid_step;
    /* For tests: how much longer than needed the stereo thread takes for a frame, in us. */
    _Atomic int32_t drag_us;
};

/* Thread: control. */
void shef_live_init(struct shef_live *live, const struct shef_config *config);
void shef_live_apply(struct shef_live *live, const struct shef_config *config);

/* The mode of a name; SHEF_DEPTH_N_MODES if there is none. Thread: any. */
enum shef_depth_mode shef_live_mode_of(const char *name);

/* Relaxed: nothing is ordered by settings.                        Thread: any. */
static inline int32_t shef_live_get(const _Atomic int32_t *setting)
{
    return atomic_load_explicit(setting, memory_order_relaxed);
}

#ifdef __cplusplus
}
#endif

#endif
