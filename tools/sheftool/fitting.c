#include "sheftool/fitting.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"

/* What an alignment fit gathers from matched pairs. */
struct alignment_job {
    struct shef_align align;
    struct shef_image_i8 left;
    struct shef_image_i8 right;
    struct shef_image_i16 cells; /* disparity per 2 x 2 px, 1/32 px */
};

static enum shef_err observe(void *context, const struct shef_matched *matched,
                             struct shef_error *err)
{
    struct alignment_job *job = context;

    (void)err;
    for (int32_t y = 0; y < job->left.height_px; y++) {
        shef_edge_map_row(matched->frame, y, shef_row_i8(job->left, y));
        shef_edge_map_row(matched->event, y, shef_row_i8(job->right, y));
    }
    for (int32_t y = 0; y < job->cells.height_px; y++)
        for (int32_t x = 0; x < job->cells.width_px; x++)
            shef_row_i16(job->cells, y)[x] =
                (int16_t)lrintf(32 * shef_row_f32(matched->disparity, 2 * y)[2 * x]);
    shef_align_observe(&job->align, job->left, job->right, job->cells, 1);
    return SHEF_OK;
}

static enum shef_err create_job(struct alignment_job *job, const struct shef_dataset *dataset,
                                struct shef_error *err)
{
    const int32_t w = dataset->width_px;
    const int32_t h = dataset->height_px;
    enum shef_err code = shef_image_create_i8(&job->left, w, h, err);

    shef_align_init(&job->align, w, h);
    if (code == SHEF_OK)
        code = shef_image_create_i8(&job->right, w, h, err);
    if (code == SHEF_OK)
        code = shef_image_create_i16(&job->cells, (w + 1) / 2, (h + 1) / 2, err);
    return code;
}

enum shef_err shef_fit_alignment(const struct shef_dataset *dataset,
                                 const struct shef_matcher_settings *settings,
                                 struct shef_smooth_field *out_field, double *out_spread_px,
                                 struct shef_error *err)
{
    struct alignment_job job = { .left = { 0 } };
    struct shef_matching matching = { .dataset = NULL };
    struct shef_matcher_settings how = *settings;
    enum shef_err code = create_job(&job, dataset, err);

    how.align = SHEF_ALIGN_AUTO; /* the better the pixels are paired, the better the field */
    how.dense = true;
    how.has_bias = false;
    if (code == SHEF_OK)
        code = shef_matching_create(&matching, dataset, &shef_matcher_robust, &how, err);
    if (code == SHEF_OK)
        code = shef_matching_run(&matching, "measuring the alignment", observe, &job, err);
    if (code == SHEF_OK) {
        code = shef_align_solve(&job.align, out_field, out_spread_px);
        if (code != SHEF_OK)
            shef_fail(err, code,
                      "the maps have too little texture to measure how they are aligned; give "
                      "more pairs");
    }
    shef_matching_destroy(&matching);
    shef_image_destroy_i8(&job.left);
    shef_image_destroy_i8(&job.right);
    shef_image_destroy_i16(&job.cells);
    return code;
}

static enum shef_err grow(struct shef_bias_collection *collection)
{
    const int32_t capacity = collection->capacity ? 2 * collection->capacity : 32;
    struct shef_bias_sample *samples =
        realloc(collection->samples, (size_t)capacity * sizeof *samples);

    if (!samples)
        return SHEF_ERR_NO_MEMORY;
    collection->samples = samples;

    int64_t *numbers = realloc(collection->numbers, (size_t)capacity * sizeof *numbers);

    if (!numbers)
        return SHEF_ERR_NO_MEMORY;
    collection->numbers = numbers;
    collection->capacity = capacity;
    return SHEF_OK;
}

enum shef_err shef_bias_collect(struct shef_bias_collection *collection,
                                const struct shef_dataset *dataset,
                                const struct shef_matched *matched, struct shef_error *err)
{
    struct shef_bias_sample sample = { .truth = { 0 } };
    enum shef_err code;

    if (collection->n == collection->capacity && grow(collection) != SHEF_OK)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "bias: out of memory");
    code = shef_image_create_f32(&sample.disparity, matched->disparity.width_px,
                                 matched->disparity.height_px, err);
    if (code == SHEF_OK)
        code = shef_dataset_load_truth(dataset, matched->index, &sample.truth, err);
    if (code != SHEF_OK) {
        shef_image_destroy_f32(&sample.disparity);
        return code;
    }
    shef_image_copy_f32(matched->disparity, sample.disparity);
    collection->samples[collection->n] = sample;
    collection->numbers[collection->n++] = matched->number;
    return SHEF_OK;
}

enum shef_err shef_bias_fit_without(const struct shef_bias_collection *collection, int64_t first,
                                    int64_t last, float hole_px, struct shef_smooth_field *out_bias,
                                    struct shef_error *err)
{
    struct shef_bias_sample *kept = calloc((size_t)collection->n + 1, sizeof *kept);
    int32_t n_kept = 0;

    if (!kept)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "bias: out of memory");
    for (int32_t i = 0; i < collection->n; i++)
        if (collection->numbers[i] < first || collection->numbers[i] > last)
            kept[n_kept++] = collection->samples[i];

    const enum shef_err code = shef_bias_fit(kept, n_kept, hole_px, out_bias, err);

    free(kept);
    return code;
}

void shef_bias_collection_free(struct shef_bias_collection *collection)
{
    for (int32_t i = 0; i < collection->n; i++) {
        shef_image_destroy_f32(&collection->samples[i].disparity);
        shef_image_destroy_f32(&collection->samples[i].truth);
    }
    free(collection->samples);
    free(collection->numbers);
    *collection = (struct shef_bias_collection){ 0 };
}
