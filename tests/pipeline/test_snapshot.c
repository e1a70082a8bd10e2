#include "pipeline/snapshot.h"

#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "filter_model.h"

#define WIDTH_PX     48
#define HEIGHT_PX    32
#define N_PIXELS     (WIDTH_PX * HEIGHT_PX)
#define START_US     INT64_C(4294000000) /* the 32-bit time wraps within the stream */
#define PERIOD_US    18519
#define EXPOSURE_US  5001 /* the middle falls between two microseconds */
#define N_FRAMES     8
#define N_EVENTS     63300 /* about 190 ms: the last frame is complete, no next one expected */
#define MAX_TRIGGERS 40

/* The stream: every event and trigger in the order sent. */
static struct shef_event events[N_EVENTS]; /* since START_US */
static uint32_t n_events;
static struct shef_trigger triggers[MAX_TRIGGERS];
static uint32_t n_triggers;

static struct shef_filter *filter;
static struct shef_hot_pixels *hot;
static struct shef_snapshots *snapshots;

void tearDown(void)
{
    shef_snapshots_destroy(snapshots);
    shef_hot_pixels_destroy(hot);
    shef_filter_destroy(filter);
    snapshots = NULL;
    hot = NULL;
    filter = NULL;
}

/* When frame i's exposure begins, in us since START_US. */
static uint32_t rise_us(int i)
{
    return 30000 + (uint32_t)i * PERIOD_US;
}

static void make_events(void)
{
    struct shef_test_random random = { 7 };
    uint32_t t_us = 0;

    for (n_events = 0; n_events < N_EVENTS; n_events++) {
        t_us += (uint32_t)shef_test_random_range(&random, 0, 6);
        events[n_events] =
            shef_event_make(t_us, (uint32_t)shef_test_random_range(&random, 0, WIDTH_PX - 1),
                            (uint32_t)shef_test_random_range(&random, 0, HEIGHT_PX - 1),
                            shef_test_random_range(&random, 0, 2) != 0);
    }
    n_triggers = 0;
}

/* A trigger where the sensor puts it: before the first later event. */
static void add_trigger(uint32_t t_us, int channel, bool rising)
{
    uint32_t n_before = 0;

    while (n_before < n_events && events[n_before].t_us <= t_us)
        n_before++;
    TEST_ASSERT_LESS_THAN_UINT32(MAX_TRIGGERS, n_triggers);
    triggers[n_triggers++] = (struct shef_trigger){
        .t_us = START_US + t_us,
        .n_before = n_before,
        .channel = (uint8_t)channel,
        .rising = rising,
    };
}

/* All frames but the edges left out, as bits 2 * i (rise) and 2 * i + 1 (fall). */
static void make_stream(uint32_t left_out)
{
    make_events();
    for (int i = 0; i < N_FRAMES; i++) {
        if (!(left_out >> (2 * i) & 1))
            add_trigger(rise_us(i), 0, true);
        if (!(left_out >> (2 * i + 1) & 1))
            add_trigger(rise_us(i) + EXPOSURE_US, 0, false);
    }
}

static void start_with(const struct shef_snapshot_params *params)
{
    const struct shef_filter_params sensor = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_error err = { 0 };

    shef_snapshots_destroy(snapshots);
    shef_filter_destroy(filter);
    snapshots = NULL;
    filter = shef_test_filter(&sensor);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_snapshots_create(&snapshots, filter, hot, params, &err),
                              err.text);
}

static struct shef_snapshot_params params_of(enum shef_snapshot_read read)
{
    struct shef_snapshot_params params = shef_snapshot_default_params();

    params.read = read;
    params.n_snapshots = 16;
    params.exposure_ns = EXPOSURE_US * 1000;
    params.max_predicted = read == SHEF_SNAPSHOT_CENTRED ? 4 : 0;
    return params;
}

static void start(enum shef_snapshot_read read)
{
    const struct shef_snapshot_params params = params_of(read);

    start_with(&params);
}

