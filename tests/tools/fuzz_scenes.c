/* Any bytes must end in scenes in order and named, or in a sentence. */
#include "sheftool/scenes.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_scenes scenes = { .n = -1 };
    struct shef_error err = { 0 };

    if (shef_scenes_parse(&scenes, (const char *)bytes, n_bytes, "fuzz", &err) != SHEF_OK) {
        if (scenes.n != -1 || err.code == SHEF_OK || err.text[0] == '\0')
            abort();
        return 0;
    }
    if (scenes.n < 1 || scenes.n > SHEF_MAX_SCENES)
        abort();
    for (int32_t i = 0; i < scenes.n; i++)
        if (scenes.at[i].first > scenes.at[i].last || !scenes.at[i].name[0] ||
            !memchr(scenes.at[i].name, '\0', sizeof scenes.at[i].name))
            abort();
    return 0;
}
