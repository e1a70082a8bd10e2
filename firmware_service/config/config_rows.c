#include "config/config.h"
#include "core/cpu.h"

#define FIELD(path_) .field = offsetof(struct shef_config, path_)

#define LIVE .is_live = true

#define BOOL(key_, path_, preset_, help_, ...)                                                     \
    {                                                                                              \
        .key = key_, .kind = SHEF_CONFIG_BOOL, FIELD(path_), .preset = preset_, .help = help_,     \
        __VA_ARGS__                                                                                \
    }
#define INT(key_, path_, preset_, min_, max_, unit_, help_, ...)                                   \
    {                                                                                              \
        .key = key_, .kind = SHEF_CONFIG_INT, FIELD(path_), .preset = preset_, .min = min_,        \
        .max = max_, .unit = unit_, .help = help_, __VA_ARGS__                                     \
    }
#define TEXT(key_, path_, preset_, min_, help_, ...)                                               \
    {                                                                                              \
        .key = key_, .kind = SHEF_CONFIG_TEXT, FIELD(path_),                                       \
        .field_bytes = sizeof((struct shef_config *)0)->path_, .preset = preset_, .min = min_,     \
        .help = help_, __VA_ARGS__                                                                 \
    }
#define CHOICE(key_, path_, preset_, choices_, help_, ...)                                         \
    {                                                                                              \
        .key = key_, .kind = SHEF_CONFIG_CHOICE, FIELD(path_), .preset = preset_,                  \
        .choices = choices_, .help = help_, __VA_ARGS__                                            \
    }
#define WORD(key_, path_, preset_, choices_, help_, ...)                                           \
    {                                                                                              \
        .key = key_, .kind = SHEF_CONFIG_WORD, FIELD(path_),                                       \
        .field_bytes = sizeof((struct shef_config *)0)->path_, .preset = preset_,                  \
        .choices = choices_, .help = help_, __VA_ARGS__                                            \
    }
#define THREAD(name_, id_, policy_, priority_, what_)                                              \
    CHOICE("threads." name_ ".policy", threads[id_].policy, policy_, "normal|fifo",                \
           "scheduling of " what_),                                                                \
        INT("threads." name_ ".priority", threads[id_].priority, priority_, 1, 99, NULL,           \
            "its real-time priority; counts only with policy fifo"),                               \
        INT("threads." name_ ".cpu", threads[id_].cpu, "-1", -1, 1023, NULL,                       \
            "the processor it stays on, counted from 0; -1: any")

/* Priorities: real-time work from the device inwards, so that no later stage delays an earlier
 * one. Shedding thresholds: a frame period at 54 fps is 18.5 ms. */
