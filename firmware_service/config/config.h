/* The settings of shefd: a plain struct, read from one YAML file.
 *
 * Every setting is one row of config_rows.c: key, field, default, range, unit, help. The schema
 * that reads the file, the checks, the lists people see and the manual page all come from there.
 * Keys are written with dots where the file nests: "depth.mode" is `mode:` under `depth:`.
 * A setting that the file leaves out has its default. Thread: setup, and the control thread. */
#ifndef SHEF_CONFIG_CONFIG_H
#define SHEF_CONFIG_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_CONFIG_DEFAULT_PATH "/etc/shef/shefd.yaml"
#define SHEF_CONFIG_PATH_BYTES   512
#define SHEF_CONFIG_NAME_BYTES   64

/* In the order of the rows' words. */
enum shef_config_pace { SHEF_PACE_RECORDED, SHEF_PACE_STEPPED, SHEF_PACE_FAST };
enum shef_config_grid { SHEF_GRID_HALF, SHEF_GRID_FULL };
enum shef_config_policy { SHEF_POLICY_NORMAL, SHEF_POLICY_FIFO };

/* The service's threads, highest first. */
enum shef_config_thread {
    SHEF_THREAD_EVENTS,    /* event camera or its replay */
    SHEF_THREAD_FRAMES,    /* frame camera or its replay */
    SHEF_THREAD_POSES,     /* robot or its replay */
    SHEF_THREAD_FILTER,    /* decode, filter, triggers, snapshots */
    SHEF_THREAD_STEREO,    /* rectification, matching, depth */
    SHEF_THREAD_WORKERS,   /* the helpers of the stereo thread */
    SHEF_THREAD_PUBLISHER, /* LCM */
    SHEF_THREAD_RECORDER,  /* writes recordings */
    SHEF_THREAD_CONTROL,   /* control socket, signals, watchdog */
    SHEF_CONFIG_THREADS,
};

struct shef_config_thread_row {
    int32_t policy;   /* enum shef_config_policy */
    int32_t priority; /* 1..99, for fifo */
    int32_t cpu;      /* -1: any */
};

struct shef_config {
    struct {
        char recording[SHEF_CONFIG_PATH_BYTES]; /* "": none, wait for `shefctl play` */
        bool loop;
        int32_t pace; /* enum shef_config_pace */
    } source;
    struct {
        char file[SHEF_CONFIG_PATH_BYTES]; /* "": the one in the recording */
        char profile[SHEF_CONFIG_NAME_BYTES];
    } calibration;
    struct {
        char mode[SHEF_CONFIG_NAME_BYTES];
        int32_t max_disparity_px; /* 0: the profile's own */
        int32_t look_ahead;       /* steps of the centred read-out, see pipeline/snapshot.h */
        int32_t workers;          /* threads in all, the stereo thread included */
    } depth;
    struct {
        char url[SHEF_CONFIG_PATH_BYTES];
        char prefix[SHEF_CONFIG_NAME_BYTES]; /* of every channel's name */
        int32_t grid;                        /* enum shef_config_grid */
        bool disparity;
        bool depth;
        bool dense;
        bool cloud;
        bool pose;
        bool status;
    } lcm;
    /* How long a complete frame may have waited before this work is left out for it. */
    struct {
        int32_t dense_ms;
        int32_t cloud_ms;
        int32_t full_grid_ms;
        int32_t range_ms;
        int32_t frame_ms;
    } shed;
    struct {
        char folder[SHEF_CONFIG_PATH_BYTES];
        int32_t min_free_mb;
    } record;
    struct {
        char socket[SHEF_CONFIG_PATH_BYTES];
        char group[SHEF_CONFIG_NAME_BYTES]; /* "": root and the service's own user only */
        int32_t max_clients;
        int32_t timeout_s;
    } control;
    struct shef_config_thread_row threads[SHEF_CONFIG_THREADS];
    struct {
        char isa[SHEF_CONFIG_NAME_BYTES]; /* one of SHEF_CPU_CHOICES */
    } kernels;
    struct {
        bool lock; /* keep all memory in RAM */
    } memory;
    struct {
        char level[SHEF_CONFIG_NAME_BYTES];
    } log;
    struct {
        int32_t stalled_after_s;
    } watchdog;
};

enum shef_config_kind {
    SHEF_CONFIG_BOOL,   /* bool: true or false */
    SHEF_CONFIG_INT,    /* int32_t within min..max */
    SHEF_CONFIG_TEXT,   /* char[]: a path, a name */
    SHEF_CONFIG_CHOICE, /* int32_t: index of the word in choices, counted from 0 */
    SHEF_CONFIG_WORD,   /* char[]: one of the words in choices */
};

struct shef_config_row {
    const char *key;
    enum shef_config_kind kind;
    size_t field;        /* offset in struct shef_config */
    size_t field_bytes;  /* of texts and words */
    const char *preset;  /* the default, as text */
    int64_t min, max;    /* of numbers, both allowed; of texts min 1 means not empty */
    const char *zero;    /* what the number 0, outside the range, stands for; NULL: it is refused */
    const char *choices; /* "a|b|c"; NULL for other kinds */
    const char *unit;    /* NULL: none */
    bool is_live;        /* SIGHUP can change it without a restart */
    const char *help;    /* one sentence without a full stop */
};

/* In the order of the file; rows of one section follow each other. */
extern const struct shef_config_row shef_config_rows[];
extern const int shef_config_n_rows;

/* What every setting is when nobody says otherwise. */
void shef_config_defaults(struct shef_config *out_config);

/* Reads a file. Errors name the file, the line and the key:
 * SHEF_ERR_INVALID: unknown key, wrong type, out of range, key given twice, or a combination that
 * makes no sense. SHEF_ERR_FORMAT: no YAML. SHEF_ERR_NOT_FOUND, PERMISSION, IO, NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_config_read(const char *path, struct shef_config *out_config,
                                               struct shef_error *err);

/* The same for bytes in memory.
 *   name  what errors call them, e.g. the path */
SHEF_MUST_CHECK enum shef_err shef_config_parse(const uint8_t *bytes, size_t n_bytes,
                                                const char *name, struct shef_config *out_config,
                                                struct shef_error *err);

/* NULL: there is no such setting. */
const struct shef_config_row *shef_config_find(const char *key);

/* For a key that is not there: "; is 'depth.mode' meant?" where there is one like it, or one of
 * that last name in another section; otherwise "".
 *   out_hint  SHEF_WORDS_HINT_BYTES bytes, terminated */
void shef_config_hint(const char *key, char *out_hint);

/* Sets one setting from text, as if the file said so.
 * SHEF_ERR_INVALID: the sentence names the key and says what is allowed; nothing was changed. */
SHEF_MUST_CHECK enum shef_err shef_config_set(struct shef_config *config,
                                              const struct shef_config_row *row, const char *text,
                                              struct shef_error *err);

/* A setting as the text that would set it.
 *   out_text  n_bytes bytes, always terminated; SHEF_CONFIG_PATH_BYTES is always enough */
void shef_config_get(const struct shef_config *config, const struct shef_config_row *row,
                     char *out_text, size_t n_bytes);

/* Refuses combinations that no single row can refuse, and paths that would lead somewhere else
 * than who wrote them thinks; read and parse call it.
 *   out_keys  the settings that the sentence is about, the second one perhaps NULL; may be NULL */
SHEF_MUST_CHECK enum shef_err shef_config_check(const struct shef_config *config,
                                                const char *out_keys[2], struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
