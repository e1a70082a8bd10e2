#include "codecs/rtde_package.h"

#include <assert.h>
#include <ctype.h>
#include <string.h>

#define HEADER_BYTES 3

/* How a type is written: n values of a size. */
static const struct {
    const char *name;
    uint32_t n;
    uint32_t n_bytes;
} types[SHEF_RTDE_TYPES] = {
    [SHEF_RTDE_BOOL] = { "BOOL", 1, 1 },
    [SHEF_RTDE_UINT8] = { "UINT8", 1, 1 },
    [SHEF_RTDE_UINT32] = { "UINT32", 1, 4 },
    [SHEF_RTDE_INT32] = { "INT32", 1, 4 },
    [SHEF_RTDE_UINT64] = { "UINT64", 1, 8 },
    [SHEF_RTDE_DOUBLE] = { "DOUBLE", 1, 8 },
    [SHEF_RTDE_VECTOR3D] = { "VECTOR3D", 3, 8 },
    [SHEF_RTDE_VECTOR6D] = { "VECTOR6D", 6, 8 },
    [SHEF_RTDE_VECTOR6INT32] = { "VECTOR6INT32", 6, 4 },
    [SHEF_RTDE_VECTOR6UINT32] = { "VECTOR6UINT32", 6, 4 },
};

const char *shef_rtde_type_name(enum shef_rtde_type type)
{
    return type >= 0 && type < SHEF_RTDE_TYPES ? types[type].name : "?";
}

/* Takes the word at *list, without blanks, and moves *list behind its comma. Returns false at the
 * end or if the word does not fit. */
static bool next_word(const char **list, char *out_word, size_t n_bytes)
{
    const char *first = *list;
    size_t n = strcspn(first, ",");

    *list += n + (first[n] == ',');
    while (n > 0 && isspace((unsigned char)*first)) {
        first++;
        n--;
    }
    while (n > 0 && isspace((unsigned char)first[n - 1]))
        n--;
    if (n == 0 || n >= n_bytes)
        return false;
    memcpy(out_word, first, n);
    out_word[n] = '\0';
    return true;
}

static bool find_type(const char *name, enum shef_rtde_type *out_type)
{
    for (int i = 0; i < SHEF_RTDE_TYPES; i++)
        if (strcmp(types[i].name, name) == 0) {
            *out_type = i;
            return true;
        }
    return false;
}

static bool is_there(const struct shef_rtde_recipe *recipe, const char *name)
{
    for (uint32_t i = 0; i < recipe->n_variables; i++)
        if (strcmp(recipe->variables[i].name, name) == 0)
            return true;
    return false;
}

enum shef_err shef_rtde_recipe_parse(uint32_t version, const char *names, const char *type_names,
                                     struct shef_rtde_recipe *out_recipe, struct shef_error *err)
{
    struct shef_rtde_recipe recipe = { .version = version };

    if (version < 1 || version > 2)
        return shef_fail(err, SHEF_ERR_FORMAT, "RTDE protocol version %u: there are 1 and 2",
                         version);
    recipe.package_bytes = HEADER_BYTES + (version == 2);
    while (*names) {
        struct shef_rtde_variable variable = { .offset = recipe.package_bytes };
        char type_name[24] = "";

        if (!next_word(&names, variable.name, sizeof variable.name)) {
            if (!*names && recipe.n_variables > 0)
                break;
            return shef_fail(err, SHEF_ERR_FORMAT, "RTDE recipe: name %u is empty or too long",
                             recipe.n_variables + 1);
        }
        if (!next_word(&type_names, type_name, sizeof type_name) ||
            !find_type(type_name, &variable.type))
            return shef_fail(err, SHEF_ERR_FORMAT, "RTDE recipe: '%s' has no known type ('%s')",
                             variable.name, type_name);
        recipe.package_bytes += types[variable.type].n * types[variable.type].n_bytes;
        if (is_there(&recipe, variable.name) || recipe.n_variables == SHEF_RTDE_MAX_VARIABLES ||
            recipe.package_bytes > SHEF_RTDE_PACKAGE_MAX_BYTES)
            return shef_fail(err, SHEF_ERR_FORMAT,
                             "RTDE recipe: '%s' is there twice, or one too many", variable.name);
        recipe.variables[recipe.n_variables++] = variable;
    }
    if (recipe.n_variables == 0 || *type_names)
        return shef_fail(err, SHEF_ERR_FORMAT, "RTDE recipe: %u names and not as many types",
                         recipe.n_variables);
    *out_recipe = recipe;
    return SHEF_OK;
}