const struct shef_config_row shef_config_rows[] = {
    TEXT("source.recording", source.recording, "", 0,
         "recording folder to play; empty: wait for 'shefctl play'"),
    BOOL("source.loop", source.loop, "false", "start again at the recording's end"),
    CHOICE("source.pace", source.pace, "recorded", "recorded|stepped|fast",
           "recorded: as it once arrived, work may be shed; stepped: one frame after the other, "
           "nothing shed, the same output every time; fast: as soon as there is room"),

    TEXT("calibration.file", calibration.file, "", 0,
         "calibration.yaml of the rig; empty: the one in the recording"),
    WORD("calibration.profile", calibration.profile, "wide", "wide|paper",
         "rectified view: wide f = 555 px, the whole event view; paper f = 1301 px, a crop"),

    WORD("depth.mode", depth.mode, "temporal",
         "paper-ds|paper-dp|unsigned|ternary|graded|temporal|combined",
         "what is matched and how; 'shefctl mode' changes it live", LIVE),
    INT("depth.max_disparity_px", depth.max_disparity_px, "0", 16, 256, "px",
        "largest disparity looked for: the nearest depth is 36.3 m / this in profile wide, 85.1 m "
        "/ this in profile paper",
        .zero = "47 px in profile wide, 110 px in profile paper"),
    INT("depth.look_ahead", depth.look_ahead, "3", 1, 4, "steps",
        "how long events after mid-exposure count too: 4, 9, 17 or 25 ms; more makes edges more "
        "symmetric, but a frame waits for it"),
    INT("depth.workers", depth.workers, "2", 1, 16, "threads", "threads that share the matching"),

    TEXT("lcm.url", lcm.url, "udpm://239.255.76.67:7667?ttl=0", 1,
         "where messages go; ttl=0 keeps them on this computer"),
    TEXT("lcm.prefix", lcm.prefix, "SHEF", 1, "how the name of every channel begins"),
    CHOICE("lcm.grid", lcm.grid, "half", "half|full",
           "disparity and depth on the half grid (320x240, one datagram) or at full resolution "
           "(in chunks)",
           LIVE),
    BOOL("lcm.disparity", lcm.disparity, "true", "publish disparity with confidence", LIVE),
    BOOL("lcm.depth", lcm.depth, "true", "publish depth with its uncertainty", LIVE),
    BOOL("lcm.dense", lcm.dense, "false", "publish the dense disparity image", LIVE),
    BOOL("lcm.cloud", lcm.cloud, "false", "publish the point cloud", LIVE),
    BOOL("lcm.pose", lcm.pose, "true", "publish the camera's pose where poses are known", LIVE),
    BOOL("lcm.status", lcm.status, "true", "publish the service's state once a second", LIVE),

    INT("shed.dense_ms", shed.dense_ms, "8", 0, 1000, "ms",
        "a frame that waited longer gets no dense image", LIVE),
    INT("shed.cloud_ms", shed.cloud_ms, "10", 0, 1000, "ms",
        "a frame that waited longer gets no point cloud", LIVE),
    INT("shed.full_grid_ms", shed.full_grid_ms, "12", 0, 1000, "ms",
        "a frame that waited longer is read out on the half grid only", LIVE),
    INT("shed.range_ms", shed.range_ms, "16", 0, 1000, "ms",
        "a frame that waited longer is searched over half the disparity range", LIVE),
    INT("shed.frame_ms", shed.frame_ms, "30", 0, 1000, "ms",
        "a frame that waited longer, for the chain or for the publisher, is left out, and counted",
        LIVE),

    TEXT("record.folder", record.folder, "/var/lib/shef/recordings", 1,
         "where 'shefctl record start' puts recordings"),
    INT("record.min_free_mb", record.min_free_mb, "1000", 0, 1000000, "MB",
        "no recording is begun, and the present one is ended, when less is free on the disk", LIVE),

    TEXT("control.socket", control.socket, "/run/shef/shefd.sock", 1,
         "the socket that shefctl talks to"),
    TEXT("control.group", control.group, "shef", 0,
         "members may use shefctl, besides root and the service's own user; empty: nobody else"),
    INT("control.max_clients", control.max_clients, "16", 1, 64, NULL,
        "how many may be connected at once"),
    INT("control.timeout_s", control.timeout_s, "10", 1, 3600, "s",
        "a client without a whole request, or with an answer not read to its end, is dropped after this"),

    THREAD("events", SHEF_THREAD_EVENTS, "fifo", "60", "the thread of the event source"),
    THREAD("frames", SHEF_THREAD_FRAMES, "fifo", "60", "the thread of the frame source"),
    THREAD("poses", SHEF_THREAD_POSES, "fifo", "50", "the thread of the robot's poses"),
    THREAD("filter", SHEF_THREAD_FILTER, "fifo", "45", "decoding, filter and snapshots"),
    THREAD("stereo", SHEF_THREAD_STEREO, "fifo", "40", "matching and depth"),
    THREAD("workers", SHEF_THREAD_WORKERS, "fifo", "39", "the helpers of the stereo thread"),
    THREAD("publisher", SHEF_THREAD_PUBLISHER, "normal", "1", "the thread that publishes"),
    THREAD("recorder", SHEF_THREAD_RECORDER, "normal", "1", "the threads that write recordings"),
    THREAD("control", SHEF_THREAD_CONTROL, "normal", "1", "control socket, signals and watchdog"),

    WORD("kernels.isa", kernels.isa, "best", SHEF_CPU_CHOICES,
         "instruction set of the kernels; a lesser one shows how fast another processor would be, "
         "the results are the same; 'shefctl kernels' shows them"),
    BOOL("memory.lock", memory.lock, "true", "keep all memory in RAM, where that is allowed"),
    WORD("log.level", log.level, "info", "error|warning|info|debug", "how much is logged", LIVE),
    INT("watchdog.stalled_after_s", watchdog.stalled_after_s, "5", 1, 600, "s",
        "without progress for this long the service counts as stalled and systemd restarts it"),
};

const int shef_config_n_rows = sizeof shef_config_rows / sizeof shef_config_rows[0];
