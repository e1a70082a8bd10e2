#include "sheftool/dataset.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "core/memory.h"
#include "core/png_io.h"

static const char *const png_only[2] = { ".png", NULL };
static const char *const pfm_only[2] = { ".pfm", NULL };

static enum shef_err copy_path(char *out_path, const char *path, struct shef_error *err)
{
    if (strlen(path) >= SHEF_FOLDER_BYTES)
        return shef_fail(err, SHEF_ERR_INVALID, "the path '%.100s...' is too long", path);
    memcpy(out_path, path, strlen(path) + 1);
    return SHEF_OK;
}

/* Refuses the first pair that has no file in another list. */
static enum shef_err check_partners(const struct shef_numbered_list *pairs,
                                    const struct shef_numbered_list *partners,
                                    const char *pair_folder, const char *partner_folder,
                                    const char *ending, struct shef_error *err)
{
    for (size_t i = 0; i < pairs->n; i++)
        if (!shef_numbered_find(partners, pairs->at[i].number))
            return shef_fail(err, SHEF_ERR_NOT_FOUND,
                             "'%s/%" PRId64 "%s' is missing, the partner of '%s/%s.png'; add it or "
                             "leave the pair out with --pairs",
                             partner_folder, pairs->at[i].number, ending, pair_folder,
                             pairs->at[i].stem);
    return SHEF_OK;
}

/* Refuses event edges without frame edges, unless the user picked pairs. */
static enum shef_err check_reverse(const struct shef_dataset *dataset, struct shef_error *err)
{
    for (size_t i = 0; i < dataset->events.n; i++)
        if (!shef_numbered_find(&dataset->pairs, dataset->events.at[i].number))
            return shef_fail(err, SHEF_ERR_NOT_FOUND,
                             "'%s/%" PRId64 ".png' is missing, the partner of '%s/%s.png'; add it "
                             "or leave the pair out with --pairs",
                             dataset->frame_edges, dataset->events.at[i].number,
                             dataset->event_edges, dataset->events.at[i].stem);
    return SHEF_OK;
}

/* Refuses one folder given for both cameras: it would match itself everywhere, with confidence. */
static enum shef_err check_two_folders(const struct shef_dataset *dataset, struct shef_error *err)
{
    struct stat frame;
    struct stat event;

    if (stat(dataset->frame_edges, &frame) != 0 || stat(dataset->event_edges, &event) != 0 ||
        frame.st_dev != event.st_dev || frame.st_ino != event.st_ino)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "'%s' and '%s' are the same folder; the edge maps of the frame camera and of "
                     "the event camera lie in two",
                     dataset->frame_edges, dataset->event_edges);
}

static enum shef_err read_lists(struct shef_dataset *dataset,
                                const struct shef_dataset_place *place, struct shef_error *err)
{
    enum shef_err code =
        shef_numbered_list_read(&dataset->pairs, dataset->frame_edges, png_only, err);

    if (code == SHEF_OK && place->event_edges)
        code = shef_numbered_list_read(&dataset->events, dataset->event_edges, png_only, err);
    if (code == SHEF_OK && place->event_edges)
        code = check_two_folders(dataset, err);
    if (code == SHEF_OK && place->event_edges && !place->pick)
        code = check_reverse(dataset, err);
    if (code == SHEF_OK && place->pick)
        code = shef_numbered_pick(&dataset->pairs, place->pick, err);
    if (code == SHEF_OK && place->event_edges)
        code = check_partners(&dataset->pairs, &dataset->events, dataset->frame_edges,
                              dataset->event_edges, ".png", err);
    if (code == SHEF_OK && place->truth)
        code = shef_numbered_list_read(&dataset->truths, dataset->truth, pfm_only, err);
    if (code == SHEF_OK && place->truth)
        code = check_partners(&dataset->pairs, &dataset->truths, dataset->frame_edges,
                              dataset->truth, ".pfm", err);
    return code;
}

static enum shef_err read_size(struct shef_dataset *dataset, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    struct shef_image_u8 image;

    snprintf(path, sizeof path, "%s/%s.png", dataset->frame_edges, dataset->pairs.at[0].stem);

    const enum shef_err code = shef_png_read_u8(path, &image, err);

    if (code != SHEF_OK)
        return code;
    dataset->width_px = image.width_px;
    dataset->height_px = image.height_px;
    shef_image_destroy_u8(&image);
    return SHEF_OK;
}

