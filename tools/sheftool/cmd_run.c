/* sheftool run: a recording to depth. */
#include <stdio.h>

#include "sheftool/command.h"
#include "sheftool/machine.h"
#include "sheftool/progress.h"
#include "sheftool/report_parts.h"
#include "sheftool/run_files.h"
#include "sheftool/run_options.h"

struct settings {
    const char *recording;
    const char *out;
    struct shef_run_options how;
    int32_t mode;
    int64_t every;
    bool dense;
    bool pictures;
    bool cloud;
};

static const struct shef_option options[] = {
    SHEF_OPT_WORD("RECORDING", struct settings, recording, true, "the folder of a recording"),
    SHEF_OPT_NEEDED("out", struct settings, out, "DIR", "folder for the results"),
    SHEF_OPT_CHOICE("mode", struct settings, mode, SHEF_DEPTH_MODE_CHOICES, "combined",
                    "what is matched, see above"),
    SHEF_RUN_OPTIONS(struct settings, how),
    SHEF_OPT_INT("every", struct settings, every, "1", 1, 1000000, NULL,
                 "write files of every N-th frame only; all are processed"),
    SHEF_OPT_FLAG("dense", struct settings, dense,
                  "write disparity and depth at every pixel instead of at frame edges"),
    SHEF_OPT_FLAG("pictures", struct settings, pictures,
                  "also write pictures/N.png: frame, edges, disparity, and truth and errors where "
                  "the recording knows the truth"),
    SHEF_OPT_FLAG("cloud", struct settings, cloud,
                  "also write cloud/N.ply and two views of it, cloud/N.png"),
    SHEF_OPT_END,
};

/* What is open during one run. */
struct job {
    const struct settings *settings;
    struct shef_run_settings run_settings;
    struct shef_run *run;
    struct shef_output_folder folder;
    struct shef_run_files files;
    struct shef_progress progress;
    struct shef_timings total;
    struct shef_timings stages[SHEF_DEPTH_N_STAGES];
    json_t *frames;
    int64_t n;
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;

    return shef_run_options_check(&settings->how, err);
}

static enum shef_err add_timings(struct job *job, const struct shef_depth_report *report,
                                 struct shef_error *err)
{
    int64_t total_ns = 0;
    enum shef_err code = SHEF_OK;

    for (int i = 0; i < SHEF_DEPTH_N_STAGES && code == SHEF_OK; i++) {
        code = shef_timings_add(&job->stages[i], report->stage_ns[i]);
        total_ns += report->stage_ns[i];
    }
    if (code == SHEF_OK)
        code = shef_timings_add(&job->total, total_ns);
    return code == SHEF_OK ? SHEF_OK : shef_fail(err, code, "out of memory");
}

static json_t *frame_json(const struct shef_run_frame *frame)
{
    const struct shef_depth_report *report = frame->report;
    const uint32_t flags = report->flags;

    return json_pack(
        "{s:I, s:I, s:f, s:f, s:s, s:I, s:I, s:i, s:f, s:[f, f, f], s:b, s:b, s:b, s:b}", "number",
        (json_int_t)frame->frame->info.number, "mid_exposure_us",
        (json_int_t)(frame->snapshot->mid.ns / SHEF_NS_PER_US), "t_err_us",
        (double)frame->pairing->t_err_ns / 1e3, "pairing_residual_us",
        (double)frame->pairing->residual_ns / 1e3, "mode", shef_depth_mode_name(report->mode),
        "edge_pixels", (json_int_t)report->n_edges, "depths", (json_int_t)report->n_depths,
        "span_frames", report->span_frames, "span_ms", (double)report->span_ns / 1e6, "direction",
        report->direction[0], report->direction[1], report->direction[2], "direction_searched",
        (flags & SHEF_DEPTH_SEARCHED) != 0, "no_motion", (flags & SHEF_DEPTH_NO_MOTION) != 0,
        "trigger_predicted", (frame->snapshot->flags & SHEF_SNAPSHOT_PREDICTED) != 0,
        "pairing_ambiguous", (frame->pairing->flags & SHEF_PAIRING_AMBIGUOUS) != 0);
}

