/* Data packages of Universal Robots' RTDE protocol (type 'U'): what a recipe puts where.
 *
 * A package is: u16 length of all, u8 'U', in protocol version 2 a u8 recipe number, then the
 * variables of the recipe in order, big-endian, without padding. Pure functions. Thread: any.
 * Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide". */
#ifndef SHEF_CODECS_RTDE_PACKAGE_H
#define SHEF_CODECS_RTDE_PACKAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_RTDE_MAX_VARIABLES     64
#define SHEF_RTDE_NAME_BYTES        48
#define SHEF_RTDE_LIST_BYTES        2049 /* names of a recipe with commas between, at most */
#define SHEF_RTDE_PACKAGE_MAX_BYTES 4096

enum shef_rtde_type {
    SHEF_RTDE_BOOL,
    SHEF_RTDE_UINT8,
    SHEF_RTDE_UINT32,
    SHEF_RTDE_INT32,
    SHEF_RTDE_UINT64,
    SHEF_RTDE_DOUBLE,
    SHEF_RTDE_VECTOR3D,
    SHEF_RTDE_VECTOR6D,
    SHEF_RTDE_VECTOR6INT32,
    SHEF_RTDE_VECTOR6UINT32,
    SHEF_RTDE_TYPES,
};

struct shef_rtde_variable {
    char name[SHEF_RTDE_NAME_BYTES];
    enum shef_rtde_type type;
    uint32_t offset; /* in the package */
};

struct shef_rtde_recipe {
    uint32_t version; /* of the protocol: 1 or 2 */
    uint32_t n_variables;
    struct shef_rtde_variable variables[SHEF_RTDE_MAX_VARIABLES];
    uint32_t package_bytes;
};

/* "DOUBLE", "VECTOR6D" ...; "?" for none of them. */
const char *shef_rtde_type_name(enum shef_rtde_type type);

/* Lays out a recipe.
 *   names  "timestamp,actual_TCP_pose"; blanks and an empty last name are ignored
 *   types  "DOUBLE,VECTOR6D", as the controller answered
 * SHEF_ERR_FORMAT: an unknown version or type, as many names as types there are not, a name that is
 * too long or there twice, or more than a package holds. */
SHEF_MUST_CHECK enum shef_err shef_rtde_recipe_parse(uint32_t version, const char *names,
                                                     const char *types,
                                                     struct shef_rtde_recipe *out_recipe,
                                                     struct shef_error *err);

/* The variable of a name and type, or NULL. */
const struct shef_rtde_variable *shef_rtde_find(const struct shef_rtde_recipe *recipe,
                                                const char *name, enum shef_rtde_type type);

/* Whether the bytes are one whole package of the recipe. */
bool shef_rtde_package_is(const struct shef_rtde_recipe *recipe, const uint8_t *bytes,
                          size_t n_bytes);

/* Makes a package whose variables are all zero.
 *   recipe_number  only in version 2
 *   out_bytes      recipe->package_bytes */
void shef_rtde_package_begin(const struct shef_rtde_recipe *recipe, uint8_t recipe_number,
                             uint8_t *out_bytes);

/* Read and write a variable of type DOUBLE, VECTOR3D or VECTOR6D: 1, 3 or 6 values. */
void shef_rtde_get_doubles(const struct shef_rtde_variable *variable, const uint8_t *package,
                           double *out_values);
void shef_rtde_put_doubles(const struct shef_rtde_variable *variable, const double *values,
                           uint8_t *package);

/* The same for BOOL, UINT8, UINT32, UINT64 and INT32, whose sign is kept. */
int64_t shef_rtde_get_integer(const struct shef_rtde_variable *variable, const uint8_t *package);
void shef_rtde_put_integer(const struct shef_rtde_variable *variable, int64_t value,
                           uint8_t *package);

#ifdef __cplusplus
}
#endif

#endif
