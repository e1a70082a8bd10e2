/* Lists of words in one text, "half|full": what a setting or an option may be, and what somebody
 * who wrote something else may have meant. Thread: any. */
#ifndef SHEF_CORE_WORDS_H
#define SHEF_CORE_WORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Enough for "; is 'WORD' meant?" with any word that is suggested. */
#define SHEF_WORDS_HINT_BYTES 96

/* The n-th word of a "a|b|c" list, counted from 0; false past the end.
 *   out_word  n_bytes bytes, terminated */
bool shef_words_at(const char *list, int32_t n, char *out_word, size_t n_bytes);

/* How many letters must be put in, left out, replaced or swapped with their neighbour to make one
 * word of the other. Words of more than 63 bytes count as entirely different: SIZE_MAX. */
size_t shef_words_distance(const char *a, const char *b);

/* Whether a word that is `distance` away from what was written is close enough to suggest. */
bool shef_words_is_near(const char *written, size_t distance);

/* "; is 'graded' meant?" where the list has a word close to what was written, otherwise "".
 *   out_hint  SHEF_WORDS_HINT_BYTES bytes, terminated */
void shef_words_hint(const char *list, const char *written, char *out_hint);

#ifdef __cplusplus
}
#endif

#endif
