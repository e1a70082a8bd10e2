#include "core/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "support/support.h"

static bool knows_nameless_files = true;
static size_t max_write_bytes = SIZE_MAX;
static bool disk_is_full;
static bool disk_is_broken;
static int n_file_syncs;
static int n_folder_syncs;
static const char *watched_path; /* looked at when something is synced */
static char content_at_file_sync[64];
static char content_at_folder_sync[64];

/* Stands in for the C library's open(): a file system without O_TMPFILE can be had at will. */
int open(const char *path, int flags, ...)
{
    va_list args;

    va_start(args, flags);
    const unsigned mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(args, unsigned) : 0;
    va_end(args);
    if (!knows_nameless_files && (flags & O_TMPFILE) == O_TMPFILE) {
        errno = EOPNOTSUPP;
        return -1;
    }
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

/* Stands in for write(): short writes and a full disk can be had at will. */
ssize_t write(int fd, const void *bytes, size_t n_bytes)
{
    if (disk_is_full && fd > 2) {
        errno = ENOSPC;
        return -1;
    }
    if (fd > 2 && n_bytes > max_write_bytes)
        n_bytes = max_write_bytes;
    return syscall(SYS_write, fd, bytes, n_bytes);
}

static void read_watched(char content[64])
{
    FILE *file = watched_path ? fopen(watched_path, "r") : NULL;
    const size_t n = file ? fread(content, 1, 63, file) : 0;

    content[n] = '\0';
    if (file)
        fclose(file);
}

/* Stands in for fsync(): notes what a power cut at that moment would find under the name. */
int fsync(int fd)
{
    struct stat info;

    TEST_ASSERT_EQUAL_INT(0, fstat(fd, &info));
    if (S_ISDIR(info.st_mode)) {
        n_folder_syncs++;
        read_watched(content_at_folder_sync);
    } else {
        n_file_syncs++;
        read_watched(content_at_file_sync);
    }
    if (disk_is_broken) {
        errno = EIO;
        return -1;
    }
    return 0;
}

void setUp(void)
{
    disk_is_broken = false;
    n_file_syncs = 0;
    n_folder_syncs = 0;
    watched_path = NULL;
    knows_nameless_files = true;
    max_write_bytes = SIZE_MAX;
    disk_is_full = false;
}

static void expect_content(const char *path, const char *expected)
{
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1000, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL_size_t(strlen(expected), n_bytes);
    TEST_ASSERT_EQUAL_STRING(expected, (const char *)bytes);
    free(bytes);
}

static void write_text(const char *path, const char *text)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_file_replace(path, text, strlen(text), &err), err.text);
}

static void expect_write_then_replace(const char *name)
{
    const char *path = shef_test_temp_path(name);
    const int n_before = shef_test_temp_count();

    write_text(path, "first content");
    expect_content(path, "first content");
    write_text(path, "second");
    expect_content(path, "second");
    write_text(path, "");
    expect_content(path, "");
    TEST_ASSERT_EQUAL_INT(n_before + 1, shef_test_temp_count());
}

static void test_a_file_is_created_and_then_replaced(void)
{
    expect_write_then_replace("plain");
}

static void test_the_same_on_a_file_system_without_nameless_files(void)
{
    knows_nameless_files = false;
    expect_write_then_replace("fallback");
}

static void test_what_a_killed_program_left_is_no_hindrance(void)
{
    const int n_numbers = 100; /* more than this program has used */
    char path[4200];
    char name[64];

    snprintf(path, sizeof path, "%s", shef_test_temp_path("again"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "old", 3, NULL));

    const int n_before = shef_test_temp_count();

    for (int i = 0; i < n_numbers; i++) {
        snprintf(name, sizeof name, ".shef-%ld-%d.tmp", (long)getpid(), i);
        const int fd = open(shef_test_temp_path(name), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);

        TEST_ASSERT_TRUE(fd >= 0);
        close(fd);
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "new", 3, NULL));
    expect_content(path, "new");
    for (int i = 0; i < n_numbers; i++) {
        snprintf(name, sizeof name, ".shef-%ld-%d.tmp", (long)getpid(), i);
        unlink(shef_test_temp_path(name));
    }
    TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
}

static void test_short_writes_are_continued(void)
{
    max_write_bytes = 3;
    write_text(shef_test_temp_path("short"), "eleven char");
    expect_content(shef_test_temp_path("short"), "eleven char");
}

static void test_a_full_disk_keeps_the_old_file_and_leaves_nothing_new(void)
{
    for (int nameless = 0; nameless <= 1; nameless++) {
        const char *path = shef_test_temp_path("kept");
        struct shef_error err = { 0 };

        knows_nameless_files = nameless;
        write_text(path, "old");
        const int n_before = shef_test_temp_count();

        disk_is_full = true;
        TEST_ASSERT_EQUAL(SHEF_ERR_NO_SPACE, shef_file_replace(path, "new", 3, &err));
        TEST_ASSERT_NOT_NULL(strstr(err.text, "kept"));
        TEST_ASSERT_EQUAL(SHEF_ERR_NO_SPACE,
                          shef_file_replace(shef_test_temp_path("absent"), "new", 3, NULL));
        disk_is_full = false;
        expect_content(path, "old");
        TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
    }
}

