#include "shefsim/description.h"

#include <cyaml/cyaml.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shefsim/yaml_lines.h"

#define REASON_BYTES 256

#define ENTRIES(table)            CYAML_ARRAY_LEN(table)
#define NUMBER(key, type, member) CYAML_FIELD_FLOAT(key, CYAML_FLAG_OPTIONAL, type, member)

static const cyaml_strval_t shapes[] = {
    { "box", SIM_SHAPE_BOX },           { "ellipsoid", SIM_SHAPE_ELLIPSOID },
    { "cylinder", SIM_SHAPE_CYLINDER }, { "cup", SIM_SHAPE_CUP },
    { "bowl", SIM_SHAPE_BOWL },         { "disc", SIM_SHAPE_DISC },
    { "floor", SIM_SHAPE_FLOOR },       { "wall", SIM_SHAPE_WALL },
};

static const cyaml_strval_t patterns[] = {
    { "plain", SIM_PATTERN_PLAIN },     { "cells", SIM_PATTERN_CELLS },
    { "blobs", SIM_PATTERN_BLOBS },     { "carpet", SIM_PATTERN_CARPET },
    { "stripes", SIM_PATTERN_STRIPES }, { "marker", SIM_PATTERN_MARKER },
    { "checker", SIM_PATTERN_CHECKER },
};

static const cyaml_schema_value_t number_value = {
    CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double),
};

static const cyaml_schema_field_t material_fields[] = {
    CYAML_FIELD_STRING_PTR("name", CYAML_FLAG_POINTER, struct sim_material, name, 1, 40),
    CYAML_FIELD_ENUM("pattern", CYAML_FLAG_STRICT, struct sim_material, pattern, patterns,
                     ENTRIES(patterns)),
    CYAML_FIELD_FLOAT("albedo", CYAML_FLAG_DEFAULT, struct sim_material, albedo),
    NUMBER("contrast", struct sim_material, contrast),
    NUMBER("cell_mm", struct sim_material, cell_mm),
    CYAML_FIELD_SEQUENCE_FIXED("colour", CYAML_FLAG_OPTIONAL, struct sim_material, colour,
                               &number_value, 3),
    NUMBER("gloss", struct sim_material, gloss),
    CYAML_FIELD_INT("sharpness", CYAML_FLAG_OPTIONAL, struct sim_material, sharpness),
    CYAML_FIELD_BOOL("blink", CYAML_FLAG_OPTIONAL, struct sim_material, blink),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t material_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sim_material, material_fields),
};

static const cyaml_schema_field_t object_fields[] = {
    CYAML_FIELD_STRING_PTR("name", CYAML_FLAG_POINTER, struct sim_object, name, 1, 40),
    CYAML_FIELD_ENUM("shape", CYAML_FLAG_STRICT, struct sim_object, shape, shapes, ENTRIES(shapes)),
    CYAML_FIELD_STRING_PTR("material", CYAML_FLAG_POINTER, struct sim_object, material, 1, 40),
    CYAML_FIELD_SEQUENCE_FIXED("position_m", CYAML_FLAG_DEFAULT, struct sim_object, position_m,
                               &number_value, 3),
    CYAML_FIELD_SEQUENCE_FIXED("size_m", CYAML_FLAG_DEFAULT, struct sim_object, size_m,
                               &number_value, 3),
    NUMBER("yaw_deg", struct sim_object, yaw_deg),
    NUMBER("tilt_deg", struct sim_object, tilt_deg),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t object_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sim_object, object_fields),
};

static const cyaml_schema_field_t light_fields[] = {
    CYAML_FIELD_STRING_PTR("name", CYAML_FLAG_POINTER, struct sim_ambient, name, 1, 40),
    CYAML_FIELD_FLOAT("ambient", CYAML_FLAG_DEFAULT, struct sim_ambient, level),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t light_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sim_ambient, light_fields),
};

static const cyaml_schema_field_t lamp_fields[] = {
    CYAML_FIELD_STRING_PTR("light", CYAML_FLAG_POINTER, struct sim_lamp, name, 1, 40),
    CYAML_FIELD_SEQUENCE_FIXED("position_m", CYAML_FLAG_DEFAULT, struct sim_lamp, position_m,
                               &number_value, 3),
    CYAML_FIELD_FLOAT("power", CYAML_FLAG_DEFAULT, struct sim_lamp, power),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t lamp_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, struct sim_lamp, lamp_fields),
};