const struct shef_rtde_variable *shef_rtde_find(const struct shef_rtde_recipe *recipe,
                                                const char *name, enum shef_rtde_type type)
{
    for (uint32_t i = 0; i < recipe->n_variables; i++)
        if (recipe->variables[i].type == type && strcmp(recipe->variables[i].name, name) == 0)
            return &recipe->variables[i];
    return NULL;
}

bool shef_rtde_package_is(const struct shef_rtde_recipe *recipe, const uint8_t *bytes,
                          size_t n_bytes)
{
    return n_bytes == recipe->package_bytes && bytes[0] == n_bytes >> 8 &&
           bytes[1] == (n_bytes & 0xff) && bytes[2] == 'U';
}

void shef_rtde_package_begin(const struct shef_rtde_recipe *recipe, uint8_t recipe_number,
                             uint8_t *out_bytes)
{
    memset(out_bytes, 0, recipe->package_bytes);
    out_bytes[0] = (uint8_t)(recipe->package_bytes >> 8);
    out_bytes[1] = (uint8_t)recipe->package_bytes;
    out_bytes[2] = 'U';
    if (recipe->version == 2)
        out_bytes[HEADER_BYTES] = recipe_number;
}

static uint64_t get(const uint8_t *bytes, uint32_t n_bytes)
{
    uint64_t value = 0;

    for (uint32_t i = 0; i < n_bytes; i++)
        value = value << 8 | bytes[i];
    return value;
}

static void put(uint64_t value, uint32_t n_bytes, uint8_t *bytes)
{
    for (uint32_t i = n_bytes; i > 0; i--, value >>= 8)
        bytes[i - 1] = (uint8_t)value;
}

static bool is_of_doubles(const struct shef_rtde_variable *variable)
{
    return variable->type == SHEF_RTDE_DOUBLE || variable->type == SHEF_RTDE_VECTOR3D ||
           variable->type == SHEF_RTDE_VECTOR6D;
}

void shef_rtde_get_doubles(const struct shef_rtde_variable *variable, const uint8_t *package,
                           double *out_values)
{
    assert(is_of_doubles(variable));
    for (uint32_t i = 0; i < types[variable->type].n; i++) {
        const uint64_t bits = get(package + variable->offset + i * sizeof bits, sizeof bits);

        memcpy(&out_values[i], &bits, sizeof bits);
    }
}

void shef_rtde_put_doubles(const struct shef_rtde_variable *variable, const double *values,
                           uint8_t *package)
{
    assert(is_of_doubles(variable));
    for (uint32_t i = 0; i < types[variable->type].n; i++) {
        uint64_t bits;

        memcpy(&bits, &values[i], sizeof bits);
        put(bits, sizeof bits, package + variable->offset + i * sizeof bits);
    }
}

int64_t shef_rtde_get_integer(const struct shef_rtde_variable *variable, const uint8_t *package)
{
    const uint64_t value = get(package + variable->offset, types[variable->type].n_bytes);

    assert(types[variable->type].n == 1 && variable->type != SHEF_RTDE_DOUBLE);
    return variable->type == SHEF_RTDE_INT32 ? (int32_t)(uint32_t)value : (int64_t)value;
}

void shef_rtde_put_integer(const struct shef_rtde_variable *variable, int64_t value,
                           uint8_t *package)
{
    assert(types[variable->type].n == 1 && variable->type != SHEF_RTDE_DOUBLE);
    put((uint64_t)value, types[variable->type].n_bytes, package + variable->offset);
}
