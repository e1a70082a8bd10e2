/* Any bytes must end in a configuration that passes its own checks, or in a sentence. */
#include "config/config.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_config config;
    struct shef_config again;
    struct shef_error err = { 0 };

    if (shef_config_parse(bytes, n_bytes, "fuzz", &config, &err) != SHEF_OK) {
        if (err.code == SHEF_OK || err.text[0] == '\0' || strchr(err.text, '\n'))
            abort();
        return 0;
    }
    shef_config_defaults(&again);
    for (int i = 0; i < shef_config_n_rows; i++) {
        char text[SHEF_CONFIG_PATH_BYTES];

        shef_config_get(&config, &shef_config_rows[i], text, sizeof text);
        if (shef_config_set(&again, &shef_config_rows[i], text, &err) != SHEF_OK)
            abort();
    }
    if (shef_config_check(&again, NULL, &err) != SHEF_OK)
        abort();
    return 0;
}
