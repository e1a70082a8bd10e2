#include "shefsim/scene.h"

#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "shefsim/random.h"
#include "shefsim/scene_files.h"
#include "shefsim/scene_internal.h"

#define MAX_FILE_BYTES (1 << 20)
#define MAX_PARTS      96  /* surfaces of one object */
#define MAX_SPREAD     1.3 /* of the distance over a part */

static enum shef_err find_lighting(struct sim_scene *scene, const char *light,
                                   struct sim_lighting *out_lighting, const struct sim_lamp **lamps,
                                   struct shef_error *err)
{
    const struct sim_description *d = scene->description;
    const struct sim_ambient *found = NULL;
    char known[200] = "";

    for (uint32_t i = 0; i < d->n_lights; i++) {
        const size_t n = strlen(known);

        if (strcmp(d->lights[i].name, light) == 0)
            found = &d->lights[i];
        if (n + strlen(d->lights[i].name) + 3 < sizeof known) {
            strcat(known, n ? ", " : "");
            strcat(known, d->lights[i].name);
        }
    }
    if (!found)
        return shef_fail(err, SHEF_ERR_INVALID, "scene '%s' has no light '%s'; it has: %s", d->name,
                         light, known);
    *out_lighting = (struct sim_lighting){ .ambient = found->level, .lamps = lamps };
    for (uint32_t i = 0; i < d->n_lamps; i++)
        if (strcmp(d->lamps[i].name, light) == 0) {
            lamps[out_lighting->n_lamps++] = &d->lamps[i];
            if (d->lamps[i].power > scene->brightest.power)
                scene->brightest = d->lamps[i];
        }
    scene->ambient = found->level;
    return SHEF_OK;
}

/* Cuts flat surfaces until the distance hardly changes over any part, behind one another in
 * memory. Returns how many they are then. */
static int32_t cut_up(struct sim_surface *surfaces, int32_t n)
{
    for (int32_t i = 0; i < n && n < MAX_PARTS; i++) {
        double spread[2];
        int along;

        if (surfaces[i].kind != SIM_SURFACE_QUAD)
            continue;
        sim_texture_spread(&surfaces[i], spread);
        along = spread[0] > spread[1] ? 0 : 1;
        if (spread[along] < MAX_SPREAD)
            continue;
        sim_surface_cut(&surfaces[i], along, &surfaces[n++]);
        i--; /* what is left of it may still be too large */
    }
    return n;
}

static enum shef_err add_surfaces(struct sim_scene *scene, uint32_t number,
                                  const struct sim_lighting *lighting,
                                  const struct sim_scene_options *options, int64_t *n_texels,
                                  struct shef_error *err)
{
    const struct sim_description *d = scene->description;
    const struct sim_object *object = &d->objects[number];
    const struct sim_material *material = sim_description_material(d, object);
    struct sim_surface parts[MAX_PARTS];
    const int32_t n_whole = sim_object_surfaces(object, (int32_t)number, material, parts);
    struct sim_surface *grown;
    enum shef_err code = SHEF_OK;

    for (int32_t i = 0; i < n_whole; i++)
        parts[i].seed =
            sim_mix64(sim_mix64(options->seed + 1) + 64 * (uint64_t)number + (uint64_t)i);

    const int32_t n = cut_up(parts, n_whole);

    grown = realloc(scene->surfaces, (size_t)(scene->n_surfaces + n) * sizeof *scene->surfaces);
    if (!grown)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "scene '%s': out of memory", d->name);
    scene->surfaces = grown;
    for (int32_t i = 0; code == SHEF_OK && i < n; i++) {
        struct sim_surface *surface = &scene->surfaces[scene->n_surfaces];

        *surface = parts[i];
        code = sim_texture_bake(surface, material, d, lighting, options->workers, err);
        if (code != SHEF_OK)
            break;
        scene->n_surfaces++;
        *n_texels += (int64_t)surface->texture.width * surface->texture.height;
        if (*n_texels > SIM_TEXTURE_TOTAL_TEXELS)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY,
                             "scene '%s' needs textures of more than %d pixels; make object '%s' "
                             "smaller or move it away",
                             d->name, SIM_TEXTURE_TOTAL_TEXELS, object->name);
    }
    return code;
}

static enum shef_err make(struct sim_scene **out_scene, const char *label, const uint8_t *text,
                          size_t n_bytes, const struct sim_scene_options *options,
                          struct shef_error *err)
{
    struct sim_scene *scene = calloc(1, sizeof *scene);
    const struct sim_lamp **lamps = NULL;
    struct sim_lighting lighting = { 0 };
    int64_t n_texels = 0;
    enum shef_err code;

