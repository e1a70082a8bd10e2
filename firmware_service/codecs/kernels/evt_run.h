/* The inner loops of the decoders: runs of ordinary event words.
 *
 * A run takes words from the front for as long as they are ordinary and stops before the first
 * one that is not; the decoder's state machine takes that one and starts the next run. Ordinary:
 *
 *   EVT2    events inside the sensor
 *   EVT2.1  events, all inside the sensor
 *   EVT3    ADDR_Y, ADDR_X and TIME_LOW, all inside the sensor; VECT_BASE_X; whole groups
 *           VECT_12, VECT_12, VECT_8 after a base, not reaching beyond the sensor's width
 *
 * Needs a running clock and, for EVT3, a valid row and no half-taken group. Every implementation
 * is bit-exact with the C version: the same events and state after the same words. With little
 * room left in the batch they may stop after different numbers of words. Writing may touch free
 * places of the batch behind n_events. Streaming: nothing blocks or allocates. */
#ifndef SHEF_CODECS_KERNELS_EVT_RUN_H
#define SHEF_CODECS_KERNELS_EVT_RUN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/packets.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A run stops when a batch has less free room than this. */
#define SHEF_EVT_RUN_ROOM 64

struct shef_evt_run {
    /* Read. */
    uint32_t width_px;
    uint32_t height_px;
    uint32_t high_us;          /* the current TIME_HIGH's time since the batch's base */
    bool upper_first;          /* EVT2.1 in legacy order */
    struct shef_event *events; /* the batch's */
    uint32_t capacity;
    /* Read and written. */
    uint32_t n_events;
    uint32_t n_back;  /* events (EVT3: TIME_LOW) with less time than the one before */
    uint32_t low_us;  /* low bits of time of the last event (EVT3: TIME_LOW) */
    uint32_t row_px;  /* EVT3: of the last ADDR_Y */
    uint32_t base_px; /* EVT3: where the next vector starts */
    bool base_on;
    bool base_known;
};

/*   words    n_words words of the format, any alignment
 * Returns how many words were taken. */
typedef size_t shef_evt_run_fn(struct shef_evt_run *run, const uint8_t *words, size_t n_words);

struct shef_evt_kernels {
    const char *isa; /* "c", "avx2", "avx512" or "neon" */
    uint32_t features;
    shef_evt_run_fn *evt2;
    shef_evt_run_fn *evt21;
    shef_evt_run_fn *evt3;
};

/* The best set that these features allow. */
const struct shef_evt_kernels *shef_evt_kernels_for(uint32_t features);

shef_evt_run_fn shef_evt2_run_c, shef_evt21_run_c, shef_evt3_run_c;
shef_evt_run_fn shef_evt2_run_avx2, shef_evt3_run_avx2;
shef_evt_run_fn shef_evt2_run_avx512, shef_evt21_run_avx512, shef_evt3_run_avx512;
shef_evt_run_fn shef_evt2_run_neon;

#ifdef __cplusplus
}
#endif

#endif
