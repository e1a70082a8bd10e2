#include "sheftool/report_parts.h"

#include <math.h>

json_t *shef_number_json(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

void shef_number_print(double value, int width, int decimals, bool is_signed, FILE *out)
{
    if (isfinite(value))
        fprintf(out, is_signed ? "%+*.*f" : "%*.*f", width, decimals, value);
    else
        fprintf(out, "%*s", width, "-");
}

void shef_report_print_json(const json_t *root, int n_digits)
{
    json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(n_digits));
    putchar('\n');
}

json_t *shef_timing_summary_json(const struct shef_timing_summary *summary)
{
    return json_pack("{s:f, s:f, s:f}", "median_ms", summary->median_ms, "p95_ms", summary->p95_ms,
                     "min_ms", summary->min_ms);
}

json_t *shef_field_json(const struct shef_smooth_field *field)
{
    json_t *list = json_array();

    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        json_array_append_new(list, json_real(field->c[i]));
    return list;
}

void shef_field_print(const struct shef_smooth_field *field, FILE *out)
{
    fprintf(out, "%+.2f %+.2f X %+.2f Y %+.2f XY %+.2f X^2 %+.2f Y^2 px", field->c[0], field->c[1],
            field->c[2], field->c[3], field->c[4], field->c[5]);
}
