/* How fast the decoders are, per instruction set: events from memory into batches, every field of
 * every event summed up, one thread.
 *
 *   bench_decode [--repeats N] [--loops N] FILE...
 *
 * FILE is a RAW recording; its event data is laid N times after itself in memory (default 1: what
 * a cache holds; 60: what it does not). Prints the best and the median of the repeats.
 *
 *   bench_decode --file FILE
 *
 * Reads FILE once, from its opening to its end, and prints events, seconds and sum for
 * tools/bench-codecs-peer. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "codecs/event_reader.h"
#include "codecs/evt.h"
#include "codecs/raw_header.h"
#include "core/cpu.h"

struct recording {
    const char *path;
    struct shef_raw_header header;
    uint8_t *bytes;
    size_t n_bytes;
};

struct result {
    uint64_t n_events;
    uint64_t checksum;
    double best_s;
    double median_s;
};

static double now_s(void)
{
    struct timespec time;

    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static bool load(const char *path, int n_loops, struct recording *out_recording)
{
    struct recording recording = { .path = path };
    struct shef_error err;
    long n_file;
    FILE *file = fopen(path, "rb");

    if (!file || fseek(file, 0, SEEK_END) != 0 || (n_file = ftell(file)) <= 0) {
        fprintf(stderr, "bench_decode: cannot read '%s'\n", path);
        return false;
    }
    rewind(file);
    uint8_t *const content = malloc((size_t)n_file);
    const bool is_read = content && fread(content, 1, (size_t)n_file, file) == (size_t)n_file;

    fclose(file);
    if (!is_read ||
        shef_raw_header_parse(content, (size_t)n_file, &recording.header, &err) != SHEF_OK) {
        fprintf(stderr, "bench_decode: '%s': %s\n", path, is_read ? err.text : "cannot read");
        free(content);
        return false;
    }

    const size_t n_data = (size_t)n_file - recording.header.n_bytes;

    recording.n_bytes = n_data * (size_t)n_loops;
    recording.bytes = malloc(recording.n_bytes + 1);
    for (int i = 0; recording.bytes && i < n_loops; i++)
        memcpy(recording.bytes + n_data * (size_t)i, content + recording.header.n_bytes, n_data);
    free(content);
    *out_recording = recording;
    return recording.bytes != NULL;
}

/* An event as one number; reading it so is allowed where it was written as an event. */
typedef uint64_t event_bits __attribute__((may_alias));

_Static_assert(sizeof(struct shef_event) == sizeof(event_bits), "an event is 64 bits");

/* The sum must not take longer than the decoding that it proves. */
#if defined(__x86_64__)
#define FOR_EACH_ISA __attribute__((noinline, target_clones("avx512f", "avx2", "default")))
#else
#define FOR_EACH_ISA
#endif

/* The sum of all events as 64-bit numbers: each field enters it, and where batches end does not. */
FOR_EACH_ISA static uint64_t sum_of(const struct shef_event_batch *batch)
{
    const event_bits *const bits = (const event_bits *)(const void *)batch->events;
    uint64_t sum = (uint64_t)batch->base_us * batch->n_events;

    for (uint32_t i = 0; i < batch->n_events; i++)
        sum += bits[i];
    return sum;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

static struct result measure(const struct recording *recording, uint32_t features, int n_repeats)
{
    static _Alignas(64) struct shef_event events[SHEF_BATCH_EVENTS];
    double *const seconds = calloc((size_t)n_repeats, sizeof *seconds);
    struct result result = { 0 };

    for (int i = 0; i < n_repeats; i++) {
        struct shef_event_batch batch = { .events = events, .capacity = SHEF_BATCH_EVENTS };
        struct shef_evt_decoder decoder;
        size_t at = 0;
        const double start_s = now_s();

        result = (struct result){ 0 };
        shef_evt_init(&decoder, recording->header.format, recording->header.width_px,
                      recording->header.height_px, 0, features);
        while (at < recording->n_bytes) {
            at += shef_evt_decode(&decoder, recording->bytes + at, recording->n_bytes - at, &batch);
            result.checksum += sum_of(&batch);
            result.n_events += batch.n_events;
            shef_event_batch_clear(&batch);
        }
        seconds[i] = now_s() - start_s;
    }
    qsort(seconds, (size_t)n_repeats, sizeof *seconds, by_size);
    result.best_s = seconds[0];
    result.median_s = seconds[n_repeats / 2];
    free(seconds);
    return result;
}

static int read_file(const char *path)
{
    static _Alignas(64) struct shef_event events[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = SHEF_BATCH_EVENTS };
    struct shef_event_reader *reader;
    struct shef_error err;
    uint64_t n_events = 0;
    uint64_t checksum = 0;
    const double start_s = now_s();
    enum shef_err code = shef_event_reader_open(path, shef_cpu_features(), &reader, &err);

    if (code == SHEF_OK) {
        while ((code = shef_event_reader_next(reader, &batch, &err)) == SHEF_OK) {
            checksum += sum_of(&batch);
            n_events += batch.n_events;
        }
        shef_event_reader_close(reader);
    }
    if (code != SHEF_ERR_EMPTY) {
        fprintf(stderr, "bench_decode: %s\n", err.text);
        return 1;
    }
    printf("%llu %.9f %llu\n", (unsigned long long)n_events, now_s() - start_s,
           (unsigned long long)checksum);
    return 0;
}

int main(int argc, char **argv)
{
    static const char *const isas[] = { "c", "neon", "avx2", "avx512" };
    char model[128];
    int n_repeats = 30;
    int n_loops = 1;
    int first = 1;

    if (argc == 3 && strcmp(argv[1], "--file") == 0)
        return read_file(argv[2]);
    for (; first + 1 < argc && strncmp(argv[first], "--", 2) == 0; first += 2) {
        if (strcmp(argv[first], "--repeats") == 0)
            n_repeats = atoi(argv[first + 1]);
        else if (strcmp(argv[first], "--loops") == 0)
            n_loops = atoi(argv[first + 1]);
    }
    if (first >= argc || n_repeats < 1 || n_loops < 1) {
        fprintf(stderr, "Usage: bench_decode [--repeats N] [--loops N] FILE... | --file FILE\n");
        return 2;
    }
    shef_cpu_model(model, sizeof model);
    printf("%s, %d repeats\n", model, n_repeats);
    for (int i = first; i < argc; i++) {
        struct recording recording;

        if (!load(argv[i], n_loops, &recording))
            return 1;
        uint64_t checksum = 0;

        for (size_t isa = 0; isa < sizeof isas / sizeof isas[0]; isa++) {
            const uint32_t features = shef_cpu_features_of(isas[isa]);

            if ((shef_cpu_features() & features) != features)
                continue;
            const struct result result = measure(&recording, features, n_repeats);

            printf("%-6s %-7s %6.1f MB %11llu events  best %6.0f  median %6.0f Mev/s\n",
                   shef_evt_format_name(recording.header.format), isas[isa],
                   (double)recording.n_bytes * 1e-6, (unsigned long long)result.n_events,
                   (double)result.n_events / result.best_s * 1e-6,
                   (double)result.n_events / result.median_s * 1e-6);
            if (isa > 0 && result.checksum != checksum) {
                fprintf(stderr, "bench_decode: the instruction sets disagree\n");
                return 1;
            }
            checksum = result.checksum;
        }
        free(recording.bytes);
    }
    return 0;
}
