/* The very images that the event sensor sees, written for other event models.
 *
 * FOLDER/images.npy: float32, n x height x width; light (1 is white) or, when asked for, ln(light +
 * dark) as exactly as the sensor keeps it. FOLDER/times.npy: int64, n times in ns of event time.
 * The folder gets its name when it is complete. Thread: one. */
#ifndef SHEFSIM_RIG_IMAGES_H
#define SHEFSIM_RIG_IMAGES_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

struct sim_rig_images;

/* Begins to write.
 *   n_images  that will come */
SHEF_MUST_CHECK enum shef_err sim_rig_images_begin(struct sim_rig_images **out_images,
                                                   const char *folder, int64_t n_images,
                                                   int32_t width_px, int32_t height_px,
                                                   struct shef_error *err);

SHEF_MUST_CHECK enum shef_err sim_rig_images_add(struct sim_rig_images *images, int64_t t_ns,
                                                 struct shef_image_f32 image,
                                                 struct shef_error *err);

/* Frees the images; on failure nothing is left. */
SHEF_MUST_CHECK enum shef_err sim_rig_images_commit(struct sim_rig_images *images,
                                                    struct shef_error *err);

/* Removes what was written and frees the images. NULL is allowed. */
void sim_rig_images_discard(struct sim_rig_images *images);

#endif
