/* A rig in front of a textured wall, for tests of the depth chain: frames and snapshots of a few
 * exposures while it moves sideways, with the disparity known.
 *
 * The event sensor sees the moving rows of moving_edges.h; the frame camera sees the same rows,
 * DISPARITY pixels of the profile `wide` further right. Thread: the test's own. */
#ifndef SHEF_TESTS_DEPTH_RIG_H
#define SHEF_TESTS_DEPTH_RIG_H

#include "pipeline/depth_chain.h"
#include "pipeline/snapshot.h"

#define DEPTH_RIG_FRAMES    4
#define DEPTH_RIG_DISPARITY 12.4
#define DEPTH_RIG_SPEED     80.0 /* px/s of the picture, to the right: the camera moves left */

struct depth_rig {
    struct shef_calibration calibration;
    struct shef_image_u8 frames[DEPTH_RIG_FRAMES]; /* raw */
    const struct shef_snapshot *snapshots[DEPTH_RIG_FRAMES];
    double velocity_m_s[3]; /* of the camera */
    /* The rig's own. */
    struct shef_filter *filter;
    struct shef_snapshots *source;
};

/* Takes about a second. Fails the test if anything goes wrong. */
void depth_rig_make(struct depth_rig *rig);
void depth_rig_free(struct depth_rig *rig);

/* Processes frame i. has_velocity: as a robot would tell it. */
struct shef_depth_report depth_rig_process(const struct depth_rig *rig,
                                           struct shef_depth_chain *chain, int i, bool has_velocity,
                                           const struct shef_depth_output *output);

/* All frames; the report of the last. */
struct shef_depth_report depth_rig_process_all(const struct depth_rig *rig,
                                               struct shef_depth_chain *chain, bool has_velocity,
                                               const struct shef_depth_output *output);

/* How disparities lie about the true one, of the columns that both cameras see. */
struct depth_rig_verdict {
    int64_t n;      /* estimates */
    double good;    /* share within 1 px */
    double mean_px; /* error of the good ones */
};
struct depth_rig_verdict depth_rig_judge(struct shef_image_f32 disparity);

#endif
