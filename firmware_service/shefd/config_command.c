#include "shefd/config_command.h"

#include "config/config_text.h"
#include "control/request.h"

static json_t *row_to_json(const struct shef_config *config, const struct shef_config_row *row)
{
    char value[SHEF_CONFIG_PATH_BYTES];
    char range[256];

    shef_config_get(config, row, value, sizeof value);
    shef_config_describe_range(row, range, sizeof range);
    return json_pack("{s:s, s:o, s:s, s:s, s:b, s:s}", "key", row->key, "value",
                     shef_control_string(value), "default", row->preset, "range", range, "live",
                     (int)row->is_live, "help", row->help);
}

static enum shef_err answer_config(void *context, const json_t *arguments, json_t *answer,
                                   struct shef_error *err)
{
    const struct shef_config *config = shef_service_config(context);
    json_t *list = json_array();

    (void)arguments;
    (void)err;
    for (int i = 0; i < shef_config_n_rows; i++)
        json_array_append_new(list, row_to_json(config, &shef_config_rows[i]));
    json_object_set_new(answer, "settings", list);
    return SHEF_OK;
}

static const struct shef_control_command commands[] = {
    { "config", "lists the settings in force", answer_config },
};

enum shef_err shef_config_command_register(struct shef_control *control,
                                           struct shef_service *service, struct shef_error *err)
{
    return shef_control_register(control, commands, 1, service, err);
}
