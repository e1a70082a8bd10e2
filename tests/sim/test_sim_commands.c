/* The real shefsim: what it writes, and what it says to those who ask for what cannot be. */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "codecs/event_reader.h"
#include "core/cpu.h"
#include "core/file.h"
#include "core/memory.h"
#include "shefsim/npy.h"
#include "small_rig.h"
#include "support/process.h"
#include "support/support.h"

#if defined(__x86_64__)
#define FOREIGN_ISA "neon"
#else
#define FOREIGN_ISA "avx2"
#endif

enum { WIDTH = 64, HEIGHT = 48, N_IMAGES = 30 };

static struct shef_test_process program;
static const struct shef_test_process_manner plain;

#define RUN(...) shef_test_process_run(&program, "shefsim", &plain, __VA_ARGS__)

static void expect_failure(int status, const char *word, int n_entries)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, program.status, program.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(program.err, word), program.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&program), program.err);
    TEST_ASSERT_EQUAL_STRING("", program.out);
    TEST_ASSERT_EQUAL_INT_MESSAGE(n_entries, shef_test_temp_count(), "something stayed behind");
}

/* A stack of images of waves that move, and their times. */
static void write_stack(const char *images_name, const char *times_name)
{
    const int64_t shape[3] = { N_IMAGES, HEIGHT, WIDTH };
    struct sim_npy images;
    struct sim_npy times;
    struct shef_error err;

    unlink(shef_test_temp_path(images_name));
    unlink(shef_test_temp_path(times_name));
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_create(&images, shef_test_temp_path(images_name),
                                                  SIM_NPY_F32, 3, shape, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_create(&times, shef_test_temp_path(times_name),
                                                  SIM_NPY_I64, 1, shape, &err));
    for (int64_t i = 0; i < N_IMAGES; i++) {
        const int64_t t_ns = i * 2000000;

        TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_write(&times, &t_ns, 1, &err));
        for (int32_t k = 0; k < WIDTH * HEIGHT; k++) {
            const double phase = 0.3 * (k % WIDTH) + 0.2 * (k / WIDTH) - 0.2 * (double)i;
            const float light = (float)exp(-1 + sin(phase));

            TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_write(&images, &light, 1, &err));
        }
    }
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_close(&images, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_npy_close(&times, &err));
}

static uint64_t count_events(const char *path)
{
    static struct shef_event room[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = room, .capacity = SHEF_BATCH_EVENTS };
    struct shef_event_reader *reader;
    struct shef_error err;
    uint64_t n = 0;

    TEST_ASSERT_EQUAL_INT(SHEF_OK,
                          shef_event_reader_open(path, shef_cpu_features(), &reader, &err));
    while (shef_event_reader_next(reader, &batch, &err) == SHEF_OK)
        n += batch.n_events;
    shef_event_reader_close(reader);
    return n;
}

static void test_images_become_events_in_any_format(void)
{
    char images[4200];
    char times[4200];
    unsigned long long n = 0;

    write_stack("images.npy", "times.npy");
    snprintf(images, sizeof images, "%s", shef_test_temp_path("images.npy"));
    snprintf(times, sizeof times, "%s", shef_test_temp_path("times.npy"));
    RUN("events %s --times %s --noise clean --out %s", images, times,
        shef_test_temp_path("events.raw"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program.status, program.err);
    TEST_ASSERT_EQUAL_INT(1, sscanf(strstr(program.out, ".raw: "), ".raw: %llu events", &n));
    TEST_ASSERT_TRUE(n > 5000);
    TEST_ASSERT_EQUAL_UINT64(n, count_events(shef_test_temp_path("events.raw")));
    RUN("events %s --times %s --noise clean --out %s", images, times,
        shef_test_temp_path("events.npy"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program.status, program.err);

    uint8_t *bytes;
    size_t n_bytes;
    struct shef_error err;

    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_file_read(shef_test_temp_path("events.npy"), 1 << 24,
                                                  &bytes, &n_bytes, &err));
    /* t i8, x i2, y i2, p u1 behind a header. */
    TEST_ASSERT_UINT32_WITHIN(256, 13 * n, n_bytes);
    free(bytes);
}

static void test_exported_images_give_the_same_events_again(void)
{
    unsigned long long n_rendered = 0;
    unsigned long long n_again = 0;
    char folder[4200];

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("exported"));
    RUN("render --scene %s --speed 0.2 --seconds 0.1 --no-frames --noise clean --export-images %s "
        "--export-as log",
        small_rig_scene(), folder);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program.status, program.err);
    TEST_ASSERT_EQUAL_INT(1, sscanf(strstr(program.out, "events "), "events %llu", &n_rendered));
    RUN("events %s/images.npy --times %s/times.npy --input log --noise clean --out %s", folder,
        folder, shef_test_temp_path("again.raw"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program.status, program.err);
    TEST_ASSERT_EQUAL_INT(1, sscanf(strstr(program.out, ".raw: "), ".raw: %llu", &n_again));
    TEST_ASSERT_TRUE(n_rendered > 10000);
    TEST_ASSERT_EQUAL_UINT64(n_rendered, n_again);
}

