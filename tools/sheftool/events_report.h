/* What `events info` says about a stream, as text, JSON and picture. Thread: main. */
#ifndef SHEFTOOL_EVENTS_REPORT_H
#define SHEFTOOL_EVENTS_REPORT_H

#include <jansson.h>
#include <stdio.h>

#include "core/error.h"
#include "record/verify.h"
#include "sheftool/events_source.h"
#include "sheftool/events_survey.h"

struct shef_events_report {
    const char *path;
    const struct shef_events_source *source;
    const struct shef_survey *survey;
    struct shef_evt_stats stats;
    double hot_limit_per_s;
    uint32_t n_hot; /* all of them; the first SHEF_SURVEY_HOT_PIXELS are listed */
    const struct shef_survey_hot_pixel *hot;
    const struct shef_verify_report *verify; /* NULL: not asked for */
};

/* "RAW EVT3", "DAT", "recording, EVT2". */
void shef_events_describe_kind(const struct shef_events_info *info, char *out_text, size_t n_bytes);

/* The camera in a few words: "EVK4, IMX636, serial 00ab"; "unknown". */
void shef_events_describe_camera(const struct shef_raw_header *camera, char *out_text,
                                 size_t n_bytes);

/* The unit in which a rate is easy to read. */
struct shef_rate_unit {
    const char *name;
    double per_mev_s;
};

struct shef_rate_unit shef_rate_unit_of(double mev_per_s);

/* A place where data are missing. */
struct shef_events_gap {
    int64_t from_us; /* event time */
    int64_t to_us;
    bool is_recorded; /* the recording knows of it; else the sensor's time jumped */
    uint64_t n_missing_blocks;
    uint32_t n_lost_buffers;
};

/* The i-th gap: those that a recording knows of, then jumps in time that they do not explain.
 * Returns false behind the last. */
bool shef_events_report_gap(const struct shef_events_report *report, uint32_t i,
                            struct shef_events_gap *out_gap);

/* How many there are. */
uint32_t shef_events_count_gaps(const struct shef_events_report *report);

void shef_events_report_print(const struct shef_events_report *report, FILE *out);

/* NULL: out of memory. The caller owns it. */
json_t *shef_events_report_json(const struct shef_events_report *report);

/* Draws the rate over time, where events came from, triggers and gaps into a PNG. */
SHEF_MUST_CHECK enum shef_err shef_events_report_draw(const struct shef_events_report *report,
                                                      const char *path, struct shef_error *err);

#endif
