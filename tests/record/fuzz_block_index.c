/* Any files in a recording must end in blocks whose bytes match their checksums, in order, and
 * never in a crash.
 *
 * The input is the index; the first byte says what the data file is like and whether checksums
 * of the records are made right, so that the checks behind them are reached too. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc32c.h"
#include "record/block_reader.h"

#define MAX_BYTES   65536
#define BLOCK_BYTES 4096

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static char folder[] = "/dev/shm/shef-fuzz-XXXXXX";

static void remove_folder(void)
{
    static const char *const names[] = { "000000.idx", "000000.raw", "000001.idx", "" };

    for (int i = 0; i < 4; i++) {
        char path[128];

        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        if (*names[i])
            unlink(path);
        else
            rmdir(path);
    }
}

static void write_file(const char *name, const uint8_t *bytes, size_t n_bytes)
{
    char path[128];

    snprintf(path, sizeof path, "%s/%s", folder, name);

    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);

    if (fd < 0 || write(fd, bytes, n_bytes) != (ssize_t)n_bytes)
        abort();
    close(fd);
}

/* Gives every whole record, and the blocks they name, the checksums they should have. */
static void make_right(uint8_t *index, size_t n_bytes, const uint8_t *data, size_t n_data)
{
    for (size_t at = 0; at + SHEF_INDEX_RECORD_BYTES <= n_bytes; at += SHEF_INDEX_RECORD_BYTES) {
        uint8_t *record = index + at;
        uint64_t offset;
        uint32_t n;
        uint32_t crc;

        memcpy(&offset, record + 8, sizeof offset);
        memcpy(&n, record + 48, sizeof n);
        if (at > 0 && offset <= n_data && n <= n_data - offset) {
            crc = shef_crc32c(0, data + offset, n);
            memcpy(record + 4, &crc, sizeof crc);
        }
        crc = shef_crc32c(0, record + 4, SHEF_INDEX_RECORD_BYTES - 4);
        memcpy(record, &crc, sizeof crc);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static uint8_t index[MAX_BYTES];
    static uint8_t data[MAX_BYTES];
    static uint8_t room[BLOCK_BYTES];
    static bool has_folder;
    struct shef_block_reader *reader;
    struct shef_error err = { 0 };
    struct shef_block block;
    uint64_t last_number = 0;
    bool has_last = false;

    if (n_bytes < 1 || n_bytes > MAX_BYTES)
        return 0;
    if (!has_folder) {
        if (!mkdtemp(folder))
            abort();
        atexit(remove_folder);
        has_folder = true;
        for (size_t i = 0; i < MAX_BYTES; i++)
            data[i] = (uint8_t)(i * 7);
    }

    const uint8_t how = bytes[0];
    const size_t n_data = (size_t)(how & 15) * 1000;

    n_bytes--;
    memcpy(index, bytes + 1, n_bytes);
    if (how & 16)
        make_right(index, n_bytes, data, n_data);
    write_file("000000.idx", index, n_bytes);
    write_file("000000.raw", data, n_data);
    write_file("000001.idx", index, how & 32 ? n_bytes : 0);
    if (shef_block_reader_open(folder, SHEF_PART_EVENTS, ".raw", BLOCK_BYTES, &reader, &err) !=
        SHEF_OK)
        return 0;
    while (shef_block_reader_next(reader, room, &block, &err) == SHEF_OK) {
        if (block.record.n_bytes > BLOCK_BYTES ||
            shef_crc32c(0, room, block.record.n_bytes) != block.record.crc32c ||
            (has_last && block.record.number <= last_number) ||
            (block.follows && block.record.number != last_number + 1))
            abort();
        last_number = block.record.number;
        has_last = true;
    }
    shef_block_reader_close(reader);
    return 0;
}
