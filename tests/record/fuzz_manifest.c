/* Any bytes must end in a manifest or in a sentence, never in a crash. */
#include "record/manifest.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_manifest manifest = { .n_files = 0 };
    struct shef_error err = { 0 };

    if (shef_manifest_parse(bytes, n_bytes, &manifest, &err) != SHEF_OK) {
        if (manifest.files || err.code == SHEF_OK || err.text[0] == '\0' || strchr(err.text, '\n'))
            abort();
        return 0;
    }
    for (size_t i = 0; i < manifest.n_files; i++)
        if (manifest.files[i].path[0] == '/' || strstr(manifest.files[i].path, ".."))
            abort();
    if (manifest.events.is_present &&
        (manifest.events.camera.width_px < 1 || manifest.events.camera.width_px > 2048))
        abort();
    shef_manifest_free(&manifest);
    return 0;
}
