/* Prints any JSON answer for people, in 80 columns as far as the texts allow: a line for each value
 * of the answer itself, values of the objects in it one after the other, tables for arrays of
 * objects. Knows nothing of what the values mean but the unit at the end of their names, as
 * everywhere in SHEF: p50_ms, rate_hz, memory_bytes. Thread: main. */
#ifndef SHEFCTL_SHOW_H
#define SHEFCTL_SHOW_H

#include <stdio.h>

#include <jansson.h>

/* Prints a whole answer.
 *   columns  names of the columns of tables, separated by commas, in this order; each table has
 *            those that its rows know; NULL: all */
void shef_show(json_t *answer, const char *columns, FILE *out);

/* A single value as text, as a cell of a table shows it: without unit.
 *   key       its name, which says how many decimals make sense
 *   out_text  n_bytes bytes, terminated; whatever could disturb a terminal is a '?' */
void shef_show_value(const char *key, const json_t *value, char *out_text, size_t n_bytes);

/* Splits "p50_ms" into "p50" and "ms"; "n_lost" into "lost" and "". Underlines become spaces.
 *   out_name  n_bytes bytes, terminated
 * Returns the unit, "" for none. */
const char *shef_show_unit(const char *key, char *out_name, size_t n_bytes);

#endif
