/* sheftool bench correlate, bench frame: speed beside OpenCV's, per instruction set. */
#include <math.h>
#include <stdio.h>

#include "core/cpu.h"
#include "sheftool/bench.h"
#include "sheftool/command.h"
#include "sheftool/report_parts.h"
#include "sheftool/machine.h"
#include "sheftool/matcher_opencv.h"

struct settings {
    const char *data;
    int64_t n_rounds;
    int64_t width_px;
    int64_t height_px;
    int64_t max_disparity_px;
    int64_t window_px;
    bool json;
};

#define N_PAIRS     8 /* enough to vary, few enough to stay in memory */
#define BM_BLOCK_PX 21

#define COMMON_OPTIONS                                                                             \
    SHEF_OPT_TEXT("data", struct settings, data, "DIR", NULL,                                      \
                  "run on the first pairs of this folder (default: synthetic pairs)"),             \
        SHEF_OPT_INT("width", struct settings, width_px, "640", 96, 4096, "px",                    \
                     "width of the synthetic maps"),                                               \
        SHEF_OPT_INT("height", struct settings, height_px, "480", 64, 4096, "px",                  \
                     "height of the synthetic maps"),                                              \
        SHEF_OPT_INT("max-disparity", struct settings, max_disparity_px, "80", 16, 256, "px",      \
                     "largest disparity searched, below the width"),                               \
        SHEF_OPT_INT("rounds", struct settings, n_rounds, "25", 1, 10000, NULL,                    \
                     "how often each case runs, after one round to warm up"),                      \
        SHEF_OPT_FLAG("json", struct settings, json, "print JSON instead of a table")

static const struct shef_option correlate_options[] = {
    COMMON_OPTIONS,
    SHEF_OPT_INT("window", struct settings, window_px, "21", 3, 127, "px",
                 "side of the correlation window, odd"),
    SHEF_OPT_END,
};

static const struct shef_option frame_options[] = {
    COMMON_OPTIONS,
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    if (settings->window_px && settings->window_px % 2 == 0)
        return shef_fail(err, SHEF_ERR_INVALID, "--window %lld: the side must be odd",
                         (long long)settings->window_px);
    return SHEF_OK;
}

static void print_table(const json_t *root, FILE *out)
{
    const json_t *machine = json_object_get(root, "machine");
    size_t i;
    const json_t *one;

    fprintf(out, "%lld pairs (%s) of %lld x %lld px, search range %lld px, %lld rounds\n",
            (long long)json_integer_value(json_object_get(root, "pairs")),
            json_string_value(json_object_get(root, "pairs_from")),
            (long long)json_integer_value(json_object_get(root, "width_px")),
            (long long)json_integer_value(json_object_get(root, "height_px")),
            (long long)json_integer_value(json_object_get(root, "disparities")),
            (long long)json_integer_value(json_object_get(root, "rounds")));
    fprintf(out, "%s, %s; OpenCV %s; one thread each, cases take turns\n\n",
            json_string_value(json_object_get(machine, "cpu")),
            json_string_value(json_object_get(machine, "compiler")),
            json_string_value(json_object_get(root, "opencv")));
    fprintf(out, "%-20s%-8s%10s%10s%10s%12s%12s\n%-28s%10s%10s%10s%12s%12s\n", "name", "isa",
            "median", "p95", "min", "speed", "StereoBM's", "", "ms", "ms", "ms", "MDE/s",
            "time / its");
    json_array_foreach(json_object_get(root, "results"), i, one)
    {
        fprintf(out, "%-20s%-8s%10.3f%10.3f%10.3f%12.0f%12.2f\n",
                json_string_value(json_object_get(one, "name")),
                json_string_value(json_object_get(one, "isa")),
                json_number_value(json_object_get(one, "median_ms")),
                json_number_value(json_object_get(one, "p95_ms")),
                json_number_value(json_object_get(one, "min_ms")),
                json_number_value(json_object_get(one, "mde_per_s")),
                json_number_value(json_object_get(one, "ratio_to_stereobm")));
    }
    fprintf(out, "\nMDE/s: millions of width x height x disparities a second, of the shortest "
                 "time.\n");
}