/* Feeds events first..end - 1 and the triggers among them; those at the very end come with it. */
static uint32_t feed(uint32_t first, uint32_t end)
{
    struct shef_event_batch batch = { .n_events = end - first };
    struct shef_event *sent = malloc((end - first + 1) * sizeof *sent);

    TEST_ASSERT_NOT_NULL(sent);
    /* Each batch has a base of its own. */
    batch.base_us = START_US - first % 10 * 1000;
    for (uint32_t i = first; i < end; i++) {
        sent[i - first] = events[i];
        sent[i - first].t_us = (uint32_t)(START_US + events[i].t_us - batch.base_us);
    }
    batch.events = sent;
    batch.reached_us = START_US + (end > 0 ? events[end - 1].t_us : 0);
    for (uint32_t i = 0; i < n_triggers; i++)
        if (triggers[i].n_before > first || (first == 0 && triggers[i].n_before == 0))
            if (triggers[i].n_before <= end) {
                batch.triggers[batch.n_triggers] = triggers[i];
                batch.triggers[batch.n_triggers++].n_before -= first;
            }

    const uint32_t n_published = shef_snapshots_feed(snapshots, &batch);

    free(sent);
    return n_published;
}

static void feed_all_in(uint32_t n_at_once)
{
    for (uint32_t first = 0; first < n_events; first += n_at_once)
        feed(first, first + n_at_once < n_events ? first + n_at_once : n_events);
}

/* A snapshot's content by value. */
struct copy {
    struct shef_snapshot snapshot;
    int16_t values[N_PIXELS];
    int16_t sums[N_PIXELS];
};

static void copy_image(int16_t *out, struct shef_image_i16 image)
{
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        memcpy(out + y * WIDTH_PX, shef_row_i16(image, y), WIDTH_PX * sizeof *out);
}

static struct copy *copy_of(uint64_t number)
{
    static struct copy copies[3 * N_FRAMES];
    static int next;
    struct copy *copy = &copies[next++ % (3 * N_FRAMES)];
    const struct shef_snapshot *snapshot;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_snapshot_pool_take(shef_snapshots_pool(snapshots), number, &snapshot));
    copy->snapshot = *snapshot;
    copy_image(copy->values, snapshot->values);
    copy_image(copy->sums, snapshot->sums);
    shef_snapshot_pool_give(shef_snapshots_pool(snapshots), snapshot);
    return copy;
}

static void expect_same(const struct copy *a, const struct copy *b)
{
    TEST_ASSERT_EQUAL_UINT64(a->snapshot.number, b->snapshot.number);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.rise.ns, b->snapshot.rise.ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.mid.ns, b->snapshot.mid.ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.exposure_ns, b->snapshot.exposure_ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.t_err_ns, b->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_HEX32(a->snapshot.flags, b->snapshot.flags);
    TEST_ASSERT_EQUAL_UINT64(a->snapshot.n_events, b->snapshot.n_events);
    TEST_ASSERT_EQUAL_INT16_ARRAY(a->values, b->values, N_PIXELS);
    TEST_ASSERT_EQUAL_INT16_ARRAY(a->sums, b->sums, N_PIXELS);
}

/* A filter of its own that has seen the events up to an instant and no others. */
static struct shef_filter *filter_until(int64_t at_ns, uint64_t *out_n_events)
{
    const struct shef_filter_params sensor = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    struct shef_filter *other = shef_test_filter(&sensor);
    uint32_t n = 0;

    while (n < n_events && (START_US + events[n].t_us) * 1000 <= at_ns)
        n++;
    if (n > 0)
        TEST_ASSERT_EQUAL_UINT32(n,
                                 shef_filter_apply(other, events, n, START_US, SHEF_TEST_FOREVER));
    *out_n_events = n;
    return other;
}

static struct shef_image_i16 image_create(void)
{
    struct shef_image_i16 image;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&image, WIDTH_PX, HEIGHT_PX, NULL));
    return image;
}

