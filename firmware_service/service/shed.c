#include "service/shed.h"

#include "core/time.h"
#include "publish/result.h"

/* How many kinds of work a wait asks to leave out; never the whole frame. */
static int32_t levels_for(int64_t wait_ns, const int32_t after_ms[SHEF_SHED_LEVELS])
{
    int32_t n = 0;

    while (n < SHEF_SHED_FRAME && wait_ns > after_ms[n] * SHEF_NS_PER_MS)
        n++;
    return n;
}

struct shef_shed_decision shef_shed_next(struct shef_shed *shed, int64_t wait_ns,
                                         const int32_t after_ms[SHEF_SHED_LEVELS])
{
    static const uint32_t bits[] = { SHEF_RESULT_SHED_DENSE, SHEF_RESULT_SHED_CLOUD,
                                     SHEF_RESULT_SHED_FULL_GRID, SHEF_RESULT_SHED_RANGE };
    const int32_t n_wanted = levels_for(wait_ns, after_ms);
    struct shef_shed_decision decision = {
        .drops_frame = wait_ns > after_ms[SHEF_SHED_FRAME] * SHEF_NS_PER_MS,
    };

    if (n_wanted >= shed->n_levels) {
        shed->n_levels = n_wanted;
        shed->n_calm = 0;
    } else if (2 * wait_ns > after_ms[shed->n_levels - 1] * SHEF_NS_PER_MS) {
        /* Below the threshold, but not clearly. */
        shed->n_calm = 0;
    } else if (++shed->n_calm == SHEF_SHED_CALM_FRAMES) {
        shed->n_levels--;
        shed->n_calm = 0;
    }
    for (int32_t i = 0; i < shed->n_levels; i++)
        decision.bits |= bits[i];
    return decision;
}
