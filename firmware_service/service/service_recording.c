/* The service's side of recording: what is told to whom when a recording ends. Thread: control. */
#include "core/log.h"
#include "service/recording_place.h"
#include "service/service_internal.h"

static struct shef_recorder *recorder_of(const struct shef_service *service)
{
    return service->is_running ? shef_playback_recorder(service->playback) : NULL;
}

enum shef_err shef_service_record(struct shef_service *service, const char *name, char *out_path,
                                  struct shef_error *err)
{
    struct shef_recorder_report report;
    enum shef_err code;

    shef_service_recording(service, &report);
    if (report.is_on)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record start: '%s' is being recorded already; end it with 'record stop'",
                         report.path);
    code = shef_recording_place(&service->config, name, out_path, err);
    if (code == SHEF_OK)
        code = shef_recorder_begin(recorder_of(service), out_path, &service->config, err);
    if (code == SHEF_OK)
        service->last_is_untold = false;
    return code;
}

enum shef_err shef_service_end_recording(struct shef_service *service,
                                         struct shef_recorder_report *out_report,
                                         struct shef_error *err)
{
    struct shef_recorder *recorder = recorder_of(service);
    struct shef_recorder_report report = { .is_on = false };
    enum shef_err code = SHEF_OK;

    if (recorder)
        shef_recorder_report(recorder, &report);
    if (report.is_on)
        code = shef_recorder_end(recorder, &service->last_recording, err);
    else if (!service->last_is_untold)
        code = shef_fail(err, SHEF_ERR_INVALID, "record stop: nothing is being recorded");
    if (code != SHEF_OK)
        return code;
    service->last_is_untold = false;
    *out_report = service->last_recording;
    return SHEF_OK;
}

void shef_service_recording(const struct shef_service *service,
                            struct shef_recorder_report *out_report)
{
    const struct shef_recorder *recorder = recorder_of(service);

    *out_report = (struct shef_recorder_report){ .is_on = false };
    if (recorder)
        shef_recorder_report(recorder, out_report);
    if (!out_report->is_on)
        *out_report = service->last_recording;
}

static void tell(struct shef_service *service)
{
    const struct shef_recorder_report *report = &service->last_recording;

    service->last_is_untold = true;
    shef_log(report->verdict == SHEF_VERDICT_STOPPED ? SHEF_LOG_ERROR : SHEF_LOG_INFO,
             "the recording '%s' has ended, verdict %s%s%s", report->path,
             shef_verdict_name(report->verdict), *report->reason ? ": " : "", report->reason);
}

void shef_service_look_after_recording(struct shef_service *service)
{
    struct shef_recorder *recorder = recorder_of(service);

    if (recorder && shef_recorder_look_after(recorder, &service->config, &service->last_recording))
        tell(service);
}

void shef_service_note_recording(struct shef_service *service, bool was_on)
{
    if (!was_on)
        return;
    shef_recorder_report(shef_playback_recorder(service->playback), &service->last_recording);
    tell(service);
}
