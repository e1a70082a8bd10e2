/* Result folders appear whole or not at all, and never take a stranger's files with them. */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "sheftool/output_folder.h"
#include "support/support.h"

static struct shef_output_folder folder;
static struct shef_error err;

static bool exists(const char *path)
{
    struct stat info;

    return stat(path, &info) == 0;
}

/* Writes a file `name` into the folder under way. */
static void add_file(const char *name)
{
    char path[SHEF_PATH_BYTES];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_add(&folder, path, &err, "%s", name));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "x", 1, &err));
}

static void commit(void)
{
    json_t *root = json_object();

    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_commit(&folder, root, &err));
    json_decref(root);
}

static void make_result(const char *path, const char *name)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_output_folder_open(&folder, path, "index.json", &err),
                              err.text);
    add_file(name);
    commit();
}

static void test_nothing_is_seen_before_commit_and_everything_after(void)
{
    const char *path = shef_test_temp_path("whole");
    const int n_before = shef_test_temp_count();

    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_open(&folder, path, "index.json", &err));
    add_file("1.pfm");
    TEST_ASSERT_FALSE(exists(path));
    commit();
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("whole/1.pfm")));
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("whole/index.json")));
    TEST_ASSERT_EQUAL_INT(n_before + 1, shef_test_temp_count());
}

static void test_discard_leaves_nothing_behind_not_even_new_parents(void)
{
    const int n_before = shef_test_temp_count();

    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_open(&folder, shef_test_temp_path("a/b/c"),
                                                       "index.json", &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_add_folder(&folder, "inner", &err));
    add_file("1.pfm");
    add_file("inner/2.pfm");
    shef_output_folder_discard(&folder);
    TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
}

static void test_earlier_result_is_replaced_whole(void)
{
    const char *path = shef_test_temp_path("again");

    make_result(path, "1.pfm");
    make_result(path, "2.pfm");
    TEST_ASSERT_FALSE(exists(shef_test_temp_path("again/1.pfm")));
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("again/2.pfm")));
}

static void test_failed_second_run_leaves_the_first_result(void)
{
    const char *path = shef_test_temp_path("kept");

    make_result(path, "1.pfm");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_open(&folder, path, "index.json", &err));
    add_file("2.pfm");
    shef_output_folder_discard(&folder);
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("kept/1.pfm")));
    TEST_ASSERT_FALSE(exists(shef_test_temp_path("kept/2.pfm")));
}

static void expect_refused(const char *path, const char *named)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_output_folder_open(&folder, path, "index.json", &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, named), err.text);
}

static void test_folder_with_a_strangers_file_is_refused_and_untouched(void)
{
    char stranger[SHEF_PATH_BYTES];

    make_result(shef_test_temp_path("mixed"), "1.pfm");
    snprintf(stranger, sizeof stranger, "%s", shef_test_temp_path("mixed/thesis.tex"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(stranger, "x", 1, &err));
    expect_refused(shef_test_temp_path("mixed"), "thesis.tex");
    TEST_ASSERT_TRUE(exists(stranger));
}

static void test_strangers_file_in_an_inner_folder_of_ours_is_seen(void)
{
    char stranger[SHEF_PATH_BYTES];

    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_output_folder_open(&folder, shef_test_temp_path("deep"), "index.json", &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_output_folder_add_folder(&folder, "gt", &err));
    add_file("gt/1.pfm");
    commit();
    snprintf(stranger, sizeof stranger, "%s", shef_test_temp_path("deep/gt/mine.txt"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(stranger, "x", 1, &err));
    expect_refused(shef_test_temp_path("deep"), "gt/mine.txt");
}

static void test_empty_folder_is_taken_also_with_a_slash_at_the_end(void)
{
    char path[SHEF_PATH_BYTES];

    snprintf(path, sizeof path, "%s/", shef_test_temp_path("empty"));
    TEST_ASSERT_EQUAL_INT(0, mkdir(path, 0755));
    make_result(path, "1.pfm");
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("empty/1.pfm")));
}

static void test_files_and_nameless_folders_are_refused(void)
{
    char file[SHEF_PATH_BYTES];

    snprintf(file, sizeof file, "%s", shef_test_temp_path("plain"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(file, "x", 1, &err));
    expect_refused(file, "is no folder");
    expect_refused("/", "'/'");
}

static void test_link_stays_and_its_folder_takes_the_result(void)
{
    char link[SHEF_PATH_BYTES];
    char with_slash[SHEF_PATH_BYTES + 1];
    struct stat info;

    make_result(shef_test_temp_path("target"), "1.pfm");
    snprintf(link, sizeof link, "%s", shef_test_temp_path("link"));
    snprintf(with_slash, sizeof with_slash, "%s/", link);
    TEST_ASSERT_EQUAL_INT(0, symlink("target", link));
    const int n_before = shef_test_temp_count();

    make_result(link, "2.pfm");
    TEST_ASSERT_FALSE(exists(shef_test_temp_path("target/1.pfm")));
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("target/2.pfm")));
    make_result(with_slash, "3.pfm");
    TEST_ASSERT_TRUE(exists(shef_test_temp_path("target/3.pfm")));
    TEST_ASSERT_EQUAL_INT(0, lstat(link, &info));
    TEST_ASSERT_TRUE(S_ISLNK(info.st_mode));
    TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
}

static void test_link_to_nothing_and_mount_point_are_refused(void)
{
    const char *link = shef_test_temp_path("dangling");

    TEST_ASSERT_EQUAL_INT(0, symlink("nowhere", link));
    const int n_before = shef_test_temp_count();

    expect_refused(link, "link to a folder that does not exist");
    expect_refused("/proc", "'/proc' is a mount point; name a folder inside it");
    TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_seen_before_commit_and_everything_after);
    RUN_TEST(test_discard_leaves_nothing_behind_not_even_new_parents);
    RUN_TEST(test_earlier_result_is_replaced_whole);
    RUN_TEST(test_failed_second_run_leaves_the_first_result);
    RUN_TEST(test_folder_with_a_strangers_file_is_refused_and_untouched);
    RUN_TEST(test_strangers_file_in_an_inner_folder_of_ours_is_seen);
    RUN_TEST(test_empty_folder_is_taken_also_with_a_slash_at_the_end);
    RUN_TEST(test_files_and_nameless_folders_are_refused);
    RUN_TEST(test_link_stays_and_its_folder_takes_the_result);
    RUN_TEST(test_link_to_nothing_and_mount_point_are_refused);
    return UNITY_END();
}
