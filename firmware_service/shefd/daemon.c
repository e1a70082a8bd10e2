#include "shefd/daemon.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include "control/loop.h"
#include "control/server.h"
#include "control/socket.h"
#include "core/clock.h"
#include "core/cpu.h"
#include "core/log.h"
#include "service/service.h"
#include "service/thread.h"
#include "shefd/config_command.h"
#include "shefd/process.h"
#include "shefd/watchdog.h"

struct daemon {
    const struct shef_shefd_options *options;
    struct shef_config config;
    struct shef_loop *loop;
    struct shef_control *control;
    struct shef_service *service;
    struct shef_watchdog watchdog;
    struct shef_loop_watch signals;
    struct shef_loop_watch timer;
    struct shef_loop_watch end;
    bool is_stall_logged;
    struct shef_error lock_err; /* why memory is not locked, if it is not */
    enum shef_err outcome;
    struct shef_error outcome_err;
};

static void set_log_level(const struct shef_config *config)
{
    static const struct {
        const char *name;
        enum shef_log_level level;
    } levels[] = {
        { "error", SHEF_LOG_ERROR },
        { "warning", SHEF_LOG_WARNING },
        { "info", SHEF_LOG_INFO },
        { "debug", SHEF_LOG_DEBUG },
    };

    for (size_t i = 0; i < sizeof levels / sizeof levels[0]; i++)
        if (strcmp(levels[i].name, config->log.level) == 0)
            shef_log_set_level(levels[i].level);
}

/* Everything picks its kernels from what is left here. */
static enum shef_err choose_kernels(const struct shef_config *config, struct shef_error *err)
{
    uint32_t features;
    const enum shef_err code = shef_cpu_features_among(config->kernels.isa, &features, err);

    if (code != SHEF_OK)
        return shef_fail_context(err, "kernels.isa");
    shef_cpu_restrict(features);
    return SHEF_OK;
}

/* Counts what differs; the first setting that needs a restart is named. */
static enum shef_err compare(const struct shef_config *now, const struct shef_config *wanted,
                             int *out_n_changed, struct shef_error *err)
{
    *out_n_changed = 0;
    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        char before[SHEF_CONFIG_PATH_BYTES], after[SHEF_CONFIG_PATH_BYTES];

        shef_config_get(now, row, before, sizeof before);
        shef_config_get(wanted, row, after, sizeof after);
        if (strcmp(before, after) == 0)
            continue;
        if (!row->is_live)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "%s has changed, which needs a restart (systemctl restart shefd)",
                             row->key);
        (*out_n_changed)++;
    }
    return SHEF_OK;
}

static void reload(struct daemon *daemon)
{
    struct shef_config wanted;
    struct shef_error err = { 0 };
    int n_changed = 0;
    enum shef_err code;

    sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%lld",
               (long long)(shef_clock_now(shef_clock_monotonic()).ns / 1000));
    code = shef_shefd_config_load(daemon->options, &wanted, &err);
    if (code == SHEF_OK)
        code = compare(shef_service_config(daemon->service), &wanted, &n_changed, &err);
    if (code == SHEF_OK)
        code = shef_service_apply(daemon->service, &wanted, &err);
    if (code == SHEF_OK) {
        daemon->config = wanted;
        set_log_level(&wanted);
        shef_log(SHEF_LOG_INFO, "settings read again, %d changed", n_changed);
    } else {
        shef_log(SHEF_LOG_ERROR, "settings stay as they were: %s", err.text);
    }
    sd_notify(0, "READY=1");
}

static void on_signal(void *context, uint32_t events)
{
    struct daemon *daemon = context;
    int number;

    (void)events;
    while ((number = shef_process_next_signal(daemon->signals.fd)) != 0) {
        if (number == SIGHUP) {
            reload(daemon);
            continue;
        }
        shef_log(SHEF_LOG_INFO, "stopping: %s", number == SIGTERM ? "SIGTERM" : "SIGINT");
        shef_loop_quit(daemon->loop);
    }
}

