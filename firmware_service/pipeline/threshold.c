#include "pipeline/threshold.h"

/* Thresholds of one share of a picture's edges move by about 1 in 50 from frame to frame. */
static int32_t first_step(int32_t guess)
{
    return guess / 64 + 1;
}

static int32_t clamped(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

int32_t shef_threshold_highest(int32_t floor, int32_t end, int32_t guess,
                               shef_threshold_fn *leaves_enough, const void *context)
{
    int32_t low = floor; /* leaves enough, or is the floor */
    int32_t high = end;  /* leaves too little, or is the end */

    if (end - floor < 2)
        return floor;

    const int32_t at = clamped(guess, floor + 1, end - 1);
    int32_t step = first_step(at);

    /* Away from the guess in growing steps until the answer lies in between. */
    if (leaves_enough(context, at)) {
        low = at;
        for (; high - low > step && leaves_enough(context, low + step); step *= 2)
            low += step;
        if (high - low > step)
            high = low + step;
    } else {
        high = at;
        for (; high - low > step && !leaves_enough(context, high - step); step *= 2)
            high -= step;
        if (high - low > step)
            low = high - step;
    }
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;

        if (leaves_enough(context, middle))
            low = middle;
        else
            high = middle;
    }
    return low;
}
