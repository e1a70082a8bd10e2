/* Numbered folders, lists of pairs, and the scenes they fall into. */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "core/file.h"
#include "sheftool/pair_list.h"
#include "sheftool/paths.h"
#include "sheftool/scenes.h"
#include "support/support.h"

static const char *const endings[2] = { ".pfm", ".png" };
static struct shef_numbered_list list;
static struct shef_error err;

void tearDown(void)
{
    shef_numbered_list_free(&list);
}

static void touch(const char *folder, const char *name)
{
    char path[SHEF_PATH_BYTES];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "x", 1, &err));
}

static const char *make_folder(const char *name)
{
    const char *path = shef_test_temp_path(name);

    TEST_ASSERT_EQUAL_INT(0, mkdir(path, 0755));
    return path;
}

/* A list of the numbers first..last without files. */
static void make_list(int64_t first, int64_t last)
{
    char name[32];
    snprintf(name, sizeof name, "list-%lld-%lld", (long long)first, (long long)last);
    const char *folder = make_folder(name);

    for (int64_t n = first; n <= last; n++) {
        snprintf(name, sizeof name, "%lld.png", (long long)n);
        touch(folder, name);
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_numbered_list_read(&list, folder, endings, &err));
}

static void test_files_come_in_numeric_order_and_others_are_passed_over(void)
{
    const char *folder = make_folder("order");

    touch(folder, "10.png");
    touch(folder, "9.png");
    touch(folder, "0100.pfm");
    touch(folder, "7.conf.pfm");
    touch(folder, "7.txt");
    touch(folder, "a7.png");
    touch(folder, "notes.md");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_numbered_list_read(&list, folder, endings, &err));
    TEST_ASSERT_EQUAL_size_t(3, list.n);
    TEST_ASSERT_EQUAL_INT64(9, list.at[0].number);
    TEST_ASSERT_EQUAL_INT64(10, list.at[1].number);
    TEST_ASSERT_EQUAL_INT64(100, list.at[2].number);
    TEST_ASSERT_EQUAL_STRING("0100", list.at[2].stem);
}

static void test_one_number_with_both_endings_counts_once(void)
{
    const char *folder = make_folder("both");

    touch(folder, "3.png");
    touch(folder, "3.pfm");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_numbered_list_read(&list, folder, endings, &err));
    TEST_ASSERT_EQUAL_size_t(1, list.n);
}

static void test_one_number_spelled_twice_is_refused(void)
{
    const char *folder = make_folder("twice");

    touch(folder, "3.png");
    touch(folder, "03.png");
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_numbered_list_read(&list, folder, endings, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "'03' and '3'"));
}

static void test_empty_and_missing_folders_are_named(void)
{
    const char *folder = make_folder("bare");

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_numbered_list_read(&list, folder, endings, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "bare' holds no numbered files such as 1.pfm or 1.png"));
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_numbered_list_read(&list, "/nowhere/at/all", endings, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "'/nowhere/at/all'"));
}

static void test_picking_keeps_numbers_and_ranges(void)
{
    make_list(1, 20);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_numbered_pick(&list, "18-30,3,5-6", &err));
    TEST_ASSERT_EQUAL_size_t(6, list.n);
    TEST_ASSERT_EQUAL_INT64(3, list.at[0].number);
    TEST_ASSERT_EQUAL_INT64(20, list.at[5].number);
    TEST_ASSERT_NOT_NULL(shef_numbered_find(&list, 19));
    TEST_ASSERT_NULL(shef_numbered_find(&list, 4));
}

static void test_picking_what_is_not_there_is_refused_and_changes_nothing(void)
{
    make_list(1, 9);
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_numbered_pick(&list, "1-3,12", &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "12"));
    TEST_ASSERT_EQUAL_size_t(9, list.n);
}

static void test_lists_that_are_none_are_refused(void)
{
    static const char *const bad[] = { "", "a", "1,,2", "1-", "-3", "5-3", "1;2", "1, 2", "1,2," };

    make_list(1, 5);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_INVALID, shef_numbered_pick(&list, bad[i], &err),
                                  bad[i]);
}

static void test_numbers_up_to_147_are_the_authors_scenes(void)
{
    struct shef_scenes scenes;

    make_list(40, 60);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_scenes_find(&scenes, "/nowhere", &list, &err));
    TEST_ASSERT_EQUAL_INT32(2, scenes.n); /* simple boxes have no pair here */
    TEST_ASSERT_EQUAL_STRING("complex boxes", scenes.at[shef_scenes_of(&scenes, 49)].name);
    TEST_ASSERT_EQUAL_STRING("picnic", scenes.at[shef_scenes_of(&scenes, 50)].name);
}

static void test_other_numbers_are_one_scene(void)
{
    struct shef_scenes scenes;

    make_list(146, 149);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_scenes_find(&scenes, "/nowhere", &list, &err));
    TEST_ASSERT_EQUAL_INT32(1, scenes.n);
    TEST_ASSERT_EQUAL_STRING("all", scenes.at[0].name);
    TEST_ASSERT_EQUAL_INT32(0, shef_scenes_of(&scenes, 149));
}

static void write_scenes(const char *folder, const char *text)
{
    char path[SHEF_PATH_BYTES];

    snprintf(path, sizeof path, "%s/scenes.json", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, text, strlen(text), &err));
}

static void test_scenes_file_names_the_scenes_and_must_cover_the_pairs(void)
{
    char folder[SHEF_FOLDER_BYTES];
    struct shef_scenes scenes;

    snprintf(folder, sizeof folder, "%s", make_folder("named"));
    make_list(1, 8);
    write_scenes(folder, "{\"scenes\": [{\"name\": \"lab\", \"first\": 1, \"last\": 3},"
                         "{\"name\": \"hall\", \"first\": 4, \"last\": 8}]}");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_scenes_find(&scenes, folder, &list, &err));
    TEST_ASSERT_EQUAL_STRING("hall", scenes.at[shef_scenes_of(&scenes, 4)].name);

    write_scenes(folder, "{\"scenes\": [{\"name\": \"lab\", \"first\": 1, \"last\": 7}]}");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_scenes_find(&scenes, folder, &list, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "pair 8 belongs to no scene"));

    write_scenes(folder, "{\"scenes\": [{\"name\": \"lab\", \"first\": 9");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_scenes_find(&scenes, folder, &list, &err));
    write_scenes(folder, "{\"scenes\": [{\"name\": \"lab\", \"first\": \"one\", \"last\": 2}]}");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_scenes_find(&scenes, folder, &list, &err));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_files_come_in_numeric_order_and_others_are_passed_over);
    RUN_TEST(test_one_number_with_both_endings_counts_once);
    RUN_TEST(test_one_number_spelled_twice_is_refused);
    RUN_TEST(test_empty_and_missing_folders_are_named);
    RUN_TEST(test_picking_keeps_numbers_and_ranges);
    RUN_TEST(test_picking_what_is_not_there_is_refused_and_changes_nothing);
    RUN_TEST(test_lists_that_are_none_are_refused);
    RUN_TEST(test_numbers_up_to_147_are_the_authors_scenes);
    RUN_TEST(test_other_numbers_are_one_scene);
    RUN_TEST(test_scenes_file_names_the_scenes_and_must_cover_the_pairs);
    return UNITY_END();
}
