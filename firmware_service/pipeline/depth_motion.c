/* Where the camera moves to and how far: told by the robot, or found in the pictures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pipeline/depth_chain_internal.h"

/* Where nobody tells the speed: a step of brightness that makes an event, ln units, and a depth
 * that stands for the scene. Both only serve to choose among a few frames. */
#define TYPICAL_THRESHOLD 0.25
#define TYPICAL_DEPTH_M   2.5

#define SAMPLE_STEP_PX 4
#define STEEPNESS_BINS 256
#define STEEPNESS_BIN  0.005f

/* The lag over that of edges of 0.275 ln per px, by steepness: BASE + PER_STEEPNESS / steepness.
 * The best lags of rendered recordings at 0.35 m/s lie between 0.29 px (0.366 ln per px) and 0.66
 * (0.126). */
#define LAG_BASE          0.47
#define LAG_PER_STEEPNESS 0.146
#define MAX_LAG_PX        4.0

/* The share of the lag that shows at a speed: all of it from 0.15 m/s on, 0.6 at 0.03 m/s and below
 * (rendered recordings, at 0.03, 0.10 and 0.35 m/s: 0.2, 0.33 and 0.37 px). */
static double lag_share(double speed_m_s)
{
    const double share = 0.6 + 0.4 * log(speed_m_s / 0.03) / log(5.0);

    return share < 0.6 ? 0.6 : share > 1 ? 1 : share;
}

/* How steep edges are along the motion, ln per px: the 0.9 quantile over a sample of pixels. */
static double steepness(const struct shef_image_u8 picture, const double direction[3])
{
    const double length = hypot(direction[0], direction[1]);
    const float u = length > 0 ? (float)(direction[0] / length) : 1.0f;
    const float v = length > 0 ? (float)(direction[1] / length) : 0.0f;
    int32_t counts[STEEPNESS_BINS] = { 0 };
    int32_t n = 0;

    for (int32_t y = 1; y + 1 < picture.height_px; y += SAMPLE_STEP_PX) {
        const uint8_t *above = shef_row_u8(picture, y - 1);
        const uint8_t *row = shef_row_u8(picture, y);
        const uint8_t *below = shef_row_u8(picture, y + 1);

        for (int32_t x = 1; x + 1 < picture.width_px; x += SAMPLE_STEP_PX) {
            const float change =
                u * (float)(row[x + 1] - row[x - 1]) + v * (float)(below[x] - above[x]);
            const int32_t bin =
                (int32_t)(fabsf(change) / (float)(row[x] + 6) * (0.5f / STEEPNESS_BIN));

            counts[bin < STEEPNESS_BINS ? bin : STEEPNESS_BINS - 1]++;
            n++;
        }
    }

    int32_t bin = STEEPNESS_BINS - 1;

    for (int32_t n_above = 0; bin > 0 && (n_above += counts[bin]) * 10 < n; bin--)
        ;
    return (bin + 0.5) * (double)STEEPNESS_BIN;
}

/* Events of flat edges come later: the picture has to move further for a threshold. Of the frame
 * before, which is at hand and shows the same scene. */
static double lag_of_texture(const struct shef_depth_chain *chain)
{
    const struct depth_past *before = depth_history_before(&chain->history);

    if (!before)
        return 1;
    const double g = steepness(before->picture, chain->direction);
    return LAG_BASE + LAG_PER_STEEPNESS / g;
}

static void set_direction(struct shef_depth_chain *chain, const double v[3], double length,
                          double speed_m_s)
{
    for (int i = 0; i < 3; i++)
        chain->direction[i] = v[i] / length;

    const double lag_px = chain->params.lag_px * lag_share(speed_m_s) * lag_of_texture(chain);

    shef_warp_shift_set(&chain->shift, chain->direction, fmin(lag_px, MAX_LAG_PX));
    chain->lag = &chain->shift;
}

/* Whether a pair falls short of what is wanted by more than half a frame, but will not for long.
 *   wanted, got, step  of the pair and of the frame before alone: times, or numbers of events */
static bool is_short(const struct shef_depth_chain *chain, double wanted, double got, double step)
{
    return step > 0 && wanted - got > step / 2 && depth_history_grows(&chain->history);
}

static bool is_short_in_time(const struct shef_depth_chain *chain, const struct depth_past *earlier,
                             int64_t wanted_ns)
{
    const struct depth_past *now = chain->now;
    const struct depth_past *before = depth_history_before(&chain->history);

    return !earlier || !before ||
           is_short(chain, (double)wanted_ns, (double)shef_event_time_since(now->mid, earlier->mid),
                    (double)shef_event_time_since(now->mid, before->mid));
}

static bool is_short_in_events(const struct shef_depth_chain *chain,
                               const struct depth_past *earlier, uint64_t wanted)
{
    const struct depth_past *now = chain->now;
    const struct depth_past *before = depth_history_before(&chain->history);

    return !earlier || !before ||
           is_short(chain, (double)wanted, (double)(now->n_events - earlier->n_events),
                    (double)(now->n_events - before->n_events));
}

static void keep_earlier(struct shef_depth_chain *chain, const struct depth_past *earlier,
                         bool is_short, struct shef_depth_report *report)
{
    chain->earlier = earlier;
    report->flags |= is_short ? SHEF_DEPTH_SETTLING : 0;
    if (!earlier) {
        report->flags |= SHEF_DEPTH_NO_PAST;
        return;
    }
    report->span_ns = shef_event_time_since(chain->now->mid, earlier->mid);
    report->span_frames = (int32_t)(chain->now->number - earlier->number);
}

