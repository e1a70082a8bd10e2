#include "calib/calibration_text.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/file.h"
#include "core/time.h"

static void write_number(FILE *out, double value)
{
    char text[40];

    for (int digits = 1; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    fputs(text, out);
}

static void write_list(FILE *out, const double *values, int n)
{
    fputc('[', out);
    for (int i = 0; i < n; i++) {
        if (i > 0)
            fputs(", ", out);
        write_number(out, values[i]);
    }
    fputc(']', out);
}

static void write_values(FILE *out, const char *key, const double *values, int n)
{
    fprintf(out, "%s: ", key);
    write_list(out, values, n);
    fputc('\n', out);
}

static void write_value(FILE *out, const char *key, double value)
{
    fprintf(out, "%s: ", key);
    write_number(out, value);
    fputc('\n', out);
}

static void write_camera(FILE *out, const char *key, const struct shef_calibrated_camera *camera)
{
    const struct shef_camera_model *model = &camera->model;
    const struct shef_camera_model *sigma = &camera->sigma;

    fprintf(out, "%s:\n", key);
    fprintf(out, "  size_px: [%d, %d]\n", camera->width_px, camera->height_px);
    write_values(out, "  focal_px", (double[2]){ model->fx_px, model->fy_px }, 2);
    write_values(out, "  focal_sigma_px", (double[2]){ sigma->fx_px, sigma->fy_px }, 2);
    write_values(out, "  centre_px", (double[2]){ model->cx_px, model->cy_px }, 2);
    write_values(out, "  centre_sigma_px", (double[2]){ sigma->cx_px, sigma->cy_px }, 2);
    write_values(out, "  distortion", model->distortion, 5);
    write_values(out, "  distortion_sigma", sigma->distortion, 5);
}

static void write_rigid(FILE *out, const char *key, const struct shef_rigid *t,
                        const struct shef_rigid_sigma *sigma)
{
    fprintf(out, "%s:\n  rotation:\n", key);
    for (int row = 0; row < 3; row++) {
        fputs("    - ", out);
        write_list(out, t->r + (ptrdiff_t)row * 3, 3);
        fputc('\n', out);
    }
    write_value(out, "  rotation_sigma_rad", sigma->rotation_rad);
    write_values(out, "  position_m", t->t_m, 3);
    write_value(out, "  position_sigma_m", sigma->position_m);
}

static void write_delay(FILE *out, const char *key, const struct shef_calibrated_delay *delay)
{
    fprintf(out, "%s:\n", key);
    write_value(out, "  us", (double)delay->ns / SHEF_NS_PER_US);
    write_value(out, "  sigma_us", (double)delay->sigma_ns / SHEF_NS_PER_US);
}

static void write_all(FILE *out, const struct shef_calibration *calibration)
{
    fprintf(out, "version: %d\n", SHEF_CALIBRATION_VERSION);
    fprintf(out, "profile: %s\n", calibration->profile);
    write_camera(out, "frame_camera", &calibration->frame);
    write_camera(out, "event_camera", &calibration->event);
    write_rigid(out, "T_event_frame", &calibration->t_event_frame,
                &calibration->t_event_frame_sigma);
    write_rigid(out, "T_hand_frame", &calibration->t_hand_frame, &calibration->t_hand_frame_sigma);
    write_values(out, "tcp_offset", calibration->tcp_offset, 6);
    write_values(out, "tcp_offset_sigma", calibration->tcp_offset_sigma, 6);
    write_delay(out, "frame_delay", &calibration->frame_delay);
    write_delay(out, "event_delay", &calibration->event_delay);
    write_delay(out, "robot_delay", &calibration->robot_delay);
}

enum shef_err shef_calibration_text(const struct shef_calibration *calibration, char **out_text,
                                    size_t *out_n_bytes, struct shef_error *err)
{
    char *text = NULL;
    size_t n_bytes = 0;
    FILE *out = open_memstream(&text, &n_bytes);

    if (out) {
        write_all(out, calibration);
        if (fclose(out) == 0) {
            *out_text = text;
            *out_n_bytes = n_bytes;
            return SHEF_OK;
        }
        free(text);
    }
    return shef_fail(err, SHEF_ERR_NO_MEMORY, "calibration: out of memory");
}

enum shef_err shef_calibration_identify(struct shef_calibration *calibration,
                                        struct shef_error *err)
{
    char *text;
    size_t n_bytes;
    enum shef_err code = shef_calibration_text(calibration, &text, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_sha256_bytes(text, n_bytes, calibration->id, err);
    free(text);
    return code;
}

/* The text with its front: what it is, and the id. */
static enum shef_err add_front(const struct shef_calibration *calibration, char **out_text,
                               size_t *out_n_bytes, struct shef_error *err)
{
    char id[SHEF_SHA256_TEXT_BYTES];
    char *values;
    size_t n_bytes;
    enum shef_err code = shef_calibration_text(calibration, &values, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_sha256_bytes(values, n_bytes, id, err);
    if (code == SHEF_OK) {
        const int n = asprintf(out_text,
                               "# Calibration of a SHEF rig. Whoever changes a value removes the "
                               "line with the id.\nid: %s\n%s",
                               id, values);

        if (n < 0)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "calibration: out of memory");
        else
            *out_n_bytes = (size_t)n;
    }
    free(values);
    return code;
}

enum shef_err shef_calibration_write(const char *path, const struct shef_calibration *calibration,
                                     struct shef_error *err)
{
    struct shef_calibration same;
    char *text;
    size_t n_bytes = 0;
    enum shef_err code = add_front(calibration, &text, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_calibration_parse(path, (const uint8_t *)text, n_bytes, &same, err);
    if (code == SHEF_OK) {
        code = shef_file_replace(path, text, n_bytes, err);
    } else if (code == SHEF_ERR_FORMAT) {
        (void)shef_fail_context(err, "not written");
        code = SHEF_ERR_INVALID;
        if (err)
            err->code = code;
    }
    free(text);
    return code;
}
