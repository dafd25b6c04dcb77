/* SPDX-License-Identifier: MIT */
#include "drift_words.h"

#include <math.h>
#include <stdio.h>

#define POOL_MPS     0.05 /* what `current` and `station_keeping` may be at best: sonard.conf(5) */
#define TURN_LEAST_S 1.0  /* of a faster turn nobody can tell metres from none */
#define FIRST_TURN_S 60.0 /* a head that has not turned once by then stands still */

/* By the words of no_speed_bound: what is wrong, and what to do. */
static const struct {
    const char *what, *remedy;
} no_bounds[] = {
    {"no bound of its speed comes", "see whether sonard-mavlink still runs"},
    {"the autopilot does not say what its thrusters do (SERVO_OUTPUT_RAW)", "let sonard-mavlink send to it"},
    {"the thrusters' outputs (SERVO_OUTPUT_RAW) come below 5 Hz",
     "let sonard-mavlink ask for 20 Hz, or set SR0_RC_CHAN to 20"},
    {"the autopilot does not answer for FRAME_CONFIG, MOT_n_DIRECTION and SERVOn_FUNCTION",
     "let sonard-mavlink send to it"},
    {"FRAME_CONFIG is of a frame that sonard-mavlink does not know", "frames 0 to 6 are known"},
    {"not every motor of the frame has an output of its own (SERVOn_FUNCTION)",
     "each needs one, and MOT_n_DIRECTION 1 or -1"},
    {"an output passes the pilot's sticks through (SERVOn_FUNCTION 51 to 56)", "set it to 0"},
    {"a thruster's pulse is not from 1100 to 1900 us", "see MOT_PWM_MIN and MOT_PWM_MAX"},
    {"the autopilot's clock jumps", "see whether two have one system id"}};

const char *drift_bound_doubt(const struct methods_env *d)
{
    const struct drift_log *unseen = &d->poses.unseen;
    const double keep_mps = d->conf.vehicle.keep_mps;
    if (d->poses.no_bound)
        return no_bounds[d->poses.no_bound].what;
    if (!unseen->t_bound_ns || drift_log_in_use(unseen, loop_now(d->loop)))
        return "";
    if (unseen->set.bounded)
        return no_bounds[0].what;
    return keep_mps >= 0               ? "station_keeping in [vehicle] says what counts"
           : keep_mps > CONF_KEEP_AUTO ? "station_keeping is not auto in [vehicle]"
                                       : "how fast the water goes is not known: current in [vehicle]";
}

/* How much a vehicle drifts, as a text: in a turn of the head, or by the second where no head turns. */
struct amount {
    char text[24];
};

static struct amount drift_of(double m, double mps, double turn_s)
{
    struct amount a;
    if (turn_s >= TURN_LEAST_S)
        snprintf(a.text, sizeof a.text, "%.1f m", m);
    else
        snprintf(a.text, sizeof a.text, "%.2f m/s", mps);
    return a;
}

/* The same at a steady speed, level, and in depth where that is not known. */
static struct amount drift_at(const struct pose *pose, double level_mps, double vertical_mps, double turn_s)
{
    const double mps = pose->has & POSE_DEPTH ? level_mps : hypot(level_mps, vertical_mps);
    return drift_of(mps * turn_s, mps, turn_s);
}

/* A bound comes, and the configuration does not let it count. */
static void write_unused(const struct methods_env *d, const struct pose *pose, double turn_s, char *text,
                         size_t size)
{
    const struct drift_log *unseen = &d->poses.unseen;
    const struct conf_vehicle *v = &d->conf.vehicle;
    const bool is_auto = v->keep_mps <= CONF_KEEP_AUTO;
    const double water_mps = v->current_mps >= 0 ? v->current_mps : POOL_MPS;
    const struct amount then =
        drift_at(pose, fmin(unseen->said_mps[DRIFT_LEVEL] + water_mps, unseen->set.mps),
                 fmin(unseen->said_mps[DRIFT_VERTICAL] + water_mps, unseen->set.mps), turn_s);
    snprintf(text, size,
             "; set %s in [vehicle]: with `current = %g m/s` it would be %s, as the thrusters push now",
             is_auto               ? "`current`"
             : v->current_mps >= 0 ? "`station_keeping = auto`"
                                   : "`station_keeping = auto` and `current`",
             water_mps, then.text);
}

