/* sheftool events bench: how fast events are decoded and filtered. */
#include <stdio.h>

#include "core/cpu.h"
#include "sheftool/command.h"
#include "sheftool/report_parts.h"
#include "sheftool/events_bench.h"
#include "sheftool/machine.h"

struct settings {
    const char *path;
    int64_t n_events;
    int64_t n_rounds;
    bool json;
};

static const struct shef_option options[] = {
    SHEF_OPT_WORD("SOURCE", struct settings, path, false,
                  "a RAW file to run on (default: a synthetic scene)"),
    SHEF_OPT_INT("events", struct settings, n_events, "1000000", 1000, 100000000, NULL,
                 "how many events, at most"),
    SHEF_OPT_INT("rounds", struct settings, n_rounds, "25", 1, 10000, NULL,
                 "how often each case runs, after one round to warm up"),
    SHEF_OPT_FLAG("json", struct settings, json, "print JSON instead of a table"),
    SHEF_OPT_END,
};

static json_t *describe(const struct settings *settings,
                        const struct shef_events_material *material, struct shef_bench *bench)
{
    return json_pack("{s:o, s:s, s:I, s:I, s:I, s:I, s:i, s:s, s:o}", "machine",
                     shef_machine_json(shef_cpu_features()), "events_from",
                     settings->path ? settings->path : "synthetic", "n_events",
                     (json_int_t)material->n_events, "width_px", (json_int_t)material->width_px,
                     "height_px", (json_int_t)material->height_px, "rounds",
                     (json_int_t)settings->n_rounds, "threads", 1, "speed_of", "min_ms", "results",
                     shef_bench_events_json(bench));
}

static double number(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

static void print_table(const json_t *root, FILE *out)
{
    const json_t *machine = json_object_get(root, "machine");
    size_t i;
    const json_t *one;

    fprintf(out, "%s, %s; one thread, cases take turns; %.0f events (%s)\n\n",
            json_string_value(json_object_get(machine, "cpu")),
            json_string_value(json_object_get(machine, "compiler")), number(root, "n_events"),
            json_string_value(json_object_get(root, "events_from")));
    fprintf(out, "%-18s%-8s%10s%10s%10s%10s%10s\n%-26s%10s%10s%10s%10s%10s\n", "name", "isa",
            "median", "p95", "min", "speed", "size", "", "ms", "ms", "ms", "Mev/s", "B/event");
    json_array_foreach(json_object_get(root, "results"), i, one)
    {
        char size[32] = "-";

        if (json_is_number(json_object_get(one, "bytes_per_event")))
            snprintf(size, sizeof size, "%.2f", number(one, "bytes_per_event"));
        fprintf(out, "%-18s%-8s%10.3f%10.3f%10.3f%10.0f%10s\n",
                json_string_value(json_object_get(one, "name")),
                json_string_value(json_object_get(one, "isa")), number(one, "median_ms"),
                number(one, "p95_ms"), number(one, "min_ms"), number(one, "mev_per_s"), size);
    }
    fprintf(out, "\nMev/s: millions of events a second, of the shortest time.\n");
}

static enum shef_err measure(const struct settings *settings,
                             const struct shef_events_material *material, struct shef_bench *bench,
                             struct shef_error *err)
{
    /* The cases bring their own events; a bench needs one pair to hand around. */
    struct shef_bench_pair none = { .frame = { { 0 } } };
    const struct shef_bench_pairs pairs = { .at = &none, .n = 1 };
    enum shef_err code = shef_bench_add_events(bench, material, shef_cpu_features(), err);

    if (code == SHEF_OK)
        code = shef_bench_run(bench, &pairs, (int32_t)settings->n_rounds, err);
    if (code == SHEF_OK)
        code = shef_bench_check_events(bench, err);
    if (code != SHEF_OK)
        return code;

    json_t *root = describe(settings, material, bench);

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    if (settings->json)
        shef_report_print_json(root, 6);
    else
        print_table(root, stdout);
    json_decref(root);
    return SHEF_OK;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_events_material material;
    struct shef_bench bench = { .n = 0 };
    enum shef_err code =
        settings->path ? shef_events_material_load(&material, settings->path,
                                                   (uint32_t)settings->n_events, err)
                       : shef_events_material_make(&material, (uint32_t)settings->n_events, err);

    if (code != SHEF_OK)
        return code;
    code = measure(settings, &material, &bench, err);
    shef_bench_destroy(&bench);
    shef_events_material_free(&material);
    return code;
}

const struct shef_command shef_command_events_bench = {
    .name = "events bench",
    .summary = "speed of decoding and filtering events",
    .description =
        "Times the decoders of EVT2, EVT2.1 and EVT3 for every instruction set of this processor,\n"
        "from memory into batches that fit the L2 cache, every field of every event entering a\n"
        "checksum; the filter on the same events and on random pixels, its worst case; and EVT3\n"
        "bytes all the way into the filter. One thread; the cases take turns, so that a\n"
        "disturbance hits all.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
