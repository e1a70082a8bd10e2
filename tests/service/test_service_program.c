/* shefd as a program, playing. */
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "played.h"
#include "support/process.h"
#include "support/support.h"

static struct shef_test_process shefd;
static struct shef_test_process shefctl;

static void start(const char *more)
{
    shef_test_process_start(&shefd, "shefd", NULL,
                            "--set control.socket=%s --set control.group= --set lcm.url=memq:// "
                            "--set memory.lock=false --play %s %s",
                            shef_test_temp_path("s"), played_recording(), more);
}

static void test_with_once_it_leaves_when_the_recording_is_over(void)
{
    start("--once");
    shef_test_process_end(&shefd, 0);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, shefd.status, shefd.err);
}

static void test_it_ends_in_order_while_it_plays(void)
{
    static const int signals[] = { SIGTERM, SIGINT };

    for (int i = 0; i < 2; i++) {
        start("--set source.loop=true");
        TEST_ASSERT_TRUE_MESSAGE(shef_test_process_wait_for(&shefd, "is up"), shefd.err);
        shef_test_process_end(&shefd, signals[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, shefd.status, shefd.err);
        TEST_ASSERT_NOT_EQUAL(0, access(shef_test_temp_path("s"), F_OK));
    }
}

static void test_shefctl_sees_it_play(void)
{
    start("--set source.loop=true");
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_wait_for(&shefd, "is up"), shefd.err);
    shef_test_process_run(&shefctl, "shefctl", NULL, "--socket %s status",
                          shef_test_temp_path("s"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shefctl.out, "playing"), shefctl.out);
    shef_test_process_run(&shefctl, "shefctl", NULL, "--socket %s graph", shef_test_temp_path("s"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shefctl.out, "raw_events"), shefctl.out);
    shef_test_process_end(&shefd, SIGTERM);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, shefd.status, shefd.err);
}

static void test_no_recording_is_one_sentence(void)
{
    shef_test_process_run(&shefd, "shefd", NULL,
                          "--set control.socket=%s --set control.group= --set memory.lock=false "
                          "--play /no/such/recording",
                          shef_test_temp_path("s"));
    TEST_ASSERT_EQUAL_INT(1, shefd.status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shefd.err, "/no/such/recording"), shefd.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&shefd), shefd.err);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_with_once_it_leaves_when_the_recording_is_over);
    RUN_TEST(test_it_ends_in_order_while_it_plays);
    RUN_TEST(test_shefctl_sees_it_play);
    RUN_TEST(test_no_recording_is_one_sentence);
    return UNITY_END();
}
