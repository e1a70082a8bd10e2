/* A disk that fails, fills or vanishes while it is recorded to: the stream goes on, what was
 * written can be read, and one sentence says what happened. */
#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "played.h"
#include "record/manifest.h"
#include "record/recorded_frames.h"
#include "record/verify.h"
#include "support/namespaces.h"
#include "support/support.h"

static struct shef_error err;
static bool has_namespace;

static const char *text_of(const json_t *answer, const char *key)
{
    const char *text = json_string_value(json_object_get(answer, key));

    TEST_ASSERT_NOT_NULL_MESSAGE(text, key);
    return text;
}

static void expect_words(const char *text, const char *words)
{
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, words), text);
}

/* A looped source without end, whose recordings go to a folder of its own, on a disk of so many MB;
 * 0: on the usual one. */
static struct shef_config looped(const char *name, int disk_mb)
{
    struct shef_config config = played_config();
    char options[32];

    config.source.loop = true;
    config.record.min_free_mb = 0;
    snprintf(config.record.folder, sizeof config.record.folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL_INT(0, mkdir(config.record.folder, 0777));
    if (disk_mb == 0)
        return config;
    if (!has_namespace)
        TEST_IGNORE_MESSAGE("this user may not mount a small file system to fill");
    snprintf(options, sizeof options, "size=%dm", disk_mb);
    TEST_ASSERT_EQUAL_INT(0, mount("none", config.record.folder, "tmpfs", 0, options));
    return config;
}

static void begin(struct shef_service *service)
{
    json_decref(played_ask(service, "record start", "{\"name\": \"tried\"}"));
}

static int64_t number_now(struct shef_service *service, const char *path)
{
    json_t *status = played_ask(service, "status", NULL);
    const int64_t n = played_number(status, path);

    json_decref(status);
    return n;
}

static void wait_for_bytes(struct shef_service *service, int64_t n_bytes)
{
    while (number_now(service, "recording.n_bytes") < n_bytes)
        usleep(1000);
}

/* As the service's main loop does, until the recording has ended by itself. Returns the sentence,
 * which status says. */
static const char *wait_for_end(struct shef_service *service)
{
    static char reason[SHEF_ERROR_TEXT_BYTES];
    json_t *status;
    bool is_on;

    do {
        (void)shef_service_progress(service);
        status = played_ask(service, "status", NULL);
        is_on = strcmp(text_of(json_object_get(status, "recording"), "state"), "on") == 0;
        if (!is_on) {
            TEST_ASSERT_EQUAL_STRING("stopped",
                                     text_of(json_object_get(status, "recording"), "verdict"));
            snprintf(reason, sizeof reason, "%s",
                     text_of(json_object_get(status, "recording"), "reason"));
        }
        json_decref(status);
        usleep(1000);
    } while (is_on);
    TEST_ASSERT_NULL_MESSAGE(strchr(reason, '\n'), reason);
    return reason;
}

/* Frames still come in, and none was lost. */
static void expect_unharmed(struct shef_service *service)
{
    const int64_t n_in = number_now(service, "frames.n_in");

    while (number_now(service, "frames.n_in") < n_in + PLAYED_FRAMES)
        usleep(1000);
    TEST_ASSERT_EQUAL_INT64(0, number_now(service, "frames.n_lost"));
    TEST_ASSERT_EQUAL_INT64(0, number_now(service, "events.n_lost_buffers"));
    TEST_ASSERT_EQUAL_INT64(0, number_now(service, "events.n_violations"));
}

/* The command tells it, too, once. */
static void expect_told(struct shef_service *service, const char *reason)
{
    json_t *answer = played_ask(service, "record stop", NULL);

    TEST_ASSERT_EQUAL_STRING("stopped", text_of(answer, "verdict"));
    TEST_ASSERT_EQUAL_STRING(reason, text_of(answer, "reason"));
    json_decref(answer);
    TEST_ASSERT_EQUAL_STRING("record stop: nothing is being recorded",
                             played_refusal(service, "record stop", NULL));
}

/* What `record list` says of the only recording. */
static void expect_listed(struct shef_service *service, const char *state, const char *reason)
{
    json_t *answer = played_ask(service, "record list", NULL);
    const json_t *list = json_object_get(answer, "recordings");

    TEST_ASSERT_EQUAL_size_t(1, json_array_size(list));
    TEST_ASSERT_EQUAL_STRING("tried", text_of(json_array_get(list, 0), "name"));
    TEST_ASSERT_EQUAL_STRING(state, text_of(json_array_get(list, 0), "state"));
    expect_words(text_of(json_array_get(list, 0), "reason"), reason);
    json_decref(answer);
}

static const char *path_of(const struct shef_config *config)
{
    static char path[600];

    snprintf(path, sizeof path, "%s/tried", config->record.folder);
    return path;
}

static struct shef_verify_report verify(const struct shef_config *config)
{
    struct shef_verify_report report;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recording_verify(path_of(config), NULL, NULL, &report, &err), err.text);
    return report;
}

