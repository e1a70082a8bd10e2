#include "codecs/raw_header.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "codecs/evt_word.h"

/* Boards up to this one send EVT2.1 with the upper half of a word first. */
#define LAST_LEGACY_SYSTEM_ID 0x36

/* What the lines have said so far. */
struct findings {
    bool has_format;
    bool has_size;
    bool has_endianness;
    bool is_legacy;
    bool is_evt21;
    bool is_foreign_format;
    uint32_t width_px;
    uint32_t height_px;
    char format_text[SHEF_TEXT_VALUE_BYTES];
};

/* The sensor behind a system_ID, for files that do not say its size. */
static bool size_of_system(int32_t system_id, uint32_t *out_width_px, uint32_t *out_height_px)
{
    static const struct {
        uint8_t id;
        uint16_t width_px;
        uint16_t height_px;
    } systems[] = {
        { 0x15, 640, 480 },  { 0x17, 640, 480 },  { 0x19, 640, 480 },  { 0x1c, 640, 480 },
        { 0x21, 640, 480 },  { 0x22, 640, 480 },  { 0x23, 640, 480 },  { 0x28, 640, 480 },
        { 0x29, 640, 480 },  { 0x97, 640, 480 },  { 0x99, 640, 480 },  { 0x1a, 1280, 720 },
        { 0x1e, 1280, 720 }, { 0x1f, 1280, 720 }, { 0x20, 1280, 720 }, { 0x27, 1280, 720 },
        { 0x30, 1280, 720 }, { 0x31, 1280, 720 }, { 0x32, 1280, 720 }, { 0x35, 1280, 720 },
        { 0x3b, 320, 320 },  { 0x40, 320, 320 },
    };

    for (size_t i = 0; i < sizeof systems / sizeof systems[0]; i++)
        if (systems[i].id == system_id) {
            *out_width_px = systems[i].width_px;
            *out_height_px = systems[i].height_px;
            return true;
        }
    return false;
}

/* Takes a format's name, e.g. "EVT3", or the number after "% evt", e.g. "3.0". */
static void take_format(struct shef_raw_header *header, struct findings *found, const char *name)
{
    found->has_format = true;
    found->is_evt21 = false;
    found->is_foreign_format = false;
    if (strcmp(name, "EVT2") == 0 || strcmp(name, "2.0") == 0 || strcmp(name, "2") == 0) {
        header->format = SHEF_EVT2;
    } else if (strcmp(name, "EVT21") == 0 || strcmp(name, "2.1") == 0) {
        header->format = SHEF_EVT21;
        found->is_evt21 = true;
    } else if (strcmp(name, "EVT3") == 0 || strcmp(name, "3.0") == 0 || strcmp(name, "3") == 0) {
        header->format = SHEF_EVT3;
    } else {
        found->is_foreign_format = true;
        snprintf(found->format_text, sizeof found->format_text, "%s", name);
    }
}

static void take_endianness(struct findings *found, const char *text)
{
    found->has_endianness = strcmp(text, "legacy") == 0 || strcmp(text, "little") == 0;
    found->is_legacy = strcmp(text, "legacy") == 0;
}

/* Numbers that are none count as 0, which no sensor has. */
static void take_size(struct shef_raw_header *header, struct findings *found, const char *text,
                      const char *width, const char *height)
{
    found->has_size = true;
    if (!shef_text_number(width, &found->width_px))
        found->width_px = 0;
    if (!shef_text_number(height, &found->height_px))
        found->height_px = 0;
    snprintf(header->size_text, sizeof header->size_text, "%s", text);
}

/* Takes "EVT3;height=720;width=1280", the options in any order. */
static void take_format_line(struct shef_raw_header *header, struct findings *found,
                             const char *value)
{
    char text[SHEF_TEXT_VALUE_BYTES];
    char *rest = text;
    const char *width = NULL;
    const char *height = NULL;

    snprintf(text, sizeof text, "%s", value);
    take_format(header, found, strsep(&rest, ";"));
    while (rest) {
        const char *const option = strsep(&rest, ";");

        if (strncmp(option, "width=", 6) == 0)
            width = option + 6;
        else if (strncmp(option, "height=", 7) == 0)
            height = option + 7;
        else if (strncmp(option, "endianness=", 11) == 0)
            take_endianness(found, option + 11);
    }
    if (width || height)
        take_size(header, found, value, width ? width : "", height ? height : "");
}

