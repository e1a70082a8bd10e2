/* A recording folder while it is being written: the folder, its manifest, and how it ends.
 *
 * The parts have writers of their own (record/event_recorder.h), which put what they have to say
 * into the manifest. Blocks on disk. Thread: one; only the parts' recorders may write and judge on
 * threads of their own meanwhile. */
#ifndef SHEF_RECORD_RECORDING_WRITER_H
#define SHEF_RECORD_RECORDING_WRITER_H

#include <limits.h>
#include <pthread.h>

#include "core/error.h"
#include "core/sha256.h"
#include "record/manifest.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recording_writer {
    /* Set by create. */
    char folder[PATH_MAX];
    /* The parts fill in their sections. */
    struct shef_manifest manifest;
    pthread_mutex_t lock; /* of the verdict, which all parts have a say in */
};

struct shef_recording_writer_config {
    const char *software;         /* "shef 0.1.0" */
    const char *calibration_path; /* copied as calibration.yaml; NULL: there is none */
    const char *config_path;      /* copied as config.yaml; NULL: there is none */
};

/* Makes the folder and its manifest ("recording").
 *   folder  must not exist or be empty; the folders above it must exist
 * SHEF_ERR_INVALID: it holds something. SHEF_ERR_NO_MEMORY, errors of the system. On failure
 * nothing stays behind. */
SHEF_MUST_CHECK enum shef_err shef_recording_writer_create(
    struct shef_recording_writer *writer, const char *folder,
    const struct shef_recording_writer_config *config, struct shef_error *err);

#define SHEF_PART_PATH_BYTES (PATH_MAX + 64)

/* Makes the folder of a part.
 *   name      at most 32 characters, "events"
 *   out_path  where it is */
SHEF_MUST_CHECK enum shef_err shef_recording_writer_add_part(struct shef_recording_writer *writer,
                                                             const char *name,
                                                             char out_path[SHEF_PART_PATH_BYTES],
                                                             struct shef_error *err);

/* Writes the manifest as it is now. */
SHEF_MUST_CHECK enum shef_err shef_recording_writer_update(struct shef_recording_writer *writer,
                                                           struct shef_error *err);

/* A part's verdict; the worst of all counts, and its first sentence. Thread: any. */
void shef_recording_writer_judge(struct shef_recording_writer *writer, enum shef_verdict verdict,
                                 const char *reason);

/* Ends the recording: list of files, manifest ("closed"). The parts have ended before. Frees what
 * create() took, on failure too.
 *   with_sha256  reads everything back for checksums of whole files, which takes time
 *   go_on        asked meanwhile; when it says stop, checksums not done are left out; or NULL */
SHEF_MUST_CHECK enum shef_err shef_recording_writer_close(struct shef_recording_writer *writer,
                                                          bool with_sha256, shef_go_on_fn *go_on,
                                                          void *context, struct shef_error *err);

/* Instead of close(), before any block was written: removes what there is. */
void shef_recording_writer_abandon(struct shef_recording_writer *writer);

#ifdef __cplusplus
}
#endif

#endif