static void on_timer(void *context, uint32_t events)
{
    struct daemon *daemon = context;
    const shef_host_time now = shef_clock_now(shef_clock_monotonic());
    char status[256];
    uint64_t n_ticks;
    const ssize_t n = read(daemon->timer.fd, &n_ticks, sizeof n_ticks);

    (void)events;
    (void)n;
    shef_service_describe(daemon->service, status, sizeof status);
    if (shef_watchdog_is_alive(&daemon->watchdog, shef_service_progress(daemon->service), now)) {
        daemon->is_stall_logged = false;
        sd_notifyf(0, "WATCHDOG=1\nSTATUS=%s", status);
        return;
    }
    sd_notifyf(0, "STATUS=stalled: %s", status);
    if (!daemon->is_stall_logged)
        shef_log(SHEF_LOG_ERROR, "no progress for %d s: %s",
                 daemon->config.watchdog.stalled_after_s, status);
    daemon->is_stall_logged = true;
}

static void on_source_end(void *context, uint32_t events)
{
    struct daemon *daemon = context;

    (void)events;
    if (!shef_service_has_ended(daemon->service))
        return; /* another source plays by now */
    daemon->outcome = shef_service_outcome(daemon->service, &daemon->outcome_err);
    if (daemon->options->ends_with_source) {
        shef_loop_quit(daemon->loop);
        return;
    }
    if (daemon->outcome != SHEF_OK)
        shef_log(SHEF_LOG_ERROR, "%s", daemon->outcome_err.text);
    else
        shef_log(SHEF_LOG_INFO, "the recording is over");
    daemon->outcome = SHEF_OK;
}

static enum shef_err open_signals(struct daemon *daemon, struct shef_error *err)
{
    int fd;
    const enum shef_err code = shef_process_take_signals(&fd, err);

    if (code != SHEF_OK)
        return code;
    daemon->signals = (struct shef_loop_watch){ fd, on_signal, daemon };
    return shef_loop_watch(daemon->loop, &daemon->signals, EPOLLIN, err);
}

/* Half the watchdog's period, a second at most. */
static enum shef_err open_timer(struct daemon *daemon, struct shef_error *err)
{
    uint64_t watchdog_us = 0;
    int64_t period_ns = SHEF_NS_PER_S;
    struct itimerspec times;
    const int fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);

    if (fd < 0)
        return shef_fail_os(err, errno, "start the watchdog's timer");
    daemon->timer = (struct shef_loop_watch){ fd, on_timer, daemon };
    if (sd_watchdog_enabled(0, &watchdog_us) > 0 &&
        (int64_t)watchdog_us * SHEF_NS_PER_US / 2 < period_ns)
        period_ns = (int64_t)watchdog_us * SHEF_NS_PER_US / 2;
    times.it_interval = (struct timespec){ period_ns / SHEF_NS_PER_S, period_ns % SHEF_NS_PER_S };
    times.it_value = times.it_interval;
    if (timerfd_settime(fd, 0, &times, NULL) != 0)
        return shef_fail_os(err, errno, "start the watchdog's timer");
    return shef_loop_watch(daemon->loop, &daemon->timer, EPOLLIN, err);
}

static enum shef_err open_control(struct daemon *daemon, struct shef_error *err)
{
    const struct shef_control_params params = {
        .path = daemon->config.control.socket,
        .group = daemon->config.control.group,
        .max_clients = daemon->config.control.max_clients,
        .timeout_s = daemon->config.control.timeout_s,
        .loop = daemon->loop,
        .clock = shef_clock_monotonic(),
    };

    return shef_control_create(&params, &daemon->control, err);
}

static enum shef_err start_service(struct daemon *daemon, struct shef_error *err)
{
    enum shef_err code = shef_service_create(&daemon->config, &daemon->service, err);