static void test_the_disk_has_the_data_before_the_name_is_given(void)
{
    for (int nameless = 0; nameless <= 1; nameless++) {
        const char *path = shef_test_temp_path("durable");

        setUp();
        knows_nameless_files = nameless;
        write_text(path, "old");
        TEST_ASSERT_EQUAL_INT(1, n_file_syncs);
        watched_path = path;
        write_text(path, "new");
        TEST_ASSERT_EQUAL_INT(2, n_file_syncs);
        TEST_ASSERT_EQUAL_STRING("old", content_at_file_sync);
        TEST_ASSERT_EQUAL_INT(2, n_folder_syncs);
        TEST_ASSERT_EQUAL_STRING("new", content_at_folder_sync);
    }
}

static void test_a_file_that_the_disk_cannot_keep_leaves_the_old_one(void)
{
    for (int nameless = 0; nameless <= 1; nameless++) {
        const char *path = shef_test_temp_path("kept-too");

        setUp();
        knows_nameless_files = nameless;
        write_text(path, "old");
        const int n_before = shef_test_temp_count();

        disk_is_broken = true;
        TEST_ASSERT_EQUAL(SHEF_ERR_IO, shef_file_replace(path, "new", 3, NULL));
        expect_content(path, "old");
        TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
    }
}

static void test_a_lazy_file_does_not_wait_for_the_disk(void)
{
    const char *path = shef_test_temp_path("lazy");

    disk_is_broken = true;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace_lazily(path, "text", 4, NULL));
    TEST_ASSERT_EQUAL_INT(0, n_file_syncs + n_folder_syncs);
    expect_content(path, "text");
}

static void test_new_files_get_the_mode_that_the_umask_allows(void)
{
    const mode_t old_mask = umask(027);

    for (int nameless = 0; nameless <= 1; nameless++) {
        const char *path = shef_test_temp_path(nameless ? "mode-1" : "mode-0");
        struct stat info;

        knows_nameless_files = nameless;
        write_text(path, "x");
        TEST_ASSERT_EQUAL_INT(0, stat(path, &info));
        TEST_ASSERT_EQUAL_HEX32(0640, info.st_mode & 0777);
    }
    umask(old_mask);
}

static void test_a_device_is_written_to_and_not_replaced(void)
{
    struct stat info;

    write_text("/dev/null", "gone");
    TEST_ASSERT_EQUAL_INT(0, stat("/dev/null", &info));
    TEST_ASSERT_TRUE(S_ISCHR(info.st_mode));
}

static void test_a_missing_folder_and_a_folder_as_target_are_errors(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_file_replace(shef_test_temp_path("no/file"), "x", 1, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "no/file"));
    const int n_before = shef_test_temp_count();
    TEST_ASSERT_EQUAL(SHEF_ERR_IO, shef_file_replace(shef_test_temp_folder(), "x", 1, &err));
    TEST_ASSERT_EQUAL_INT(n_before, shef_test_temp_count());
}

static void test_a_relative_path_is_written_in_the_working_folder(void)
{
    TEST_ASSERT_EQUAL_INT(0, chdir(shef_test_temp_folder()));
    write_text("relative", "here");
    expect_content(shef_test_temp_path("relative"), "here");
    TEST_ASSERT_EQUAL_INT(0, chdir("/"));
}

static void test_what_cannot_be_read_is_refused_with_a_reason(void)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    struct shef_error err = { 0 };
    const char *fifo = shef_test_temp_path("fifo");

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_file_read("/no/such", 9, &bytes, &n_bytes, &err));
    TEST_ASSERT_EQUAL_STRING("read '/no/such': No such file or directory", err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_file_read(shef_test_temp_folder(), 9, &bytes, &n_bytes, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "not a regular file"));
    TEST_ASSERT_EQUAL_INT(0, mkfifo(fifo, 0600));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_file_read(fifo, 9, &bytes, &n_bytes, &err));
    write_text(shef_test_temp_path("ten"), "0123456789");
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_file_read(shef_test_temp_path("ten"), 9, &bytes, &n_bytes, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "10 bytes are more than the 9"));
    TEST_ASSERT_NULL(bytes);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_file_is_created_and_then_replaced);
    RUN_TEST(test_the_same_on_a_file_system_without_nameless_files);
    RUN_TEST(test_what_a_killed_program_left_is_no_hindrance);
    RUN_TEST(test_short_writes_are_continued);
    RUN_TEST(test_a_full_disk_keeps_the_old_file_and_leaves_nothing_new);
    RUN_TEST(test_the_disk_has_the_data_before_the_name_is_given);
    RUN_TEST(test_a_file_that_the_disk_cannot_keep_leaves_the_old_one);
    RUN_TEST(test_a_lazy_file_does_not_wait_for_the_disk);
    RUN_TEST(test_new_files_get_the_mode_that_the_umask_allows);
    RUN_TEST(test_a_device_is_written_to_and_not_replaced);
    RUN_TEST(test_a_missing_folder_and_a_folder_as_target_are_errors);
    RUN_TEST(test_a_relative_path_is_written_in_the_working_folder);
    RUN_TEST(test_what_cannot_be_read_is_refused_with_a_reason);
    return UNITY_END();
}
