#include "sheftool/pair_list.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_DIGITS 18 /* fits int64 */

/* Reads a name as digits followed by one of the endings. */
static bool parse_name(const char *name, const char *const endings[2], struct shef_numbered *out)
{
    const size_t n_digits = strspn(name, "0123456789");
    const char *rest = name + n_digits;

    if (n_digits < 1 || n_digits > MAX_DIGITS)
        return false;
    if (strcmp(rest, endings[0]) != 0 && (!endings[1] || strcmp(rest, endings[1]) != 0))
        return false;
    memcpy(out->stem, name, n_digits);
    out->stem[n_digits] = '\0';
    out->number = strtoll(out->stem, NULL, 10);
    return true;
}

static int compare(const void *a, const void *b)
{
    const struct shef_numbered *left = a;
    const struct shef_numbered *right = b;

    if (left->number != right->number)
        return left->number < right->number ? -1 : 1;
    return strcmp(left->stem, right->stem);
}

static enum shef_err append(struct shef_numbered_list *list, size_t *capacity,
                            const struct shef_numbered *item)
{
    if (list->n == *capacity) {
        const size_t grown = *capacity ? 2 * *capacity : 64;
        struct shef_numbered *at = realloc(list->at, grown * sizeof *at);

        if (!at)
            return SHEF_ERR_NO_MEMORY;
        list->at = at;
        *capacity = grown;
    }
    list->at[list->n++] = *item;
    return SHEF_OK;
}

static enum shef_err sort_and_merge(struct shef_numbered_list *list, const char *folder,
                                    struct shef_error *err)
{
    size_t n = 0;

    qsort(list->at, list->n, sizeof *list->at, compare);
    for (size_t i = 0; i < list->n; i++) {
        if (n == 0 || list->at[i].number != list->at[n - 1].number)
            list->at[n++] = list->at[i];
        else if (strcmp(list->at[i].stem, list->at[n - 1].stem) != 0)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "folder '%s' has number %" PRId64 " twice, as '%s' and '%s'; remove "
                             "one",
                             folder, list->at[i].number, list->at[n - 1].stem, list->at[i].stem);
    }
    list->n = n;
    return SHEF_OK;
}

enum shef_err shef_numbered_list_read(struct shef_numbered_list *out_list, const char *folder,
                                      const char *const endings[2], struct shef_error *err)
{
    struct shef_numbered_list list = { 0 };
    size_t capacity = 0;
    enum shef_err code = SHEF_OK;
    DIR *dir = opendir(folder);

    if (!dir)
        return shef_fail_os(err, errno, "open folder '%s'", folder);
    for (const struct dirent *entry; code == SHEF_OK && (entry = readdir(dir));) {
        struct shef_numbered item;

        if (parse_name(entry->d_name, endings, &item))
            code = append(&list, &capacity, &item);
    }
    closedir(dir);
    if (code != SHEF_OK)
        shef_fail(err, code, "list folder '%s': out of memory", folder);
    else if (list.n == 0)
        code = shef_fail(err, SHEF_ERR_NOT_FOUND,
                         "folder '%s' holds no numbered files such as 1%s%s%s", folder, endings[0],
                         endings[1] ? " or 1" : "", endings[1] ? endings[1] : "");
    else
        code = sort_and_merge(&list, folder, err);
    if (code != SHEF_OK) {
        free(list.at);
        return code;
    }
    *out_list = list;
    return SHEF_OK;
}

void shef_numbered_list_free(struct shef_numbered_list *list)
{
    free(list->at);
    *list = (struct shef_numbered_list){ 0 };
}

const struct shef_numbered *shef_numbered_find(const struct shef_numbered_list *list,
                                               int64_t number)
{
    size_t first = 0;
    size_t last = list->n;

    while (first < last) {
        const size_t middle = first + (last - first) / 2;

        if (list->at[middle].number < number)
            first = middle + 1;
        else
            last = middle;
    }
    return first < list->n && list->at[first].number == number ? &list->at[first] : NULL;
}

/* Reads "N" or "N-M" and moves behind it. */
static bool parse_range(const char **text, int64_t *out_first, int64_t *out_last)
{
    char *end;

    if (!isdigit((unsigned char)**text))
        return false;
    *out_first = *out_last = strtoll(*text, &end, 10);
    if (*end == '-') {
        if (!isdigit((unsigned char)end[1]))
            return false;
        *out_last = strtoll(end + 1, &end, 10);
    }
    *text = end;
    return *out_first <= *out_last && (*end == ',' || *end == '\0');
}

enum shef_err shef_numbered_pick(struct shef_numbered_list *list, const char *text,
                                 struct shef_error *err)
{
    bool *kept = calloc(list->n + 1, sizeof *kept);
    const char *at = text;
    size_t n = 0;

    if (!kept)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    for (bool more = true; more; at += more) {
        int64_t first;
        int64_t last;
        size_t n_found = 0;

        if (!parse_range(&at, &first, &last)) {
            free(kept);
            return shef_fail(err, SHEF_ERR_INVALID,
                             "'%s' is no list of pairs; write numbers and ranges, such as "
                             "1-16,50",
                             text);
        }
        for (size_t i = 0; i < list->n; i++)
            if (list->at[i].number >= first && list->at[i].number <= last) {
                kept[i] = true;
                n_found++;
            }
        if (n_found == 0) {
            free(kept);
            return shef_fail(err, SHEF_ERR_NOT_FOUND,
                             "pairs '%s': the data has no pair from %" PRId64 " to %" PRId64, text,
                             first, last);
        }
        const double n_asked = (double)last - (double)first + 1;

        if ((double)n_found < n_asked)
            fprintf(stderr, "pairs %" PRId64 "-%" PRId64 ": %zu of %.0f present\n", first, last,
                    n_found, n_asked);
        more = *at == ',';
    }
    for (size_t i = 0; i < list->n; i++)
        if (kept[i])
            list->at[n++] = list->at[i];
    list->n = n;
    free(kept);

    return SHEF_OK;
}
