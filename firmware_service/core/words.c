#include "core/words.h"

#include <stdio.h>
#include <string.h>

#define LONGEST 63

bool shef_words_at(const char *list, int32_t n, char *out_word, size_t n_bytes)
{
    const char *word = list;

    for (; n > 0 && word; n--) {
        word = strchr(word, '|');
        if (word)
            word++;
    }
    if (!word)
        return false;
    snprintf(out_word, n_bytes, "%.*s", (int)strcspn(word, "|"), word);
    return true;
}

static size_t min_size(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Damerau 1964, in the form that never edits a swapped pair again: cost[i][j] makes the first j
 * bytes of b from the first i of a. */
size_t shef_words_distance(const char *a, const char *b)
{
    const size_t n_a = strlen(a), n_b = strlen(b);
    uint8_t cost[LONGEST + 1][LONGEST + 1];

    if (n_a > LONGEST || n_b > LONGEST)
        return SIZE_MAX;
    for (size_t i = 0; i <= n_a; i++)
        cost[i][0] = (uint8_t)i;
    for (size_t j = 0; j <= n_b; j++)
        cost[0][j] = (uint8_t)j;
    for (size_t i = 1; i <= n_a; i++) {
        for (size_t j = 1; j <= n_b; j++) {
            size_t least = min_size(cost[i - 1][j], cost[i][j - 1]) + 1u;

            least = min_size(least, cost[i - 1][j - 1] + (size_t)(a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                least = min_size(least, cost[i - 2][j - 2] + 1u);
            cost[i][j] = (uint8_t)least;
        }
    }
    return cost[n_a][n_b];
}

bool shef_words_is_near(const char *written, size_t distance)
{
    /* One slip in three letters; more would suggest any short word for any other. */
    return distance <= 3 && distance <= (strlen(written) + 1) / 3;
}

void shef_words_hint(const char *list, const char *written, char *out_hint)
{
    char word[LONGEST + 1];
    size_t least = SIZE_MAX;

    out_hint[0] = '\0';
    for (int32_t i = 0; shef_words_at(list, i, word, sizeof word); i++) {
        const size_t distance = shef_words_distance(word, written);

        if (distance < least && shef_words_is_near(written, distance)) {
            least = distance;
            snprintf(out_hint, SHEF_WORDS_HINT_BYTES, "; is '%s' meant?", word);
        }
    }
}