/* Takes "640x480". */
static void take_geometry_line(struct shef_raw_header *header, struct findings *found,
                               const char *value)
{
    char text[SHEF_TEXT_VALUE_BYTES];
    char *height = text;

    snprintf(text, sizeof text, "%s", value);
    strsep(&height, "x");
    take_size(header, found, value, text, height ? height : "");
}

static void take_line(struct shef_raw_header *header, struct findings *found,
                      const struct shef_text_line *line, bool *has_format_line)
{
    const struct {
        const char *key;
        char *text;
    } texts[] = {
        { "date", header->date },
        { "serial_number", header->serial },
        { "integrator_name", header->integrator },
        { "camera_integrator_name", header->integrator },
        { "plugin_name", header->plugin },
        { "sensor_name", header->sensor },
    };
    uint32_t number;

    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        if (strcasecmp(line->key, texts[i].key) == 0)
            memcpy(texts[i].text, line->value, sizeof line->value);
    if (strcmp(line->key, "format") == 0) {
        take_format_line(header, found, line->value);
        *has_format_line = true;
    } else if (strcmp(line->key, "evt") == 0 && !*has_format_line) {
        take_format(header, found, line->value);
    } else if (strcmp(line->key, "geometry") == 0 && !found->has_size) {
        take_geometry_line(header, found, line->value);
    } else if (strcmp(line->key, "endianness") == 0) {
        take_endianness(found, line->value);
    } else if (strcasecmp(line->key, "system_ID") == 0 && shef_text_number(line->value, &number)) {
        header->system_id = (int32_t)number;
    }
}

static bool is_possible_side(uint32_t side_px)
{
    return side_px >= 1 && side_px <= SHEF_EVT_MAX_SIDE_PX;
}

static void settle_size(struct shef_raw_header *header, const struct findings *found)
{
    header->width_px = SHEF_EVT_MAX_SIDE_PX;
    header->height_px = SHEF_EVT_MAX_SIDE_PX;
    if (found->has_size && is_possible_side(found->width_px) &&
        is_possible_side(found->height_px)) {
        header->size = SHEF_RAW_SIZE_GIVEN;
        header->width_px = found->width_px;
        header->height_px = found->height_px;
    } else if (found->has_size) {
        header->size = SHEF_RAW_SIZE_ABSURD;
    } else if (size_of_system(header->system_id, &header->width_px, &header->height_px)) {
        header->size = SHEF_RAW_SIZE_OF_SYSTEM;
    } else {
        header->size = SHEF_RAW_SIZE_UNKNOWN;
    }
}

enum shef_err shef_raw_header_parse(const uint8_t *bytes, size_t n_bytes,
                                    struct shef_raw_header *out_header, struct shef_error *err)
{
    struct shef_raw_header header = { .system_id = -1 };
    struct findings found = { 0 };
    struct shef_text_line line;
    bool has_format_line = false;
    size_t at = 0;

    while (!header.has_end && shef_text_header_next(bytes, n_bytes, &at, &line)) {
        header.has_end = strcmp(line.key, "end") == 0;
        take_line(&header, &found, &line, &has_format_line);
    }
    header.n_bytes = at;
    if (!header.has_end && shef_text_header_is_cut(bytes, n_bytes, at))
        return shef_fail(err, SHEF_ERR_FORMAT, "the file ends inside its header; it is not whole");
    if (at == 0)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "not a RAW recording: it does not start with header lines '%% key value'");
    if (!found.has_format)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the header names no event format (a line '%% evt 2.0' or '%% format "
                         "EVT3;height=480;width=640')");
    if (found.is_foreign_format)
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "the event format '%s' cannot be read, only EVT2, EVT21 (2.1) and EVT3",
                         found.format_text);
    if (found.is_evt21) {
        const bool is_legacy = found.has_endianness ? found.is_legacy
                                                    : header.system_id >= 0 &&
                                                          header.system_id <= LAST_LEGACY_SYSTEM_ID;

        header.format = is_legacy ? SHEF_EVT21_LEGACY : SHEF_EVT21;
    }
    settle_size(&header, &found);
    *out_header = header;
    return SHEF_OK;
}

