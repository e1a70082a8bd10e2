/* Any line must end in a request whose parts obey their limits, or in a sentence; and whatever is
 * said about it must be one line of JSON again. */
#include "control/request.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "control/command.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void expect_line(char *line)
{
    json_t *root;

    if (!line || strchr(line, '\n') != line + strlen(line) - 1)
        abort();
    root = json_loads(line, 0, NULL);
    if (!json_is_object(root))
        abort();
    json_decref(root);
    free(line);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_control_request request = { .arguments = NULL };
    struct shef_error err = { 0 };
    char text[32];

    if (shef_control_request_parse((const char *)bytes, n_bytes, &request, &err) != SHEF_OK) {
        if (request.arguments || err.code == SHEF_OK || !err.text[0])
            abort();
        expect_line(shef_control_refusal(&err, false));
        return 0;
    }
    if (strlen(request.command) >= SHEF_CONTROL_NAME_BYTES || !json_is_object(request.arguments))
        abort();
    if (shef_control_text(request.arguments, "name", text, sizeof text, &err) != SHEF_OK)
        expect_line(shef_control_refusal(&err, false));
    expect_line(shef_control_answer(request.arguments));
    json_decref(request.arguments);
    return 0;
}
