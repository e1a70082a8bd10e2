#include "shefsim/rig_images.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "shefsim/npy.h"
#include "shefsim/staging.h"

#define MAX_NAME 32

struct sim_rig_images {
    struct sim_staging staging;
    char images_path[PATH_MAX + MAX_NAME];
    char times_path[PATH_MAX + MAX_NAME];
    struct sim_npy images;
    struct sim_npy times;
};

static enum shef_err open_files(struct sim_rig_images *images, int64_t n_images, int32_t width_px,
                                int32_t height_px, struct shef_error *err)
{
    const int64_t shape[3] = { n_images, height_px, width_px };
    enum shef_err code;

    if (mkdir(images->staging.path, 0777) != 0)
        return shef_fail_os(err, errno, "make the folder '%s'", images->staging.path);
    snprintf(images->images_path, sizeof images->images_path, "%s/images.npy",
             images->staging.path);
    snprintf(images->times_path, sizeof images->times_path, "%s/times.npy", images->staging.path);
    code = sim_npy_create(&images->images, images->images_path, SIM_NPY_F32, 3, shape, err);
    return code == SHEF_OK
               ? sim_npy_create(&images->times, images->times_path, SIM_NPY_I64, 1, shape, err)
               : code;
}

enum shef_err sim_rig_images_begin(struct sim_rig_images **out_images, const char *folder,
                                   int64_t n_images, int32_t width_px, int32_t height_px,
                                   struct shef_error *err)
{
    struct sim_rig_images *images = calloc(1, sizeof *images);
    enum shef_err code;

    if (!images)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "export images: out of memory");
    code = sim_staging_begin(&images->staging, folder, err);
    if (code == SHEF_OK)
        code = open_files(images, n_images, width_px, height_px, err);
    if (code == SHEF_OK)
        *out_images = images;
    else
        sim_rig_images_discard(images);
    return code;
}

enum shef_err sim_rig_images_add(struct sim_rig_images *images, int64_t t_ns,
                                 struct shef_image_f32 image, struct shef_error *err)
{
    enum shef_err code = sim_npy_write(&images->times, &t_ns, 1, err);

    for (int32_t y = 0; code == SHEF_OK && y < image.height_px; y++)
        code = sim_npy_write(&images->images, shef_row_f32(image, y), (size_t)image.width_px, err);
    return code;
}

enum shef_err sim_rig_images_commit(struct sim_rig_images *images, struct shef_error *err)
{
    enum shef_err code = sim_npy_close(&images->images, err);

    if (code == SHEF_OK)
        code = sim_npy_close(&images->times, err);
    if (code == SHEF_OK)
        code = sim_staging_commit(&images->staging, err);
    sim_rig_images_discard(images);
    return code;
}

void sim_rig_images_discard(struct sim_rig_images *images)
{
    if (!images)
        return;
    sim_npy_discard(&images->images);
    sim_npy_discard(&images->times);
    sim_staging_discard(&images->staging);
    free(images);
}
