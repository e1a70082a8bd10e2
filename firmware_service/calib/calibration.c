#include "calib/calibration.h"

#include <cyaml/cyaml.h>
#include <math.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calib/calibration_text.h"
#include "calib/rectification.h"
#include "core/file.h"
#include "core/time.h"
#include "core/yaml.h"

#define MAX_FILE_BYTES     (1u << 20)
#define MAX_ROTATION_ERROR 1e-5 /* of numbers with six digits */
#define MAX_FOCAL_PX       100000.0
#define MAX_DISTORTION     1000.0
#define MAX_POSITION_M     10.0
#define MAX_ANGLE_RAD      6.2831853071795865
#define MAX_DELAY_US       1e6

/* The file as libcyaml fills it in. */
struct camera_keys {
    int32_t size_px[2];
    double focal_px[2], focal_sigma_px[2];
    double centre_px[2], centre_sigma_px[2];
    double distortion[5], distortion_sigma[5];
};

struct rigid_keys {
    double rotation[3][3], rotation_sigma_rad;
    double position_m[3], position_sigma_m;
};

struct delay_keys {
    double us, sigma_us;
};

struct file_keys {
    int32_t version;
    char id[SHEF_SHA256_TEXT_BYTES];
    char profile[SHEF_CALIBRATION_NAME_BYTES];
    struct camera_keys frame, event;
    struct rigid_keys event_frame, hand_frame;
    double tcp_offset[6], tcp_offset_sigma[6];
    struct delay_keys frame_delay, event_delay, robot_delay;
};

static const cyaml_schema_value_t whole = { CYAML_VALUE_INT(CYAML_FLAG_DEFAULT, int32_t) };
static const cyaml_schema_value_t number = { CYAML_VALUE_FLOAT(CYAML_FLAG_STRICT, double) };
static const cyaml_schema_value_t three_numbers = { CYAML_VALUE_SEQUENCE_FIXED(
    CYAML_FLAG_DEFAULT, double, &number, 3) };

#define NUMBER(key, type, field) CYAML_FIELD_FLOAT(key, CYAML_FLAG_STRICT, type, field)
#define LIST(key, type, field, entry, n)                                                           \
    CYAML_FIELD_SEQUENCE_FIXED(key, CYAML_FLAG_DEFAULT, type, field, entry, n)
#define INNER(key, type, field, fields)                                                            \
    CYAML_FIELD_MAPPING(key, CYAML_FLAG_DEFAULT, type, field, fields)

