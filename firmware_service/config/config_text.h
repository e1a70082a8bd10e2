/* The rows as text for people: a commented file, a list, a manual page's section.
 * Thread: setup. */
#ifndef SHEF_CONFIG_CONFIG_TEXT_H
#define SHEF_CONFIG_CONFIG_TEXT_H

#include <stdio.h>

#include "config/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file that sets every setting to what config holds, each with its meaning above it. Reading
 * it gives the same configuration. */
void shef_config_write_yaml(const struct shef_config *config, FILE *out);

/* One setting after the other: key, value, default, range, unit, meaning. */
void shef_config_write_list(const struct shef_config *config, FILE *out);

/* The settings' part of shefd.yaml(5), in man(7). */
void shef_config_write_man(FILE *out);

/* What a setting may be: "16 to 256 px", "true or false", "half|full", "text". */
void shef_config_describe_range(const struct shef_config_row *row, char *out_text, size_t n_bytes);

#ifdef __cplusplus
}
#endif

#endif
