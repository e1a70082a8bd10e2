/* The reference: one ray at a time. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/cpu.h"

#define LANES 1
typedef float real;
typedef int32_t whole;
typedef bool mask;

static inline real r_set(float value)
{
    return value;
}

static inline real r_load(const float *from)
{
    return *from;
}

static inline void r_store(float *to, real a)
{
    *to = a;
}

static inline real r_sqrt(real a)
{
    return sqrtf(a);
}

static inline mask r_less(real a, real b)
{
    return a < b;
}

static inline real r_pick(mask m, real a, real b)
{
    return m ? a : b;
}

static inline real r_from(whole a)
{
    return (float)a;
}

static inline real r_byte0(whole a)
{
    return (float)(a & 255);
}

static inline real r_byte1(whole a)
{
    return (float)(a >> 8 & 255);
}

static inline real r_byte2(whole a)
{
    return (float)(a >> 16 & 255);
}

static inline real r_byte3(whole a)
{
    return (float)((uint32_t)a >> 24);
}

static inline whole w_set(int32_t value)
{
    return value;
}

static inline void w_store(int32_t *to, whole a)
{
    *to = a;
}

/* Towards zero; within the range of int32. */
static inline whole w_truncate(real a)
{
    return (int32_t)a;
}

static inline whole w_least(whole a, whole b)
{
    return a < b ? a : b;
}

static inline whole w_pick(mask m, whole a, whole b)
{
    return m ? a : b;
}

/* row * pitch + column */
static inline whole w_at(whole row, int32_t pitch, whole column)
{
    return row * pitch + column;
}

/* from[index] in the lower half, from[index + 1] in the upper one */
static inline whole w_gather(const uint16_t *from, whole index)
{
    return (int32_t)((uint32_t)from[index] | (uint32_t)from[index + 1] << 16);
}

static inline mask m_and(mask a, mask b)
{
    return a && b;
}

static inline mask m_or(mask a, mask b)
{
    return a || b;
}

static inline bool m_any(mask a)
{
    return a;
}

#include "shefsim/kernels/trace_body.h"

const struct sim_trace_kernels sim_trace_kernels_c = { "c", SHEF_CPU_NONE, light, depth };
