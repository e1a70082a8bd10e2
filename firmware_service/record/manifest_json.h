/* A manifest as JSON. Internal to the manifest. Thread: any. */
#ifndef SHEF_RECORD_MANIFEST_JSON_H
#define SHEF_RECORD_MANIFEST_JSON_H

#include <jansson.h>

#include "record/manifest.h"

/* NULL: out of memory. The caller owns it. */
json_t *shef_manifest_to_json(const struct shef_manifest *manifest);

#endif
