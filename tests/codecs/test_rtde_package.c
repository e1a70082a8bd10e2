#include "codecs/rtde_package.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "support/support.h"

static struct shef_rtde_recipe recipe;
static struct shef_error err;

static void parse(uint32_t version, const char *names, const char *types)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_rtde_recipe_parse(version, names, types, &recipe, &err),
                              err.text);
}

static void expect_refused(uint32_t version, const char *names, const char *types,
                           const char *reason)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_FORMAT,
                              shef_rtde_recipe_parse(version, names, types, &recipe, &err), names);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_packages_have_the_length_of_the_guide(void)
{
    /* The worked example: timestamp and pose take 60 bytes in version 2, 59 in version 1. */
    parse(2, "timestamp,actual_TCP_pose", "DOUBLE,VECTOR6D");
    TEST_ASSERT_EQUAL_UINT32(60, recipe.package_bytes);
    TEST_ASSERT_EQUAL_UINT32(12, recipe.variables[1].offset);
    parse(1, "timestamp,actual_TCP_pose", "DOUBLE,VECTOR6D");
    TEST_ASSERT_EQUAL_UINT32(59, recipe.package_bytes);
    parse(2, "a,b,c,d,e,f,g,h,i,j",
          "BOOL,UINT8,UINT32,INT32,UINT64,DOUBLE,VECTOR3D,VECTOR6D,VECTOR6INT32,VECTOR6UINT32");
    TEST_ASSERT_EQUAL_UINT32(4 + 1 + 1 + 4 + 4 + 8 + 8 + 24 + 48 + 24 + 24, recipe.package_bytes);
}

static void test_a_package_begins_as_the_guide_says(void)
{
    const uint8_t expected[] = { 0x00, 0x3c, 0x55, 0x01, 0x40, 0x09,
                                 0x21, 0xfb, 0x54, 0x44, 0x2d, 0x18 };
    uint8_t package[60];

    parse(2, "timestamp,actual_TCP_pose", "DOUBLE,VECTOR6D");
    shef_rtde_package_begin(&recipe, 1, package);
    shef_rtde_put_doubles(&recipe.variables[0], &(double){ M_PI }, package);
    TEST_ASSERT_EQUAL_MEMORY(expected, package, sizeof expected);
    TEST_ASSERT_TRUE(shef_rtde_package_is(&recipe, package, 60));
    TEST_ASSERT_FALSE(shef_rtde_package_is(&recipe, package, 59));
    package[2] = 'M';
    TEST_ASSERT_FALSE(shef_rtde_package_is(&recipe, package, 60));
    package[2] = 'U';
    package[1] = 61;
    TEST_ASSERT_FALSE(shef_rtde_package_is(&recipe, package, 60));
}

static void test_values_come_back_from_their_places(void)
{
    const double vector[6] = { 1, -2.5, 1e-300, -0.0, INFINITY, 6 };
    double values[6];
    uint8_t package[256];

    parse(2, "m,timestamp,v,n,u", "INT32,DOUBLE,VECTOR6D,UINT8,UINT64");
    shef_rtde_package_begin(&recipe, 1, package);
    shef_rtde_put_integer(&recipe.variables[0], -7, package);
    shef_rtde_put_doubles(&recipe.variables[1], &(double){ 0.008 }, package);
    shef_rtde_put_doubles(&recipe.variables[2], vector, package);
    shef_rtde_put_integer(&recipe.variables[3], 200, package);
    shef_rtde_put_integer(&recipe.variables[4], INT64_C(1) << 62, package);
    TEST_ASSERT_EQUAL_INT64(-7, shef_rtde_get_integer(&recipe.variables[0], package));
    shef_rtde_get_doubles(&recipe.variables[1], package, values);
    TEST_ASSERT_EQUAL_DOUBLE(0.008, values[0]);
    shef_rtde_get_doubles(&recipe.variables[2], package, values);
    TEST_ASSERT_EQUAL_MEMORY(vector, values, sizeof vector);
    TEST_ASSERT_EQUAL_INT64(200, shef_rtde_get_integer(&recipe.variables[3], package));
    TEST_ASSERT_EQUAL_INT64(INT64_C(1) << 62, shef_rtde_get_integer(&recipe.variables[4], package));
}

static void test_names_are_found_with_their_type(void)
{
    parse(2, " timestamp , actual_TCP_pose,", "DOUBLE,VECTOR6D");
    TEST_ASSERT_EQUAL_UINT32(2, recipe.n_variables);
    TEST_ASSERT_EQUAL_PTR(&recipe.variables[1],
                          shef_rtde_find(&recipe, "actual_TCP_pose", SHEF_RTDE_VECTOR6D));
    TEST_ASSERT_NULL(shef_rtde_find(&recipe, "actual_TCP_pose", SHEF_RTDE_DOUBLE));
    TEST_ASSERT_NULL(shef_rtde_find(&recipe, "actual_TCP", SHEF_RTDE_VECTOR6D));
}

static void test_recipes_that_cannot_be_are_refused_with_a_sentence(void)
{
    char many[SHEF_RTDE_MAX_VARIABLES * 6 + 20] = "";
    char types[SHEF_RTDE_MAX_VARIABLES * 6 + 20] = "";

    expect_refused(3, "a", "DOUBLE", "there are 1 and 2");
    expect_refused(2, "", "", "0 names");
    expect_refused(2, "a,b", "DOUBLE", "'b' has no known type");
    expect_refused(2, "a", "DOUBLE,DOUBLE", "not as many types");
    expect_refused(2, "a", "NOT_FOUND", "'NOT_FOUND'");
    expect_refused(2, "a,,b", "DOUBLE,DOUBLE,DOUBLE", "name 2 is empty");
    expect_refused(2, "a,a", "DOUBLE,DOUBLE", "twice");
    expect_refused(2, "a_name_that_is_longer_than_any_that_the_controller_knows", "DOUBLE",
                   "too long");
    for (int i = 0; i <= SHEF_RTDE_MAX_VARIABLES; i++) {
        snprintf(many + strlen(many), 16, "v%d,", i);
        strcat(types, "BOOL,");
    }
    expect_refused(2, many, types, "one too many");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_packages_have_the_length_of_the_guide);
    RUN_TEST(test_a_package_begins_as_the_guide_says);
    RUN_TEST(test_values_come_back_from_their_places);
    RUN_TEST(test_names_are_found_with_their_type);
    RUN_TEST(test_recipes_that_cannot_be_are_refused_with_a_sentence);
    return UNITY_END();
}
