#include "sheftool/protocol.h"

#include <stdlib.h>

#include "core/memory.h"

const int shef_level_percent[SHEF_N_LEVELS] = { 25, 50, 75, 100 };

/* One row of everything that is scored. */
struct row {
    const float *disparity;
    const float *confidence; /* NULL: none */
    const float *truth;
    int8_t *edges; /* NULL: not given */
    int8_t edge_memory[SHEF_IMAGE_MAX_SIDE_PX];
};

static void get_row(struct row *row, const struct shef_scored_map *map, int32_t y)
{
    row->disparity = shef_row_f32(map->disparity, y);
    row->confidence = map->confidence.data ? shef_row_f32(map->confidence, y) : NULL;
    row->truth = shef_row_f32(map->truth, y);
    row->edges = map->frame_edges ? row->edge_memory : NULL;
    if (row->edges)
        shef_edge_map_row(map->frame_edges, y, row->edges);
}

static int32_t last_column(const struct shef_scored_map *map)
{
    return map->disparity.width_px - SHEF_LAST_MARGIN_PX;
}

static void add_pixel(struct shef_tally *tally, const struct row *row, int32_t x,
                      const struct shef_score_rules *rules)
{
    shef_tally_add(tally, row->disparity[x], row->truth[x],
                   row->confidence ? row->confidence[x] : -1.0f, &rules->rig);
}

static void add_authors(struct shef_tally *tally, const struct shef_scored_map *map,
                        const struct shef_score_rules *rules)
{
    struct row row;

    for (int32_t y = 0; y < map->disparity.height_px; y++) {
        get_row(&row, map, y);
        for (int32_t x = SHEF_FIRST_COLUMN; x <= last_column(map); x++) {
            if (row.edges && row.edges[x])
                shef_tally_want(tally, row.disparity[x] > 0);
            if (row.disparity[x] > 0 && row.truth[x] > 0)
                add_pixel(tally, &row, x, rules);
        }
    }
    shef_tally_end_image(tally);
}

/* Every pixel with truth, or every one of them on a frame edge. */
static void add_wanted(struct shef_tally *tally, const struct shef_scored_map *map,
                       const struct shef_score_rules *rules, bool edges_only)
{
    struct row row;

    for (int32_t y = 0; y < map->disparity.height_px; y++) {
        get_row(&row, map, y);
        for (int32_t x = SHEF_FIRST_COLUMN; x <= last_column(map); x++) {
            if (!(row.truth[x] > 0 && row.truth[x] < rules->hole_px) ||
                (edges_only && !row.edges[x]))
                continue;
            shef_tally_want(tally, row.disparity[x] > 0);
            if (row.disparity[x] > 0)
                add_pixel(tally, &row, x, rules);
        }
    }
    shef_tally_end_image(tally);
}

static void add_density(struct shef_tally *tally, const struct shef_scored_map *map,
                        const struct shef_score_rules *rules)
{
    add_wanted(tally, map, rules, true);
}

static void add_dense(struct shef_tally *tally, const struct shef_scored_map *map,
                      const struct shef_score_rules *rules)
{
    add_wanted(tally, map, rules, false);
}

const struct shef_protocol shef_protocols[SHEF_N_PROTOCOLS] = {
    [SHEF_AUTHORS] = { "authors", true, false, add_authors },
    [SHEF_DENSITY] = { "density", false, true, add_density },
    [SHEF_DENSE] = { "dense", false, false, add_dense },
};

struct ranked_pixel {
    float confidence;
    float disparity;
    float truth;
    int32_t place; /* in raster order: decides between equal confidences */
};

static int by_confidence(const void *a, const void *b)
{
    const struct ranked_pixel *left = a;
    const struct ranked_pixel *right = b;

    if (left->confidence != right->confidence)
        return left->confidence > right->confidence ? -1 : 1;
    return left->place - right->place;
}

/* Collects the estimates at frame edges with truth; out_n_wanted counts the edges. */
static int64_t collect(struct ranked_pixel *pixels, const struct shef_scored_map *map,
                       const struct shef_score_rules *rules, int64_t *out_n_wanted)
{
    struct row row;
    int64_t n = 0;

    *out_n_wanted = 0;
    for (int32_t y = 0; y < map->disparity.height_px; y++) {
        get_row(&row, map, y);
        for (int32_t x = SHEF_FIRST_COLUMN; x <= last_column(map); x++) {
            if (!row.edges[x] || !(row.truth[x] > 0 && row.truth[x] < rules->hole_px))
                continue;
            (*out_n_wanted)++;
            if (row.disparity[x] > 0)
                pixels[n++] = (struct ranked_pixel){
                    .confidence = row.confidence ? row.confidence[x] : 0,
                    .disparity = row.disparity[x],
                    .truth = row.truth[x],
                    .place = y * map->disparity.width_px + x,
                };
        }
    }
    return n;
}

enum shef_err shef_density_curve_add(struct shef_density_curve *curve,
                                     const struct shef_scored_map *map,
                                     const struct shef_score_rules *rules)
{
    const size_t n_pixels = (size_t)map->disparity.width_px * (size_t)map->disparity.height_px;
    struct ranked_pixel *pixels = malloc(n_pixels * sizeof *pixels);
    int64_t n_wanted;

    if (!pixels)
        return SHEF_ERR_NO_MEMORY;

    const int64_t n_found = collect(pixels, map, rules, &n_wanted);
    const bool ranked = map->confidence.data != NULL;

    if (ranked)
        qsort(pixels, (size_t)n_found, sizeof *pixels, by_confidence);
    curve->ranked = ranked && (curve->ranked || curve->level[SHEF_N_LEVELS - 1].n_images == 0);
    for (int i = ranked ? 0 : SHEF_N_LEVELS - 1; i < SHEF_N_LEVELS; i++) {
        const int64_t n_asked = (n_wanted * shef_level_percent[i] + 50) / 100;
        const int64_t n_kept = n_found < n_asked ? n_found : n_asked;
        struct shef_tally *level = &curve->level[i];

        for (int64_t k = 0; k < n_kept; k++)
            shef_tally_add(level, pixels[k].disparity, pixels[k].truth,
                           ranked ? pixels[k].confidence : -1.0f, &rules->rig);
        level->n_wanted += n_wanted;
        level->n_found += n_kept;
        shef_tally_end_image(level);
    }
    free(pixels);
    return SHEF_OK;
}
