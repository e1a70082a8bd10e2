/* The files of a recording, by walking its folder. Thread: any. */
#ifndef SHEF_RECORD_FOLDER_LIST_H
#define SHEF_RECORD_FOLDER_LIST_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "record/manifest.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_folder_list {
    struct shef_manifest_file *files; /* sorted by path; no checksums; owned */
    size_t n_files;
};

/* Lists what lies in the folder and in the folders inside it, up to two deep. Left out: the
 * manifest, hidden files, what is no regular file, and names longer than a manifest can hold.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_folder_list_read(const char *folder,
                                                    struct shef_folder_list *out_list,
                                                    struct shef_error *err);

/* A zeroed list is allowed. */
void shef_folder_list_free(struct shef_folder_list *list);

#ifdef __cplusplus
}
#endif

#endif
