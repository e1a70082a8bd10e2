/* Frames, poses and triggers of any bytes: no crash, and nothing that could not be. The input is
 * the part, the length of the data file (2 bytes), the data file and the index, whose checksums
 * are made right, so that what is behind them is reached. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc32c.h"
#include "core/little_endian.h"
#include "record/part_table.h"
#include "record/recorded_frames.h"
#include "record/recorded_poses.h"
#include "record/recorded_triggers.h"

#define MAX_BYTES 65536

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static char folder[] = "/dev/shm/shef-fuzz-XXXXXX";

static void demand(int condition)
{
    if (!condition)
        abort();
}

static void path_of(enum shef_part part, const char *ending, char out_path[128])
{
    snprintf(out_path, 128, "%s/%s%s%s", folder, shef_part_kind(part)->folder,
             *ending ? "/000000" : "", ending);
}

static void remove_folder(void)
{
    for (enum shef_part part = SHEF_PART_FRAMES; part <= SHEF_PART_TRIGGERS; part++) {
        char path[128];

        path_of(part, ".idx", path);
        unlink(path);
        path_of(part, shef_part_kind(part)->ending, path);
        unlink(path);
        path_of(part, "", path);
        rmdir(path);
    }
    rmdir(folder);
}

static void make_folder(void)
{
    demand(mkdtemp(folder) != NULL);
    atexit(remove_folder);
    for (enum shef_part part = SHEF_PART_FRAMES; part <= SHEF_PART_TRIGGERS; part++) {
        char path[128];

        path_of(part, "", path);
        demand(mkdir(path, 0700) == 0);
    }
}

static void write_file(enum shef_part part, const char *ending, const uint8_t *bytes,
                       size_t n_bytes)
{
    char path[128];

    path_of(part, ending, path);

    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);

    demand(fd >= 0 && write(fd, bytes, n_bytes) == (ssize_t)n_bytes);
    close(fd);
}

static uint32_t sum_of(const uint8_t *data, size_t n_data, uint64_t offset, uint32_t n)
{
    return offset <= n_data && n <= n_data - offset ? shef_crc32c(0, data + offset, n) : 0;
}

/* Gives the header, every record and what they vouch for the checksums they should have. */
static void make_right(uint8_t *index, size_t n_index, const uint8_t *data, size_t n_data)
{
    for (size_t at = 0; at + SHEF_INDEX_RECORD_BYTES <= n_index; at += SHEF_INDEX_RECORD_BYTES) {
        uint8_t *record = index + at;

        if (at == 0)
            shef_put_u32_le(record + 44, sum_of(data, n_data, 0, shef_get_u32_le(record + 40)));
        else
            shef_put_u32_le(record + 4, sum_of(data, n_data, shef_get_u64_le(record + 8),
                                               shef_get_u32_le(record + 48)));
        shef_put_u32_le(record, shef_crc32c(0, record + 4, SHEF_INDEX_RECORD_BYTES - 4));
    }
}

static void read_frames(void)
{
    struct shef_recorded_frames *frames;
    struct shef_recorded_frame frame;
    volatile uint8_t last = 0;

    if (shef_recorded_frames_open(folder, &frames, NULL) != SHEF_OK)
        return;
    demand(shef_recorded_frames_count(frames) > 0);
    while (shef_recorded_frames_next(frames, &frame, NULL) == SHEF_OK) {
        const uint32_t n_bytes = shef_frame_bytes(&frame.info);

        demand(n_bytes > 0 && n_bytes <= shef_recorded_frames_max_bytes(frames));
        demand(frame.info.width_px <= SHEF_FRAME_MAX_SIDE_PX);
        last = frame.pixels[n_bytes - 1];
    }
    (void)last;
    shef_recorded_frames_close(frames);
}

static void read_poses(void)
{
    struct shef_recorded_poses *poses;
    struct shef_recorded_pose pose;

    if (shef_recorded_poses_open(folder, &poses, NULL) != SHEF_OK)
        return;
    while (shef_recorded_poses_next(poses, &pose, NULL) == SHEF_OK)
        demand(shef_rigid_error(&pose.t_world_hand) < 1e-12 && isfinite(pose.t_world_hand.t_m[0]) &&
               (!pose.has_speed || isfinite(pose.turn_rad_s[2])));
    shef_recorded_poses_close(poses);
}

static void read_triggers(void)
{
    struct shef_recorded_triggers *triggers;
    struct shef_edge_line line;
    struct shef_edge edge;

    if (shef_recorded_triggers_open(folder, &triggers, NULL) != SHEF_OK)
        return;
    for (int i = 0; shef_recorded_triggers_line(triggers, i, &line); i++)
        demand(strlen(line.name) < SHEF_EDGE_NAME_BYTES);
    while (shef_recorded_triggers_next(triggers, &edge, NULL, NULL) == SHEF_OK)
        continue;
    shef_recorded_triggers_close(triggers);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static void (*const readers[])(void) = { read_frames, read_poses, read_triggers };
    static uint8_t index[MAX_BYTES];
    static bool has_folder;

    if (n_bytes < 3 || n_bytes > MAX_BYTES)
        return 0;
    if (!has_folder)
        make_folder();
    has_folder = true;

    const enum shef_part part = SHEF_PART_FRAMES + bytes[0] % 3;
    const size_t n_wanted = bytes[1] | (size_t)bytes[2] << 8;
    const size_t n_data = n_wanted < n_bytes - 3 ? n_wanted : n_bytes - 3;
    const size_t n_index = n_bytes - 3 - n_data;

    memcpy(index, bytes + 3 + n_data, n_index);
    make_right(index, n_index, bytes + 3, n_data);
    write_file(part, shef_part_kind(part)->ending, bytes + 3, n_data);
    write_file(part, ".idx", index, n_index);
    readers[bytes[0] % 3]();
    return 0;
}
