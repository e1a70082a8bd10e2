#include "record/verify.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "record/folder_list.h"
#include "record/part_table.h"
#include "record/recording.h"

SHEF_PRINTF(2, 3) static void add_problem(struct shef_verify_report *report, const char *fmt, ...)
{
    va_list args;

    if (report->n_problems < SHEF_VERIFY_MAX_PROBLEMS) {
        va_start(args, fmt);
        vsnprintf(report->problems[report->n_problems], SHEF_ERROR_TEXT_BYTES, fmt, args);
        va_end(args);
    }
    report->n_problems++;
}

/* A count that should be zero. */
static void expect_none(struct shef_verify_report *report, enum shef_part part, uint64_t n,
                        const char *what)
{
    if (n > 0)
        add_problem(report, "%s: %llu %s", shef_part_kind(part)->name, (unsigned long long)n, what);
}

static void report_damage(struct shef_verify_report *report, enum shef_part part,
                          const struct shef_damage *damage, uint64_t n_promised,
                          uint64_t next_number)
{
    expect_none(report, part, damage->n_bad_blocks, "blocks do not match their checksums");
    expect_none(report, part, damage->n_cut_blocks, "blocks lie beyond the ends of their files");
    expect_none(report, part, damage->n_bad_records, "records of indexes are damaged");
    expect_none(report, part, damage->n_loose_bytes, "bytes have no record in an index");
    expect_none(report, part, damage->n_bad_segments, "segments have no readable index");
    expect_none(report, part, damage->n_lost_segments, "segments are missing");
    expect_none(report, part, damage->n_strange_segments, "segments are of another recording");
    expect_none(report, part, damage->n_missing_blocks, "blocks are missing between others");
    if (n_promised > next_number)
        expect_none(report, part, n_promised - next_number, "blocks are missing at the end");
}

static void add_damage(struct shef_damage *sum, const struct shef_damage *damage)
{
    sum->n_missing_blocks += damage->n_missing_blocks;
    sum->n_bad_blocks += damage->n_bad_blocks;
    sum->n_cut_blocks += damage->n_cut_blocks;
    sum->n_bad_records += damage->n_bad_records;
    sum->n_loose_bytes += damage->n_loose_bytes;
    sum->n_bad_segments += damage->n_bad_segments;
    sum->n_lost_segments += damage->n_lost_segments;
    sum->n_strange_segments += damage->n_strange_segments;
    sum->n_lost_buffers += damage->n_lost_buffers;
}

/* How many blocks the manifest says there are; 0 if it does not say. */
static uint64_t promised_blocks(const struct shef_manifest *manifest, enum shef_part part)
{
    return part == SHEF_PART_EVENTS ? manifest->events.n_blocks : manifest->parts[part].n_blocks;
}

static enum shef_err verify_blocks(struct shef_block_reader *reader, enum shef_part part,
                                   const struct shef_manifest *manifest, uint8_t *room,
                                   shef_go_on_fn *go_on, void *context,
                                   struct shef_verify_report *report, struct shef_error *err)
{
    const struct shef_damage *damage = shef_block_reader_damage(reader);
    struct shef_block block;
    uint64_t next_number = 0;
    enum shef_err code;

    while ((code = shef_block_reader_next(reader, room, &block, err)) == SHEF_OK) {
        report->n_blocks++;
        next_number = block.record.number + 1;
        if (go_on && !go_on(context, block.record.n_bytes))
            return shef_fail(err, SHEF_ERR_GONE, "the check was stopped");
    }
    if (code != SHEF_ERR_EMPTY)
        return code;
    add_damage(&report->damage, damage);
    report_damage(report, part, damage, manifest->is_closed ? promised_blocks(manifest, part) : 0,
                  next_number);
    return SHEF_OK;
}

static enum shef_err verify_part(const char *path, enum shef_part part,
                                 const struct shef_manifest *manifest, shef_go_on_fn *go_on,
                                 void *context, struct shef_verify_report *report,
                                 struct shef_error *err)
{
    const struct shef_part_kind *kind = shef_part_kind(part);
    struct shef_block_reader *reader;
    char folder[PATH_MAX];

    if (snprintf(folder, sizeof folder, "%s/%s", path, kind->folder) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "check '%s': the path is too long", path);

    enum shef_err code =
        shef_block_reader_open(folder, part, kind->ending, kind->max_block_bytes, &reader, err);

    if (code == SHEF_ERR_EMPTY || code == SHEF_ERR_NOT_FOUND) {
        if (promised_blocks(manifest, part) > 0)
            add_problem(report, "the %s is gone", kind->name);
        return SHEF_OK;
    }
    if (code == SHEF_ERR_FORMAT) {
        add_problem(report, "no segment of the %s has a readable index", kind->name);
        return SHEF_OK;
    }
    if (code != SHEF_OK)
        return code;

