/* Instants, one type per clock, so that mixing clocks does not compile.
 *
 * All are int64 nanoseconds; durations are plain int64_t named ..._ns. Who reads which clock:
 *
 *   shef_host_time   CLOCK_MONOTONIC of this computer
 *   shef_event_time  the event camera's own time stamps, unwrapped
 *   shef_frame_time  the frame camera's own time stamps
 *   shef_robot_time  the robot controller's own time
 *
 * For each type T: T_add(instant, duration_ns), T_since(later, earlier) in ns, T_before(a, b). */
#ifndef SHEF_CORE_TIME_H
#define SHEF_CORE_TIME_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_NS_PER_US INT64_C(1000)
#define SHEF_NS_PER_MS INT64_C(1000000)
#define SHEF_NS_PER_S  INT64_C(1000000000)

#define SHEF_DECLARE_TIME(name)                                                                    \
    typedef struct {                                                                               \
        int64_t ns;                                                                                \
    } name;                                                                                        \
                                                                                                   \
    static inline name name##_add(name instant, int64_t duration_ns)                               \
    {                                                                                              \
        return (name){ instant.ns + duration_ns };                                                 \
    }                                                                                              \
                                                                                                   \
    static inline int64_t name##_since(name later, name earlier)                                   \
    {                                                                                              \
        return later.ns - earlier.ns;                                                              \
    }                                                                                              \
                                                                                                   \
    static inline bool name##_before(name a, name b)                                               \
    {                                                                                              \
        return a.ns < b.ns;                                                                        \
    }

SHEF_DECLARE_TIME(shef_host_time)
SHEF_DECLARE_TIME(shef_event_time)
SHEF_DECLARE_TIME(shef_frame_time)
SHEF_DECLARE_TIME(shef_robot_time)

#undef SHEF_DECLARE_TIME

#ifdef __cplusplus
}
#endif

#endif
