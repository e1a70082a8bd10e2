#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/calibration.h"
#include "calib/rectification.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void demand(int condition)
{
    if (!condition)
        abort();
}

/* What can be read is a calibration that everything else can rely on. */
static void expect_sane(const struct shef_calibration *calibration)
{
    struct shef_rectification left;
    struct shef_rectification right;
    double baseline_m = 0;
    double ray[3];

    demand(strlen(calibration->id) == SHEF_SHA256_TEXT_BYTES - 1);
    demand(shef_rigid_error(&calibration->t_event_frame) <= 1e-5);
    demand(shef_rigid_error(&calibration->t_hand_frame) <= 1e-5);
    if (shef_rectification_pair(calibration, calibration->profile, &left, &right, &baseline_m,
                                NULL) == SHEF_OK)
        demand(baseline_m >= 0.001 && baseline_m <= 1 && isfinite(left.r_camera_rectified[8]));
    if (shef_camera_unproject(&calibration->frame.model, 10, 10, ray))
        demand(isfinite(ray[0]) && isfinite(ray[1]));
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_calibration calibration;
    struct shef_error err = { 0 };

    if (shef_calibration_parse("fuzz", bytes, n_bytes, &calibration, &err) != SHEF_OK) {
        demand(err.code != SHEF_OK && err.text[0] != '\0');
        return 0;
    }
    expect_sane(&calibration);
    return 0;
}
