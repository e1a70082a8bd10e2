#include "pipeline/kernels/rectify.h"

#include "core/cpu.h"
#include "kernel_check.h"

#define ONE          (1 << SHEF_RECTIFY_FRACTION_BITS)
#define MAX_CELLS    300
#define N_ROWS       40
#define MAX_SEGMENTS 30

/* Black and white pixels are as frequent as all others together. */
static uint8_t any_pixel(void)
{
    const int32_t kind = any(0, 3);

    return (uint8_t)(kind == 0 ? 0 : kind == 1 ? 255 : any(0, 255));
}

static void test_cells_equal_the_reference(void)
{
    for (int round = 0; round < 200; round++) {
        const int32_t n = any(0, MAX_CELLS);
        uint8_t pixels[2][2 * MAX_CELLS];
        uint16_t expected[MAX_CELLS];
        uint16_t widened[MAX_CELLS];

        for (int32_t i = 0; i < 2 * MAX_CELLS; i++)
            for (int row = 0; row < 2; row++)
                pixels[row][i] = any_pixel();
        shef_rectify_kernels_c.sum_cells(expected, pixels[0], pixels[1], n);
        shef_rectify_kernels_c.widen(widened, pixels[0], n);
        for (int k = 0; k < n_features; k++) {
            uint16_t actual[MAX_CELLS + 1];

            actual[n] = 7777;
            shef_rectify_pick(features[k])->sum_cells(actual, pixels[0], pixels[1], n);
            for (int32_t i = 0; i < n; i++)
                TEST_ASSERT_EQUAL_UINT16(expected[i], actual[i]);
            TEST_ASSERT_EQUAL_UINT16(7777, actual[n]);
            shef_rectify_pick(features[k])->widen(actual, pixels[0], n);
            for (int32_t i = 0; i < n; i++)
                TEST_ASSERT_EQUAL_UINT16(widened[i], actual[i]);
            TEST_ASSERT_EQUAL_UINT16(7777, actual[n]);
        }
    }
}

static struct shef_rectify_segment any_segment(struct shef_rectify_position *scattered, int32_t s)
{
    struct shef_rectify_segment segment = { .form = (uint16_t)any(0, 9) };

    if (segment.form >= SHEF_RECTIFY_SCATTERED)
        segment.form = segment.form == 9 ? SHEF_RECTIFY_SCATTERED : SHEF_RECTIFY_TWO_ROWS;
    if (segment.form == SHEF_RECTIFY_SCATTERED) {
        segment.at.scattered = s * SHEF_RECTIFY_SEGMENT_PX;
        for (int j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++)
            scattered[s * SHEF_RECTIFY_SEGMENT_PX + j] = (struct shef_rectify_position){
                any(0, 3) ? any(0, (MAX_CELLS - 1) * ONE) : -1,
                any(0, (N_ROWS - 1) * ONE - 1),
            };
        return segment;
    }
    segment.at.first_x[0] = (int16_t)any(0, MAX_CELLS - 1);
    segment.at.first_x[1] = (int16_t)any(0, MAX_CELLS - 1);
    segment.first_y = (int16_t)any(0, N_ROWS - 3);
    for (int j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++) {
        segment.x[j] = (uint16_t)any(0, 7 * ONE - 1);
        segment.y[j] =
            (uint16_t)any(0, (segment.form == SHEF_RECTIFY_THREE_ROWS ? 2 : 1) * ONE - 1);
    }
    return segment;
}

static void test_rows_equal_the_reference(void)
{
    static uint16_t cells[N_ROWS][MAX_CELLS + SHEF_RECTIFY_PAD_CELLS];
    static struct shef_rectify_position scattered[MAX_SEGMENTS * SHEF_RECTIFY_SEGMENT_PX];
    const uint16_t *rows[N_ROWS];
    int n_scattered = 0;

    for (int y = 0; y < N_ROWS; y++) {
        rows[y] = cells[y];
        for (int x = 0; x < MAX_CELLS + SHEF_RECTIFY_PAD_CELLS; x++)
            cells[y][x] = (uint16_t)(any(0, 2) ? any(0, 1) * SHEF_RECTIFY_CELL_MAX
                                               : any(0, SHEF_RECTIFY_CELL_MAX));
    }
    for (int round = 0; round < 300; round++) {
        struct shef_rectify_segment segments[MAX_SEGMENTS];
        uint8_t expected[MAX_SEGMENTS * SHEF_RECTIFY_SEGMENT_PX];
        const int32_t n = any(1, MAX_SEGMENTS);

        for (int32_t s = 0; s < n; s++) {
            segments[s] = any_segment(scattered, s);
            n_scattered += segments[s].form == SHEF_RECTIFY_SCATTERED;
        }
        shef_rectify_kernels_c.row(expected, segments, n, rows, scattered);
        for (int k = 0; k < n_features; k++) {
            uint8_t actual[MAX_SEGMENTS * SHEF_RECTIFY_SEGMENT_PX + 1];

            actual[n * SHEF_RECTIFY_SEGMENT_PX] = 77;
            shef_rectify_pick(features[k])->row(actual, segments, n, rows, scattered);
            TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, actual, n * SHEF_RECTIFY_SEGMENT_PX);
            TEST_ASSERT_EQUAL_UINT8(77, actual[n * SHEF_RECTIFY_SEGMENT_PX]);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(100, n_scattered);
}

static void test_the_brightest_cells_give_255_everywhere(void)
{
    uint16_t white[SHEF_RECTIFY_PAD_CELLS];
    const uint16_t *const rows[3] = { white, white, white };
    struct shef_rectify_segment segment = { .form = SHEF_RECTIFY_TWO_ROWS };

    for (int x = 0; x < SHEF_RECTIFY_PAD_CELLS; x++)
        white[x] = SHEF_RECTIFY_CELL_MAX;
    for (int fraction = 0; fraction < ONE; fraction += 3) {
        for (int j = 0; j < SHEF_RECTIFY_SEGMENT_PX; j++) {
            segment.x[j] = (uint16_t)fraction;
            segment.y[j] = (uint16_t)(fraction * 7 % ONE);
        }
        for (int k = 0; k < n_features; k++) {
            uint8_t pixels[SHEF_RECTIFY_SEGMENT_PX];

            shef_rectify_pick(features[k])->row(pixels, &segment, 1, rows, NULL);
            TEST_ASSERT_EACH_EQUAL_UINT8(255, pixels, SHEF_RECTIFY_SEGMENT_PX);
        }
    }
}

static void test_the_best_instruction_set_is_picked(void)
{
    for (int k = 0; k < n_features; k++)
        TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features[k]),
                                 shef_rectify_pick(features[k])->isa);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_cells_equal_the_reference);
    RUN_TEST(test_rows_equal_the_reference);
    RUN_TEST(test_the_brightest_cells_give_255_everywhere);
    RUN_TEST(test_the_best_instruction_set_is_picked);
    return UNITY_END();
}
