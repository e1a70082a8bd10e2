#include "wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/support.h"

#define LOG_SYNC     0xeda1da01
#define HEADER_BYTES 108 /* the type and header_t */
#define CRC_AT       104
#define DEPTH_BYTES  184 /* the same with what depth_t has before data */

/* How a message begins. Made from names and types of its fields: with another one, subscribers that
 * exist take the message for a stranger's. */
static const struct {
    const char *channel;
    uint64_t type;
} kinds[] = {
    { "SHEF_POSE", 0xa1cd0bf443da7f2b },  { "SHEF_DISPARITY", 0x2f09560ce1c3c842 },
    { "SHEF_DEPTH", 0x290072e3c151c914 }, { "SHEF_DENSE", 0xc22de71edad4af13 },
    { "SHEF_CLOUD", 0x2f48eb55c12356c4 }, { "SHEF_STATUS", 0x8e01719532bac52d },
};

enum kind { POSE, DISPARITY, DEPTH, DENSE, CLOUD, STATUS, KINDS };

/* LCM writes the most significant byte first. */
static uint64_t number(const uint8_t *at, int n_bytes)
{
    uint64_t value = 0;

    for (int i = 0; i < n_bytes; i++)
        value = value << 8 | at[i];
    return value;
}

static int32_t int_at(const uint8_t *message, int at)
{
    return (int32_t)number(message + at, 4);
}

static int64_t long_at(const uint8_t *message, int at)
{
    return (int64_t)number(message + at, 8);
}

