#include "sheftool/progress.h"

#include <inttypes.h>
#include <stdio.h>
#include <unistd.h>

#include "sheftool/stopwatch.h"

#define WORTH_SHOWING_NS INT64_C(1000000000)
#define FIRST_LOOK_NS    INT64_C(200000000) /* before that, no forecast is worth making */
#define REDRAW_NS        INT64_C(100000000)
#define BAR_CELLS        30

void shef_progress_begin(struct shef_progress *progress, const char *what, int64_t n_total)
{
    *progress = (struct shef_progress){
        .what = what,
        .n_total = n_total > 0 ? n_total : 1,
        .start_ns = shef_monotonic_ns(),
        .terminal = isatty(STDERR_FILENO) == 1,
    };
}

void shef_progress_step(struct shef_progress *progress, int64_t n_done)
{
    if (!progress->terminal || n_done < 1)
        return;

    const int64_t now_ns = shef_monotonic_ns();
    const int64_t spent_ns = now_ns - progress->start_ns;
    const double share = (double)n_done / (double)progress->n_total;

    if (!progress->drawn_ns &&
        (spent_ns < FIRST_LOOK_NS || (double)spent_ns / share < (double)WORTH_SHOWING_NS))
        return;
    if (progress->drawn_ns && now_ns - progress->drawn_ns < REDRAW_NS)
        return;
    progress->drawn_ns = now_ns;

    static const char full[BAR_CELLS + 1] = "##############################";
    const int n_cells = (int)(share * BAR_CELLS);
    const double left_s = (double)spent_ns * (1.0 / share - 1.0) / 1e9;

    fprintf(stderr, "\r%s [%.*s%*s] %" PRId64 "/%" PRId64 ", %.0f s left \033[K", progress->what,
            n_cells, full, BAR_CELLS - n_cells, "", n_done, progress->n_total, left_s);
    fflush(stderr);
}

void shef_progress_end(struct shef_progress *progress)
{
    if (progress->drawn_ns)
        fprintf(stderr, "\r\033[K");
    progress->drawn_ns = 0;
}
