/* Any recipe and package: no crash, and values stay inside the package. The input is the protocol
 * version, names, a newline, types, a newline, and the package. */
#include <stdlib.h>
#include <string.h>

#include "codecs/rtde_package.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void demand(int condition)
{
    if (!condition)
        abort();
}

/* Copies a line and returns how many bytes it took. */
static size_t take_line(const uint8_t *bytes, size_t n_bytes, char *out_line, size_t line_bytes)
{
    size_t n = 0;

    while (n < n_bytes && n < line_bytes - 1 && bytes[n] != '\n' && bytes[n] != '\0') {
        out_line[n] = (char)bytes[n];
        n++;
    }
    out_line[n] = '\0';
    return n < n_bytes ? n + 1 : n;
}

static void read_and_write(const struct shef_rtde_recipe *recipe, const uint8_t *package)
{
    uint8_t *again = malloc(recipe->package_bytes);

    demand(again != NULL);
    shef_rtde_package_begin(recipe, recipe->version == 2 ? package[3] : 0, again);
    for (uint32_t i = 0; i < recipe->n_variables; i++) {
        const struct shef_rtde_variable *variable = &recipe->variables[i];
        double values[6];

        demand(shef_rtde_find(recipe, variable->name, variable->type) == variable);
        if (variable->type == SHEF_RTDE_DOUBLE || variable->type == SHEF_RTDE_VECTOR3D ||
            variable->type == SHEF_RTDE_VECTOR6D) {
            shef_rtde_get_doubles(variable, package, values);
            shef_rtde_put_doubles(variable, values, again);
        } else if (variable->type != SHEF_RTDE_VECTOR6INT32 &&
                   variable->type != SHEF_RTDE_VECTOR6UINT32) {
            shef_rtde_put_integer(variable, shef_rtde_get_integer(variable, package), again);
        } else {
            memcpy(again + variable->offset, package + variable->offset, 24);
        }
    }
    demand(memcmp(again, package, recipe->package_bytes) == 0);
    free(again);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    char names[SHEF_RTDE_LIST_BYTES];
    char types[SHEF_RTDE_LIST_BYTES];
    struct shef_rtde_recipe recipe;
    struct shef_error err = { 0 };
    size_t at = 1;

    if (n_bytes < 1)
        return 0;
    at += take_line(bytes + at, n_bytes - at, names, sizeof names);
    at += take_line(bytes + at, n_bytes - at, types, sizeof types);
    if (shef_rtde_recipe_parse(bytes[0] & 3, names, types, &recipe, &err) != SHEF_OK) {
        demand(err.code == SHEF_ERR_FORMAT && err.text[0] != '\0');
        return 0;
    }
    demand(recipe.n_variables >= 1 && recipe.package_bytes <= SHEF_RTDE_PACKAGE_MAX_BYTES);
    if (at < n_bytes && shef_rtde_package_is(&recipe, bytes + at, n_bytes - at))
        read_and_write(&recipe, bytes + at);
    return 0;
}