static double double_at(const uint8_t *message, int at)
{
    const uint64_t bits = number(message + at, 8);
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

static float float_at(const uint8_t *message, int at)
{
    const uint32_t bits = (uint32_t)number(message + at, 4);
    float value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Bit by bit, as the definition has it. */
static uint32_t crc32c(const uint8_t *message, size_t n_bytes)
{
    uint32_t crc = UINT32_MAX;

    for (size_t i = 0; i < n_bytes; i++) {
        crc ^= i >= CRC_AT && i < CRC_AT + 4 ? 0 : message[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0x82f63b78 : 0); /* 0x1edc6f41 reflected */
    }
    return ~crc;
}

/* ---- depth_t ----------------------------------------------------------------------------- */

static void read_depth_front(struct wire_frame *frame, const uint8_t *message)
{
    frame->width_px = int_at(message, 108);
    frame->height_px = int_at(message, 112);
    frame->grid_step = int_at(message, 116);
    frame->f_px = double_at(message, 120);
    frame->cx_px = double_at(message, 128);
    frame->cy_px = double_at(message, 136);
    frame->baseline_m = double_at(message, 144);
    frame->mode = int_at(message, 152);
    frame->shed_bits = int_at(message, 156);
    frame->validity = int_at(message, 160);
    frame->unit_m = (double)float_at(message, 172);
    TEST_ASSERT_TRUE(frame->grid_step == 1 || frame->grid_step == 2);
    frame->grid_w = (frame->width_px + frame->grid_step - 1) / frame->grid_step;
    frame->grid_h = (frame->height_px + frame->grid_step - 1) / frame->grid_step;
    TEST_ASSERT_EQUAL_INT32(640, frame->width_px);
    TEST_ASSERT_EQUAL_INT32(480, frame->height_px);
    TEST_ASSERT_EQUAL_DOUBLE((double)0.00025f, frame->unit_m);
}

/* A further message of a frame differs in nothing but its rows. */
static void read_depth(struct wire_frame *frame, const uint8_t *message, size_t n_bytes)
{
    struct wire_frame now = *frame;

    TEST_ASSERT_GREATER_OR_EQUAL_size_t(DEPTH_BYTES, n_bytes);
    read_depth_front(&now, message);
    if (frame->n_depth == 1) {
        now.depths = calloc((size_t)now.grid_w * (size_t)now.grid_h, sizeof *now.depths);
        now.sigmas = calloc((size_t)now.grid_w * (size_t)now.grid_h, 1);
        TEST_ASSERT_TRUE(now.depths && now.sigmas);
        *frame = now;
    }
    TEST_ASSERT_EQUAL_MEMORY(&now, frame, sizeof now);

    const int32_t first_row = int_at(message, 164), n_rows = int_at(message, 168);
    const int32_t n_points = int_at(message, 176);
    const int32_t mask_bytes = (frame->grid_w + 7) / 8;
    const uint8_t *mask = message + DEPTH_BYTES;
    const uint8_t *values = mask + n_rows * mask_bytes;
    const uint8_t *sigmas = values + 2 * n_points;
    int32_t n = 0;

    TEST_ASSERT_EQUAL_INT32(frame->n_rows, first_row);
    TEST_ASSERT_TRUE(n_rows > 0 && first_row + n_rows <= frame->grid_h);
    TEST_ASSERT_EQUAL_INT32(n_rows * mask_bytes + 3 * n_points, int_at(message, 180));
    TEST_ASSERT_EQUAL_size_t(DEPTH_BYTES + (size_t)int_at(message, 180), n_bytes);
    for (int32_t y = 0; y < n_rows; y++)
        for (int32_t x = 0; x < 8 * mask_bytes; x++) {
            const ptrdiff_t cell = (ptrdiff_t)(first_row + y) * frame->grid_w + x;

            if ((mask[y * mask_bytes + x / 8] >> x % 8 & 1) == 0)
                continue;
            TEST_ASSERT_TRUE(x < frame->grid_w && n < n_points);
            frame->depths[cell] = (uint16_t)(values[2 * n] | values[2 * n + 1] << 8);
            frame->sigmas[cell] = sigmas[n++];
            TEST_ASSERT_NOT_EQUAL_UINT16(0, frame->depths[cell]);
        }
    TEST_ASSERT_EQUAL_INT32(n_points, n);
    frame->n_rows += n_rows;
    frame->n_points += n_points;
}

double wire_depth_m(const struct wire_frame *frame, int32_t cell)
{
    return frame->depths[cell] * frame->unit_m;
}

double wire_sigma_m(const struct wire_frame *frame, int32_t cell)
{
    const uint8_t code = frame->sigmas[cell];

    return frame->unit_m * (1 + (code & 15) / 16.0) * (double)(1 << (code >> 4));
}

/* ---- the log ----------------------------------------------------------------------------- */

static enum kind kind_of(const char *channel, uint64_t type)
{
    for (int i = 0; i < KINDS; i++)
        if (strcmp(kinds[i].channel, channel) == 0) {
            TEST_ASSERT_EQUAL_HEX64(kinds[i].type, type);
            return (enum kind)i;
        }
    TEST_FAIL_MESSAGE(channel);
    return KINDS;
}

/* The frame whose messages are under way, or a new one. */
static struct wire_frame *frame_of(struct wire_log *log, int64_t seq)
{
    struct wire_frame *last = log->n_frames > 0 ? &log->frames[log->n_frames - 1] : NULL;

    if (last && last->seq == seq)
        return last;
    log->frames = realloc(log->frames, (size_t)(log->n_frames + 1) * sizeof *log->frames);
    TEST_ASSERT_NOT_NULL(log->frames);
    last = &log->frames[log->n_frames++];
    memset(last, 0, sizeof *last);
    last->seq = seq;
    return last;
}

static void read_message(struct wire_log *log, const char *channel, const uint8_t *message,
                         size_t n_bytes)
{
    TEST_ASSERT_GREATER_OR_EQUAL_size_t(HEADER_BYTES, n_bytes);
    TEST_ASSERT_LESS_OR_EQUAL_size_t(65499, n_bytes);
    TEST_ASSERT_EQUAL_HEX32(crc32c(message, n_bytes), (uint32_t)int_at(message, CRC_AT));

    const enum kind kind = kind_of(channel, number(message, 8));

    if (kind == STATUS) {
        log->n_status++;
        return;
    }

    struct wire_frame *frame = frame_of(log, long_at(message, 48));
    int32_t *counts[] = { &frame->n_pose, &frame->n_disparity, &frame->n_depth, &frame->n_dense,
                          &frame->n_cloud };

    TEST_ASSERT_EQUAL_INT32(*counts[kind], int_at(message, 96)); /* chunk */
    (*counts[kind])++;
    TEST_ASSERT_LESS_OR_EQUAL_INT32(int_at(message, 100), *counts[kind]); /* n_chunks */
    TEST_ASSERT_TRUE(frame->event_us == 0 || frame->event_us == long_at(message, 24));
    frame->event_us = long_at(message, 24);
    if (kind != DEPTH)
        return;
    frame->n_chunks = int_at(message, 100);
    read_depth(frame, message, n_bytes);
}

/* A log: for each message this word, its number, its time, two lengths, its channel, its bytes. */
void wire_log_read(struct wire_log *out_log, const char *path)
{
    FILE *file = fopen(path, "rb");
    uint8_t front[28];
    static uint8_t message[1 << 17];

    *out_log = (struct wire_log){ 0 };
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    while (fread(front, sizeof front, 1, file) == 1) {
        const size_t channel_bytes = (size_t)number(front + 20, 4);
        const size_t n_bytes = (size_t)number(front + 24, 4);
        char channel[64] = "";

        TEST_ASSERT_EQUAL_HEX32(LOG_SYNC, (uint32_t)number(front, 4));
        TEST_ASSERT_TRUE(channel_bytes < sizeof channel && n_bytes <= sizeof message);
        TEST_ASSERT_EQUAL_size_t(1, fread(channel, channel_bytes, 1, file));
        TEST_ASSERT_EQUAL_size_t(1, fread(message, n_bytes, 1, file));
        read_message(out_log, channel, message, n_bytes);
    }
    fclose(file);
    for (int32_t i = 0; i < out_log->n_frames; i++) {
        const struct wire_frame *frame = &out_log->frames[i];

        TEST_ASSERT_EQUAL_INT32(frame->n_chunks, frame->n_depth);
        TEST_ASSERT_EQUAL_INT32(frame->grid_h, frame->n_rows);
    }
}

void wire_log_free(struct wire_log *log)
{
    for (int32_t i = 0; i < log->n_frames; i++) {
        free(log->frames[i].depths);
        free(log->frames[i].sigmas);
    }
    free(log->frames);
    *log = (struct wire_log){ 0 };
}

const struct wire_frame *wire_log_frame(const struct wire_log *log, int64_t seq)
{
    for (int32_t i = 0; i < log->n_frames; i++)
        if (log->frames[i].seq == seq)
            return &log->frames[i];
    return NULL;
}
