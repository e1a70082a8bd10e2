#include "sheftool/bench.h"

#include <stdbool.h>

#include <assert.h>
#include <string.h>

#include "sheftool/command.h"
#include "sheftool/progress.h"

void shef_bench_add(struct shef_bench *bench, const struct shef_bench_case *one)
{
    assert(bench->n < SHEF_BENCH_MAX_CASES);
    bench->cases[bench->n++] = *one;
}

static enum shef_err run_once(struct shef_bench_case *one, const struct shef_bench_pair *pair,
                              int64_t number, bool counted, struct shef_error *err)
{
    enum shef_err code = one->prepare ? one->prepare(one->state, pair, err) : SHEF_OK;

    if (code != SHEF_OK)
        return code;

    const int64_t start_ns = shef_monotonic_ns();
    const int64_t start_cpu_ns = shef_stopwatch_cpu_ns();

    code = one->run(one->state, pair, number, err);
    const int64_t cpu_ns = shef_stopwatch_cpu_ns() - start_cpu_ns;
    const int64_t wall_ns = shef_monotonic_ns() - start_ns;

    if (code != SHEF_OK || !counted)
        return code;
    code = shef_timings_add(&one->wall, wall_ns);
    if (code == SHEF_OK)
        code = shef_timings_add(&one->cpu, cpu_ns);
    return code == SHEF_OK ? SHEF_OK : shef_fail(err, code, "timings: out of memory");
}

/* A case's turn: one run that is not counted, so that the case finds its own data in the caches as
 * it does when frames follow each other, and one that is. */
static enum shef_err take_turn(struct shef_bench_case *one, const struct shef_bench_pairs *pairs,
                               int32_t round, bool counted, struct shef_error *err)
{
    const int32_t first = 2 * round;
    const enum shef_err code = run_once(one, &pairs->at[first % pairs->n], first + 1, false, err);

    return code == SHEF_OK
               ? run_once(one, &pairs->at[(first + 1) % pairs->n], first + 2, counted, err)
               : code;
}

enum shef_err shef_bench_run(struct shef_bench *bench, const struct shef_bench_pairs *pairs,
                             int32_t n_rounds, struct shef_error *err)
{
    struct shef_progress progress;
    enum shef_err code = SHEF_OK;

    shef_progress_begin(&progress, "measuring", (int64_t)(n_rounds + 1) * bench->n);
    for (int32_t round = 0; code == SHEF_OK && round <= n_rounds; round++)
        for (int32_t i = 0; code == SHEF_OK && i < bench->n; i++) {
            code = shef_interrupted() ? shef_fail_interrupted(err)
                                      : take_turn(&bench->cases[i], pairs, round, round > 0, err);
            shef_progress_step(&progress, (int64_t)round * bench->n + i + 1);
        }
    shef_progress_end(&progress);
    return code;
}

/* The shortest time of StereoBM, or 0. */
static double stereobm_ms(struct shef_bench *bench)
{
    for (int32_t i = 0; i < bench->n; i++)
        if (strcmp(bench->cases[i].name, "opencv-stereobm") == 0)
            return shef_timings_summary(&bench->cases[i].wall).min_ms;
    return 0;
}

json_t *shef_bench_results_json(struct shef_bench *bench)
{
    const double peer_ms = stereobm_ms(bench);
    const double mde = (double)bench->width_px * bench->height_px * bench->max_disparity_px / 1e6;
    json_t *list = json_array();

    for (int32_t i = 0; i < bench->n; i++) {
        struct shef_bench_case *one = &bench->cases[i];
        const struct shef_timing_summary wall = shef_timings_summary(&one->wall);
        const bool known = wall.min_ms > 0;

        json_array_append_new(
            list,
            json_pack(
                "{s:s, s:s, s:f, s:f, s:f, s:f, s:o, s:o, s:o}", "name", one->name, "isa", one->isa,
                "median_ms", wall.median_ms, "p95_ms", wall.p95_ms, "min_ms", wall.min_ms,
                "cpu_median_ms", shef_timings_summary(&one->cpu).median_ms, "mde_per_s",
                known ? json_real(mde / (wall.min_ms / 1e3)) : json_null(), "ratio_to_stereobm",
                known && peer_ms > 0 ? json_real(peer_ms / wall.min_ms) : json_null(),
                "memory_bytes",
                one->memory_bytes ? json_integer((json_int_t)one->memory_bytes) : json_null()));
    }
    return list;
}

void shef_bench_destroy(struct shef_bench *bench)
{
    for (int32_t i = 0; i < bench->n; i++) {
        bench->cases[i].destroy(bench->cases[i].state);
        shef_timings_free(&bench->cases[i].wall);
        shef_timings_free(&bench->cases[i].cpu);
    }
    bench->n = 0;
}
