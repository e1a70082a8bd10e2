#include "codecs/evt_sync.h"

#include "codecs/evt_word.h"

/* One impossible word in four keeps the trouble level; some 30 in a row of two lose alignment. */
#define TROUBLE_OF_A_WORD 4
#define TROUBLE_LOST      64
#define N_WORDS_CALM      256

#define SCORE_FOUND       32
#define SCORE_OF_BAD_WORD 3
#define N_HIGH_FOUND      3
#define N_STEPS_FOLLOWING 255 /* sparse streams skip values */

void shef_evt_sync_lose(struct shef_evt_sync *sync, uint64_t n_words)
{
    *sync = (struct shef_evt_sync){ .last_bad_word = n_words, .hunting = true };
}

bool shef_evt_sync_is_calm(const struct shef_evt_sync *sync, uint64_t n_words)
{
    return n_words - sync->last_bad_word >= N_WORDS_CALM;
}

bool shef_evt_sync_bad_word(struct shef_evt_sync *sync, uint64_t n_words)
{
    const uint64_t n_good = n_words - sync->last_bad_word;

    sync->last_bad_word = n_words;
    sync->trouble = n_good < sync->trouble ? sync->trouble - (uint32_t)n_good : 0;
    sync->trouble += TROUBLE_OF_A_WORD;
    if (sync->trouble < TROUBLE_LOST)
        return false;
    shef_evt_sync_lose(sync, n_words);
    return true;
}

void shef_evt_sync_forgive(struct shef_evt_sync *sync, uint32_t n_words)
{
    const uint32_t trouble = n_words * TROUBLE_OF_A_WORD;

    sync->trouble -= sync->trouble < trouble ? sync->trouble : trouble;
}

struct glimpse {
    uint32_t type;
    bool known;
    bool is_time_high;
    uint32_t high;
    uint32_t high_mask;
};

static struct glimpse glimpse_of(enum shef_evt_format format, const uint32_t *spare,
                                 uint64_t recent, uint32_t last_type)
{
    struct glimpse seen = { .high_mask = (1u << SHEF_EVT2_HIGH_BITS) - 1 };

    if (format == SHEF_EVT3) {
        const uint32_t word = (uint32_t)(recent >> 48);

        seen.type = word >> 12;
        seen.known = shef_evt3_is_known(word, last_type);
        seen.is_time_high = seen.type == SHEF_EVT3_TIME_HIGH;
        seen.high_mask = (1u << SHEF_EVT3_HIGH_BITS) - 1;
        seen.high = word & seen.high_mask;
    } else {
        const uint64_t word = shef_evt21_order(recent, format == SHEF_EVT21_LEGACY);
        const uint32_t upper = (uint32_t)(word >> 32);

        seen.type = upper >> 28;
        seen.known = format == SHEF_EVT2 ? shef_evt2_is_known(seen.type, last_type)
                                         : shef_evt21_is_known(seen.type);
        seen.is_time_high = seen.type == SHEF_EVT2_TIME_HIGH;
        seen.high = upper & seen.high_mask;
        if (seen.is_time_high && spare && (uint32_t)word != *spare) {
            seen.is_time_high = false;
            seen.known = false;
        }
    }
    return seen;
}

bool shef_evt_sync_feed(struct shef_evt_sync *sync, int format, const uint32_t *spare, uint8_t byte,
                        uint32_t *out_high)
{
    const uint32_t word_bytes = shef_evt_word_bytes((enum shef_evt_format)format);
    struct shef_evt_place *place = &sync->places[sync->place];

    sync->recent = sync->recent >> 8 | (uint64_t)byte << 56;
    sync->place = (uint8_t)((sync->place + 1) % word_bytes);
    if (sync->n_seen < 8)
        sync->n_seen++;
    if (sync->n_seen < word_bytes)
        return false;

    struct glimpse seen =
        glimpse_of((enum shef_evt_format)format, spare, sync->recent, place->last_type);

    place->last_type = seen.known ? (uint8_t)seen.type : 0;
    if (seen.is_time_high) {
        const uint32_t n_steps = (seen.high - place->high) & seen.high_mask;

        if (place->n_high > 0 && n_steps > N_STEPS_FOLLOWING) {
            place->n_high = 0;
            seen.known = false;
        }
        place->high = seen.high;
        if (place->n_high < N_HIGH_FOUND)
            place->n_high++;
    }
    if (seen.known)
        place->score += place->score < SCORE_FOUND;
    else
        place->score -= place->score < SCORE_OF_BAD_WORD ? place->score : SCORE_OF_BAD_WORD;
    if (place->score < SCORE_FOUND || place->n_high < N_HIGH_FOUND)
        return false;

    *out_high = place->high;
    *sync = (struct shef_evt_sync){ .last_bad_word = sync->last_bad_word };
    return true;
}
