/* How much of a core recording takes: checksums, decoding, writing, per second of a sensor that
 * sends 200 MB/s in buffers of 128 KiB, the most that its USB carries.
 *
 * Usage: bench_recorder [FOLDER [SECONDS]]   (default: /dev/shm, 2 s; a disk's folder includes
 * what the system does to get the data there) */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "codecs/evt_encode.h"
#include "core/cpu.h"
#include "core/crc32c.h"
#include "recordings.h"

#define BUFFER_BYTES (128u << 10)
#define N_BUFFERS    256
#define BYTES_PER_S  200000000.0

static double cpu_s(void)
{
    struct rusage usage;

    getrusage(RUSAGE_SELF, &usage);
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / 1e6;
}

/* 32 MiB of a busy VGA sensor. */
static uint8_t *make_bytes(enum shef_evt_format format, struct shef_test_random *random,
                           uint64_t *out_n_events)
{
    const size_t n_wanted = (size_t)N_BUFFERS * BUFFER_BYTES;
    uint8_t *bytes = malloc(n_wanted + 65536);
    struct shef_event events[512];
    struct shef_event_batch batch = { .events = events, .capacity = 512 };
    struct shef_evt_encoder encoder;
    size_t n = 0;
    int64_t t_us = 0;

    *out_n_events = 0;
    shef_evt_encoder_init(&encoder, format, SHEF_EVT_TICKS_SENSOR, 640, 480);
    while (bytes && n < n_wanted) {
        size_t n_more;

        shef_event_batch_clear(&batch);
        batch.base_us = t_us;
        for (int i = 0; i < 512; i++) {
            const uint32_t y_px = (uint32_t)shef_test_random_range(random, 0, 479);

            batch.events[batch.n_events++] =
                shef_event_make((uint32_t)(i / 50), (uint32_t)(i * 37 % 640), y_px, i % 2 == 0);
        }
        t_us += 10;
        batch.reached_us = t_us;
        if (shef_evt_encode(&encoder, &batch, bytes + n, 65536, &n_more) != SHEF_OK)
            abort();
        n += n_more;
        *out_n_events += 512;
    }
    return bytes;
}

static void measure(const char *parent, int seconds, enum shef_evt_format format)
{
    struct shef_test_random random = { .state = 1 };
    uint64_t n_events;
    uint8_t *bytes = make_bytes(format, &random, &n_events);
    const struct sensor_stream stream = {
        .camera = { .format = format, .width_px = 640, .height_px = 480, .system_id = 28 },
    };
    const struct shef_recording_writer_config writer_config = { .software = "bench" };
    const struct shef_event_recorder_config config =
        shef_event_recorder_default_config(&stream.camera);
    static struct shef_recording_writer recording;
    struct shef_event_recorder *recorder;
    struct shef_error err = { .text = "out of memory" };
    const int n_buffers = (int)(seconds * BYTES_PER_S / BUFFER_BYTES);
    char folder[4096];

    snprintf(folder, sizeof folder, "%s/shef-bench-recorder", parent);
    if (!bytes ||
        shef_recording_writer_create(&recording, folder, &writer_config, &err) != SHEF_OK ||
        shef_event_recorder_start(&recording, &config, &recorder, &err) != SHEF_OK) {
        fprintf(stderr, "%s\n", err.text);
        exit(1);
    }

    const double start_s = cpu_s();
    uint32_t crc = 0;

    for (int i = 0; i < n_buffers; i++) {
        const shef_host_time arrived = { i * (int64_t)(BUFFER_BYTES / BYTES_PER_S * 1e9) };

        if (shef_event_recorder_write(recorder, bytes + (size_t)(i % N_BUFFERS) * BUFFER_BYTES,
                                      BUFFER_BYTES, arrived, 0, &err) != SHEF_OK) {
            fprintf(stderr, "%s\n", err.text);
            exit(1);
        }
    }

    const double record_s = cpu_s() - start_s;

    for (int i = 0; i < n_buffers; i++)
        crc = shef_crc32c(crc, bytes + (size_t)(i % N_BUFFERS) * BUFFER_BYTES, BUFFER_BYTES);

    const double crc_s = cpu_s() - start_s - record_s;

    if (shef_event_recorder_stop(recorder, &err) != SHEF_OK ||
        shef_recording_writer_close(&recording, false, NULL, NULL, &err) != SHEF_OK)
        fprintf(stderr, "%s\n", err.text);
    printf("%s to %s: %.1f %% of a core at 200 MB/s (%.0f Mev/s); checksums alone %.1f %% (%08x)\n",
           shef_evt_format_name(format), parent, 100 * record_s / seconds,
           (double)n_events / N_BUFFERS / BUFFER_BYTES * BYTES_PER_S / 1e6, 100 * crc_s / seconds,
           crc);
    free(bytes);

    char command[4200];

    snprintf(command, sizeof command, "rm -r '%s'", folder);
    if (system(command) != 0)
        fprintf(stderr, "could not remove %s\n", folder);
}

int main(int argc, char **argv)
{
    const char *parent = argc > 1 ? argv[1] : "/dev/shm";
    const int seconds = argc > 2 ? atoi(argv[2]) : 2;

    measure(parent, seconds > 0 ? seconds : 1, SHEF_EVT2);
    measure(parent, seconds > 0 ? seconds : 1, SHEF_EVT3);
    return 0;
}