void shef_folder_above(const char *folder, char *out_path)
{
    struct stat info;
    char path[SHEF_PATH_BYTES];
    size_t n = strlen(folder);

    while (n > 1 && folder[n - 1] == '/')
        n--;
    snprintf(path, sizeof path, "%.*s", (int)n, folder);

    char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;

    /* Above a link lies another folder than before its name. */
    if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0 || slash == path ||
        (lstat(path, &info) == 0 && S_ISLNK(info.st_mode))) {
        snprintf(out_path, SHEF_PATH_BYTES, "%.*s/..", (int)n, folder);
        return;
    }
    if (slash)
        *slash = '\0';
    snprintf(out_path, SHEF_PATH_BYTES, "%s", slash ? path : ".");
}

enum shef_err shef_dataset_open(struct shef_dataset *out_dataset,
                                const struct shef_dataset_place *place, struct shef_error *err)
{
    struct shef_dataset dataset = { .frame_edges = "" };
    char parent[SHEF_PATH_BYTES];
    enum shef_err code = copy_path(dataset.frame_edges, place->frame_edges, err);

    if (code == SHEF_OK && place->event_edges)
        code = copy_path(dataset.event_edges, place->event_edges, err);
    if (code == SHEF_OK && place->truth)
        code = copy_path(dataset.truth, place->truth, err);
    if (code == SHEF_OK)
        code = read_lists(&dataset, place, err);
    if (code == SHEF_OK)
        code = read_size(&dataset, err);
    if (code == SHEF_OK) {
        shef_folder_above(dataset.frame_edges, parent);
        code = shef_scenes_find(&dataset.scenes, parent, &dataset.pairs, err);
    }
    if (code != SHEF_OK) {
        shef_dataset_close(&dataset);
        return code;
    }
    *out_dataset = dataset;
    return SHEF_OK;
}

enum shef_err shef_dataset_open_folder(struct shef_dataset *out_dataset, const char *folder,
                                       const char *pick, struct shef_error *err)
{
    char frame_edges[SHEF_PATH_BYTES];
    char event_edges[SHEF_PATH_BYTES];
    char truth[SHEF_PATH_BYTES];
    struct stat info;

    snprintf(frame_edges, sizeof frame_edges, "%s/frame_edge", folder);
    snprintf(event_edges, sizeof event_edges, "%s/event_edge", folder);
    snprintf(truth, sizeof truth, "%s/gt", folder);

    const struct shef_dataset_place place = {
        .frame_edges = frame_edges,
        .event_edges = event_edges,
        .truth = stat(truth, &info) == 0 ? truth : NULL,
        .pick = pick,
    };

    return shef_dataset_open(out_dataset, &place, err);
}

void shef_dataset_close(struct shef_dataset *dataset)
{
    shef_numbered_list_free(&dataset->pairs);
    shef_numbered_list_free(&dataset->events);
    shef_numbered_list_free(&dataset->truths);
}

enum shef_err shef_dataset_load_edges(const struct shef_dataset *dataset, size_t index,
                                      struct shef_edge_map *frame, struct shef_edge_map *event,
                                      struct shef_error *err)
{
    assert(index < dataset->pairs.n);

    const struct shef_numbered *pair = &dataset->pairs.at[index];
    char path[SHEF_PATH_BYTES];

    snprintf(path, sizeof path, "%s/%s.png", dataset->frame_edges, pair->stem);
    enum shef_err code = shef_edge_map_read(path, frame, err);

    if (code == SHEF_OK && event) {
        snprintf(path, sizeof path, "%s/%s.png", dataset->event_edges,
                 shef_numbered_find(&dataset->events, pair->number)->stem);
        code = shef_edge_map_read(path, event, err);
    }
    return code;
}

enum shef_err shef_dataset_load_truth(const struct shef_dataset *dataset, size_t index,
                                      struct shef_image_f32 *out_truth, struct shef_error *err)
{
    char path[SHEF_PATH_BYTES];
    struct shef_image_f32 truth;

    assert(index < dataset->pairs.n && dataset->truth[0]);
    snprintf(path, sizeof path, "%s/%s.pfm", dataset->truth,
             shef_numbered_find(&dataset->truths, dataset->pairs.at[index].number)->stem);

    enum shef_err code = shef_disparity_read(path, &truth, err);

    if (code != SHEF_OK)
        return code;
    code = shef_check_size(path, truth.width_px, truth.height_px, dataset->width_px,
                           dataset->height_px, err);
    if (code != SHEF_OK) {
        shef_image_destroy_f32(&truth);
        return code;
    }
    *out_truth = truth;
    return SHEF_OK;
}
