/* The frame camera's sensor: the light of an exposure in, an 8-bit frame out.
 *
 * Motion blur is in the light: the mean over the exposure, of instants so close that nothing moves
 * by more than half a pixel between two. The sensor adds the noise of photons (it grows with the
 * square root of the light) and of the read-out, amplifies, cuts at black and white and rounds.
 * Frames are functions of parameters, seed, number and light: the same bytes whatever the threads
 * and instruction sets. Thread: one at a time; an exposure shares its work with the workers. */
#ifndef SHEFSIM_FRAME_SENSOR_H
#define SHEFSIM_FRAME_SENSOR_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"

enum sim_frame_format {
    SIM_FRAME_MONO8,
    SIM_FRAME_BAYER_RG8, /* first row red, green; second green, blue */
};

/* The names of the formats in their order, "mono8|bayer-rg8". */
#define SIM_FRAME_FORMATS "mono8|bayer-rg8"

#define SIM_FRAME_MIN_INSTANTS 4
#define SIM_FRAME_MAX_INSTANTS 16

struct sim_frame_sensor_params {
    enum sim_frame_format format;
    int32_t width_px;
    int32_t height_px;
    int64_t exposure_ns;
    uint32_t gain_mdb;       /* 0.001 dB */
    double electrons_per_ms; /* of a white pixel in white light */
    double full_well;        /* electrons that are white at a gain of 0 dB */
    double read_noise;       /* electrons, deviation */
    double black;            /* grey level of no light */
};

/* A sensor with 3.45 um pixels as the FLIR Chameleon3's: 1600 electrons per ms of white light,
 * 10500 full, 7 of read-out noise, black at 4. The gain is 0. */
struct sim_frame_sensor_params sim_frame_sensor_default(int32_t width_px, int32_t height_px);

/* The gain, in steps of 0.1 dB from 0 to 24 dB, that brings the brightest percent of the light to
 * 90 % of white. */
uint32_t sim_frame_sensor_gain_mdb(const struct sim_frame_sensor_params *params,
                                   struct shef_image_f32 radiance);

/* How many instants an exposure needs if the image moves by this much meanwhile:
 * SIM_FRAME_MIN_INSTANTS..SIM_FRAME_MAX_INSTANTS. */
int32_t sim_frame_sensor_n_instants(double motion_px);

/* Where in an exposure instant i of n lies: the middle of its share, ns from the start. */
int64_t sim_frame_sensor_instant_ns(const struct sim_frame_sensor_params *params, int32_t i,
                                    int32_t n);

struct sim_frame_sensor;

/* SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_frame_sensor_create(struct sim_frame_sensor **out_sensor,
                                                      const struct sim_frame_sensor_params *params,
                                                      uint64_t seed, uint32_t cpu_features,
                                                      struct shef_workers *workers,
                                                      struct shef_error *err);

/* Exposes one frame.
 *   number    of the frame: another one has other noise
 *   radiance  the mean over the exposure
 *   tints     red, green and blue factor of each object, for a colour sensor; else NULL
 *   object    which object each pixel sees, below 0 for none; .data may be NULL without tints
 *   out       of the sensor's size */
void sim_frame_sensor_expose(struct sim_frame_sensor *sensor, uint64_t number,
                             struct shef_image_f32 radiance, const float (*tints)[3],
                             struct shef_image_i16 object, struct shef_image_u8 out);

/* NULL is allowed. */
void sim_frame_sensor_destroy(struct sim_frame_sensor *sensor);

#endif