/* What a camera that moves one pixel sideways should see in events, whatever its direction is: the
 * sum of the brightness changes over the picture, in thresholds. */
static double events_per_px(const struct shef_depth_chain *chain)
{
    const struct shef_image_u8 picture = chain->now->picture;
    double sum = 0;

    for (int32_t y = 1; y + 1 < picture.height_px; y += SAMPLE_STEP_PX) {
        const uint8_t *above = shef_row_u8(picture, y - 1);
        const uint8_t *row = shef_row_u8(picture, y);
        const uint8_t *below = shef_row_u8(picture, y + 1);

        for (int32_t x = 1; x + 1 < picture.width_px; x += SAMPLE_STEP_PX) {
            const int32_t change = abs(row[x + 1] - row[x - 1]) + abs(below[x] - above[x]);

            sum += (double)change / (row[x] + 6);
        }
    }
    /* Half of the mean over both axes, central differences over two pixels. */
    return sum * SAMPLE_STEP_PX * SAMPLE_STEP_PX / 4 / TYPICAL_THRESHOLD;
}

/* The robot says how the camera moves. */
static void use_velocity(struct shef_depth_chain *chain, struct shef_depth_report *report)
{
    const double *v = chain->input->velocity_m_s;
    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const struct depth_past *earlier;
    int64_t span_ns;

    if (speed < chain->params.least_speed_m_s) {
        report->flags |= SHEF_DEPTH_NO_MOTION;
        earlier = depth_history_find(&chain->history, INT64_MAX / 2);
        keep_earlier(chain, earlier, !earlier, report);
        return;
    }
    set_direction(chain, v, speed, speed);
    span_ns = (int64_t)(chain->params.travel_m / speed * 1e9);
    earlier = depth_history_find(&chain->history, span_ns);
    keep_earlier(chain, earlier, is_short_in_time(chain, earlier, span_ns), report);
}

/* How fast the camera seems to move, from the events since the earlier frame.
 *   per_m  events that a metre of travel makes */
static double guess_speed(const struct shef_depth_chain *chain, double per_m, int64_t span_ns)
{
    if (!chain->earlier || per_m <= 0)
        return 1;
    return (double)(chain->now->n_events - chain->earlier->n_events) / per_m /
           ((double)span_ns * 1e-9);
}

/* Nobody says it. */
static void search(struct shef_depth_chain *chain, struct shef_depth_report *report)
{
    struct shef_flow flow;

    shef_frame_rectify_run(chain->rectify, chain->input->frame, chain->now->picture);
    chain->is_rectified = true;
    /* Events that a metre of travel makes. */
    const double per_m = chain->geometry.f_px / TYPICAL_DEPTH_M * events_per_px(chain);
    const uint64_t n_events = (uint64_t)(chain->params.travel_m * per_m);
    const struct depth_past *earlier = depth_history_find_events(&chain->history, n_events);

    keep_earlier(chain, earlier, is_short_in_events(chain, earlier, n_events), report);
    shef_event_edges_of_values(chain->event_edges[SHEF_EDGE_GRADED], chain->input->snapshot->values,
                               NULL, &chain->graded_right[0]);
    shef_flow_search_run(chain->search, chain->now->picture, &chain->graded_right[0], &flow);
    report->flags |= SHEF_DEPTH_SEARCHED;
    report->flow_margin = flow.margin;
    if (flow.state == SHEF_FLOW_FOUND)
        set_direction(chain, flow.camera_velocity, 1, guess_speed(chain, per_m, report->span_ns));
    else
        report->flags |= SHEF_DEPTH_NO_MOTION;
}

void depth_motion_find(struct shef_depth_chain *chain, struct shef_depth_report *report)
{
    chain->lag = NULL;
    chain->is_rectified = false;
    memset(chain->direction, 0, sizeof chain->direction);
    if (chain->input->has_velocity) {
        use_velocity(chain, report);
    } else if (chain->search) {
        search(chain, report);
    } else {
        report->flags |= SHEF_DEPTH_NO_MOTION;
        const int64_t span_ns = 100 * SHEF_NS_PER_MS;
        const struct depth_past *earlier = depth_history_find(&chain->history, span_ns);

        keep_earlier(chain, earlier, is_short_in_time(chain, earlier, span_ns), report);
    }
}

/* out = v turned by the inverse of a rotation; out may be v. */
static void turn_back(const double r[9], const double v[3], double out[3])
{
    const double from[3] = { v[0], v[1], v[2] };

    for (int i = 0; i < 3; i++)
        out[i] = r[i] * from[0] + r[3 + i] * from[1] + r[6 + i] * from[2];
}

void shef_depth_velocity(const struct shef_calibration *calibration,
                         const struct shef_depth_geometry *geometry,
                         const struct shef_rigid *t_world_hand, const double speed[6],
                         double out_velocity_m_s[3])
{
    const double *w = speed + 3;
    double arm[3]; /* from the tool to the camera, world axes */
    double v[3];

    shef_rigid_rotate(t_world_hand, calibration->t_hand_frame.t_m, arm);
    v[0] = speed[0] + w[1] * arm[2] - w[2] * arm[1];
    v[1] = speed[1] + w[2] * arm[0] - w[0] * arm[2];
    v[2] = speed[2] + w[0] * arm[1] - w[1] * arm[0];
    turn_back(t_world_hand->r, v, v);
    turn_back(calibration->t_hand_frame.r, v, v);
    turn_back(geometry->r_camera_rectified, v, out_velocity_m_s);
}
