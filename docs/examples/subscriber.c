/* Prints the nearest depth in every message.  Build: see docs/lcm.md */
#include <stdio.h>

#include <lcm/lcm.h>
#include <shef_lcm_decode.h>

static void on_depth(const lcm_recv_buf_t *rbuf, const char *channel, void *context)
{
    static float depth_m[640 * 480], sigma_m[640 * 480];
    struct shef_lcm_grid grid;
    int nearest = -1;

    (void)context;
    if (shef_lcm_decode_depth(rbuf->data, rbuf->data_size, &grid) || grid.grid_w > 640 ||
        grid.grid_h > 480)
        return;
    shef_lcm_grid_images(&grid, depth_m, sigma_m); /* rows first_row .. first_row + n_rows - 1 */
    for (int i = grid.first_row * grid.grid_w; i < (grid.first_row + grid.n_rows) * grid.grid_w;
         i++)
        if (depth_m[i] > 0 && (nearest < 0 || depth_m[i] < depth_m[nearest]))
            nearest = i;
    printf("%s %lld: %d points", channel, (long long)grid.header.seq, grid.n_points);
    if (nearest >= 0)
        printf(", nearest %.4f m +- %.4f", depth_m[nearest], sigma_m[nearest]);
    putchar('\n');
    fflush(stdout);
}

int main(void)
{
    lcm_t *lcm = lcm_create("udpm://239.255.76.67:7667?recv_buf_size=2097152");

    if (!lcm)
        return 1;
    lcm_subscribe(lcm, "SHEF_DEPTH", on_depth, NULL);
    while (lcm_handle(lcm) == 0)
        continue;
    return 1;
}
