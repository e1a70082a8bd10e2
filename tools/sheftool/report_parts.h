/* What several commands' reports share: numbers, timings and smooth fields as JSON and as text. */
#ifndef SHEFTOOL_REPORT_PARTS_H
#define SHEFTOOL_REPORT_PARTS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#include "pipeline/smooth_field.h"
#include "sheftool/stopwatch.h"

/* JSON has no NaN: a value that is not finite is null. */
json_t *shef_number_json(double value);

/* Prints a number right-aligned in a column, or a dash if it is not finite.
 *   is_signed  + before positive ones */
void shef_number_print(double value, int width, int decimals, bool is_signed, FILE *out);

/* Prints a report on standard output, with so many digits of its numbers. */
void shef_report_print_json(const json_t *root, int n_digits);

/* {"median_ms", "p95_ms", "min_ms"}; NULL: out of memory. */
json_t *shef_timing_summary_json(const struct shef_timing_summary *summary);

/* The six coefficients in px as a list; NULL: out of memory. */
json_t *shef_field_json(const struct shef_smooth_field *field);

/* "+1.56 -0.63 X +0.60 Y ... px", X and Y from -1 to 1 about the image's centre; no line end. */
void shef_field_print(const struct shef_smooth_field *field, FILE *out);

#endif
