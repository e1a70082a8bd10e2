#include "service/service.h"

#include <stdio.h>
#include <stdlib.h>

#include <jansson.h>

#include "control/server.h"
#include "core/clock.h"
#include "core/cpu.h"
#include "core/wake.h"
#include "service/kernels.h"

struct shef_service {
    struct shef_config config;
    struct shef_wake end_wake;
    shef_host_time started;
};

enum shef_err shef_service_create(const struct shef_config *config,
                                  struct shef_service **out_service, struct shef_error *err)
{
    struct shef_service *service = calloc(1, sizeof *service);

    if (!service)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "service: out of memory");
    service->config = *config;
    service->started = shef_clock_now(shef_clock_monotonic());
    if (*config->source.recording) {
        free(service);
        return shef_fail(err, SHEF_ERR_UNSUPPORTED, "this build plays no recordings");
    }
    if (shef_wake_init(&service->end_wake, err) != SHEF_OK) {
        free(service);
        return err->code;
    }
    *out_service = service;
    return SHEF_OK;
}

enum shef_err shef_service_start(struct shef_service *service, struct shef_error *err)
{
    (void)service;
    (void)err;
    return SHEF_OK;
}

void shef_service_stop(struct shef_service *service)
{
    (void)service;
}

void shef_service_destroy(struct shef_service *service)
{
    if (!service)
        return;
    shef_wake_deinit(&service->end_wake);
    free(service);
}

const struct shef_config *shef_service_config(const struct shef_service *service)
{
    return &service->config;
}

struct shef_service_progress shef_service_progress(const struct shef_service *service)
{
    (void)service;
    return (struct shef_service_progress){ .is_expected = false };
}

void shef_service_describe(const struct shef_service *service, char *out_text, size_t n_bytes)
{
    (void)service;
    snprintf(out_text, n_bytes, "idle, no source");
}

int shef_service_end_fd(const struct shef_service *service)
{
    return service->end_wake.fd;
}

enum shef_err shef_service_outcome(const struct shef_service *service, struct shef_error *err)
{
    (void)service;
    (void)err;
    return SHEF_OK;
}

enum shef_err shef_service_apply(struct shef_service *service, const struct shef_config *config,
                                 struct shef_error *err)
{
    (void)err;
    service->config = *config;
    return SHEF_OK;
}

static double uptime_s(const struct shef_service *service)
{
    const shef_host_time now = shef_clock_now(shef_clock_monotonic());

    return (double)shef_host_time_since(now, service->started) / (double)SHEF_NS_PER_S;
}

static enum shef_err answer_status(void *context, const json_t *arguments, json_t *answer,
                                   struct shef_error *err)
{
    const struct shef_service *service = context;

    (void)arguments;
    (void)err;
    json_object_set_new(answer, "state", json_string("idle"));
    json_object_set_new(answer, "mode", json_string(service->config.depth.mode));
    json_object_set_new(answer, "source", json_pack("{s:s}", "kind", "none"));
    json_object_set_new(answer, "uptime_s", json_real(uptime_s(service)));
    json_object_set_new(answer, "warnings", json_array());
    return SHEF_OK;
}

static enum shef_err answer_kernels(void *context, const json_t *arguments, json_t *answer,
                                    struct shef_error *err)
{
    json_t *kernels = shef_kernels_to_json(shef_cpu_features());

    (void)context;
    (void)arguments;
    if (!kernels)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "list the kernels: out of memory");
    json_object_update(answer, kernels);
    json_decref(kernels);
    return SHEF_OK;
}

static const struct shef_control_command commands[] = {
    { "status", "says what the service does and how it fares", answer_status },
    { "kernels", "lists the implementations picked for this processor", answer_kernels },
};

enum shef_err shef_service_register_commands(struct shef_service *service,
                                             struct shef_control *control, struct shef_error *err)
{
    return shef_control_register(control, commands, sizeof commands / sizeof commands[0], service,
                                 err);
}
