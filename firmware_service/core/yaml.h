/* YAML files that people write, read by a schema of libcyaml.
 *
 * The schema (cyaml/cyaml.h) says which keys there are and of which type; everything else becomes
 * one sentence with file, line and key. Aliases are refused. Thread: any. */
#ifndef SHEF_CORE_YAML_H
#define SHEF_CORE_YAML_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct cyaml_schema_value;

/* Reads a text.
 *   name       of the file, for sentences
 *   schema     its outermost value is a mapping with CYAML_FLAG_POINTER
 *   out_value  the struct that the schema describes; shef_yaml_free() it
 * SHEF_ERR_FORMAT: no YAML, or not what the schema wants. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_yaml_parse(const char *name, const uint8_t *bytes,
                                              size_t n_bytes,
                                              const struct cyaml_schema_value *schema,
                                              void **out_value, struct shef_error *err);

/* NULL is allowed. */
void shef_yaml_free(const struct cyaml_schema_value *schema, void *value);

/* The line, from 1, in which the value of a key begins: "frame_camera.focal_px". Entries of
 * sequences are numbered from 0: "objects.3.size_m". For sentences about values that the schema
 * cannot judge.
 * Returns 0 if there is none. */
uint32_t shef_yaml_line(const uint8_t *bytes, size_t n_bytes, const char *key);

#ifdef __cplusplus
}
#endif

#endif
