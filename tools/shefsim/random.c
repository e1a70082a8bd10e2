#include "shefsim/random.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#define LN2 0.693147180559945309417

/* Beyond this mean the counts of Poisson's distribution are drawn as normal numbers. */
#define POISSON_MAX_MEAN 16.0

double sim_normal(uint64_t key, uint64_t index)
{
    int32_t sum = 0;

    for (uint64_t i = 0; i < 3; i++) {
        const uint64_t bits = sim_random(key, 3 * index + i);

        for (int shift = 0; shift < 64; shift += 16)
            sum += (int32_t)(bits >> shift & 0xffff);
    }
    /* Twelve even numbers over 0..65535: mean 393210, deviation 65536. */
    return (sum - 393210) * 0x1p-16;
}

int64_t sim_poisson(uint64_t key, uint64_t index, double mean)
{
    assert(mean >= 0);
    if (mean > POISSON_MAX_MEAN) {
        const double count = mean + sqrt(mean) * sim_normal(key, index) + 0.5;

        return count > 0 ? (int64_t)count : 0;
    }

    /* Walks up the distribution until it passes an even number. */
    const double target = sim_unit(sim_random(key, index));
    double term = sim_exp(-mean);
    double sum = term;
    int64_t n = 0;

    while (sum <= target && n < 100) {
        n++;
        term = term * mean / (double)n;
        sum += term;
    }
    return n;
}

double sim_exp(double x)
{
    assert(x >= -700 && x <= 700);

    const double n_real = x / LN2;
    const int64_t n = (int64_t)(n_real < 0 ? n_real - 0.5 : n_real + 0.5);
    const double r = x - (double)n * LN2;
    double sum = 1;

    for (int k = 16; k >= 1; k--)
        sum = 1 + sum * r / k;

    const uint64_t bits = (uint64_t)(n + 1023) << 52;
    double scale;

    memcpy(&scale, &bits, sizeof scale);
    return sum * scale;
}
