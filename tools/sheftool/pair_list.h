/* Lists of pair numbers: what a folder holds, and what a user picks ("1-16,50").
 *
 * Sorted by number, each number once. Thread: any, one per list. */
#ifndef SHEFTOOL_PAIR_LIST_H
#define SHEFTOOL_PAIR_LIST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#define SHEF_STEM_BYTES 24

/* A numbered file: the number and how its name spells it ("7" or "0007"). */
struct shef_numbered {
    int64_t number;
    char stem[SHEF_STEM_BYTES];
};

struct shef_numbered_list {
    struct shef_numbered *at; /* owned */
    size_t n;
};

/* Lists the files of a folder that are called N followed by one of the endings; other files are
 * passed over. Several endings of one number count once.
 *   endings  up to two, the second may be NULL: ".pfm", ".png"
 * SHEF_ERR_NOT_FOUND: no such folder, or not one such file in it.
 * SHEF_ERR_INVALID: two spellings of one number ("7.png" and "07.png"). */
SHEF_MUST_CHECK enum shef_err shef_numbered_list_read(struct shef_numbered_list *out_list,
                                                      const char *folder,
                                                      const char *const endings[2],
                                                      struct shef_error *err);

void shef_numbered_list_free(struct shef_numbered_list *list);

/* The entry of a number, or NULL. */
const struct shef_numbered *shef_numbered_find(const struct shef_numbered_list *list,
                                               int64_t number);

/* Keeps the numbers that a text like "1-16,50,99-114" names.
 * SHEF_ERR_INVALID: not such a text. SHEF_ERR_NOT_FOUND: a single number, or a whole range, that
 * the list does not have; the list is unchanged. A range of which only a part is there is kept
 * so far, with a line on standard error. */
SHEF_MUST_CHECK enum shef_err shef_numbered_pick(struct shef_numbered_list *list, const char *text,
                                                 struct shef_error *err);

#endif
