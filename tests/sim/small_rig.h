/* A small scene that is quickly made, and rigs in front of it. Thread: the test's main thread. */
#ifndef SHEF_TESTS_SIM_SMALL_RIG_H
#define SHEF_TESTS_SIM_SMALL_RIG_H

#include "shefsim/rig.h"

/* A wall 3 m away and a box in front of it, in bright light; the typical event sensor; a circle at
 * 0.1 m/s; 0.12 s, five frames. */
struct sim_rig_settings small_rig_settings(void);

/* The scene file. Valid to the end of the program. */
const char *small_rig_scene(void);

/* Makes the rig, renders it to a folder, and fails the test if that fails.
 *   n_threads, features  see sim_rig_create() */
struct sim_rig_report small_rig_render(const struct sim_rig_settings *settings, const char *out,
                                       int32_t n_threads, uint32_t features);

#endif
