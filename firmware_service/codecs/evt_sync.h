/* Finding the alignment of EVT words again after bytes were lost.
 *
 * A stream that lost a part of a word goes on with words that straddle true ones. Their types are
 * then nearly random: mostly a quarter and more of them do not exist, and their times contradict
 * each other. When more than one word in four is impossible for a while, or a sensor's TIME_HIGH,
 * due every 16 us, stays away for thousands of bytes, the decoder gives the alignment up and
 * hunts: every byte position of a word keeps a score of its own, and the first at which words are
 * plausible and three TIME_HIGH follow each other wins. Works byte by byte, so slices do not
 * matter. Thread: the decoder's. */
#ifndef SHEF_CODECS_EVT_SYNC_H
#define SHEF_CODECS_EVT_SYNC_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct shef_evt_sync {
    /* While aligned. */
    uint32_t trouble;       /* rises with impossible words, falls with every word */
    uint64_t last_bad_word; /* its number in the stream */
    uint64_t last_tick;     /* the number of the last word that time went on with */
    /* While hunting. */
    bool hunting;
    uint8_t n_seen;  /* bytes in recent, up to 8 */
    uint8_t place;   /* of the next byte, counted modulo the word's size */
    uint64_t recent; /* the last 8 bytes, the newest on top */
    struct shef_evt_place {
        uint32_t high;     /* the last TIME_HIGH's value */
        uint8_t n_high;    /* that followed each other */
        uint8_t score;     /* plausible words */
        uint8_t last_type; /* for continuations */
    } places[8];
};

/* Without a TIME_HIGH in so many bytes, a sensor's stream has lost its alignment: at 400 MB/s, more
 * than any board sends, 6400 bytes lie between two of them. */
#define SHEF_EVT_SYNC_MAX_SILENCE_BYTES 16384

/* Starts a hunt. */
void shef_evt_sync_lose(struct shef_evt_sync *sync, uint64_t n_words);

/* Whether the last impossible word is long gone. */
bool shef_evt_sync_is_calm(const struct shef_evt_sync *sync, uint64_t n_words);

/* Notes an impossible word, the n_words-th of the stream. Returns true when that is one too many:
 * sync is then hunting. */
bool shef_evt_sync_bad_word(struct shef_evt_sync *sync, uint64_t n_words);

/* Takes back the last n_words words noted as impossible: others have confirmed them. */
void shef_evt_sync_forgive(struct shef_evt_sync *sync, uint32_t n_words);

/* Hunts through one byte.
 *   format    an enum shef_evt_format
 *   spare     EVT2.1: the spare bits of every TIME_HIGH, NULL where they are not known
 *   out_high  the value of the last TIME_HIGH at the new alignment
 * Returns true when this byte ends a word of the alignment found; sync then hunts no more. */
bool shef_evt_sync_feed(struct shef_evt_sync *sync, int format, const uint32_t *spare, uint8_t byte,
                        uint32_t *out_high);

#ifdef __cplusplus
}
#endif

#endif
