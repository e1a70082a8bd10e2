/* Reads SHEF's LCM messages, for subscribers in C and C++.
 *
 * Give it the bytes that an lcm_subscribe() handler gets (rbuf->data, rbuf->data_size). Everything
 * is checked, checksum and sizes included, before a byte of it is believed: the decoders that
 * lcm-gen makes trust the sizes in a message, these do not. Nothing is allocated or copied; the
 * results point into the message. The messages themselves are described in the .lcm files.
 *
 * Needs the generated types and nothing else of SHEF. Thread: any. */
#ifndef SHEF_LCM_DECODE_H
#define SHEF_LCM_DECODE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum shef_lcm_result {
    SHEF_LCM_OK = 0,
    SHEF_LCM_WRONG_TYPE, /* another message, or one of another version */
    SHEF_LCM_WRONG_SIZE, /* cut short, or bytes left over */
    SHEF_LCM_WRONG_CRC,  /* damaged on the way */
    SHEF_LCM_WRONG_DATA, /* says things that cannot be */
};

/* For people, e.g. "damaged on the way". */
const char *shef_lcm_result_text(enum shef_lcm_result result);

/* header_t. */
struct shef_lcm_header {
    int64_t utime_us;
    int64_t mono_ns;
    int64_t event_us;
    int64_t utc_minus_mono_ns;
    int64_t t_err_ns;
    int64_t seq;
    int64_t session_id;
    uint8_t calib_id[32];
    int32_t chunk;
    int32_t n_chunks;
};

/* disparity_t, depth_t or dense_t: rows first_row .. first_row + n_rows - 1 of a grid. */
struct shef_lcm_grid {
    struct shef_lcm_header header;
    int32_t width_px, height_px, grid_step;
    double f_px, cx_px, cy_px, baseline_m;
    int32_t mode, shed_bits, validity;
    int32_t first_row, n_rows;
    float unit;       /* px or m */
    int32_t n_points; /* cells with a value; of dense_t its n_filled */
    int32_t grid_w, grid_h;
    const uint8_t *mask;   /* NULL: dense_t */
    const uint8_t *values; /* little-endian uint16 */
    const uint8_t *sigmas; /* NULL: not depth_t */
};

/* out_ is written only on SHEF_LCM_OK. */
enum shef_lcm_result shef_lcm_decode_disparity(const void *message, size_t n_bytes,
                                               struct shef_lcm_grid *out_grid);
enum shef_lcm_result shef_lcm_decode_depth(const void *message, size_t n_bytes,
                                           struct shef_lcm_grid *out_grid);
enum shef_lcm_result shef_lcm_decode_dense(const void *message, size_t n_bytes,
                                           struct shef_lcm_grid *out_grid);

/* Fills the chunk's rows of images of grid_w x grid_h floats, row by row; 0 = none. The other rows
 * stay as they are, so the chunks of a frame add up.
 *   first    disparity in px, or depth in m
 *   second   confidence 0..1, or depth's sigma in m; may be NULL */
void shef_lcm_grid_images(const struct shef_lcm_grid *grid, float *first, float *second);

/* The pixel that the centre of cell gx (or gy) lies on. */
double shef_lcm_grid_pixel(const struct shef_lcm_grid *grid, int32_t cell);

/* cloud_t. */
struct shef_lcm_cloud {
    struct shef_lcm_header header;
    int32_t mode, shed_bits, validity;
    int32_t first_point, n_points;
    const uint8_t *points; /* 16 bytes each */
};

struct shef_lcm_point {
    float x_m, y_m, z_m;
    float confidence; /* 0..1 */
    float sigma_m;
    uint8_t grey;
};

enum shef_lcm_result shef_lcm_decode_cloud(const void *message, size_t n_bytes,
                                           struct shef_lcm_cloud *out_cloud);

/* The i-th point of this chunk, 0 to n_points - 1. */
struct shef_lcm_point shef_lcm_cloud_point(const struct shef_lcm_cloud *cloud, int32_t i);

/* pose_t. */
struct shef_lcm_pose {
    struct shef_lcm_header header;
    int32_t validity; /* 1: valid */
    double pos_m[3];
    double orientation_wxyz[4];
    double covariance[36];
};

enum shef_lcm_result shef_lcm_decode_pose(const void *message, size_t n_bytes,
                                          struct shef_lcm_pose *out_pose);

/* status_t. */
struct shef_lcm_status {
    struct shef_lcm_header header;
    const char *state; /* terminated, in the message */
    int32_t mode, shed_bits;
    int64_t n_events, n_frames, n_published, n_shed, n_unmatched, n_unpublished, n_damaged;
    float events_per_s, frames_per_s, cpu_cores;
    int32_t memory_mib, backlog;
    int64_t complete_to_published_p50_ns, complete_to_published_p99_ns;
    int64_t mid_to_published_p50_ns, mid_to_published_p99_ns;
};

enum shef_lcm_result shef_lcm_decode_status(const void *message, size_t n_bytes,
                                            struct shef_lcm_status *out_status);

#ifdef __cplusplus
}
#endif

#endif
