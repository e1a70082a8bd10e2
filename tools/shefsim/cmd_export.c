/* shefsim export: a scene as a mesh or as points, for other programs. */
#include <stdio.h>

#include "shefsim/commands.h"
#include "shefsim/mesh.h"

enum kind { KIND_MESH, KIND_POINTS };

struct settings {
    const char *scene;
    const char *out;
    const char *light;
    int64_t seed;
    int32_t kind;
    double spacing_mm;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("scene", struct settings, scene, "S",
                    "a built-in scene's name, or a scene file (docs/scenes.md)"),
    SHEF_OPT_NEEDED("out", struct settings, out, "FILE", "the PLY file to write"),
    SHEF_OPT_CHOICE("kind", struct settings, kind, "mesh|points", "mesh",
                    "triangles, or only their corners"),
    SHEF_OPT_REAL("spacing", struct settings, spacing_mm, "20", 2, 1000, "mm",
                  "between neighbouring points, at most"),
    SHEF_OPT_TEXT("light", struct settings, light, "NAME", "day", "one of the scene's lights"),
    SHEF_OPT_INT("seed", struct settings, seed, "1", 0, 1000000, NULL,
                 "another number makes other textures"),
    SHEF_OPT_END,
};

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    const struct sim_scene_options how = {
        .light = settings->light,
        .seed = (uint64_t)settings->seed,
    };
    const bool with_triangles = settings->kind == KIND_MESH;
    struct sim_scene *scene = NULL;
    struct sim_mesh mesh = { 0 };
    enum shef_err code = sim_scene_open(&scene, settings->scene, &how, err);

    if (code == SHEF_OK)
        code = sim_mesh_create(&mesh, scene, settings->spacing_mm / 1000, err);
    if (code == SHEF_OK)
        code = sim_ply_write(settings->out, &mesh, with_triangles, err);
    if (code == SHEF_OK && with_triangles)
        printf("%s: %d points, %d triangles\n", settings->out, mesh.n_vertices, mesh.n_triangles);
    else if (code == SHEF_OK)
        printf("%s: %d points\n", settings->out, mesh.n_vertices);
    sim_mesh_destroy(&mesh);
    sim_scene_destroy(scene);
    return code;
}

const struct shef_command sim_command_export = {
    .name = "export",
    .summary = "write a scene as a PLY file",
    .description =
        "Writes a scene as coloured triangles or points, in world axes: x right, y down, z\n"
        "forward from the middle of the camera's path, in metres. Colours are those in the light\n"
        "asked for, without highlights. Sides that no camera near the path sees are left out.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .run = run,
};