    uint8_t *room = malloc(kind->max_block_bytes);

    if (room)
        code = verify_blocks(reader, part, manifest, room, go_on, context, report, err);
    else
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "check '%s': out of memory", path);
    free(room);
    shef_block_reader_close(reader);
    return code;
}

static enum shef_err verify_file(const char *path, const struct shef_manifest_file *promised,
                                 shef_go_on_fn *go_on, void *context,
                                 struct shef_verify_report *report, struct shef_error *err)
{
    char inner[PATH_MAX + SHEF_MANIFEST_PATH_BYTES];
    char found[SHEF_SHA256_TEXT_BYTES];
    struct stat info;

    snprintf(inner, sizeof inner, "%s/%s", path, promised->path);
    if (stat(inner, &info) != 0 || !S_ISREG(info.st_mode)) {
        add_problem(report, "file '%s' is missing", promised->path);
        return SHEF_OK;
    }
    if ((uint64_t)info.st_size != promised->n_bytes) {
        add_problem(report, "file '%s' has %lld bytes, %llu were recorded", promised->path,
                    (long long)info.st_size, (unsigned long long)promised->n_bytes);
        return SHEF_OK;
    }
    if (!*promised->sha256) {
        report->n_unhashed_files++;
        return SHEF_OK;
    }

    const enum shef_err code = shef_sha256_file(inner, go_on, context, found, err);

    if (code != SHEF_OK)
        return code;
    report->n_files++;
    if (strcmp(found, promised->sha256) != 0)
        add_problem(report, "file '%s' does not match its SHA-256", promised->path);
    return SHEF_OK;
}

/* Counts files that came after the recording was closed. Both lists are sorted. */
static void count_new_files(const struct shef_folder_list *list,
                            const struct shef_manifest *manifest, struct shef_verify_report *report)
{
    size_t k = 0;

    for (size_t i = 0; i < list->n_files; i++) {
        while (k < manifest->n_files && strcmp(manifest->files[k].path, list->files[i].path) < 0)
            k++;
        if (k == manifest->n_files || strcmp(manifest->files[k].path, list->files[i].path) != 0)
            report->n_new_files++;
    }
}

static enum shef_err verify_files(const char *path, const struct shef_manifest *manifest,
                                  shef_go_on_fn *go_on, void *context,
                                  struct shef_verify_report *report, struct shef_error *err)
{
    struct shef_folder_list list;
    enum shef_err code = SHEF_OK;

    for (size_t i = 0; code == SHEF_OK && i < manifest->n_files; i++)
        code = verify_file(path, &manifest->files[i], go_on, context, report, err);
    if (code == SHEF_OK)
        code = shef_folder_list_read(path, &list, err);
    if (code != SHEF_OK)
        return code;
    count_new_files(&list, manifest, report);
    shef_folder_list_free(&list);
    return SHEF_OK;
}

uint64_t shef_recording_verify_size(const char *path)
{
    struct shef_folder_list list;
    uint64_t n_bytes = 0;

    if (shef_folder_list_read(path, &list, NULL) != SHEF_OK)
        return 0;
    /* Blocks and their files' SHA-256: the data are read twice. */
    for (size_t i = 0; i < list.n_files; i++)
        n_bytes += 2 * list.files[i].n_bytes;
    shef_folder_list_free(&list);
    return n_bytes;
}

enum shef_err shef_recording_verify(const char *path, shef_go_on_fn *go_on, void *context,
                                    struct shef_verify_report *out_report, struct shef_error *err)
{
    struct shef_recording recording;
    struct shef_verify_report *report = out_report;
    enum shef_err code = shef_recording_inspect(path, &recording, err);

    if (code != SHEF_OK)
        return code;
    *report = (struct shef_verify_report){ 0 };
    if (!recording.has_manifest)
        add_problem(report, "the manifest cannot be used: %s", recording.manifest_trouble);
    else if (!recording.manifest.is_closed)
        add_problem(report, "the recording was never closed, so there is nothing to compare its "
                            "files with; its blocks were checked");
    for (enum shef_part part = SHEF_PART_EVENTS; code == SHEF_OK && part <= SHEF_PART_TRIGGERS;
         part++)
        code = verify_part(path, part, &recording.manifest, go_on, context, report, err);
    if (code == SHEF_OK && recording.manifest.is_closed)
        code = verify_files(path, &recording.manifest, go_on, context, report, err);
    shef_recording_free(&recording);
    return code;
}