    if (!scene)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "scene '%s': out of memory", label);
    code = sim_description_parse(&scene->description, label, text, n_bytes, err);
    if (code == SHEF_OK) {
        const struct sim_description *d = scene->description;

        lamps = calloc(d->n_lamps + 1, sizeof *lamps);
        scene->surfaces =
            calloc((size_t)d->n_objects * SIM_SURFACES_PER_OBJECT + 1, sizeof *scene->surfaces);
        if (!lamps || !scene->surfaces)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "scene '%s': out of memory", label);
    }
    if (code == SHEF_OK)
        code = find_lighting(scene, options->light, &lighting, lamps, err);
    if (code == SHEF_OK)
        for (uint32_t i = 0; code == SHEF_OK && i < scene->description->n_objects; i++)
            code = add_surfaces(scene, i, &lighting, options, &n_texels, err);
    free(lamps);
    if (code != SHEF_OK) {
        sim_scene_destroy(scene);
        return code;
    }
    *out_scene = scene;
    return SHEF_OK;
}

const char *const *sim_scene_names(void)
{
    return sim_scene_file_names;
}

enum shef_err sim_scene_builtin(struct sim_scene **out_scene, const char *name,
                                const struct sim_scene_options *options, struct shef_error *err)
{
    for (int i = 0; sim_scene_file_names[i]; i++)
        if (strcmp(sim_scene_file_names[i], name) == 0)
            return make(out_scene, name, (const uint8_t *)sim_scene_file_texts[i],
                        strlen(sim_scene_file_texts[i]), options, err);
    return shef_fail(err, SHEF_ERR_NOT_FOUND, "there is no built-in scene '%s'", name);
}

enum shef_err sim_scene_read(struct sim_scene **out_scene, const char *path,
                             const struct sim_scene_options *options, struct shef_error *err)
{
    uint8_t *text;
    size_t n_bytes;
    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &text, &n_bytes, err);

    if (code != SHEF_OK)
        return shef_fail_context(err, "scene file");
    code = make(out_scene, path, text, n_bytes, options, err);
    free(text);
    return code;
}

enum shef_err sim_scene_open(struct sim_scene **out_scene, const char *name_or_path,
                             const struct sim_scene_options *options, struct shef_error *err)
{
    enum shef_err code = sim_scene_builtin(out_scene, name_or_path, options, err);
    char names[200] = "";

    if (code != SHEF_ERR_NOT_FOUND)
        return code;
    code = sim_scene_read(out_scene, name_or_path, options, err);
    if (code != SHEF_ERR_NOT_FOUND)
        return code;
    for (int i = 0; sim_scene_file_names[i]; i++) {
        strcat(names, i ? ", " : "");
        strcat(names, sim_scene_file_names[i]);
    }
    return shef_fail(err, SHEF_ERR_NOT_FOUND,
                     "'%s' is neither a scene file that exists nor one of the built-in scenes %s",
                     name_or_path, names);
}

void sim_scene_destroy(struct sim_scene *scene)
{
    if (!scene)
        return;
    for (int32_t i = 0; i < scene->n_surfaces; i++)
        sim_texture_destroy(&scene->surfaces[i].texture);
    free(scene->surfaces);
    sim_description_free(scene->description);
    free(scene);
}

const char *sim_scene_name(const struct sim_scene *scene)
{
    return scene->description->name;
}

int32_t sim_scene_n_objects(const struct sim_scene *scene)
{
    return (int32_t)scene->description->n_objects;
}

const char *sim_scene_object_name(const struct sim_scene *scene, int32_t object)
{
    return scene->description->objects[object].name;
}

void sim_scene_object_tint(const struct sim_scene *scene, int32_t object, float out_rgb[3])
{
    const struct sim_material *material =
        sim_description_material(scene->description, &scene->description->objects[object]);
    const double sum = material->colour[0] + material->colour[1] + material->colour[2];

    for (int i = 0; i < 3; i++)
        out_rgb[i] = (float)(3 * material->colour[i] / sum);
}

double sim_scene_clearance_m(const struct sim_scene *scene, const double point_m[3],
                             int32_t *out_object)
{
    const struct sim_description *d = scene->description;
    double least_m = 1e9;

    for (uint32_t i = 0; i < d->n_objects; i++) {
        const double here_m = sim_object_clearance_m(&d->objects[i], point_m);

        if (here_m < least_m) {
            least_m = here_m;
            if (out_object)
                *out_object = (int32_t)i;
        }
    }
    return least_m;
}
