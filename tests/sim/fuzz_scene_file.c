/* Any bytes must end in a description whose names are known and whose numbers are in range, or in a
 * sentence, never in a crash. */
#include <stdlib.h>

#include "shefsim/description.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct sim_description *description = NULL;
    struct shef_error err = { 0 };

    if (sim_description_parse(&description, "fuzz", bytes, n_bytes, &err) != SHEF_OK) {
        if (description || err.code == SHEF_OK || err.text[0] == '\0')
            abort();
        return 0;
    }
    for (uint32_t i = 0; i < description->n_objects; i++) {
        const struct sim_object *object = &description->objects[i];
        const struct sim_material *material = sim_description_material(description, object);

        if (!material || !(material->albedo > 0) || !(object->size_m[0] > 0))
            abort();
    }
    sim_description_free(description);
    return 0;
}