static json_t *describe(const struct settings *settings, struct shef_bench *bench, int32_t n_pairs)
{
    return json_pack("{s:o, s:s, s:s, s:i, s:i, s:i, s:i, s:I, s:i, s:s, s:i, s:o}", "machine",
                     shef_machine_json(shef_cpu_features()), "opencv", shef_opencv_version(),
                     "pairs_from", settings->data ? settings->data : "synthetic", "pairs", n_pairs,
                     "width_px", bench->width_px, "height_px", bench->height_px, "disparities",
                     bench->max_disparity_px, "rounds", (json_int_t)settings->n_rounds, "threads",
                     1, "speed_and_ratio_of", "min_ms", "opencv_stereobm_block_px", BM_BLOCK_PX,
                     "results", shef_bench_results_json(bench));
}

static enum shef_err measure(const struct settings *settings, struct shef_bench *bench,
                             const struct shef_bench_pairs *pairs, struct shef_error *err)
{
    enum shef_err code = shef_bench_run(bench, pairs, (int32_t)settings->n_rounds, err);

    if (code != SHEF_OK)
        return code;

    json_t *root = describe(settings, bench, pairs->n);

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    if (settings->json)
        shef_report_print_json(root, 6);
    else
        print_table(root, stdout);
    json_decref(root);
    return SHEF_OK;
}

static enum shef_err open_pairs(const struct settings *settings, struct shef_bench_pairs *pairs,
                                struct shef_error *err)
{
    if (settings->data)
        return shef_bench_pairs_load(pairs, settings->data, N_PAIRS, err);
    return shef_bench_pairs_make(pairs, (int32_t)settings->width_px, (int32_t)settings->height_px,
                                 N_PAIRS, err);
}

/* What differs between the two benches: which cases of ours run. */
typedef enum shef_err add_cases_fn(struct shef_bench *bench, const struct settings *settings,
                                   struct shef_error *err);

static enum shef_err run_bench(const struct settings *settings, add_cases_fn *add_cases,
                               struct shef_error *err)
{
    struct shef_bench_pairs pairs = { 0 };
    struct shef_bench bench = { .n = 0 };
    enum shef_err code = open_pairs(settings, &pairs, err);

    bench.width_px = pairs.width_px;
    bench.height_px = pairs.height_px;
    bench.max_disparity_px = (int32_t)settings->max_disparity_px;
    if (code == SHEF_OK && bench.max_disparity_px >= bench.width_px)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "a search range of %d px does not fit maps of %d px width; give "
                         "--max-disparity a value below the width",
                         bench.max_disparity_px, bench.width_px);
    if (code == SHEF_OK)
        code = add_cases(&bench, settings, err);
    if (code == SHEF_OK)
        code = shef_bench_add_opencv(&bench, BM_BLOCK_PX, err);
    if (code == SHEF_OK)
        code = measure(settings, &bench, &pairs, err);
    shef_bench_destroy(&bench);
    shef_bench_pairs_free(&pairs);
    return code;
}

static enum shef_err add_correlate_cases(struct shef_bench *bench, const struct settings *settings,
                                         struct shef_error *err)
{
    return shef_bench_add_correlate(bench, (int32_t)settings->window_px, shef_cpu_features(), err);
}

static enum shef_err add_frame_cases(struct shef_bench *bench, const struct settings *settings,
                                     struct shef_error *err)
{
    (void)settings;
    return shef_bench_add_frame(bench, shef_cpu_features(), err);
}

static enum shef_err run_correlate(const void *settings, struct shef_error *err)
{
    return run_bench(settings, add_correlate_cases, err);
}

static enum shef_err run_frame(const void *settings, struct shef_error *err)
{
    return run_bench(settings, add_frame_cases, err);
}

#define HOW_IT_MEASURES                                                                            \
    "Every instruction set of this processor runs beside OpenCV's StereoBM (block 21) and\n"       \
    "StereoSGBM (block 5) on the same pairs, one thread each. The cases take turns, so that a\n"   \
    "disturbance hits all; of a turn's two pairs the second is timed. OpenCV gets ready 8-bit\n"   \
    "images; only its matching is timed."

const struct shef_command shef_command_bench_correlate = {
    .name = "bench correlate",
    .summary = "speed of the window correlation",
    .description = "Times the correlation of two edge maps with the best disparity at each edge:\n"
                   "correlate (one plane) and correlate-signed (two).\n" HOW_IT_MEASURES,
    .options = correlate_options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run_correlate,
};

const struct shef_command shef_command_bench_frame = {
    .name = "bench frame",
    .summary = "speed of whole frames",
    .description =
        "Times whole frames, every step included: robust on one plane, robust-signed on two,\n"
        "robust-graded on int8 maps, paper-ds, and paper-dp with its outlier filter.\n" HOW_IT_MEASURES,
    .options = frame_options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run_frame,
};