/* Compares a snapshot with what the definition of its read-out gives. */
static void expect_defined(const struct copy *copy, enum shef_snapshot_read read)
{
    static const double ends[] = { 0, .5, 1.1, 2, 3 };
    static const int16_t weights_q15[] = { 0, 25786, 14945, 7192,
                                           2803 }; /* mean of exp(-t), 2^15 */
    const int64_t mid_ns = copy->snapshot.mid.ns;
    const int64_t lag_ns = shef_filter_lag_ns(filter);
    struct shef_image_i16 values = image_create();
    struct shef_image_i16 sums = image_create();
    struct shef_image_i16 later = image_create();
    uint64_t n_before_mid;
    uint64_t n;
    struct shef_filter *other = filter_until(mid_ns, &n_before_mid);

    shef_filter_read(other, (shef_event_time){ mid_ns }, values);
    shef_filter_read_sums(other, sums);
    TEST_ASSERT_EQUAL_UINT64(n_before_mid, copy->snapshot.n_events);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(sums, y), copy->sums + y * WIDTH_PX, WIDTH_PX);
    shef_filter_destroy(other);
    if (read == SHEF_SNAPSHOT_LATE) {
        other = filter_until(mid_ns + lag_ns, &n);
        shef_filter_read(other, (shef_event_time){ mid_ns + lag_ns }, values);
        shef_filter_destroy(other);
    }
    for (int k = 1; read == SHEF_SNAPSHOT_CENTRED && k < 5; k++) {
        other = filter_until(mid_ns + (int64_t)(ends[k] * (double)lag_ns + .5), &n);
        shef_filter_read_sums(other, later);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++) {
                const int32_t gained = shef_row_i16(later, y)[x] - shef_row_i16(sums, y)[x];

                shef_row_i16(values, y)[x] =
                    (int16_t)(shef_row_i16(values, y)[x] +
                              ((gained * weights_q15[k] + (1 << 14)) >> 15));
                shef_row_i16(sums, y)[x] = shef_row_i16(later, y)[x];
            }
        shef_filter_destroy(other);
    }
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(values, y), copy->values + y * WIDTH_PX,
                                      WIDTH_PX);
    shef_image_destroy_i16(&values);
    shef_image_destroy_i16(&sums);
    shef_image_destroy_i16(&later);
}

static const enum shef_snapshot_read reads[] = { SHEF_SNAPSHOT_AT_MID, SHEF_SNAPSHOT_LATE,
                                                 SHEF_SNAPSHOT_CENTRED };

static void test_a_snapshot_holds_the_events_up_to_its_instant_and_no_others(void)
{
    for (int r = 0; r < 3; r++) {
        make_stream(0);
        start(reads[r]);
        /* Everything in one batch: events after each instant sit in the same packet. */
        TEST_ASSERT_EQUAL_UINT32(N_FRAMES, feed(0, n_events));
        for (int i = 0; i < N_FRAMES; i++) {
            const struct copy *copy = copy_of((uint64_t)i);

            TEST_ASSERT_EQUAL_INT64((START_US + rise_us(i)) * 1000, copy->snapshot.rise.ns);
            TEST_ASSERT_EQUAL_INT64((START_US + rise_us(i)) * 1000 + EXPOSURE_US * 500,
                                    copy->snapshot.mid.ns);
            TEST_ASSERT_EQUAL_INT64(EXPOSURE_US * 1000, copy->snapshot.exposure_ns);
            TEST_ASSERT_EQUAL_INT64(2000, copy->snapshot.t_err_ns);
            TEST_ASSERT_EQUAL_HEX32(0, copy->snapshot.flags);
            expect_defined(copy, reads[r]);
        }
    }
}

static void test_slicing_the_stream_changes_no_bit(void)
{
    static const uint32_t sizes[] = { 1, 7, 1000, 16384 };

    for (int r = 0; r < 3; r++) {
        struct copy whole[N_FRAMES];

        make_stream(0);
        start(reads[r]);
        feed(0, n_events);
        for (int i = 0; i < N_FRAMES; i++)
            whole[i] = *copy_of((uint64_t)i);
        for (int s = 0; s < 4; s++) {
            start(reads[r]);
            feed_all_in(sizes[s]);
            TEST_ASSERT_EQUAL_UINT64(N_FRAMES, shef_snapshots_stats(snapshots).n_published);
            for (int i = 0; i < N_FRAMES; i++)
                expect_same(&whole[i], copy_of((uint64_t)i));
        }
    }
}

/* The snapshot of frame 1, asked for when a frame that comes this late arrives. */
static struct copy taken_late(int64_t late_us)
{
    const int64_t frame_us = rise_us(1) + EXPOSURE_US + late_us;
    const struct shef_snapshot *snapshot;
    uint32_t at = 0;

    make_stream(0);
    start(SHEF_SNAPSHOT_CENTRED);
    while (events[at].t_us < frame_us)
        at++;
    feed(0, at);
    /* A frame that is early waits for its snapshot. */
    while (shef_snapshot_pool_take(shef_snapshots_pool(snapshots), 1, &snapshot) ==
           SHEF_ERR_EMPTY) {
        feed(at, at + 100);
        at += 100;
    }
    shef_snapshot_pool_give(shef_snapshots_pool(snapshots), snapshot);
    return *copy_of(1);
}

static void test_frames_0_20_and_60_ms_late_get_the_same_bits(void)
{
    const struct copy prompt = taken_late(0);
    const struct copy late = taken_late(20000);
    const struct copy very_late = taken_late(60000);

    expect_same(&prompt, &late);
    expect_same(&prompt, &very_late);
    expect_defined(&prompt, SHEF_SNAPSHOT_CENTRED);
}

