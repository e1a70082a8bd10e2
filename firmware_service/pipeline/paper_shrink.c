#include "pipeline/paper_shrink.h"

#include <assert.h>
#include <stdlib.h>

#include "core/memory.h"

#define N_STEPS 6 /* 2^6 = 64: a bit moves by any distance in a word, one power of two a step */

/* How one source word is squeezed. In step s the bits in moves[s] go 2^s places to the right. */
struct squeeze {
    uint64_t wanted;
    uint64_t moves[N_STEPS];
    int32_t n_wanted;
};

struct shef_paper_shrink {
    int32_t from_width_px;
    int32_t from_height_px;
    int32_t to_width_px;
    int32_t to_height_px;
    int32_t n_words;         /* of a source row */
    struct squeeze *squeeze; /* one a source word */
    size_t bytes;
};

int32_t shef_paper_source_of(int32_t i, int32_t n_from, int32_t n_to)
{
    return (int32_t)((2 * (int64_t)i + 1) * n_from / (2 * (int64_t)n_to));
}

/* Every wanted bit moves right by the number of unwanted bits below it. */
static struct squeeze squeeze_for(uint64_t wanted)
{
    struct squeeze squeeze = { .wanted = wanted };
    int32_t n_unwanted = 0;

    for (int32_t bit = 0; bit < 64; bit++) {
        if (!(wanted >> bit & 1)) {
            n_unwanted++;
            continue;
        }
        squeeze.n_wanted++;
        /* The smaller steps come first, so in step s the bit has moved by the lower bits of its
         * distance already. */
        for (int32_t s = 0; s < N_STEPS; s++) {
            const int32_t moved = n_unwanted & ((1 << s) - 1);

            if (n_unwanted >> s & 1)
                squeeze.moves[s] |= UINT64_C(1) << (bit - moved);
        }
    }
    return squeeze;
}

static uint64_t squeezed(uint64_t bits, const struct squeeze *squeeze)
{
    bits &= squeeze->wanted;
    for (int32_t s = 0; s < N_STEPS; s++) {
        const uint64_t moving = bits & squeeze->moves[s];

        bits = (bits ^ moving) | moving >> (1 << s);
    }
    return bits;
}

enum shef_err shef_paper_shrink_create(struct shef_paper_shrink **out_shrink, int32_t from_width_px,
                                       int32_t from_height_px, int32_t to_width_px,
                                       int32_t to_height_px, struct shef_error *err)
{
    struct shef_paper_shrink *shrink = calloc(1, sizeof *shrink);
    const int32_t n_words = (from_width_px + 63) / 64;

    assert(to_width_px >= 1 && to_width_px <= from_width_px);
    assert(to_height_px >= 1 && to_height_px <= from_height_px);
    if (shrink)
        shrink->squeeze = shef_memory_create((size_t)n_words, sizeof *shrink->squeeze);
    if (!shrink || !shrink->squeeze) {
        free(shrink);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "shrinking %d x %d px: out of memory",
                         from_width_px, from_height_px);
    }
    shrink->from_width_px = from_width_px;
    shrink->from_height_px = from_height_px;
    shrink->to_width_px = to_width_px;
    shrink->to_height_px = to_height_px;
    shrink->n_words = n_words;
    shrink->bytes = sizeof *shrink + (size_t)n_words * sizeof *shrink->squeeze;

    int32_t x = 0;

    for (int32_t word = 0; word < n_words; word++) {
        uint64_t wanted = 0;

        for (; x < to_width_px; x++) {
            const int32_t from_x = shef_paper_source_of(x, from_width_px, to_width_px);

            if (from_x / 64 != word)
                break;
            wanted |= UINT64_C(1) << (from_x % 64);
        }
        shrink->squeeze[word] = squeeze_for(wanted);
    }
    *out_shrink = shrink;
    return SHEF_OK;
}

static void shrink_row(const struct shef_paper_shrink *shrink, const uint64_t *from, uint64_t *to)
{
    uint64_t filling = 0; /* the low n_filled bits of the word under way */
    int32_t n_filled = 0;

    for (int32_t word = 0; word < shrink->n_words; word++) {
        const struct squeeze *squeeze = &shrink->squeeze[word];
        const uint64_t bits = squeezed(from[word], squeeze);
        const int32_t n_filled_before = n_filled;

        filling |= bits << n_filled_before;
        n_filled += squeeze->n_wanted;
        if (n_filled >= 64) {
            *to++ = filling;
            n_filled -= 64;
            /* In two steps: a shift by 64 is undefined. */
            filling = bits >> (63 - n_filled_before) >> 1;
        }
    }
    if (n_filled > 0)
        *to = filling;
}

static void shrink_plane(const struct shef_paper_shrink *shrink, const uint64_t *from,
                         int32_t from_stride_words, uint64_t *to, int32_t to_stride_words)
{
    for (int32_t y = 0; y < shrink->to_height_px; y++) {
        const int32_t from_y =
            shef_paper_source_of(y, shrink->from_height_px, shrink->to_height_px);

        shrink_row(shrink, from + (size_t)from_y * (size_t)from_stride_words,
                   to + (size_t)y * (size_t)to_stride_words);
    }
}

void shef_paper_shrink_run(const struct shef_paper_shrink *shrink, const struct shef_edge_map *from,
                           struct shef_edge_map *to)
{
    assert(from->width_px == shrink->from_width_px && from->height_px == shrink->from_height_px);
    assert(to->width_px == shrink->to_width_px && to->height_px == shrink->to_height_px);
    assert((from->minus != NULL) == (to->minus != NULL));

    shrink_plane(shrink, from->plus, from->stride_words, to->plus, to->stride_words);
    if (from->minus)
        shrink_plane(shrink, from->minus, from->stride_words, to->minus, to->stride_words);
}

size_t shef_paper_shrink_bytes(const struct shef_paper_shrink *shrink)
{
    return shrink->bytes;
}

void shef_paper_shrink_destroy(struct shef_paper_shrink *shrink)
{
    if (!shrink)
        return;
    free(shrink->squeeze);
    free(shrink);
}
