/* What a log of LCM messages says of frames, read by docs/lcm.md and lcm_types/ alone: with none of
 * the project's own decoders, nor with LCM, so that both sides cannot be wrong alike.
 *
 * Whatever a message may not say fails the test. Thread: the test's main thread. */
#ifndef SHEF_TESTS_SERVICE_WIRE_H
#define SHEF_TESTS_SERVICE_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The bits of shed_bits. */
#define WIRE_SHED_DENSE     0x01
#define WIRE_SHED_CLOUD     0x02
#define WIRE_SHED_FULL_GRID 0x04
#define WIRE_SHED_RANGE     0x08

/* All messages of one seq. */
struct wire_frame {
    int64_t seq;
    int64_t event_us;
    int32_t n_pose, n_disparity, n_depth, n_dense, n_cloud; /* messages */
    /* The rest: of depth_t, all chunks together. */
    int32_t width_px, height_px, grid_step;
    int32_t grid_w, grid_h;
    double f_px, cx_px, cy_px, baseline_m;
    int32_t mode, shed_bits, validity;
    double unit_m;
    int32_t n_chunks;
    int32_t n_rows;   /* that the chunks so far had */
    int32_t n_points; /* the same */
    uint16_t *depths; /* grid_w * grid_h; 0: none */
    uint8_t *sigmas;
};

struct wire_log {
    struct wire_frame *frames; /* in the order of their first messages */
    int32_t n_frames;
    int32_t n_status;
};

/* Reads a log whose channels begin with SHEF_. */
void wire_log_read(struct wire_log *out_log, const char *path);

void wire_log_free(struct wire_log *log);

/* The frame of a seq, or NULL. */
const struct wire_frame *wire_log_frame(const struct wire_log *log, int64_t seq);

/* Of a cell that has a depth. */
double wire_depth_m(const struct wire_frame *frame, int32_t cell);
double wire_sigma_m(const struct wire_frame *frame, int32_t cell);

#endif
