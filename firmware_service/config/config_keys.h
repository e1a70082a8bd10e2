/* Which keys a YAML file has, and on which lines. Internal to the configuration.
 *
 * libcyaml reads the values; this pass over the same bytes gives the sentences their line
 * numbers, which libcyaml 1.3.1 does not know for a key that is not in its schema, and finds
 * what would otherwise be read in silence. Thread: setup. */
#ifndef SHEF_CONFIG_CONFIG_KEYS_H
#define SHEF_CONFIG_CONFIG_KEYS_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#define SHEF_CONFIG_KEY_BYTES 96
#define SHEF_CONFIG_MAX_KEYS  256

struct shef_config_key {
    char path[SHEF_CONFIG_KEY_BYTES]; /* "depth.mode"; of a section "depth" */
    int line;                         /* counted from 1 */
};

struct shef_config_keys {
    struct shef_config_key keys[SHEF_CONFIG_MAX_KEYS];
    int n_keys;
};

/* Walks through the file and refuses whatever is no setting of ours.
 *   name  what errors call the file
 * SHEF_ERR_FORMAT: no YAML. SHEF_ERR_INVALID: a key that is unknown or given twice, a section
 * without keys under it, a list, an alias, a second document. */
SHEF_MUST_CHECK enum shef_err shef_config_keys_check(const uint8_t *bytes, size_t n_bytes,
                                                     const char *name,
                                                     struct shef_config_keys *out_keys,
                                                     struct shef_error *err);

/* The line of a key, 0 if it is not in the file. */
int shef_config_keys_line(const struct shef_config_keys *keys, const char *path);

#endif