static const cyaml_schema_field_t scene_fields[] = {
    CYAML_FIELD_STRING_PTR("scene", CYAML_FLAG_POINTER, struct sim_description, name, 1, 40),
    NUMBER("contrast_scale", struct sim_description, contrast_scale),
    NUMBER("cell_scale", struct sim_description, cell_scale),
    CYAML_FIELD_SEQUENCE_COUNT("lights", CYAML_FLAG_POINTER, struct sim_description, lights,
                               n_lights, &light_value, 1, 16),
    CYAML_FIELD_SEQUENCE_COUNT("lamps", CYAML_FLAG_POINTER | CYAML_FLAG_OPTIONAL,
                               struct sim_description, lamps, n_lamps, &lamp_value, 0, 64),
    CYAML_FIELD_SEQUENCE_COUNT("materials", CYAML_FLAG_POINTER, struct sim_description, materials,
                               n_materials, &material_value, 1, 256),
    CYAML_FIELD_SEQUENCE_COUNT("objects", CYAML_FLAG_POINTER, struct sim_description, objects,
                               n_objects, &object_value, 1, 1000),
    CYAML_FIELD_END,
};

static const cyaml_schema_value_t scene_value = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, struct sim_description, scene_fields),
};

/* What libcyaml says about the first fault: the reason, then lines that lead to the place. */
struct complaint {
    char reason[REASON_BYTES];
    int line; /* counted from 1; 0: not said */
};

static void hear(cyaml_log_t level, void *context, const char *fmt, va_list args)
{
    struct complaint *complaint = context;
    char text[REASON_BYTES];
    const char *line;

    if (level < CYAML_LOG_ERROR)
        return;
    vsnprintf(text, sizeof text, fmt, args);
    text[strcspn(text, "\n")] = '\0';
    line = strstr(text, "line: ");
    if (line && complaint->line == 0)
        complaint->line = atoi(line + 6);
    if (complaint->reason[0] == '\0' && strncmp(text, "Load: ", 6) == 0)
        snprintf(complaint->reason, sizeof complaint->reason, "%s", text + 6);
}

static void *resize(void *context, void *memory, size_t n_bytes)
{
    (void)context;
    if (n_bytes == 0) {
        free(memory);
        return NULL;
    }
    return realloc(memory, n_bytes);
}

static const cyaml_config_t plain_config = {
    .mem_fn = resize,
    .log_level = CYAML_LOG_ERROR,
    .flags = CYAML_CFG_DEFAULT,
};

/* A row per number that has a range. */
struct range {
    const char *list;
    const char *field;
    size_t offset;
    int32_t n; /* numbers one after another */
    double low, high;
};

#define RANGE(list_, type, field_, member, n_, low_, high_)                                        \
    {                                                                                              \
        list_, field_, offsetof(type, member), n_, low_, high_                                     \
    }

static const struct range ranges[] = {
    RANGE("materials", struct sim_material, "albedo", albedo, 1, 0.02, 0.95),
    RANGE("materials", struct sim_material, "contrast", contrast, 1, 0, 3),
    RANGE("materials", struct sim_material, "cell_mm", cell_mm, 1, 1, 2000),
    RANGE("materials", struct sim_material, "colour", colour, 3, 0.01, 1),
    RANGE("materials", struct sim_material, "gloss", gloss, 1, 0, 10),
    RANGE("objects", struct sim_object, "position_m", position_m, 3, -20, 20),
    RANGE("objects", struct sim_object, "size_m", size_m, 3, 0.001, 20),
    RANGE("objects", struct sim_object, "yaw_deg", yaw_deg, 1, -360, 360),
    RANGE("objects", struct sim_object, "tilt_deg", tilt_deg, 1, -90, 90),
    RANGE("lights", struct sim_ambient, "ambient", level, 1, 0, 10),
    RANGE("lamps", struct sim_lamp, "position_m", position_m, 3, -50, 50),
    RANGE("lamps", struct sim_lamp, "power", power, 1, 0.001, 1000),
};

struct text {
    const char *label;
    const uint8_t *bytes;
    size_t n_bytes;
};

