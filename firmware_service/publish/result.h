/* A finished frame: disparity and depth with everything that a reader of them must know.
 *
 * Results live in a pool that is allocated once. The stereo thread takes one, fills it and shares
 * it with whoever wants it: the publisher, the snapshot picture, recorders. The last to give it
 * back returns it to the pool. After it has been shared it is read-only.
 *
 * A result that waits for the publisher is out of the pool: give the pool more results than the
 * publisher's ring has slots, plus one for each other holder. */
#ifndef SHEF_PUBLISH_RESULT_H
#define SHEF_PUBLISH_RESULT_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/rigid.h"
#include "core/error.h"
#include "core/image.h"
#include "core/pool.h"
#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CALIB_ID_BYTES 32 /* a SHA-256 */

/* Work that was left out because time was short, in the order in which it is. As in disparity_t. */
#define SHEF_RESULT_SHED_DENSE     (1u << 0) /* no dense image */
#define SHEF_RESULT_SHED_CLOUD     (1u << 1) /* no point cloud */
#define SHEF_RESULT_SHED_FULL_GRID (1u << 2) /* the half grid instead of full resolution */
#define SHEF_RESULT_SHED_RANGE     (1u << 3) /* only half the disparities were searched */
#define SHEF_RESULT_SHED_SINGLE    (1u << 4) /* mode combined: only one of its two pairs */

/* What a reader should know before trusting the numbers. As in disparity_t. */
#define SHEF_RESULT_TIME_AMBIGUOUS (1u << 0) /* the frame may belong to another trigger */
#define SHEF_RESULT_TIME_PREDICTED (1u << 1) /* its trigger was lost; the time is extrapolated */
#define SHEF_RESULT_NO_MOTION      (1u << 2) /* the direction of motion is not known */
#define SHEF_RESULT_NO_PAST        (1u << 3) /* no earlier frame to compare with */
#define SHEF_RESULT_SATURATED      (1u << 4) /* too many events for clear edges */
#define SHEF_RESULT_NO_CONFIDENCE  (1u << 5) /* this mode has none: all are 1 */
#define SHEF_RESULT_MODE_CHANGED   (1u << 6) /* the mode asked for lacked something: see mode */
#define SHEF_RESULT_SETTLING       (1u << 7) /* one of the first frames: depths tend to be too far */

/* Whether a pose can be used, and if not, why. As in pose_t. */
enum shef_pose_validity {
    SHEF_POSE_NO_SOURCE, /* neither robot nor recorded poses */
    SHEF_POSE_VALID,
    SHEF_POSE_NO_SAMPLE,    /* none near enough to the frame's time */
    SHEF_POSE_NO_HAND_EYE,  /* the calibration has no T_H_C */
    SHEF_POSE_TCP_DIFFERS,  /* the robot's tcp_offset is not the calibration's */
    SHEF_POSE_ROBOT_FAULT,  /* the robot reports a fault or is not running */
    SHEF_POSE_CLOCK_UNSURE, /* robot time and host time are not yet joined */
};

struct shef_result_pose {
    enum shef_pose_validity validity;
    struct shef_rigid t_world_rectified; /* T_W_R at mid-exposure, of a valid pose */
    double covariance[36];               /* x, y, z in m, then rotation vector in rad, in W's axes;
                                          * row by row */
};

/* Where a frame's time went. */
enum shef_result_stage {
    SHEF_RESULT_STAGE_WAIT,     /* frame complete until the stereo thread began */
    SHEF_RESULT_STAGE_PICTURES, /* rectification, edges */
    SHEF_RESULT_STAGE_FLOW,     /* direction of motion */
    SHEF_RESULT_STAGE_MATCH,
    SHEF_RESULT_STAGE_CONVERT, /* depth, sigma */
    SHEF_RESULT_STAGES,
};

struct shef_result {
    /* Set by the pool, never to be changed. The images are the pool's, of the size that create()
     * got; the dense ones have data NULL where none were left. */
    struct shef_buffer *buffer;
    struct shef_buffer *dense_buffer;       /* NULL: none */
    struct shef_image_f32 disparity;        /* px, 0 = none */
    struct shef_image_f32 confidence;       /* 0..1, at the same pixels */
    struct shef_image_f32 depth_m;          /* along z, 0 = none */
    struct shef_image_f32 sigma_m;          /* of depth_m */
    struct shef_image_f32 dense_disparity;  /* px, 0 = none */
    struct shef_image_f32 dense_confidence; /* 0..1 */
    struct shef_image_u8 picture;           /* the rectified frame */

    /* The taker writes everything below before sharing; take() zeroes it. */
    uint64_t seq;              /* of the frame: gaps are frames left out */
    shef_event_time mid;       /* mid-exposure */
    shef_host_time mid_host;   /* the same instant by the host's clock. When stepped: derived from
                                * mid alone, so that messages are the same every time */
    int64_t utc_minus_mono_ns; /* UTC minus the host's clock; when stepped the recording's */
    int64_t t_err_ns;          /* bound of mid's error */
    shef_host_time complete; /* when the whole frame had arrived, read from the clock; 0: unknown */
    int64_t session_id;      /* one number for each start of a source */
    uint8_t calib_id[SHEF_CALIB_ID_BYTES]; /* all zero: none */

    int32_t mode;       /* enum shef_depth_mode, which MODE_... in disparity_t.lcm repeats */
    uint32_t shed_bits; /* SHEF_RESULT_SHED_... */
    uint32_t flags;     /* SHEF_RESULT_... */
    double f_px;        /* of the rectified view, with cx and cy */
    double cx_px;
    double cy_px;
    double baseline_m;
    float max_disparity_px; /* the largest that was looked for */
    bool has_dense;         /* the dense images were filled */
    bool has_picture;       /* the picture was */
    struct shef_result_pose pose;
    int64_t stage_ns[SHEF_RESULT_STAGES];
};

struct shef_result_pool;

/* Allocates everything.                                           Thread: setup.
 *   n_results   1 to 64
 *   width, height  of every image, 1 to 16384
 *   n_dense     how many results may have dense images at the same time, 0 to n_results
 * Returns NULL and a sentence in err on failure. */
struct shef_result_pool *shef_result_pool_create(uint32_t n_results, int32_t width_px,
                                                 int32_t height_px, uint32_t n_dense,
                                                 struct shef_error *err);

/* Frees everything; every result must have been given back. NULL is allowed. Thread: setup. */
void shef_result_pool_destroy(struct shef_result_pool *pool);

/* Lends a result with one holder, and dense images with it if some are left; its fields are zero,
 * its images whatever the last holder left.
 * NULL: all are out; counted.                                     Thread: the one taker. */
struct shef_result *shef_result_take(struct shef_result_pool *pool);

/* One holder more. Only for who holds it, before handing it on.   Thread: any holder. */
void shef_result_share(struct shef_result *result);

/* One holder less; the last returns it to the pool.               Thread: any holder. */
void shef_result_give(struct shef_result *result);

/* How often take() found nothing.                                 Thread: any. */
uint64_t shef_result_pool_refused_count(const struct shef_result_pool *pool);

/* How many are out at the moment.                                 Thread: any. */
uint32_t shef_result_pool_lent_count(const struct shef_result_pool *pool);

#ifdef __cplusplus
}
#endif

#endif
