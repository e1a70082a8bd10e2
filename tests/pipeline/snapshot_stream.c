#include "snapshot_stream.h"

#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "filter_model.h"

struct shef_event stream_events[STREAM_N_EVENTS];
uint32_t stream_n_events;
struct shef_trigger stream_triggers[STREAM_MAX_TRIGGERS];
uint32_t stream_n_triggers;
struct shef_filter *stream_filter;
struct shef_hot_pixels *stream_hot;
struct shef_snapshots *stream_snapshots;

void stream_stop(void)
{
    shef_snapshots_destroy(stream_snapshots);
    shef_hot_pixels_destroy(stream_hot);
    shef_filter_destroy(stream_filter);
    stream_snapshots = NULL;
    stream_hot = NULL;
    stream_filter = NULL;
}

uint32_t stream_rise_us(int i)
{
    return 30000 + (uint32_t)i * STREAM_PERIOD_US;
}

static void make_events(void)
{
    struct shef_test_random random = { 7 };
    uint32_t t_us = 0;

    for (stream_n_events = 0; stream_n_events < STREAM_N_EVENTS; stream_n_events++) {
        t_us += (uint32_t)shef_test_random_range(&random, 0, 6);
        stream_events[stream_n_events] =
            shef_event_make(t_us, (uint32_t)shef_test_random_range(&random, 0, STREAM_WIDTH_PX - 1),
                            (uint32_t)shef_test_random_range(&random, 0, STREAM_HEIGHT_PX - 1),
                            shef_test_random_range(&random, 0, 2) != 0);
    }
    stream_n_triggers = 0;
}

void stream_add_trigger(uint32_t t_us, int channel, bool rising)
{
    uint32_t n_before = 0;

    while (n_before < stream_n_events && stream_events[n_before].t_us <= t_us)
        n_before++;
    TEST_ASSERT_LESS_THAN_UINT32(STREAM_MAX_TRIGGERS, stream_n_triggers);
    stream_triggers[stream_n_triggers++] = (struct shef_trigger){
        .t_us = STREAM_START_US + t_us,
        .n_before = n_before,
        .channel = (uint8_t)channel,
        .rising = rising,
    };
}

/* All frames but the edges left out, as bits 2 * i (rise) and 2 * i + 1 (fall). */
void stream_make(uint32_t left_out)
{
    make_events();
    for (int i = 0; i < STREAM_N_FRAMES; i++) {
        if (!(left_out >> (2 * i) & 1))
            stream_add_trigger(stream_rise_us(i), 0, true);
        if (!(left_out >> (2 * i + 1) & 1))
            stream_add_trigger(stream_rise_us(i) + STREAM_EXPOSURE_US, 0, false);
    }
}

void stream_start_with(const struct shef_snapshot_params *params)
{
    const struct shef_filter_params sensor =
        shef_filter_default_params(STREAM_WIDTH_PX, STREAM_HEIGHT_PX);
    struct shef_error err = { 0 };

    shef_snapshots_destroy(stream_snapshots);
    shef_filter_destroy(stream_filter);
    stream_snapshots = NULL;
    stream_filter = shef_test_filter(&sensor);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_snapshots_create(&stream_snapshots, stream_filter, stream_hot, params, &err),
        err.text);
}

struct shef_snapshot_params stream_params(enum shef_snapshot_read read)
{
    struct shef_snapshot_params params = shef_snapshot_default_params();

    params.read = read;
    params.n_snapshots = 16;
    params.exposure_ns = STREAM_EXPOSURE_US * 1000;
    params.max_predicted = read == SHEF_SNAPSHOT_CENTRED ? 4 : 0;
    return params;
}

void stream_start(enum shef_snapshot_read read)
{
    const struct shef_snapshot_params params = stream_params(read);

    stream_start_with(&params);
}

uint32_t stream_feed(uint32_t first, uint32_t end)
{
    struct shef_event_batch batch = { .n_events = end - first };
    struct shef_event *sent = malloc((end - first + 1) * sizeof *sent);

    TEST_ASSERT_NOT_NULL(sent);
    /* Each batch has a base of its own. */
    batch.base_us = STREAM_START_US - first % 10 * 1000;
    for (uint32_t i = first; i < end; i++) {
        sent[i - first] = stream_events[i];
        sent[i - first].t_us = (uint32_t)(STREAM_START_US + stream_events[i].t_us - batch.base_us);
    }
    batch.events = sent;
    batch.reached_us = STREAM_START_US + (end > 0 ? stream_events[end - 1].t_us : 0);
    for (uint32_t i = 0; i < stream_n_triggers; i++)
        if (stream_triggers[i].n_before > first || (first == 0 && stream_triggers[i].n_before == 0))
            if (stream_triggers[i].n_before <= end) {
                batch.triggers[batch.n_triggers] = stream_triggers[i];
                batch.triggers[batch.n_triggers++].n_before -= first;
            }

    const uint32_t n_published = shef_snapshots_feed(stream_snapshots, &batch);

    free(sent);
    return n_published;
}

void stream_feed_all_in(uint32_t n_at_once)
{
    for (uint32_t first = 0; first < stream_n_events; first += n_at_once)
        stream_feed(first,
                    first + n_at_once < stream_n_events ? first + n_at_once : stream_n_events);
}