static void end(struct shef_service *service)
{
    shef_service_stop(service);
    shef_service_destroy(service);
}

static void clean_up(const struct shef_config *config)
{
    char command[1024];

    if (has_namespace)
        (void)umount(config->record.folder);
    snprintf(command, sizeof command, "rm -rf '%s'", config->record.folder);
    TEST_ASSERT_EQUAL_INT(0, system(command));
}

/* ---- full -------------------------------------------------------------------------------- */

static void test_a_full_disk_ends_the_recording_and_nothing_else(void)
{
    struct shef_config config = looped("full", 90);
    struct shef_service *service = played_start(&config);
    struct shef_verify_report report;
    struct shef_manifest manifest;
    const char *reason;

    begin(service);
    reason = wait_for_end(service);
    expect_words(reason, config.record.folder);
    expect_words(reason, "are kept): No space left on device");
    expect_words(reason, "; not written: ");
    expect_words(reason, "; make room or set record.folder to another disk");
    expect_unharmed(service);
    expect_told(service, reason);
    expect_listed(service, "closed", reason);
    end(service);

    report = verify(&config);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, report.n_problems, report.problems[0]);
    TEST_ASSERT_GREATER_THAN_UINT64(10, report.n_blocks);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_read(path_of(&config), &manifest, &err),
                              err.text);
    TEST_ASSERT_TRUE(manifest.is_closed);
    TEST_ASSERT_EQUAL(SHEF_VERDICT_STOPPED, manifest.verdict);
    TEST_ASSERT_EQUAL_STRING(reason, manifest.reason);
    TEST_ASSERT_GREATER_THAN_UINT64(0, manifest.events.n_lost_buffers +
                                           manifest.parts[SHEF_PART_FRAMES].n_lost);
    shef_manifest_free(&manifest);
    clean_up(&config);
}

static void test_room_is_looked_at_before_and_while_recording(void)
{
    struct shef_config config = looped("nearly_full", 250);
    struct shef_service *service = played_start(&config);
    const char *reason;

    config.record.min_free_mb = 4000;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_service_apply(service, &config, &err));
    reason = played_refusal(service, "record start", "{\"name\": \"tried\"}");
    expect_words(reason, "MB left, less than record.min_free_mb, 4000; make room or set "
                         "record.folder to another disk");
    TEST_ASSERT_NOT_EQUAL_INT(0, access(path_of(&config), F_OK));

    /* As much as waits in the rings can still be written. */
    config.record.min_free_mb = 120;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_service_apply(service, &config, &err));
    begin(service);
    reason = wait_for_end(service);
    expect_words(reason, "MB left, less than record.min_free_mb, 120; ");
    expect_words(reason, "make room");
    expect_unharmed(service);
    expect_told(service, reason);
    expect_listed(service, "closed", reason);
    end(service);
    TEST_ASSERT_EQUAL_INT(0, verify(&config).n_problems);
    clean_up(&config);
}