static enum shef_err use_frame(void *context, const struct shef_run_frame *frame,
                               struct shef_error *err)
{
    struct job *job = context;
    enum shef_err code = add_timings(job, frame->report, err);

    json_array_append_new(job->frames, frame_json(frame));
    if (code == SHEF_OK && job->n % job->settings->every == 0) {
        if (job->files.scorer) {
            const struct shef_run_estimate estimate = { .disparity = frame->output->disparity };
            static struct shef_run_tally unused;

            code = shef_run_scorer_load(job->files.scorer, frame->frame->info.number, err);
            job->files.has_truth = code == SHEF_OK;
            if (code == SHEF_OK)
                code = shef_run_scorer_add(job->files.scorer, &estimate, &unused, err);
            if (code == SHEF_ERR_NOT_FOUND)
                code = SHEF_OK;
        }
        if (code == SHEF_OK)
            code = shef_run_files_write(&job->files, frame, err);
    }
    shef_progress_step(&job->progress, ++job->n);
    return code;
}

static json_t *timing_json(struct job *job)
{
    const struct shef_timing_summary total = shef_timings_summary(&job->total);
    json_t *root = json_pack("{s:o}", "total", shef_timing_summary_json(&total));

    for (int i = 0; i < SHEF_DEPTH_N_STAGES; i++) {
        const struct shef_timing_summary stage = shef_timings_summary(&job->stages[i]);

        json_object_set_new(root, shef_depth_stage_name((enum shef_depth_stage)i),
                            shef_timing_summary_json(&stage));
    }
    return root;
}

static json_t *run_json(struct job *job)
{
    const struct shef_run_counts counts = shef_run_counts(job->run);
    const struct shef_depth_geometry geometry = shef_run_geometry(job->run);
    json_t *notes = json_array();
    const char *note;

    for (int i = 0; (note = shef_run_note(job->run, i)); i++)
        json_array_append_new(notes, json_string(note));
    return json_pack(
        "{s:s, s:s, s:s, s:s, s:s, s:s, s:b, s:b, s:i, s:{s:i, s:i, s:f, s:f, s:f, s:f, s:i},"
        " s:{s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:f, s:f}, s:I, s:o, s:o, s:O, s:o}",
        "kind", "run", "recording", job->settings->recording, "mode",
        shef_depth_mode_name((enum shef_depth_mode)job->settings->mode), "profile",
        shef_run_profile(job->run), "calibration", shef_run_calibration(job->run)->id,
        "calibration_file", job->settings->how.calibration ? job->settings->how.calibration : "",
        "robot", shef_run_has_robot(job->run), "dense", job->settings->dense, "threads",
        (int)job->settings->how.n_threads, "geometry", "width_px", geometry.width_px, "height_px",
        geometry.height_px, "f_px", geometry.f_px, "cx_px", geometry.cx_px, "cy_px", geometry.cy_px,
        "baseline_m", geometry.baseline_m, "max_disparity_px", geometry.max_disparity_px, "counts",
        "frames", (json_int_t)counts.n_frames, "processed", (json_int_t)counts.n_processed,
        "damaged", (json_int_t)counts.n_damaged, "unpaired", (json_int_t)counts.n_unpaired,
        "ambiguous", (json_int_t)counts.n_ambiguous, "with_velocity",
        (json_int_t)counts.n_with_velocity, "triggers", (json_int_t)counts.snapshots.n_triggers,
        "triggers_predicted", (json_int_t)counts.snapshots.n_predicted, "triggers_without_frame",
        (json_int_t)counts.pairing.n_skipped, "clock_skew_ppm", 1e6 * counts.pairing.skew,
        "pairing_residual_rms_us", counts.pairing.residual_rms_ns / 1e3, "memory_bytes",
        (json_int_t)shef_run_memory_bytes(job->run), "timing", timing_json(job), "machine",
        shef_machine_json(job->run_settings.cpu_features), "frames", job->frames, "notes", notes);
}