/* Nobody bounds its speed. */
static void write_unbounded(const struct methods_env *d, const struct pose *pose, double turn_s, char *text,
                            size_t size)
{
    snprintf(
        text, size,
        "; send a position or velocity, or set %s in [vehicle]: with `station_keeping = %g m/s` it would be %s",
        d->conf.vehicle.max_speed_mps > 0 ? "station_keeping" : "max_speed or station_keeping", POOL_MPS,
        drift_at(pose, POOL_MPS, POOL_MPS, turn_s).text);
}

static void write_what_helps(const struct methods_env *d, const struct pose *pose, double turn_s, char *text,
                             size_t size)
{
    const struct drift_log *unseen = &d->poses.unseen;
    const uint64_t now_ns = loop_now(d->loop);
    if (drift_log_in_use(unseen, now_ns))
        snprintf(text, size, ", by thrusters and `current`; a DVL, or a faster scan, would leave less");
    else if (d->poses.no_bound || (unseen->set.bounded && unseen->t_bound_ns))
        snprintf(text, size, "; %s: %s%s", no_bounds[d->poses.no_bound].what, no_bounds[d->poses.no_bound].remedy,
                 d->conf.vehicle.current_mps >= 0 ? "" : ", and set `current` in [vehicle]");
    else if (drift_log_comes(unseen, now_ns))
        write_unused(d, pose, turn_s, text, size);
    else
        write_unbounded(d, pose, turn_s, text, size);
}

const char *drift_sentence(const struct methods_env *d, char text[QUERY_REASON_SIZE])
{
    const struct answer_now now = query_now(d);
    const struct drift_log *unseen = &d->poses.unseen;
    const struct pose *pose = &now.pose;
    struct picture_frame frame;
    char helps[220];
    text[0] = '\0';
    if (!(pose->drift_mps > 0) || d->conf.vehicle.keep_mps >= 0 || pose_log_last_ns(&d->poses, POSE_POSITION) ||
        pose_log_last_ns(&d->poses, POSE_VELOCITY))
        return text;
    if (pose->heading_adrift) {
        snprintf(text, QUERY_REASON_SIZE,
                 "no attitude: the vehicle may have turned, so no direction is known; let the autopilot send "
                 "ATTITUDE, or "
                 "set station_keeping in [vehicle] where it neither moves nor turns");
        return text;
    }
    picture_get_frame(pipeline_picture(d->pipeline), &frame);
    write_what_helps(d, pose, frame.turn_s, helps, sizeof helps);
    const bool bounded = drift_log_in_use(unseen, now.now_ns), turns = frame.turn_s >= TURN_LEAST_S;
    const struct amount is =
        turns     ? drift_of(answer_drifted_m(&now, frame.turn_s), 0, frame.turn_s)
        : bounded ? drift_at(pose, unseen->mps[DRIFT_LEVEL], unseen->mps[DRIFT_VERTICAL], frame.turn_s)
                  : drift_at(pose, unseen->set.mps, unseen->set.mps, frame.turn_s);
    char in[32] = "";
    if (turns)
        snprintf(in, sizeof in, " in a scan of %.0f s", frame.turn_s);
    snprintf(text, QUERY_REASON_SIZE, "no position%s: %.20s of drift allowed for%.24s%.200s",
             pose->has & POSE_DEPTH ? "" : " and no depth", is.text, in, helps);
    return text;
}

const char *drift_why_not_clear(const struct methods_env *d, const struct picture_frame *frame, bool ned,
                                char text[QUERY_REASON_SIZE])
{
    if (!frame->pings)
        snprintf(text, QUERY_REASON_SIZE, "nothing is known yet: no ping was received");
    else if (ned && !frame->ned)
        snprintf(text, QUERY_REASON_SIZE, "no attitude received, so north is unknown");
    else if (frame->ned && !pose_log_fresh(&d->poses, loop_now(d->loop)) && query_pose_missing(d, text)[0])
        return text;
    else if (frame->looks.first_turns && frame->turn_s <= 0 &&
             (double)(loop_now(d->loop) - d->start_ns) * 1e-9 < FIRST_TURN_S)
        snprintf(text, QUERY_REASON_SIZE, "nothing is clear yet: the first scan is not over");
    else
        drift_sentence(d, text);
    return text;
}