/* ---- taken away -------------------------------------------------------------------------- */

static void test_a_deleted_recording_is_noticed(void)
{
    struct shef_config config = looped("deleted", 0);
    struct shef_service *service = played_start(&config);
    char command[1024];
    const char *reason;

    begin(service);
    wait_for_bytes(service, 1000000);
    snprintf(command, sizeof command, "rm -r '%s'", path_of(&config));
    TEST_ASSERT_EQUAL_INT(0, system(command));
    reason = wait_for_end(service);
    expect_words(reason, path_of(&config));
    expect_words(reason, "somebody has deleted this file while it was written, and what was in it "
                         "is lost");
    expect_unharmed(service);
    expect_told(service, reason);
    end(service);
    clean_up(&config);
}

/* Makes root as powerless as anybody before file permissions. */
static void obey_permissions(bool obey)
{
    struct __user_cap_header_struct header = { .version = _LINUX_CAPABILITY_VERSION_3 };
    struct __user_cap_data_struct data[2];
    const uint32_t mask = 1u << CAP_DAC_OVERRIDE | 1u << CAP_DAC_READ_SEARCH;

    TEST_ASSERT_EQUAL_INT(0, syscall(SYS_capget, &header, data));
    data[0].effective =
        obey ? data[0].effective & ~mask : data[0].effective | (data[0].permitted & mask);
    TEST_ASSERT_EQUAL_INT(0, syscall(SYS_capset, &header, data));
}

static void set_mode(const struct shef_config *config, const char *inner, mode_t mode)
{
    char path[700];

    snprintf(path, sizeof path, "%s/%s", path_of(config), inner);
    TEST_ASSERT_EQUAL_INT(0, chmod(path, mode));
}

static void test_a_folder_made_read_only_ends_the_recording_in_order(void)
{
    struct shef_config config = looped("read_only", 0);
    struct shef_verify_report report;
    struct shef_service *service;
    const char *reason;

    obey_permissions(true);
    service = played_start(&config);
    /* The end of the loop, which begins a new segment, shall not come before that. */
    atomic_store(&service->live.drag_us, 30000);
    begin(service);
    wait_for_bytes(service, 1000000);
    set_mode(&config, "events", 0555);
    atomic_store(&service->live.drag_us, 0);
    reason = wait_for_end(service);
    expect_words(reason, "/events/0000");
    expect_words(reason, "are kept): Permission denied; ");
    expect_words(reason, "leave the folder alone while it is recorded to");
    expect_unharmed(service);
    expect_told(service, reason);
    expect_listed(service, "closed", reason);
    end(service);
    report = verify(&config);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, report.n_problems, report.problems[0]);
    set_mode(&config, "events", 0777);
    clean_up(&config);
    obey_permissions(false);
}

static void test_without_its_summary_a_recording_can_be_read(void)
{
    struct shef_config config = looped("no_summary", 0);
    struct shef_service *service;
    struct shef_verify_report report;
    json_t *answer;

    obey_permissions(true);
    service = played_start(&config);
    begin(service);
    wait_for_bytes(service, 1000000);
    set_mode(&config, ".", 0555);
    answer = played_ask(service, "record stop", NULL);
    TEST_ASSERT_EQUAL_STRING("stopped", text_of(answer, "verdict"));
    expect_words(text_of(answer, "reason"), "manifest.json': Permission denied; what was recorded "
                                            "can be read, without the verdict; ");
    json_decref(answer);
    expect_listed(service, "cut", "what was written can be played");
    expect_unharmed(service);
    end(service);
    report = verify(&config);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, report.n_problems, report.problems[1]);
    expect_words(report.problems[0], "was never closed");
    TEST_ASSERT_GREATER_THAN_UINT64(1, report.n_blocks);
    set_mode(&config, ".", 0777);
    clean_up(&config);
    obey_permissions(false);
}

