/* What docs/lcm.md tells people who write subscribers: the examples are the files that are
 * installed, and types for other languages are the same types. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "documented.h"
#include "support/support.h"

#define LCM_JAR "/usr/share/java/lcm.jar" /* of Debian's package liblcm-java */

static void expect_same_text(const char *shown, const char *installed)
{
    char *a = documented_read(shown);
    char *b = documented_read(shef_test_source(installed));

    TEST_ASSERT_EQUAL_STRING(b, a);
    free(a);
    free(b);
}

static void test_the_page_shows_the_examples_that_are_installed(void)
{
    expect_same_text("docs/examples/subscriber.c", "docs/examples/subscriber.c");
    expect_same_text("docs/examples/subscriber.py", "docs/examples/subscriber.py");
}

/* The documented commands for lcm-spy, from the beginning to where those begin. */
static const char *java_commands(const char *end)
{
    static char commands[4096];
    char *cut;

    (void)snprintf(commands, sizeof commands, "%s", documented_commands("lcm-gen --java"));
    cut = strstr(commands, end);
    TEST_ASSERT_NOT_NULL_MESSAGE(cut, commands);
    *cut = '\0';
    return commands;
}

/* The number that tells a type from others, from its own fields. */
static uint64_t number_after(const char *path, const char *words)
{
    char *text = documented_read(path);
    const char *at = strstr(text, words);
    uint64_t number = 0;

    TEST_ASSERT_NOT_NULL_MESSAGE(at, path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, sscanf(at + strlen(words), "%" SCNx64, &number), at);
    free(text);
    return number;
}

static void test_the_types_that_lcm_spy_gets_are_those_that_are_published(void)
{
    static const char *const types[] = { "cloud_t",  "dense_t", "depth_t", "disparity_t",
                                         "header_t", "pose_t",  "status_t" };

    documented_run(java_commands("javac"));
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        char java[100], c[100];

        (void)snprintf(java, sizeof java, "java/shef/%s.java", types[i]);
        (void)snprintf(c, sizeof c, "build/release/lcm_types/generated/shef_%s.c", types[i]);
        TEST_ASSERT_EQUAL_HEX64(number_after(c, "uint64_t hash = (uint64_t)"),
                                number_after(java, "LCM_FINGERPRINT_BASE = "));
    }
}

/* Asks the part of lcm-spy that looks for types; the rest needs a display. */
static void test_lcm_spy_finds_the_types_in_the_documented_jar(void)
{
    static const char look_up[] =
        "\ncat >LookUp.java <<'END'\n"
        "public class LookUp {\n"
        "    public static void main(String[] types) throws Exception {\n"
        "        Class<?> database = Class.forName(\"lcm.spy.LCMTypeDatabase\");\n"
        "        var create = database.getDeclaredConstructor();\n"
        "        var get = database.getDeclaredMethod(\"getClassByFingerprint\", long.class);\n"
        "        create.setAccessible(true);\n"
        "        get.setAccessible(true);\n"
        "        Object made = create.newInstance();\n"
        "        for (String type : types)\n"
        "            System.out.println(get.invoke(made, Long.parseUnsignedLong(type, 16)));\n"
        "    }\n"
        "}\n"
        "END\n"
        "javac LookUp.java\n"
        "java -cp " LCM_JAR ":shef_types.jar:. LookUp 290072e3c151c914 8e01719532bac52d >found\n"
        "grep -qx 'class shef.depth_t' found\n"
        "grep -qx 'class shef.status_t' found\n";
    char commands[8192];

    if (access(LCM_JAR, R_OK) != 0 || system("command -v javac >/dev/null") != 0)
        TEST_IGNORE_MESSAGE("no lcm-spy: it is in liblcm-java and needs a Java compiler");
    (void)snprintf(commands, sizeof commands, "%s%s", java_commands("java -cp"), look_up);
    documented_run(commands);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_page_shows_the_examples_that_are_installed);
    RUN_TEST(test_the_types_that_lcm_spy_gets_are_those_that_are_published);
    RUN_TEST(test_lcm_spy_finds_the_types_in_the_documented_jar);
    return UNITY_END();
}