    if (code == SHEF_OK)
        code = shef_service_register_commands(daemon->service, daemon->control, err);
    if (code == SHEF_OK)
        code = shef_config_command_register(daemon->control, daemon->service, err);
    if (code == SHEF_OK)
        code = shef_service_start(daemon->service, err);
    if (code != SHEF_OK)
        return code;
    daemon->end =
        (struct shef_loop_watch){ shef_service_end_fd(daemon->service), on_source_end, daemon };
    /* Edge-triggered: each end is told once, without reading the service's own descriptor. */
    return shef_loop_watch(daemon->loop, &daemon->end, EPOLLIN | EPOLLET, err);
}

/* The socket comes first: a second service must not get as far as touching devices. */
static enum shef_err start(struct daemon *daemon, struct shef_error *err)
{
    const struct shef_thread_params own =
        shef_thread_params_of(&daemon->config, SHEF_THREAD_CONTROL, "shefd");
    bool has_real_time;
    enum shef_err code = shef_loop_create(&daemon->loop, err);

    if (code == SHEF_OK)
        code = open_signals(daemon, err);
    if (code == SHEF_OK)
        code = open_control(daemon, err);
    if (code == SHEF_OK && daemon->config.memory.lock)
        (void)!shef_process_lock_memory(&daemon->lock_err);
    if (code == SHEF_OK)
        code = start_service(daemon, err);
    if (code == SHEF_OK)
        code = shef_thread_adopt(pthread_self(), &own, &has_real_time, err);
    if (code == SHEF_OK) {
        shef_watchdog_init(&daemon->watchdog,
                           daemon->config.watchdog.stalled_after_s * SHEF_NS_PER_S,
                           shef_clock_now(shef_clock_monotonic()));
        code = open_timer(daemon, err);
    }
    return code;
}

/* Once it is clear that the service starts: a failure stays the one sentence that it is. */
static void log_what_is_missing(const struct daemon *daemon)
{
    const char *group = daemon->config.control.group;

    if (*group && shef_control_group(group) == SHEF_CONTROL_NO_GROUP)
        shef_log(SHEF_LOG_INFO,
                 "there is no group '%s', so root and this user only may use shefctl; see "
                 "control.group",
                 group);
    if (daemon->lock_err.code != SHEF_OK)
        shef_log(SHEF_LOG_WARNING, "memory is not locked, so other programs may slow this down: %s",
                 daemon->lock_err.text);
}

static void stop(struct daemon *daemon)
{
    shef_service_stop(daemon->service);
    shef_control_destroy(daemon->control);
    shef_service_destroy(daemon->service);
    if (daemon->timer.fd >= 0)
        close(daemon->timer.fd);
    if (daemon->signals.fd >= 0)
        close(daemon->signals.fd);
    shef_loop_destroy(daemon->loop);
}

enum shef_err shef_daemon_run(const struct shef_shefd_options *options,
                              const struct shef_config *config, struct shef_error *err)
{
    struct daemon daemon = {
        .options = options, .config = *config, .signals = { .fd = -1 }, .timer = { .fd = -1 }
    };
    char status[256];
    enum shef_err code = choose_kernels(config, err);

    if (code != SHEF_OK)
        return code;
    set_log_level(config);
    code = start(&daemon, err);
    if (code == SHEF_OK) {
        log_what_is_missing(&daemon);
        shef_service_describe(daemon.service, status, sizeof status);
        sd_notifyf(0, "READY=1\nSTATUS=%s", status);
        shef_log(SHEF_LOG_INFO, "shefd %s is up: %s", SHEF_VERSION, status);
        shef_loop_run(daemon.loop);
        sd_notify(0, "STOPPING=1");
        code = daemon.outcome;
        if (code != SHEF_OK)
            *err = daemon.outcome_err;
    }
    stop(&daemon);
    return code;
}
