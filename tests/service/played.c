#include "played.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "control/command.h"
#include "service/service_internal.h"
#include "support/process.h"
#include "support/support.h"

const char *played_recording(void)
{
    static char path[512];
    static struct shef_test_process shefsim;

    if (*path)
        return path;
    if (getenv("SHEF_TEST_RECORDING")) {
        snprintf(path, sizeof path, "%s", getenv("SHEF_TEST_RECORDING"));
        return path;
    }
#ifdef __SANITIZE_THREAD__
    TEST_IGNORE_MESSAGE("rendering takes minutes under the thread sanitizer; name a recording made "
                        "by another build in SHEF_TEST_RECORDING, see played.h");
#endif
    snprintf(path, sizeof path, "%s", shef_test_temp_path("played"));
    shef_test_process_run(&shefsim, "shefsim", NULL,
                          "render --scene simple_boxes --speed 0.2 --seconds 0.4 --seed 3 "
                          "--truth-every 4 --out %s",
                          path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, shefsim.status, shefsim.err);
    return path;
}

struct shef_config played_config(void)
{
    struct shef_config config;

    shef_config_defaults(&config);
    snprintf(config.source.recording, sizeof config.source.recording, "%s", played_recording());
    snprintf(config.lcm.url, sizeof config.lcm.url, "memq://");
    snprintf(config.record.folder, sizeof config.record.folder, "%s", shef_test_temp_folder());
    config.record.min_free_mb = 1;
    config.source.pace = SHEF_PACE_STEPPED;
    return config;
}

struct shef_service *played_start(const struct shef_config *config)
{
    struct shef_service *service = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_create(config, &service, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_start(service, &err), err.text);
    return service;
}

void played_wait(struct shef_service *service)
{
    struct pollfd end = { .fd = shef_service_end_fd(service), .events = POLLIN };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_INT(1, poll(&end, 1, 60000));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_outcome(service, &err), err.text);
}

void played_whole(const struct shef_config *config)
{
    struct shef_service *service = played_start(config);

    played_wait(service);
    shef_service_stop(service);
    shef_service_destroy(service);
}

static enum shef_err ask(struct shef_service *service, const char *command, const char *arguments,
                         json_t **out_answer, struct shef_error *err)
{
    json_t *parsed = json_loads(arguments ? arguments : "{}", 0, NULL);
    enum shef_err code;

    TEST_ASSERT_NOT_NULL_MESSAGE(parsed, arguments);
    for (int i = 0; i < shef_service_n_commands; i++) {
        if (strcmp(shef_service_commands[i].name, command) != 0)
            continue;
        *out_answer = json_object();
        code = shef_service_commands[i].handler(service, parsed, *out_answer, err);
        json_decref(parsed);
        return code;
    }
    TEST_FAIL_MESSAGE(command);
    return SHEF_ERR_NOT_FOUND;
}

json_t *played_ask(struct shef_service *service, const char *command, const char *arguments)
{
    struct shef_error err = { 0 };
    json_t *answer = NULL;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, ask(service, command, arguments, &answer, &err), err.text);
    return answer;
}

const char *played_refusal(struct shef_service *service, const char *command, const char *arguments)
{
    static struct shef_error err;
    json_t *answer = NULL;

    err = (struct shef_error){ 0 };
    TEST_ASSERT_NOT_EQUAL_MESSAGE(SHEF_OK, ask(service, command, arguments, &answer, &err),
                                  command);
    json_decref(answer);
    TEST_ASSERT_NULL_MESSAGE(strchr(err.text, '\n'), err.text);
    return err.text;
}

int64_t played_number(const json_t *answer, const char *path)
{
    char copy[128];
    char *rest = copy;
    const char *key;

    snprintf(copy, sizeof copy, "%s", path);
    while ((key = strsep(&rest, ".")))
        answer = json_object_get(answer, key);
    TEST_ASSERT_TRUE_MESSAGE(json_is_number(answer), path);
    return (int64_t)json_number_value(answer);
}

void played_expect_accounted(struct shef_service *service, int64_t n_under_way)
{
    json_t *status = played_ask(service, "status", NULL);
    int64_t n_lost = 0;
    const char *reason;
    json_t *count;

    json_object_foreach(json_object_get(json_object_get(status, "frames"), "lost_by"), reason,
                        count) n_lost += (int64_t)json_integer_value(count);
    TEST_ASSERT_EQUAL_INT64(n_lost, played_number(status, "frames.n_lost"));
    TEST_ASSERT_INT64_WITHIN((uint64_t)n_under_way, played_number(status, "frames.n_in"),
                             played_number(status, "frames.n_published") + n_lost);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(0, played_number(status, "frames.n_under_way"));
    json_decref(status);
}