/* ---- before it begins -------------------------------------------------------------------- */

static void test_a_folder_that_cannot_be_recorded_to_is_refused_with_advice(void)
{
    struct shef_config config = looped("refused", 0);
    struct shef_service *service;

    obey_permissions(true);
    TEST_ASSERT_EQUAL_INT(0, chmod(config.record.folder, 0555));
    service = played_start(&config);
    expect_words(played_refusal(service, "record start", NULL), config.record.folder);
    expect_words(played_refusal(service, "record start", NULL),
                 "Permission denied; let the service's user write there, or set record.folder");
    TEST_ASSERT_EQUAL_INT(0, rmdir(config.record.folder));
    expect_words(played_refusal(service, "record start", NULL),
                 "No such file or directory; make it, or set record.folder to one that is there");
    TEST_ASSERT_EQUAL_INT(0, mkdir(config.record.folder, 0777));
    TEST_ASSERT_EQUAL_INT(0, symlink("/nowhere", path_of(&config)));
    expect_words(played_refusal(service, "record start", "{\"name\": \"tried\"}"),
                 "is there already; take another name");
    expect_words(played_refusal(service, "record start", "{\"name\": \"a\\nb\"}"),
                 "hold a slash or a control character");
    expect_unharmed(service);
    end(service);
    clean_up(&config);
    obey_permissions(false);
}

/* ---- killed ------------------------------------------------------------------------------ */

static void test_a_killed_service_leaves_what_it_has_written(void)
{
    struct shef_config config = looped("killed", 0);
    struct shef_verify_report report;
    struct shef_service *service;
    int ready[2];
    char byte;
    int status;
    pid_t pid;

    TEST_ASSERT_EQUAL_INT(0, pipe(ready));
    pid = fork();
    TEST_ASSERT_TRUE(pid >= 0);
    if (pid == 0) {
        service = played_start(&config);
        begin(service);
        wait_for_bytes(service, 20000000);
        if (write(ready[1], "!", 1) == 1)
            while (true)
                usleep(1000000);
        _exit(1);
    }
    close(ready[1]);
    TEST_ASSERT_EQUAL_INT(1, read(ready[0], &byte, 1));
    close(ready[0]);
    TEST_ASSERT_EQUAL_INT(0, kill(pid, SIGKILL));
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));

    report = verify(&config);
    expect_words(report.problems[0], "was never closed");
    TEST_ASSERT_GREATER_THAN_UINT64(10, report.n_blocks);
    snprintf(config.source.recording, sizeof config.source.recording, "%.400s/tried",
             config.record.folder);
    config.source.loop = false;
    service = played_start(&config);
    expect_listed(service, "cut", "was never ended, by a crash, a kill or a power cut");
    played_wait(service);
    played_expect_accounted(service, 0);
    TEST_ASSERT_GREATER_THAN_INT64(2, number_now(service, "frames.n_published"));
    end(service);
    clean_up(&config);
}

int main(void)
{
    UNITY_BEGIN();
    /* For mounts that vanish with the test. */
    (void)played_recording();
    has_namespace = shef_test_enter_namespaces(CLONE_NEWNS);
    RUN_TEST(test_a_full_disk_ends_the_recording_and_nothing_else);
    RUN_TEST(test_room_is_looked_at_before_and_while_recording);
    RUN_TEST(test_a_deleted_recording_is_noticed);
    RUN_TEST(test_a_folder_made_read_only_ends_the_recording_in_order);
    RUN_TEST(test_without_its_summary_a_recording_can_be_read);
    RUN_TEST(test_a_folder_that_cannot_be_recorded_to_is_refused_with_advice);
    RUN_TEST(test_a_killed_service_leaves_what_it_has_written);
    return UNITY_END();
}