static const cyaml_schema_field_t camera_fields[] = {
    LIST("size_px", struct camera_keys, size_px, &whole, 2),
    LIST("focal_px", struct camera_keys, focal_px, &number, 2),
    LIST("focal_sigma_px", struct camera_keys, focal_sigma_px, &number, 2),
    LIST("centre_px", struct camera_keys, centre_px, &number, 2),
    LIST("centre_sigma_px", struct camera_keys, centre_sigma_px, &number, 2),
    LIST("distortion", struct camera_keys, distortion, &number, 5),
    LIST("distortion_sigma", struct camera_keys, distortion_sigma, &number, 5),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t rigid_fields[] = {
    LIST("rotation", struct rigid_keys, rotation, &three_numbers, 3),
    NUMBER("rotation_sigma_rad", struct rigid_keys, rotation_sigma_rad),
    LIST("position_m", struct rigid_keys, position_m, &number, 3),
    NUMBER("position_sigma_m", struct rigid_keys, position_sigma_m),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t delay_fields[] = {
    NUMBER("us", struct delay_keys, us),
    NUMBER("sigma_us", struct delay_keys, sigma_us),
    CYAML_FIELD_END,
};

static const cyaml_schema_field_t file_fields[] = {
    CYAML_FIELD_INT("version", CYAML_FLAG_DEFAULT, struct file_keys, version),
    CYAML_FIELD_STRING("id", CYAML_FLAG_OPTIONAL, struct file_keys, id, 0),
    CYAML_FIELD_STRING("profile", CYAML_FLAG_DEFAULT, struct file_keys, profile, 1),
    INNER("frame_camera", struct file_keys, frame, camera_fields),
    INNER("event_camera", struct file_keys, event, camera_fields),
    INNER("T_event_frame", struct file_keys, event_frame, rigid_fields),
    INNER("T_hand_frame", struct file_keys, hand_frame, rigid_fields),
    LIST("tcp_offset", struct file_keys, tcp_offset, &number, 6),
    LIST("tcp_offset_sigma", struct file_keys, tcp_offset_sigma, &number, 6),
    INNER("frame_delay", struct file_keys, frame_delay, delay_fields),
    INNER("event_delay", struct file_keys, event_delay, delay_fields),
    INNER("robot_delay", struct file_keys, robot_delay, delay_fields),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t file_schema = { CYAML_VALUE_MAPPING(
    CYAML_FLAG_POINTER, struct file_keys, file_fields) };

/* Where a value stands, for sentences about it; the first one that is said stays. */
struct judge {
    const char *name;
    const uint8_t *bytes;
    size_t n_bytes;
    const char *group; /* "frame_camera"; "" for the outermost keys */
    enum shef_err code;
    struct shef_error *err;
};

static void refuse(struct judge *judge, const char *key, const char *reason)
{
    char path[80];

    snprintf(path, sizeof path, "%s%s%s", judge->group, *judge->group && *key ? "." : "", key);
    judge->code = shef_fail(judge->err, SHEF_ERR_FORMAT, "'%s', line %u, key '%s': %s", judge->name,
                            shef_yaml_line(judge->bytes, judge->n_bytes, path), path, reason);
}

/* Every value must lie in low..high; NaN does not. */
static void expect_range(struct judge *judge, const char *key, const double *values, int n,
                         double low, double high)
{
    for (int i = 0; judge->code == SHEF_OK && i < n; i++)
        if (!(values[i] >= low && values[i] <= high)) {
            char reason[120];

            snprintf(reason, sizeof reason, "%g is not in the range %g to %g", values[i], low,
                     high);
            refuse(judge, key, reason);
        }
}

static void expect_sigmas(struct judge *judge, const char *key, const double *values, int n)
{
    expect_range(judge, key, values, n, 0, 1e6);
}

static void judge_camera(struct judge *judge, const char *group, const struct camera_keys *camera)
{
    judge->group = group;
    for (int i = 0; i < 2; i++) {
        const double side_px = camera->size_px[i];

        expect_range(judge, "size_px", &side_px, 1, 1, SHEF_SENSOR_MAX_SIDE_PX);
        expect_range(judge, "centre_px", &camera->centre_px[i], 1, -side_px, 2 * side_px);
    }
    expect_range(judge, "focal_px", camera->focal_px, 2, 1, MAX_FOCAL_PX);
    expect_range(judge, "distortion", camera->distortion, 5, -MAX_DISTORTION, MAX_DISTORTION);
    expect_sigmas(judge, "focal_sigma_px", camera->focal_sigma_px, 2);
    expect_sigmas(judge, "centre_sigma_px", camera->centre_sigma_px, 2);
    expect_sigmas(judge, "distortion_sigma", camera->distortion_sigma, 5);
}

static struct shef_rigid rigid_of(const struct rigid_keys *keys)
{
    struct shef_rigid t;

    for (int i = 0; i < 9; i++)
        t.r[i] = keys->rotation[i / 3][i % 3];
    memcpy(t.t_m, keys->position_m, sizeof t.t_m);
    return t;
}

static void judge_rigid(struct judge *judge, const char *group, const struct rigid_keys *keys)
{
    const struct shef_rigid t = rigid_of(keys);

    judge->group = group;
    for (int row = 0; row < 3; row++)
        expect_range(judge, "rotation", keys->rotation[row], 3, -1.001, 1.001);
    if (judge->code == SHEF_OK && !(shef_rigid_error(&t) <= MAX_ROTATION_ERROR)) {
        char reason[160];

        snprintf(reason, sizeof reason,
                 "this is no rotation: its rows are off by %.2g from being at right angles, of "
                 "length 1 and right-handed",
                 shef_rigid_error(&t));
        refuse(judge, "rotation", reason);
    }
    expect_range(judge, "position_m", keys->position_m, 3, -MAX_POSITION_M, MAX_POSITION_M);
    expect_sigmas(judge, "rotation_sigma_rad", &keys->rotation_sigma_rad, 1);
    expect_sigmas(judge, "position_sigma_m", &keys->position_sigma_m, 1);
}

static void judge_delay(struct judge *judge, const char *group, const struct delay_keys *delay)
{
    judge->group = group;
    expect_range(judge, "us", &delay->us, 1, -MAX_DELAY_US, MAX_DELAY_US);
    expect_range(judge, "sigma_us", &delay->sigma_us, 1, 0, MAX_DELAY_US);
}

static void judge_file(struct judge *judge, const struct file_keys *keys)
{
    judge->group = "";
    if (keys->version > SHEF_CALIBRATION_VERSION)
        judge->code = shef_fail(judge->err, SHEF_ERR_UNSUPPORTED,
                                "'%s' is of version %d, this program reads up to %d; use a newer "
                                "one",
                                judge->name, keys->version, SHEF_CALIBRATION_VERSION);
    else if (keys->version < 1)
        refuse(judge, "version", "versions begin with 1");
    else if (strcmp(keys->profile, "wide") != 0 && strcmp(keys->profile, "paper") != 0)
        refuse(judge, "profile", "there are the profiles 'wide' and 'paper'");
    judge_camera(judge, "frame_camera", &keys->frame);
    judge_camera(judge, "event_camera", &keys->event);
    judge_rigid(judge, "T_event_frame", &keys->event_frame);
    judge_rigid(judge, "T_hand_frame", &keys->hand_frame);
    judge->group = "";
    expect_range(judge, "tcp_offset", keys->tcp_offset, 3, -MAX_POSITION_M, MAX_POSITION_M);
    expect_range(judge, "tcp_offset", keys->tcp_offset + 3, 3, -MAX_ANGLE_RAD, MAX_ANGLE_RAD);
    expect_sigmas(judge, "tcp_offset_sigma", keys->tcp_offset_sigma, 6);
    judge_delay(judge, "frame_delay", &keys->frame_delay);
    judge_delay(judge, "event_delay", &keys->event_delay);
    judge_delay(judge, "robot_delay", &keys->robot_delay);
}

static struct shef_camera_model model_of(const double focal_px[2], const double centre_px[2],
                                         const double distortion[5])
{
    struct shef_camera_model model = {
        .fx_px = focal_px[0], .fy_px = focal_px[1], .cx_px = centre_px[0], .cy_px = centre_px[1]
    };

    memcpy(model.distortion, distortion, sizeof model.distortion);
    return model;
}

static struct shef_calibrated_camera camera_of(const struct camera_keys *keys)
{
    return (struct shef_calibrated_camera){
        .width_px = keys->size_px[0],
        .height_px = keys->size_px[1],
        .model = model_of(keys->focal_px, keys->centre_px, keys->distortion),
        .sigma = model_of(keys->focal_sigma_px, keys->centre_sigma_px, keys->distortion_sigma),
    };
}

static int64_t ns_of(double us)
{
    return llround(us * SHEF_NS_PER_US);
}

static struct shef_calibrated_delay delay_of(const struct delay_keys *keys)
{
    return (struct shef_calibrated_delay){ ns_of(keys->us), ns_of(keys->sigma_us) };
}

static struct shef_calibration calibration_of(const struct file_keys *keys)
{
    struct shef_calibration calibration = {
        .frame = camera_of(&keys->frame),
        .event = camera_of(&keys->event),
        .t_event_frame = rigid_of(&keys->event_frame),
        .t_event_frame_sigma = { keys->event_frame.rotation_sigma_rad,
                                 keys->event_frame.position_sigma_m },
        .t_hand_frame = rigid_of(&keys->hand_frame),
        .t_hand_frame_sigma = { keys->hand_frame.rotation_sigma_rad,
                                keys->hand_frame.position_sigma_m },
        .frame_delay = delay_of(&keys->frame_delay),
        .event_delay = delay_of(&keys->event_delay),
        .robot_delay = delay_of(&keys->robot_delay),
    };

    memcpy(calibration.profile, keys->profile, sizeof calibration.profile);
    memcpy(calibration.tcp_offset, keys->tcp_offset, sizeof calibration.tcp_offset);
    memcpy(calibration.tcp_offset_sigma, keys->tcp_offset_sigma,
           sizeof calibration.tcp_offset_sigma);
    return calibration;
}

enum shef_err shef_calibration_parse(const char *name, const uint8_t *bytes, size_t n_bytes,
                                     struct shef_calibration *out_calibration,
                                     struct shef_error *err)
{
    struct judge judge = { .name = name, .bytes = bytes, .n_bytes = n_bytes, .err = err };
    struct shef_calibration calibration;
    void *keys_memory;
    enum shef_err code = shef_yaml_parse(name, bytes, n_bytes, &file_schema, &keys_memory, err);

    if (code != SHEF_OK)
        return code;

    const struct file_keys *keys = keys_memory;

    judge_file(&judge, keys);
    if (judge.code == SHEF_OK) {
        calibration = calibration_of(keys);
        judge.code = shef_calibration_identify(&calibration, err);
    }
    judge.group = "";
    if (judge.code == SHEF_OK && *keys->id && strcmp(keys->id, calibration.id) != 0)
        refuse(
            &judge, "id",
            "values were changed since it was written; if that was on purpose, remove this line");
    shef_yaml_free(&file_schema, keys_memory);
    if (judge.code == SHEF_OK)
        *out_calibration = calibration;
    return judge.code;
}

enum shef_err shef_calibration_read(const char *path, struct shef_calibration *out_calibration,
                                    struct shef_error *err)
{
    uint8_t *bytes;
    size_t n_bytes;
    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_calibration_parse(path, bytes, n_bytes, out_calibration, err);
    free(bytes);
    return code;
}

static struct shef_calibrated_camera ideal_camera(int32_t width_px, int32_t height_px, double f_px)
{
    return (struct shef_calibrated_camera){
        .width_px = width_px,
        .height_px = height_px,
        .model = { .fx_px = f_px,
                   .fy_px = f_px,
                   .cx_px = (width_px - 1) / 2.0,
                   .cy_px = (height_px - 1) / 2.0 },
    };
}

struct shef_calibration shef_calibration_paper_rig(void)
{
    struct shef_calibration rig = {
        .profile = "wide",
        .frame = ideal_camera(2048, 1536, 1301),
        .event = ideal_camera(640, 480, 555),
        .t_event_frame = shef_rigid_identity(),
        .t_hand_frame = shef_rigid_identity(),
    };

    rig.t_event_frame.t_m[0] = -0.06544;
    if (shef_calibration_identify(&rig, NULL) != SHEF_OK)
        rig.id[0] = '\0';
    return rig;
}
