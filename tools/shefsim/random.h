/* Random numbers without a state: each is a function of what it is for.
 *
 * A key is made from the seed, the stream (what kind of number) and the step; a number from the
 * key and an index (a pixel, a count). So the numbers do not depend on the order in which they are
 * drawn, nor on threads, and two kinds never share a sequence. Integers only: the same numbers on
 * every machine. Thread: any.
 *
 * The mixing functions are the finishers of SplitMix64 (Steele 2014, variant 13 of Stafford) and
 * of `lowbias32` (Wellons 2018): both change half of the output bits for any input bit. */
#ifndef SHEFSIM_RANDOM_H
#define SHEFSIM_RANDOM_H

#include <stdint.h>

/* What a number is for. The order is part of what a seed means: add at the end only. */
enum sim_stream {
    SIM_STREAM_THRESHOLD_ON,
    SIM_STREAM_THRESHOLD_OFF,
    SIM_STREAM_HOT_PIXEL,
    SIM_STREAM_HOT_EVENT,
    SIM_STREAM_BACKGROUND,
    SIM_STREAM_JITTER,
    SIM_STREAM_FRAME_NOISE,
    SIM_STREAM_HOST_DELAY,
    SIM_STREAM_CLOCK,
    SIM_STREAM_MOUNT,
    SIM_STREAM_SESSION,
    SIM_STREAM_LEAK,
    SIM_STREAM_GRAIN,
};

static inline uint64_t sim_mix64(uint64_t x)
{
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

static inline uint32_t sim_mix32(uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

static inline uint64_t sim_key(uint64_t seed, enum sim_stream stream, uint64_t step)
{
    return sim_mix64(sim_mix64(seed + UINT64_C(0x9e3779b97f4a7c15) * (1 + (uint64_t)stream)) +
                     UINT64_C(0xd1b54a32d192ed03) * step);
}

/* 64 even bits. */
static inline uint64_t sim_random(uint64_t key, uint64_t index)
{
    return sim_mix64(key + UINT64_C(0x9e3779b97f4a7c15) * (index + 1));
}

/* Even over [0, 1), in steps of 2^-53. */
static inline double sim_unit(uint64_t bits)
{
    return (double)(bits >> 11) * 0x1p-53;
}

/* Mean 0, deviation 1, never beyond +-3.46: the sum of four even numbers, in steps of 2.6e-5.
 * For small disturbances; its tails are short. */
static inline double sim_bell(uint64_t bits)
{
    const int32_t sum =
        (int32_t)((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48));

    /* The deviation of an even number over 0..n-1 is sqrt((n^2 - 1) / 12). */
    return (sum - 131070) * 2.6429124e-5;
}

/* Mean 0, deviation 1, never beyond +-6: the sum of twelve even numbers, from three draws. */
double sim_normal(uint64_t key, uint64_t index);

/* How many events of a process with this mean happen: Poisson's distribution up to a mean of 16,
 * beyond that a normal one, rounded. */
int64_t sim_poisson(uint64_t key, uint64_t index, double mean);

/* exp(x) to 1e-14, from additions, multiplications and divisions alone.
 *   x  within +-700 */
double sim_exp(double x);

#endif
