#include "sheftool/isa_option.h"

#include "core/words.h"

enum shef_err shef_isa_option(int32_t isa, uint32_t *out_features, struct shef_error *err)
{
    char name[16];

    shef_words_at(SHEF_CPU_CHOICES, isa, name, sizeof name);
    if (shef_cpu_features_among(name, out_features, err) != SHEF_OK)
        return shef_fail_context(err, "--isa");
    return SHEF_OK;
}