static void test_wrong_arrays_are_refused_in_a_sentence(void)
{
    struct shef_error err;
    int n_entries;

    write_stack("images.npy", "times.npy");
    TEST_ASSERT_EQUAL_INT(
        SHEF_OK, shef_file_replace(shef_test_temp_path("text.npy"), "not an array", 12, &err));
    n_entries = shef_test_temp_count();
    RUN("events %s --times %s --out %s", shef_test_temp_path("text.npy"),
        shef_test_temp_path("times.npy"), shef_test_temp_path("none.raw"));
    expect_failure(1, "no .npy file", n_entries);
    RUN("events %s --times %s --out %s", shef_test_temp_path("images.npy"),
        shef_test_temp_path("images.npy"), shef_test_temp_path("none.raw"));
    expect_failure(1, "one time for each", n_entries);
    RUN("events %s --times %s --time-unit s --out %s", shef_test_temp_path("images.npy"),
        shef_test_temp_path("times.npy"), shef_test_temp_path("none.raw"));
    expect_failure(1, "--time-unit", n_entries);
    RUN("events %s --times %s --out %s", shef_test_temp_path("images.npy"),
        shef_test_temp_path("times.npy"), shef_test_temp_path("none.txt"));
    expect_failure(1, "none.txt", n_entries);
    RUN("events %s --times %s --threshold 0.001 --out %s", shef_test_temp_path("images.npy"),
        shef_test_temp_path("times.npy"), shef_test_temp_path("none.raw"));
    expect_failure(2, "threshold", n_entries);
    /* An array that is cut. */
    TEST_ASSERT_EQUAL_INT(0, truncate(shef_test_temp_path("images.npy"), 100000));
    RUN("events %s --times %s --out %s", shef_test_temp_path("images.npy"),
        shef_test_temp_path("times.npy"), shef_test_temp_path("none.raw"));
    expect_failure(1, "length", n_entries);
}

static void test_what_cannot_be_rendered_is_refused_in_a_sentence(void)
{
    const char *scene = small_rig_scene();
    const int n_entries = shef_test_temp_count();

    RUN("render --scene no_such_scene --out %s", shef_test_temp_path("no"));
    expect_failure(1, "no_such_scene", n_entries);
    RUN("render --scene %s --path triangle --out %s", scene, shef_test_temp_path("no"));
    expect_failure(1, "triangle", n_entries);
    RUN("render --scene %s --path-size 1 --tilt -60 --out %s", scene, shef_test_temp_path("no"));
    expect_failure(1, "reach", n_entries);
    RUN("render --scene %s --fps 150 --exposure-ms 30 --out %s", scene, shef_test_temp_path("no"));
    expect_failure(1, "shefsim render: an exposure of 30 ms", n_entries);
    RUN("render --scene %s --light strobe --out %s", scene, shef_test_temp_path("no"));
    expect_failure(1, "strobe", n_entries);
    RUN("render --scene %s --out %s", scene, scene);
    expect_failure(1, "file of that name", n_entries);
    RUN("render --scene %s", scene);
    expect_failure(2, "--out", n_entries);
    RUN("render --scene %s --noise loud --out %s", scene, shef_test_temp_path("no"));
    expect_failure(2, "loud", n_entries);
    RUN("render --scene %s --isa %s --out %s", scene, FOREIGN_ISA, shef_test_temp_path("no"));
    expect_failure(2, "--isa: this processor", n_entries);
}

static void test_a_signal_leaves_nothing(void)
{
    const char *scene = small_rig_scene();
    const int n_entries = shef_test_temp_count();

    shef_test_process_start(&program, "shefsim", &plain, "render --scene %s --seconds 60 --out %s",
                            scene, shef_test_temp_path("long"));
    /* Once its folder is there, it is at work. */
    for (int i = 0; i < 2000 && shef_test_temp_count() == n_entries; i++)
        usleep(10000);
    TEST_ASSERT_EQUAL_INT(n_entries + 1, shef_test_temp_count());
    shef_test_process_end(&program, SIGINT);
    expect_failure(130, "signal", n_entries);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_images_become_events_in_any_format);
    RUN_TEST(test_exported_images_give_the_same_events_again);
    RUN_TEST(test_wrong_arrays_are_refused_in_a_sentence);
    RUN_TEST(test_what_cannot_be_rendered_is_refused_in_a_sentence);
    RUN_TEST(test_a_signal_leaves_nothing);
    return UNITY_END();
}
