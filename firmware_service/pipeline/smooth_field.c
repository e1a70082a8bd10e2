#include "pipeline/smooth_field.h"

#include <math.h>
#include <string.h>

static void terms_at(int32_t width_px, int32_t height_px, double x, double y,
                     double out_terms[SHEF_FIELD_TERMS])
{
    const double nx = (x - (width_px - 1) / 2.0) / (width_px / 2.0);
    const double ny = (y - (height_px - 1) / 2.0) / (height_px / 2.0);

    out_terms[0] = 1.0;
    out_terms[1] = nx;
    out_terms[2] = ny;
    out_terms[3] = nx * ny;
    out_terms[4] = nx * nx;
    out_terms[5] = ny * ny;
}

double shef_field_at(const struct shef_smooth_field *field, double x, double y)
{
    double terms[SHEF_FIELD_TERMS];
    double value = 0.0;

    terms_at(field->width_px, field->height_px, x, y, terms);
    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        value += field->c[i] * terms[i];
    return value;
}

void shef_field_row(const struct shef_smooth_field *field, double y, double first, double step,
                    int32_t n, float *out_values)
{
    const double *c = field->c;
    const double ny = (y - (field->height_px - 1) / 2.0) / (field->height_px / 2.0);
    const double constant = c[0] + c[2] * ny + c[5] * ny * ny;
    const double slope = c[1] + c[3] * ny;
    const double half_width = field->width_px / 2.0;
    const double start = (first - (field->width_px - 1) / 2.0) / half_width;

    for (int32_t i = 0; i < n; i++) {
        const double nx = start + i * step / half_width;

        out_values[i] = (float)(constant + nx * (slope + nx * c[4]));
    }
}

struct shef_field_fit shef_field_fit_begin(int32_t width_px, int32_t height_px)
{
    return (struct shef_field_fit){ .width_px = width_px, .height_px = height_px };
}

void shef_field_fit_add(struct shef_field_fit *fit, double x, double y, double value_px,
                        double weight)
{
    double terms[SHEF_FIELD_TERMS];

    terms_at(fit->width_px, fit->height_px, x, y, terms);
    for (int i = 0; i < SHEF_FIELD_TERMS; i++) {
        for (int j = 0; j < SHEF_FIELD_TERMS; j++)
            fit->normal[i][j] += weight * terms[i] * terms[j];
        fit->right[i] += weight * terms[i] * value_px;
    }
}

/* Gauss elimination with partial pivoting on the 6x7 system. */
enum shef_err shef_field_fit_solve(const struct shef_field_fit *fit,
                                   struct shef_smooth_field *out_field)
{
    double a[SHEF_FIELD_TERMS][SHEF_FIELD_TERMS + 1];
    const double total_weight = fit->normal[0][0];

    for (int i = 0; i < SHEF_FIELD_TERMS; i++) {
        memcpy(a[i], fit->normal[i], sizeof fit->normal[i]);
        a[i][SHEF_FIELD_TERMS] = fit->right[i];
    }
    for (int i = 0; i < SHEF_FIELD_TERMS; i++) {
        int pivot = i;

        for (int j = i + 1; j < SHEF_FIELD_TERMS; j++)
            if (fabs(a[j][i]) > fabs(a[pivot][i]))
                pivot = j;
        /* Relative to the weight: one part in a million is noise of the placement. */
        if (!(fabs(a[pivot][i]) > 1e-6 * total_weight))
            return SHEF_ERR_EMPTY;
        for (int k = 0; k <= SHEF_FIELD_TERMS; k++) {
            const double swap = a[i][k];

            a[i][k] = a[pivot][k];
            a[pivot][k] = swap;
        }
        for (int j = i + 1; j < SHEF_FIELD_TERMS; j++) {
            const double factor = a[j][i] / a[i][i];

            for (int k = i; k <= SHEF_FIELD_TERMS; k++)
                a[j][k] -= factor * a[i][k];
        }
    }

    struct shef_smooth_field field = { .width_px = fit->width_px, .height_px = fit->height_px };

    for (int i = SHEF_FIELD_TERMS - 1; i >= 0; i--) {
        double rest = a[i][SHEF_FIELD_TERMS];

        for (int k = i + 1; k < SHEF_FIELD_TERMS; k++)
            rest -= a[i][k] * field.c[k];
        field.c[i] = rest / a[i][i];
    }
    *out_field = field;
    return SHEF_OK;
}
