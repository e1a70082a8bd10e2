/* Any text must pick some of the pairs, in order, or be refused with a sentence. */
#include "sheftool/pair_list.h"

#include <stdlib.h>
#include <string.h>

#define N_PAIRS 200

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_numbered_list list = { calloc(N_PAIRS, sizeof *list.at), N_PAIRS };
    struct shef_error err = { 0 };
    char *text = strndup((const char *)bytes, n_bytes);

    if (!list.at || !text)
        abort();
    for (size_t i = 0; i < N_PAIRS; i++)
        list.at[i].number = (int64_t)(3 * i);
    if (shef_numbered_pick(&list, text, &err) != SHEF_OK) {
        if (list.n != N_PAIRS || err.text[0] == '\0')
            abort();
    } else if (list.n < 1 || list.n > N_PAIRS) {
        abort();
    }
    for (size_t i = 1; i < list.n; i++)
        if (list.at[i].number <= list.at[i - 1].number)
            abort();
    free(text);
    shef_numbered_list_free(&list);
    return 0;
}