static void copy_image(int16_t *out, struct shef_image_i16 image)
{
    for (int32_t y = 0; y < STREAM_HEIGHT_PX; y++)
        memcpy(out + y * STREAM_WIDTH_PX, shef_row_i16(image, y), STREAM_WIDTH_PX * sizeof *out);
}

struct stream_copy *stream_copy_of(uint64_t number)
{
    static struct stream_copy copies[3 * STREAM_N_FRAMES];
    static int next;
    struct stream_copy *copy = &copies[next++ % (3 * STREAM_N_FRAMES)];
    const struct shef_snapshot *snapshot;

    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_snapshot_pool_take(shef_snapshots_pool(stream_snapshots), number, &snapshot));
    copy->snapshot = *snapshot;
    copy_image(copy->values, snapshot->values);
    copy_image(copy->sums, snapshot->sums);
    shef_snapshot_pool_give(shef_snapshots_pool(stream_snapshots), snapshot);
    return copy;
}

void stream_expect_same(const struct stream_copy *a, const struct stream_copy *b)
{
    TEST_ASSERT_EQUAL_UINT64(a->snapshot.number, b->snapshot.number);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.rise.ns, b->snapshot.rise.ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.mid.ns, b->snapshot.mid.ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.exposure_ns, b->snapshot.exposure_ns);
    TEST_ASSERT_EQUAL_INT64(a->snapshot.t_err_ns, b->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_HEX32(a->snapshot.flags, b->snapshot.flags);
    TEST_ASSERT_EQUAL_UINT64(a->snapshot.n_events, b->snapshot.n_events);
    TEST_ASSERT_EQUAL_INT16_ARRAY(a->values, b->values, STREAM_N_PIXELS);
    TEST_ASSERT_EQUAL_INT16_ARRAY(a->sums, b->sums, STREAM_N_PIXELS);
}

/* A filter of its own that has seen the events up to an instant and no others. */
static struct shef_filter *filter_until(int64_t at_ns, uint64_t *out_n_events)
{
    const struct shef_filter_params sensor =
        shef_filter_default_params(STREAM_WIDTH_PX, STREAM_HEIGHT_PX);
    struct shef_filter *other = shef_test_filter(&sensor);
    uint32_t n = 0;

    while (n < stream_n_events && (STREAM_START_US + stream_events[n].t_us) * 1000 <= at_ns)
        n++;
    if (n > 0)
        TEST_ASSERT_EQUAL_UINT32(
            n, shef_filter_apply(other, stream_events, n, STREAM_START_US, SHEF_TEST_FOREVER));
    *out_n_events = n;
    return other;
}

static struct shef_image_i16 image_create(void)
{
    struct shef_image_i16 image;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_image_create_i16(&image, STREAM_WIDTH_PX, STREAM_HEIGHT_PX, NULL));
    return image;
}

void stream_expect_defined(const struct stream_copy *copy, enum shef_snapshot_read read)
{
    static const double ends[] = { 0, .5, 1.1, 2, 3 };
    static const int16_t weights_q15[] = { 0, 25786, 14945, 7192,
                                           2803 }; /* mean of exp(-t), 2^15 */
    const int64_t mid_ns = copy->snapshot.mid.ns;
    const int64_t lag_ns = shef_filter_lag_ns(stream_filter);
    struct shef_image_i16 values = image_create();
    struct shef_image_i16 sums = image_create();
    struct shef_image_i16 later = image_create();
    uint64_t n_before_mid;
    uint64_t n;
    struct shef_filter *other = filter_until(mid_ns, &n_before_mid);

    shef_filter_read(other, (shef_event_time){ mid_ns }, values);
    shef_filter_read_sums(other, sums);
    TEST_ASSERT_EQUAL_UINT64(n_before_mid, copy->snapshot.n_events);
    for (int32_t y = 0; y < STREAM_HEIGHT_PX; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(sums, y), copy->sums + y * STREAM_WIDTH_PX,
                                      STREAM_WIDTH_PX);
    shef_filter_destroy(other);
    if (read == SHEF_SNAPSHOT_LATE) {
        other = filter_until(mid_ns + lag_ns, &n);
        shef_filter_read(other, (shef_event_time){ mid_ns + lag_ns }, values);
        shef_filter_destroy(other);
    }
    for (int k = 1; read == SHEF_SNAPSHOT_CENTRED && k < 5; k++) {
        other = filter_until(mid_ns + (int64_t)(ends[k] * (double)lag_ns + .5), &n);
        shef_filter_read_sums(other, later);
        for (int32_t y = 0; y < STREAM_HEIGHT_PX; y++)
            for (int32_t x = 0; x < STREAM_WIDTH_PX; x++) {
                const int32_t gained = shef_row_i16(later, y)[x] - shef_row_i16(sums, y)[x];

                shef_row_i16(values, y)[x] =
                    (int16_t)(shef_row_i16(values, y)[x] +
                              ((gained * weights_q15[k] + (1 << 14)) >> 15));
                shef_row_i16(sums, y)[x] = shef_row_i16(later, y)[x];
            }
        shef_filter_destroy(other);
    }
    for (int32_t y = 0; y < STREAM_HEIGHT_PX; y++)
        TEST_ASSERT_EQUAL_INT16_ARRAY(shef_row_i16(values, y), copy->values + y * STREAM_WIDTH_PX,
                                      STREAM_WIDTH_PX);
    shef_image_destroy_i16(&values);
    shef_image_destroy_i16(&sums);
    shef_image_destroy_i16(&later);
}