/* A header's text as it grows; lines beyond its end are left out. */
struct text {
    char *out;
    size_t n_bytes;
};

static const char end_line[] = "% end\n";

static void put_line(struct text *text, const char *key, const char *value)
{
    char *const line = text->out + text->n_bytes;
    const size_t room = SHEF_RAW_HEADER_BYTES - sizeof end_line - text->n_bytes;
    const int n = value[0] == '\0' ? 0 : snprintf(line, room, "%% %s %s", key, value);

    if (n <= 0 || (size_t)n >= room)
        return;
    /* A value with a line break in it must not end the line, or the header. */
    for (int i = 0; i < n; i++)
        if (!isprint((unsigned char)line[i]))
            line[i] = ' ';
    line[n] = '\n';
    text->n_bytes += (size_t)n + 1;
}

static const char *or_default(const char *text, const char *fallback)
{
    return text[0] != '\0' ? text : fallback;
}

size_t shef_raw_header_write(const struct shef_raw_header *header,
                             enum shef_raw_generation generation,
                             char out_text[SHEF_RAW_HEADER_BYTES])
{
    const bool is_evt21 = header->format == SHEF_EVT21 || header->format == SHEF_EVT21_LEGACY;
    const char *const evt = header->format == SHEF_EVT2 ? "2.0" : is_evt21 ? "2.1" : "3.0";
    const char *const endianness = header->format == SHEF_EVT21          ? "little"
                                   : header->format == SHEF_EVT21_LEGACY ? "legacy"
                                                                         : "";
    const char *const integrator = or_default(header->integrator, "Prophesee");
    char format[64];
    char geometry[32];
    char system_id[16] = "";
    struct text text = { .out = out_text };

    snprintf(format, sizeof format, "%s;%s%s%sheight=%u;width=%u",
             shef_evt_format_name(header->format), is_evt21 ? "endianness=" : "", endianness,
             is_evt21 ? ";" : "", header->height_px, header->width_px);
    snprintf(geometry, sizeof geometry, "%ux%u", header->width_px, header->height_px);
    if (header->system_id >= 0)
        snprintf(system_id, sizeof system_id, "%d", header->system_id);
    if (generation == SHEF_RAW_NEW) {
        put_line(&text, "camera_integrator_name", integrator);
        put_line(&text, "date", header->date);
        put_line(&text, "endianness", endianness);
        put_line(&text, "evt", evt);
        put_line(&text, "format", format);
        put_line(&text, "geometry", geometry);
        put_line(&text, "integrator_name", integrator);
        put_line(&text, "plugin_integrator_name", integrator);
        put_line(&text, "plugin_name", or_default(header->plugin, "hal_plugin_prophesee"));
        put_line(&text, "sensor_name", header->sensor);
        put_line(&text, "serial_number", or_default(header->serial, "00000000"));
        put_line(&text, "system_ID", system_id);
    } else {
        put_line(&text, "Date", header->date);
        put_line(&text, "evt", evt);
        put_line(&text, "endianness", endianness);
        put_line(&text, "geometry", geometry);
        put_line(&text, "integrator_name", integrator);
        put_line(&text, "plugin_name", header->plugin);
        put_line(&text, "serial_number", or_default(header->serial, "00000000"));
        put_line(&text, "system_ID", system_id);
    }
    memcpy(out_text + text.n_bytes, end_line, sizeof end_line);
    return text.n_bytes + sizeof end_line - 1;
}