static enum shef_err fail_at(const struct text *text, const char *list, uint32_t item,
                             const char *field, struct shef_error *err, const char *reason)
{
    const int line = sim_yaml_line(text->bytes, text->n_bytes, list, (int32_t)item, field);

    return shef_fail(err, SHEF_ERR_FORMAT, "scene file '%s', line %d: %s", text->label, line,
                     reason);
}

static enum shef_err check_ranges(const struct text *text, const char *list, const void *items,
                                  size_t item_bytes, uint32_t n_items, struct shef_error *err)
{
    char reason[REASON_BYTES];

    for (uint32_t i = 0; i < n_items; i++)
        for (size_t r = 0; r < sizeof ranges / sizeof *ranges; r++) {
            const uint8_t *item = (const uint8_t *)items + i * item_bytes;
            const double *values = (const void *)(item + ranges[r].offset);

            if (strcmp(ranges[r].list, list) != 0)
                continue;
            for (int32_t k = 0; k < ranges[r].n; k++) {
                if (values[k] >= ranges[r].low && values[k] <= ranges[r].high)
                    continue;
                snprintf(reason, sizeof reason, "%s is %g, but must be %g to %g", ranges[r].field,
                         values[k], ranges[r].low, ranges[r].high);
                return fail_at(text, list, i, ranges[r].field, err, reason);
            }
        }
    return SHEF_OK;
}

/* Numbers that may be left out and are not zero then. */
static void set_defaults(struct sim_description *d)
{
    if (d->contrast_scale == 0)
        d->contrast_scale = 1;
    if (d->cell_scale == 0)
        d->cell_scale = 1;
    for (uint32_t i = 0; i < d->n_materials; i++) {
        struct sim_material *m = &d->materials[i];

        if (m->colour[0] == 0 && m->colour[1] == 0 && m->colour[2] == 0)
            m->colour[0] = m->colour[1] = m->colour[2] = 1;
        if (m->cell_mm == 0)
            m->cell_mm = 60;
        if (m->sharpness == 0)
            m->sharpness = 5;
    }
}

static enum shef_err check_names(const struct text *text, const struct sim_description *d,
                                 struct shef_error *err)
{
    char reason[REASON_BYTES];

    for (uint32_t i = 0; i < d->n_materials; i++)
        for (uint32_t k = 0; k < i; k++)
            if (strcmp(d->materials[i].name, d->materials[k].name) == 0) {
                snprintf(reason, sizeof reason, "there are two materials named '%s'",
                         d->materials[i].name);
                return fail_at(text, "materials", i, "name", err, reason);
            }
    for (uint32_t i = 0; i < d->n_materials; i++)
        if (d->materials[i].sharpness < 1 || d->materials[i].sharpness > 8) {
            snprintf(reason, sizeof reason, "sharpness is %d, but must be 1 to 8",
                     d->materials[i].sharpness);
            return fail_at(text, "materials", i, "sharpness", err, reason);
        }
    for (uint32_t i = 0; i < d->n_objects; i++)
        if (!sim_description_material(d, &d->objects[i])) {
            snprintf(reason, sizeof reason, "object '%s' is of a material '%s' that is not listed",
                     d->objects[i].name, d->objects[i].material);
            return fail_at(text, "objects", i, "material", err, reason);
        }
    for (uint32_t i = 0; i < d->n_lamps; i++) {
        bool known = false;

        for (uint32_t k = 0; k < d->n_lights; k++)
            known = known || strcmp(d->lights[k].name, d->lamps[i].name) == 0;
        if (!known) {
            snprintf(reason, sizeof reason, "the lamp belongs to a light '%s' that is not listed",
                     d->lamps[i].name);
            return fail_at(text, "lamps", i, "light", err, reason);
        }
    }
    return SHEF_OK;
}

