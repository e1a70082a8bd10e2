#include "sheftool/match_summary.h"

#include <inttypes.h>

/* Good pairs have about 0.9, swapped cameras 0.3 to 0.75: a lower value is surely wrong, a higher
 * one not surely right. */
#define LOW_CONFIDENCE 0.4

static void add_row(struct shef_match_summary *summary, const struct shef_matched *matched,
                    int32_t y)
{
    const struct shef_edge_map *frame = matched->frame;
    const uint64_t *edges = frame->plus + (size_t)y * (size_t)frame->stride_words;
    const float *disparity = shef_row_f32(matched->disparity, y);
    const float *confidence =
        matched->confidence.data ? shef_row_f32(matched->confidence, y) : NULL;

    for (int32_t x = 0; x < frame->width_px; x++) {
        if (!(edges[x / 64] >> (x % 64) & 1))
            continue;
        summary->n_edges++;
        if (disparity[x] <= 0)
            continue;
        summary->n_matched++;
        if (confidence)
            summary->sum_confidence += confidence[x];
    }
}

void shef_match_summary_add(struct shef_match_summary *summary, const struct shef_matched *matched)
{
    for (int32_t y = 0; y < matched->frame->height_px; y++)
        add_row(summary, matched, y);
    summary->n_pairs++;
    summary->has_confidence = matched->confidence.data != NULL;
    summary->has_report = matched->report != NULL;
    if (matched->report) {
        summary->n_saturated += matched->report->is_saturated;
        summary->n_scene_cuts += matched->report->is_cut;
    }
    if (shef_edge_map_count(matched->event) == 0 && summary->n_empty++ == 0)
        summary->first_empty = matched->number;
}

static double share(double part, int64_t whole)
{
    return whole > 0 ? part / (double)whole : 0;
}

void shef_match_summary_print(const struct shef_match_summary *summary, FILE *out)
{
    fprintf(out, "frame edges matched: %.1f %%",
            100 * share((double)summary->n_matched, summary->n_edges));
    if (summary->has_confidence)
        fprintf(out, ", mean confidence %.2f", share(summary->sum_confidence, summary->n_matched));
    fprintf(out, "; event maps empty: %" PRId64, summary->n_empty);
    if (summary->has_report)
        fprintf(out, ", saturated: %" PRId64 "; scene cuts: %" PRId64, summary->n_saturated,
                summary->n_scene_cuts);
    fputc('\n', out);
}

void shef_match_summary_warn(const struct shef_match_summary *summary, FILE *out)
{
    if (summary->n_empty > 0)
        fprintf(out,
                "sheftool match: warning: %" PRId64 " of %" PRId64
                " event maps are empty (the first is pair %" PRId64 "); they have no estimates\n",
                summary->n_empty, summary->n_pairs, summary->first_empty);
    if (summary->has_confidence && summary->n_matched > 0 &&
        share(summary->sum_confidence, summary->n_matched) < LOW_CONFIDENCE)
        fprintf(out,
                "sheftool match: warning: the mean confidence is below %.1f; check that the maps "
                "are rectified, the frame camera is the left one and the numbers pair up\n",
                LOW_CONFIDENCE);
}