static void test_a_lost_trigger_is_predicted_flagged_and_exact_at_its_instant(void)
{
    make_stream(3u << (2 * 4)); /* both edges of frame 4 */
    start(SHEF_SNAPSHOT_CENTRED);
    feed_all_in(5000);
    TEST_ASSERT_EQUAL_UINT64(1, shef_snapshots_stats(snapshots).n_predicted);
    for (int i = 0; i < N_FRAMES; i++) {
        const struct copy *copy = copy_of((uint64_t)i);

        TEST_ASSERT_EQUAL_HEX32(i == 4 ? SHEF_SNAPSHOT_PREDICTED | SHEF_SNAPSHOT_NO_FALL : 0,
                                copy->snapshot.flags);
        TEST_ASSERT_EQUAL_INT64((START_US + rise_us(i)) * 1000 + EXPOSURE_US * 500,
                                copy->snapshot.mid.ns);
        expect_defined(copy, SHEF_SNAPSHOT_CENTRED);
    }
}

static void test_a_lost_edge_of_one_kind_is_made_up_for_by_the_other(void)
{
    make_stream(1u << (2 * 4) | 2u << (2 * 6)); /* frame 4 does not rise, frame 6 does not fall */
    start(SHEF_SNAPSHOT_CENTRED);
    feed_all_in(5000);
    TEST_ASSERT_EQUAL_HEX32(SHEF_SNAPSHOT_PREDICTED, copy_of(4)->snapshot.flags);
    TEST_ASSERT_EQUAL_HEX32(SHEF_SNAPSHOT_NO_FALL, copy_of(6)->snapshot.flags);
    TEST_ASSERT_EQUAL_INT64(2000, copy_of(4)->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_INT64(2000, copy_of(6)->snapshot.t_err_ns);
}

static void test_a_falling_edge_that_differs_goes_into_the_stated_error(void)
{
    make_stream(2u << (2 * 4));
    add_trigger(rise_us(4) + EXPOSURE_US + 800, 0, false);
    /* Triggers come in the order of the stream. */
    for (uint32_t i = n_triggers - 1; i > 0 && triggers[i].t_us < triggers[i - 1].t_us; i--) {
        const struct shef_trigger swapped = triggers[i];

        triggers[i] = triggers[i - 1];
        triggers[i - 1] = swapped;
    }
    start(SHEF_SNAPSHOT_CENTRED);
    feed_all_in(5000);

    const struct copy *copy = copy_of(4);

    TEST_ASSERT_EQUAL_HEX32(0, copy->snapshot.flags);
    TEST_ASSERT_EQUAL_INT64((EXPOSURE_US + 800) * 1000, copy->snapshot.exposure_ns);
    TEST_ASSERT_EQUAL_INT64(2000 + 400000, copy->snapshot.t_err_ns);
    expect_defined(copy, SHEF_SNAPSHOT_CENTRED);
    /* The next one is taken where the new exposure puts it, and its own edge corrects it. */
    TEST_ASSERT_EQUAL_INT64((START_US + rise_us(5)) * 1000 + (EXPOSURE_US + 800) * 500,
                            copy_of(5)->snapshot.mid.ns);
}

static void test_a_trigger_that_comes_after_its_instant_is_flagged(void)
{
    make_stream(0);
    n_triggers = 0;
    add_trigger(rise_us(0), 0, true);
    /* Sent 4 ms late, 1.5 ms after mid-exposure. */
    while (events[triggers[0].n_before].t_us < rise_us(0) + 4000)
        triggers[0].n_before++;
    start(SHEF_SNAPSHOT_AT_MID);
    feed_all_in(1000);

    const struct copy *copy = copy_of(0);

    TEST_ASSERT_BITS(SHEF_SNAPSHOT_LATE_TRIGGER, SHEF_SNAPSHOT_LATE_TRIGGER, copy->snapshot.flags);
    TEST_ASSERT_GREATER_THAN_INT64(1400000, copy->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_UINT64(1, shef_snapshots_stats(snapshots).n_late);
}

static void test_a_quiet_stream_still_gives_its_snapshot(void)
{
    struct shef_event_batch batch = { 0 };

    make_stream(0);
    n_triggers = 2;
    n_events = triggers[0].n_before; /* nothing moves any more */
    start(SHEF_SNAPSHOT_CENTRED);
    feed(0, n_events);
    TEST_ASSERT_EQUAL_UINT64(0, shef_snapshot_pool_end(shef_snapshots_pool(snapshots)));
    batch.base_us = START_US;
    batch.triggers[0] = triggers[1];
    batch.triggers[0].n_before = 0;
    batch.n_triggers = 1;
    batch.reached_us = START_US + rise_us(0) + EXPOSURE_US / 2 + 25000 + 5000;
    TEST_ASSERT_EQUAL_UINT32(0, shef_snapshots_feed(snapshots, &batch));
    batch.n_triggers = 0;
    batch.reached_us += 2;
    TEST_ASSERT_EQUAL_UINT32(1, shef_snapshots_feed(snapshots, &batch));
    TEST_ASSERT_EQUAL_HEX32(0, copy_of(0)->snapshot.flags);
    expect_defined(copy_of(0), SHEF_SNAPSHOT_CENTRED);
}

static void test_a_jump_back_in_time_drops_what_is_open_and_goes_on(void)
{
    uint32_t jump = 0;

    make_stream(0);
    /* After frame 3's mid-exposure the camera's time starts anew, 3 s earlier. */
    while (events[jump].t_us < rise_us(3) + 4000)
        jump++;
    for (uint32_t i = 0; i < n_events; i++)
        events[i].t_us += i < jump ? 3000000 : 0;
    for (uint32_t i = 0; i < n_triggers; i++)
        triggers[i].t_us += triggers[i].n_before <= jump ? 3000000 : 0;
    start(SHEF_SNAPSHOT_CENTRED);
    feed_all_in(1000);

    const struct shef_snapshot_stats stats = shef_snapshots_stats(snapshots);

    TEST_ASSERT_EQUAL_UINT32(1, shef_filter_stats(filter).n_epochs);
    /* Frame 2 was not complete yet either. */
    TEST_ASSERT_EQUAL_UINT64(2, stats.n_dropped);
    TEST_ASSERT_EQUAL_UINT64(N_FRAMES - 2, stats.n_published);
    TEST_ASSERT_EQUAL_UINT32(0, copy_of(1)->snapshot.epoch);
    TEST_ASSERT_EQUAL_UINT32(1, copy_of(4)->snapshot.epoch);
    TEST_ASSERT_EQUAL_INT64((START_US + rise_us(4)) * 1000 + EXPOSURE_US * 500,
                            copy_of(4)->snapshot.mid.ns);
    TEST_ASSERT_EQUAL_HEX32(0, copy_of(4)->snapshot.flags);
}

static void test_a_full_pool_loses_snapshots_and_recovers(void)
{
    struct shef_snapshot_params params = params_of(SHEF_SNAPSHOT_AT_MID);
    const struct shef_snapshot *held[4];
    uint32_t at = 0;

    make_stream(0);
    params.n_snapshots = 4;
    start_with(&params);
    for (int i = 0; i < 4; i++) {
        while (shef_snapshot_pool_take(shef_snapshots_pool(snapshots), (uint64_t)i, &held[i]) !=
               SHEF_OK) {
            feed(at, at + 50);
            at += 50;
        }
    }
    while (events[at].t_us < rise_us(6) - 2000) {
        feed(at, at + 50);
        at += 50;
    }
    TEST_ASSERT_EQUAL_UINT64(2, shef_snapshots_stats(snapshots).n_lost);
    for (int i = 0; i < 4; i++)
        shef_snapshot_pool_give(shef_snapshots_pool(snapshots), held[i]);
    feed(at, n_events);
    TEST_ASSERT_EQUAL_UINT64(6, shef_snapshots_stats(snapshots).n_published);
    expect_defined(copy_of(6), SHEF_SNAPSHOT_AT_MID);
    expect_defined(copy_of(7), SHEF_SNAPSHOT_AT_MID);
    TEST_ASSERT_EQUAL(SHEF_ERR_GONE,
                      shef_snapshot_pool_take(shef_snapshots_pool(snapshots), 4, &held[0]));
}

static void test_only_the_chosen_channel_and_level_count(void)
{
    struct shef_snapshot_params params = params_of(SHEF_SNAPSHOT_AT_MID);

    make_stream(0);
    for (uint32_t i = 0; i < n_triggers; i++) {
        triggers[i].channel = (uint8_t)(i / 2 % 2 ? 3 : 6);
        triggers[i].rising = !triggers[i].rising;
    }
    params.channel = 3;
    params.is_inverted = true;
    start_with(&params);
    feed(0, n_events);
    TEST_ASSERT_EQUAL_UINT64(N_FRAMES, shef_snapshots_stats(snapshots).n_triggers);
    TEST_ASSERT_EQUAL_UINT64(N_FRAMES / 2, shef_snapshots_stats(snapshots).n_published);
    TEST_ASSERT_EQUAL_INT64((START_US + rise_us(1)) * 1000, copy_of(0)->snapshot.rise.ns);
    TEST_ASSERT_EQUAL_INT64((START_US + rise_us(3)) * 1000, copy_of(1)->snapshot.rise.ns);
}

static void test_hot_pixels_are_learnt_and_gone_from_snapshots_whatever_the_slicing(void)
{
    static const uint32_t sizes[] = { N_EVENTS, 1, 333 };
    struct shef_hot_pixels_params hot_params = shef_hot_pixels_default_params(WIDTH_PX, HEIGHT_PX);
    const uint32_t hot_pixel = 10 * WIDTH_PX + 20;
    struct copy whole[N_FRAMES];
    uint32_t hot_sum = 0;

    make_stream(0);
    for (uint32_t i = 0; i < n_events; i += 40) {
        events[i].x_px = 20;
        events[i].y_on = 10 | SHEF_EVENT_ON;
    }
    hot_params.limit_per_s = 5000;
    hot_params.window_ms = 20;
    for (int s = 0; s < 3; s++) {
        struct shef_error err = { 0 };

        tearDown();
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_hot_pixels_create(&hot, &hot_params, &err),
                                  err.text);
        start(SHEF_SNAPSHOT_CENTRED);
        feed_all_in(sizes[s]);
        for (int i = 0; i < N_FRAMES; i++) {
            if (s == 0)
                whole[i] = *copy_of((uint64_t)i);
            else
                expect_same(&whole[i], copy_of((uint64_t)i));
        }
    }
    TEST_ASSERT_GREATER_THAN_INT16(50 * 256, whole[0].values[hot_pixel]);
    TEST_ASSERT_EQUAL_INT16(0, whole[4].values[hot_pixel]);
    TEST_ASSERT_EQUAL_INT16(0, whole[4].sums[hot_pixel]);
    for (int p = 0; p < N_PIXELS; p++)
        hot_sum += whole[4].values[p] != 0;
    TEST_ASSERT_GREATER_THAN_UINT32(N_PIXELS * 9 / 10, hot_sum);
}

static void expect_refused(struct shef_snapshot_params params, const char *reason)
{
    struct shef_snapshots *made = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_snapshots_create(&made, filter, NULL, &params, &err));
    TEST_ASSERT_NULL(made);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_sentence(void)
{
    struct shef_snapshot_params params = shef_snapshot_default_params();

    start(SHEF_SNAPSHOT_CENTRED);
    params.channel = 32;
    expect_refused(params, "channels 0 to 31");
    params = shef_snapshot_default_params();
    params.n_steps = 5;
    expect_refused(params, "there can be 1 to 4");
    params = shef_snapshot_default_params();
    params.exposure_ns = -1;
    expect_refused(params, "must be 0 to 1 s");
    params = shef_snapshot_default_params();
    params.max_predicted = 2000;
    expect_refused(params, "0 to 1000");
    params = shef_snapshot_default_params();
    params.n_snapshots = 2;
    expect_refused(params, "4 to 64");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_snapshot_holds_the_events_up_to_its_instant_and_no_others);
    RUN_TEST(test_slicing_the_stream_changes_no_bit);
    RUN_TEST(test_frames_0_20_and_60_ms_late_get_the_same_bits);
    RUN_TEST(test_a_lost_trigger_is_predicted_flagged_and_exact_at_its_instant);
    RUN_TEST(test_a_lost_edge_of_one_kind_is_made_up_for_by_the_other);
    RUN_TEST(test_a_falling_edge_that_differs_goes_into_the_stated_error);
    RUN_TEST(test_a_trigger_that_comes_after_its_instant_is_flagged);
    RUN_TEST(test_a_quiet_stream_still_gives_its_snapshot);
    RUN_TEST(test_a_jump_back_in_time_drops_what_is_open_and_goes_on);
    RUN_TEST(test_a_full_pool_loses_snapshots_and_recovers);
    RUN_TEST(test_only_the_chosen_channel_and_level_count);
    RUN_TEST(test_hot_pixels_are_learnt_and_gone_from_snapshots_whatever_the_slicing);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_sentence);
    return UNITY_END();
}
