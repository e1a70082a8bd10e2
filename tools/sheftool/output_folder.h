/* A result folder that appears whole or not at all.
 *
 * Results are written into a hidden folder beside the final one. commit() renames it into place;
 * discard() removes it. A folder that exists is only replaced if it is empty or holds nothing but
 * an earlier result: every command writes a JSON index with the key "files", and what that list
 * names is what may be deleted. A link to a folder stays, the results go where it points. Files lie
 * flat or one folder deep. A program that is killed without a chance to clean up leaves the hidden
 * folder `.NAME.partial-*`, never a half result. Thread: main. */
#ifndef SHEFTOOL_OUTPUT_FOLDER_H
#define SHEFTOOL_OUTPUT_FOLDER_H

#include <jansson.h>
#include <stdbool.h>

#include "core/error.h"
#include "sheftool/paths.h"

struct shef_output_folder {
    char final[SHEF_FOLDER_BYTES];   /* as the user named it, links followed, no trailing slashes */
    char staging[SHEF_FOLDER_BYTES]; /* where the files are written; empty: none */
    const char *index;               /* "timing.json" */
    json_t *files;      /* array of relative names, owned until commit() or discard() */
    bool replaces;      /* an empty folder or an earlier result lies at `final` */
    int n_parents_made; /* folders above `final` that open() had to make */
};

/* Looks at the place and makes the staging folder.
 *   path   the folder to be; missing folders above it are made
 *   index  name of the JSON file that the command writes at the end
 * SHEF_ERR_INVALID: the folder holds something that is not an earlier result, is a mount point,
 * or is a link to nothing.
 * SHEF_ERR_NOT_FOUND, SHEF_ERR_PERMISSION, SHEF_ERR_IO: it cannot be made here. */
SHEF_MUST_CHECK enum shef_err shef_output_folder_open(struct shef_output_folder *out_folder,
                                                      const char *path, const char *index,
                                                      struct shef_error *err);

/* The same for pictures of errors, with the index errors.json.
 *   named   where the user wants them; NULL: beside what is scored, its name + "-errors" */
SHEF_MUST_CHECK enum shef_err shef_output_folder_open_errors(struct shef_output_folder *out_folder,
                                                             const char *named, const char *scored,
                                                             struct shef_error *err);

/* Makes a folder inside the staging folder. */
SHEF_MUST_CHECK enum shef_err shef_output_folder_add_folder(struct shef_output_folder *folder,
                                                            const char *name,
                                                            struct shef_error *err);

/* Registers a file and gives the path to write it to.
 *   out_path  SHEF_PATH_BYTES */
SHEF_MUST_CHECK enum shef_err shef_output_folder_add(struct shef_output_folder *folder,
                                                     char *out_path, struct shef_error *err,
                                                     const char *name_fmt, ...) SHEF_PRINTF(4, 5);

/* Adds "files" to root, writes it as the index, and puts the folder in its place.
 *   root  not consumed
 * On failure the staging folder is already removed. */
SHEF_MUST_CHECK enum shef_err shef_output_folder_commit(struct shef_output_folder *folder,
                                                        json_t *root, struct shef_error *err);

/* Removes what was written. After commit(), or on a zeroed folder, it does nothing. */
void shef_output_folder_discard(struct shef_output_folder *folder);

/* Serialises root, indented, into a file that appears whole or not at all. */
SHEF_MUST_CHECK enum shef_err shef_write_json(const char *path, json_t *root,
                                              struct shef_error *err);

#endif
