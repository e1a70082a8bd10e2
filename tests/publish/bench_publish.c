/* What publishing costs: bytes and time of each message, at several densities.
 *
 *   bench_publish [URL]    memq:// unless said; e.g. udpm://239.255.76.67:7667?ttl=0 */
#include <stdio.h>
#include <stdlib.h>

#include "made_result.h"
#include "publish/publisher.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480
#define N_TIMES   200

static struct shef_error err;

static void fail(void)
{
    fprintf(stderr, "bench_publish: %s\n", err.text);
    exit(1);
}

static void measure(const char *url, struct shef_result_pool *pool, enum shef_channel channel,
                    int32_t grid_step, double density)
{
    const struct shef_publisher_params params = {
        .url = url,
        .prefix = "BENCH",
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .outputs = SHEF_OUTPUT(channel),
        .grid_step = grid_step,
        .clock = shef_clock_monotonic(),
    };
    struct shef_test_random random = { 1 };
    struct shef_publisher *publisher;
    struct shef_publisher_stats stats;
    struct shef_result *result = shef_result_take(pool);
    int64_t best_ns = INT64_MAX;

    if (shef_publisher_create(&publisher, &params, &err) || shef_publisher_connect(publisher, &err))
        fail();
    made_result_fill(result, 0, density, &random);
    for (int i = 0; i < N_TIMES; i++) {
        const shef_host_time began = shef_clock_now(params.clock);

        shef_result_share(result); /* the publisher's holder; ours keeps it */
        shef_publisher_result(publisher, result);

        const int64_t took_ns = shef_host_time_since(shef_clock_now(params.clock), began);

        best_ns = took_ns < best_ns ? took_ns : best_ns;
    }
    shef_publisher_stats(publisher, &stats);

    const struct shef_publisher_channel_stats *seen = &stats.channels[channel];

    printf("%-10s  %d  %5.1f  %4.1f  %9.0f  %7llu  %8.1f\n", shef_channel_name(channel), grid_step,
           100.0 * density, (double)seen->n_messages / N_TIMES, (double)seen->n_bytes / N_TIMES,
           (unsigned long long)seen->max_bytes, (double)best_ns / 1000.0);
    shef_result_give(result);
    shef_publisher_destroy(publisher);
}

int main(int argc, char **argv)
{
    const char *url = argc > 1 ? argv[1] : "memq://";
    const double densities[] = { 0.02, 0.05, 0.10, 0.25 }; /* of pixels with a disparity */
    struct shef_result_pool *pool = shef_result_pool_create(1, WIDTH_PX, HEIGHT_PX, 1, &err);

    if (!pool)
        fail();
    printf("channel  step  px %%  messages  bytes a frame  largest  us a frame (least of %d)\n",
           N_TIMES);
    measure(url, pool, SHEF_CHANNEL_POSE, 2, 0.05);
    for (size_t i = 0; i < sizeof densities / sizeof densities[0]; i++)
        for (int32_t step = 2; step >= 1; step--) {
            measure(url, pool, SHEF_CHANNEL_DISPARITY, step, densities[i]);
            measure(url, pool, SHEF_CHANNEL_DEPTH, step, densities[i]);
        }
    measure(url, pool, SHEF_CHANNEL_CLOUD, 2, 0.05);
    measure(url, pool, SHEF_CHANNEL_DENSE, 2, 0.05);
    measure(url, pool, SHEF_CHANNEL_DENSE, 1, 0.05);
    shef_result_pool_destroy(pool);
    return 0;
}