static void print_summary(struct job *job)
{
    const struct shef_run_counts counts = shef_run_counts(job->run);
    const struct shef_timing_summary total = shef_timings_summary(&job->total);

    printf("%u of %u frames, mode %s, profile %s: %s\n", counts.n_processed, counts.n_frames,
           shef_depth_mode_name((enum shef_depth_mode)job->settings->mode),
           shef_run_profile(job->run), job->folder.final);
    printf("%.2f ms a frame (median; p95 %.2f), events and files not counted\n", total.median_ms,
           total.p95_ms);
}

/* Also where the run failed: they may say why. */
static void print_notes(const struct job *job)
{
    const char *note;

    for (int i = 0; (note = shef_run_note(job->run, i)); i++)
        fprintf(stderr, "note: %s\n", note);
}

static enum shef_err run_and_write(struct job *job, struct shef_error *err)
{
    enum shef_err code;

    job->files = (struct shef_run_files){
        .folder = &job->folder,
        .geometry = shef_run_geometry(job->run),
        .dense = job->settings->dense,
        .pictures = job->settings->pictures,
        .cloud = job->settings->cloud,
    };
    if (job->settings->pictures) {
        struct shef_error reason;

        /* Without truth the pictures show less. */
        code = shef_run_scorer_open(&job->files.scorer, job->settings->recording,
                                    shef_run_calibration(job->run), shef_run_profile(job->run),
                                    &reason);
        if (code == SHEF_ERR_NO_MEMORY)
            return shef_fail(err, code, "%s", reason.text);
    }
    code = shef_run_files_prepare(&job->files, err);
    if (code != SHEF_OK)
        return code;
    shef_progress_begin(&job->progress, "frames", shef_run_n_frames(job->run));
    code = shef_run_all(job->run, use_frame, job, err);
    shef_progress_end(&job->progress);
    print_notes(job);
    if (code != SHEF_OK)
        return code;

    json_t *root = run_json(job);

    if (!root)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "out of memory");
    code = shef_output_folder_commit(&job->folder, root, err);
    json_decref(root);
    if (code == SHEF_OK)
        print_summary(job);
    return code;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct job job = { .settings = settings, .frames = json_array() };
    enum shef_err code;

    job.run_settings = shef_run_options_settings(&settings->how, settings->recording);
    job.run_settings.modes[0] = (enum shef_depth_mode)settings->mode;
    job.run_settings.n_modes = 1;
    code = shef_run_open(&job.run, &job.run_settings, err);
    if (code == SHEF_OK)
        code = shef_output_folder_open(&job.folder, settings->out, "run.json", err);
    if (code == SHEF_OK)
        code = run_and_write(&job, err);
    shef_output_folder_discard(&job.folder);
    shef_run_scorer_close(job.files.scorer);
    shef_run_files_free(&job.files);
    shef_run_close(job.run);
    shef_timings_free(&job.total);
    for (int i = 0; i < SHEF_DEPTH_N_STAGES; i++)
        shef_timings_free(&job.stages[i]);
    json_decref(job.frames);
    return code;
}

const struct shef_command shef_command_run = {
    .name = "run",
    .summary = "a recording to disparity, depth and point clouds",
    .description =
        "Takes a recording through the live service's own chain, in the order of event time:\n"
        "events, filter, snapshots at mid-exposure, frames paired with them by the gaps of the\n"
        "cameras' clocks, edge maps, matching, depth. Writes into a folder that appears whole or\n"
        "not at all, for frame N of the camera:\n"
        "  disparity/N.pfm       px, 0 = none; left(x, y) matches right(x - d, y)\n"
        "  disparity/N.conf.pfm  confidence 0..1: the probability of |error| <= 1 px at\n"
        "                        f 555 px\n"
        "  depth/N.png           mm along the left camera's axis, 0 = none\n"
        "  sigma/N.png           its standard deviation, mm\n"
        "  pictures/N.png, cloud/N.ply and .png  if asked for\n"
        "  run.json              settings, counts, times, what each frame was like\n"
        "\n"
        "Modes:\n"
        "  combined            graded and temporal together\n"
        "  graded, ternary     events against the frame's gradient along the motion\n"
        "  temporal            events between two frames against the frames' difference\n"
        "  unsigned            edges without their sign\n"
        "  paper-ds, paper-dp  the paper's window correlation (D_s), its pyramid (D_p)",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