static enum shef_err check(const struct text *text, const struct sim_description *d,
                           struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (!(d->contrast_scale >= 0.01 && d->contrast_scale <= 10))
        code = fail_at(text, NULL, 0, "contrast_scale", err, "contrast_scale must be 0.01 to 10");
    if (code == SHEF_OK && !(d->cell_scale >= 0.05 && d->cell_scale <= 20))
        code = fail_at(text, NULL, 0, "cell_scale", err, "cell_scale must be 0.05 to 20");
    if (code == SHEF_OK)
        code = check_ranges(text, "materials", d->materials, sizeof *d->materials, d->n_materials,
                            err);
    if (code == SHEF_OK)
        code = check_ranges(text, "objects", d->objects, sizeof *d->objects, d->n_objects, err);
    if (code == SHEF_OK)
        code = check_ranges(text, "lights", d->lights, sizeof *d->lights, d->n_lights, err);
    if (code == SHEF_OK)
        code = check_ranges(text, "lamps", d->lamps, sizeof *d->lamps, d->n_lamps, err);
    if (code == SHEF_OK)
        code = check_names(text, d, err);
    return code;
}

/* The line on which a key stands, at or after the line where its mapping begins. */
static int line_of_key(const struct text *text, const char *key, int first_line)
{
    const size_t length = strlen(key);
    const char *at = (const char *)text->bytes;
    const char *end = at + text->n_bytes;

    for (int line = 1; at < end; line++) {
        const char *line_end = memchr(at, '\n', (size_t)(end - at));
        const char *found;

        if (!line_end)
            line_end = end;
        found = line < first_line ? NULL : memmem(at, (size_t)(line_end - at), key, length);
        if (found && found + length < line_end && strchr(": ", found[length]))
            return line;
        at = line_end + 1;
    }
    return first_line;
}

/* libcyaml's words in ours, where they would puzzle. */
static enum shef_err fail_load(const struct text *text, cyaml_err_t problem,
                               struct complaint *complaint, struct shef_error *err)
{
    static const char no_key[] = "Unexpected key: ";
    static const char no_word[] = "Invalid ENUM value: ";
    const char *reason = complaint->reason;
    const size_t n = strlen(reason);
    int line = complaint->line > 0 ? complaint->line : 1;

    if (problem == CYAML_ERR_OOM)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "scene file '%s': out of memory", text->label);
    if (n > 0 && reason[n - 1] == '.')
        complaint->reason[n - 1] = '\0';
    if (strncmp(reason, no_key, sizeof no_key - 1) == 0) {
        const char *key = reason + sizeof no_key - 1;

        line = line_of_key(text, key, line);
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "scene file '%s', line %d: there is no field '%s' here; docs/scenes.md "
                         "lists the fields",
                         text->label, line, key);
    }
    if (strncmp(reason, no_word, sizeof no_word - 1) == 0)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "scene file '%s', line %d: there is no '%s'; docs/scenes.md lists the "
                         "shapes and patterns",
                         text->label, line, reason + sizeof no_word - 1);
    return shef_fail(err, SHEF_ERR_FORMAT, "scene file '%s', line %d: %s", text->label, line,
                     reason[0] ? reason : cyaml_strerror(problem));
}

enum shef_err sim_description_parse(struct sim_description **out_description, const char *label,
                                    const uint8_t *bytes, size_t n_bytes, struct shef_error *err)
{
    const struct text text = { label, bytes, n_bytes };
    struct complaint complaint = { 0 };
    cyaml_config_t config = plain_config;
    struct sim_description *description = NULL;
    cyaml_err_t problem;
    enum shef_err code;

    config.log_fn = hear;
    config.log_ctx = &complaint;
    problem =
        cyaml_load_data(bytes, n_bytes, &config, &scene_value, (cyaml_data_t **)&description, NULL);
    if (problem != CYAML_OK)
        return fail_load(&text, problem, &complaint, err);
    if (!description)
        return shef_fail(err, SHEF_ERR_FORMAT, "scene file '%s', line 1: there is nothing in it",
                         label);
    set_defaults(description);
    code = check(&text, description, err);
    if (code != SHEF_OK) {
        sim_description_free(description);
        return code;
    }
    *out_description = description;
    return SHEF_OK;
}

void sim_description_free(struct sim_description *description)
{
    if (description)
        cyaml_free(&plain_config, &scene_value, description, 0);
}

const struct sim_material *sim_description_material(const struct sim_description *description,
                                                    const struct sim_object *object)
{
    for (uint32_t i = 0; i < description->n_materials; i++)
        if (strcmp(description->materials[i].name, object->material) == 0)
            return &description->materials[i];
    return NULL;
}
