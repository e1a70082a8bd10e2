#include "sheftool/events_draft.h"

#include <errno.h>
#include <stdbool.h>
#include <unistd.h>

#include "core/file.h"

#define BUFFER_BYTES (1u << 20)

enum shef_err shef_draft_open(struct shef_draft *draft, const char *path, struct shef_error *err)
{
    *draft = (struct shef_draft){ .file = NULL };
    if (snprintf(draft->path, sizeof draft->path, "%s", path) >= (int)sizeof draft->path ||
        snprintf(draft->part, sizeof draft->part, "%s.part", path) >= (int)sizeof draft->part) {
        draft->part[0] = '\0';
        return shef_fail(err, SHEF_ERR_INVALID, "write '%s': the path is too long", path);
    }
    draft->file = fopen(draft->part, "wbe");
    if (!draft->file) {
        draft->part[0] = '\0';
        return shef_fail_os(err, errno, "write '%s'", path);
    }
    setvbuf(draft->file, NULL, _IOFBF, BUFFER_BYTES);
    return SHEF_OK;
}

enum shef_err shef_draft_fail(const struct shef_draft *draft, struct shef_error *err)
{
    return shef_fail_os(err, errno, "write '%s'", draft->path);
}

enum shef_err shef_draft_commit(struct shef_draft *draft, struct shef_error *err)
{
    /* The disk has the data before they get the name, which a power cut could else leave on an
     * empty file. */
    const bool is_whole = fflush(draft->file) == 0 && fsync(fileno(draft->file)) == 0;

    if (!is_whole || rename(draft->part, draft->path) != 0) {
        const enum shef_err code = shef_draft_fail(draft, err);

        shef_draft_discard(draft);
        return code;
    }
    shef_file_sync_name(draft->path);
    fclose(draft->file);
    draft->file = NULL;
    draft->part[0] = '\0';
    return SHEF_OK;
}

void shef_draft_discard(struct shef_draft *draft)
{
    if (draft->file)
        fclose(draft->file);
    if (draft->part[0])
        unlink(draft->part);
    draft->file = NULL;
    draft->part[0] = '\0';
}
