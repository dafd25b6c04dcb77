/* SPDX-License-Identifier: MIT */
#include "mavlink_thrusters.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define ATTITUDE_OLD_NS 300000000u
#define REORDERED_NS    100000000u /* a message that is older than the last by less was overtaken */
#define RESTARTED_NS    2000000000u
#define SELDOM_NS       2000000000u /* two samples that are no farther apart come at a rate */
#define IN_SECOND       12          /* of 20 samples */
#define CLIMB_S         2.0         /* of the average: a motion to and fro pushes to and fro */
#define CLIMB_OFF       0.03        /* of the average */
#define CLIMB_MOST      20.0
#define CLIMB_OLD_NS    1000000000u
#define CLIMBS_NS       5000000000u

#define FRAME     0
#define DIRECTION 1                   /* of motor 1 */
#define FUNCTION  (1 + THRUST_MOTORS) /* of output 1 */

/* Numbers of SERVOn_FUNCTION. */
#define MOTOR_1  33
#define MOTOR_8  40
#define MOTOR_9  82
#define MOTOR_12 85
#define STICKS_1 51 /* RCIN1 to RCIN6 are the sticks; the rest lights, camera and other switches */
#define STICKS_6 56
#define NEEDED   8 /* outputs: there is no BlueROV2 whose motors are beyond */

const char *const mavlink_no_bound_words[] = {"",       "messages", "rate",   "parameters", "frame",
                                              "motors", "sticks",   "pulses", "clock",      "vehicle"};

void mavlink_thrusters_init(struct mavlink_thrusters *t, const struct mavlink_thrusters_conf *conf)
{
    *t = (struct mavlink_thrusters){.conf = *conf, .why = MAVLINK_NO_MESSAGES};
    if (!(t->conf.volts > 0))
        t->conf.volts = THRUST_VOLTS;
}

void mavlink_thrusters_forget(struct mavlink_thrusters *t)
{
    const struct mavlink_thrusters_conf conf = t->conf;
    const bool submarine = t->submarine, armed = t->armed;
    mavlink_thrusters_init(t, &conf);
    t->submarine = submarine;
    t->armed = armed;
}

void mavlink_thrusters_lose(struct mavlink_thrusters *t, enum mavlink_no_bound why)
{
    t->t_ns = 0;
    t->why = why;
    t->fresh = false;
}

void mavlink_thrusters_heartbeat(struct mavlink_thrusters *t, const struct mavlink_heartbeat *m)
{
    t->submarine = m->type == MAVLINK_TYPE_SUBMARINE && m->autopilot == MAVLINK_AUTOPILOT_ARDUPILOT;
    t->armed = m->base_mode & MAVLINK_MODE_ARMED;
}

/* ---- parameters ---- */

static void name_of(int param, char id[MAVLINK_PARAM_ID])
{
    char text[32];
    memset(id, 0, MAVLINK_PARAM_ID);
    if (param == FRAME)
        snprintf(text, sizeof text, "FRAME_CONFIG");
    else if (param < FUNCTION)
        snprintf(text, sizeof text, "MOT_%d_DIRECTION", param - DIRECTION + 1);
    else
        snprintf(text, sizeof text, "SERVO%d_FUNCTION", param - FUNCTION + 1);
    memcpy(id, text, strnlen(text, MAVLINK_PARAM_ID));
}

void mavlink_thrusters_param(struct mavlink_thrusters *t, const struct mavlink_param_value *m)
{
    char id[MAVLINK_PARAM_ID];
    for (int i = 0; i < MAVLINK_THRUSTERS_PARAMS; i++) {
        name_of(i, id);
        if (strncmp(id, m->param_id, sizeof id) != 0)
            continue;
        const int value = fabsf(m->param_value) < 1e6f ? (int)lrintf(m->param_value) : -1000;
        if (t->known[i] && t->param[i] != value) /* what was pushed until now went by the old one */
            mavlink_thrusters_lose(t, MAVLINK_NO_PARAMETERS);
        t->param[i] = value;
        t->known[i] = true;
    }
}

bool mavlink_thrusters_ask(struct mavlink_thrusters *t, bool missing, char id[MAVLINK_PARAM_ID])
{
    if (!t->submarine)
        return false;
    for (int k = 0; k < MAVLINK_THRUSTERS_PARAMS; k++) {
        t->asked = (t->asked + 1) % MAVLINK_THRUSTERS_PARAMS;
        if (missing && t->known[t->asked])
            continue;
        name_of(t->asked, id);
        return true;
    }
    return false;
}

/* ---- which output is which motor ---- */

static bool is_direction(int value)
{
    return value == 1 || value == -1;
}

/* The output of each motor of the frame. */
static enum mavlink_no_bound wire(const struct mavlink_thrusters *t, const struct thrust_frame **frame,
                                  int output[THRUST_MOTORS])
{
    *frame = thrust_frame(t->param[FRAME]);
    for (int i = 0; i < NEEDED; i++)
        if (!t->known[FUNCTION + i] || !t->known[FRAME])
            return MAVLINK_NO_PARAMETERS;
    if (!*frame)
        return MAVLINK_NO_FRAME;
    for (int k = 0; k < (*frame)->n; k++)
        if (!t->known[DIRECTION + k])
            return MAVLINK_NO_PARAMETERS;
    for (int k = 0; k < THRUST_MOTORS; k++)
        output[k] = -1;
    for (int i = 0; i < MAVLINK_SERVOS; i++) {
        const int function = t->param[FUNCTION + i], motor = function - MOTOR_1;
        if (!t->known[FUNCTION + i])
            continue;
        if (function >= STICKS_1 && function <= STICKS_6)
            return MAVLINK_NO_STICKS;
        if (function >= MOTOR_9 && function <= MOTOR_12)
            return MAVLINK_NO_MOTORS;
        if (function < MOTOR_1 || function > MOTOR_8)
            continue;
        if (motor >= (*frame)->n || output[motor] >= 0)
            return MAVLINK_NO_MOTORS;
        output[motor] = i;
    }
    for (int k = 0; k < (*frame)->n; k++)
        if (output[k] < 0 || !is_direction(t->param[DIRECTION + k]))
            return MAVLINK_NO_MOTORS;
    return MAVLINK_BOUND;
}

/* What each motor pushes. */
static enum mavlink_no_bound pushes(const struct mavlink_thrusters *t, const struct mavlink_servo_output_raw *m,
                                    const struct thrust_frame **frame, struct thrust_range out[])
{
    int output[THRUST_MOTORS];
    const enum mavlink_no_bound why = wire(t, frame, output);
    for (int k = 0; why == MAVLINK_BOUND && k < (*frame)->n; k++) {
        int us = m->servo[output[k]];
        if (us == 0 && !t->armed) /* no pulses at all */
            us = THRUST_PULSE_MID;
        if (us < THRUST_PULSE_MIN || us > THRUST_PULSE_MAX)
            return MAVLINK_NO_PULSES;
        out[k] = thrust_range(&(*frame)->motor[k], us, t->param[DIRECTION + k], t->conf.volts);
    }
    return why;
}

/* ---- time ---- */

void mavlink_thrusters_attitude(struct mavlink_thrusters *t, const double q[4], uint64_t t_ns)
{
    t->attitude = (struct mavlink_thrusters_attitude){
        .t_ns = t_ns,
        .down = {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]),
                 1 - 2 * (q[1] * q[1] + q[2] * q[2])},
        .yaw_rad = atan2(2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))};
}

void mavlink_thrusters_climb(struct mavlink_thrusters *t, double mps, uint64_t now_ns)
{
    const double gap_s = t->climb_ns && now_ns > t->climb_ns ? (double)(now_ns - t->climb_ns) * 1e-9 : 0;
    if (mps == 0 || !(fabs(mps) < CLIMB_MOST))
        return;
    if (t->climb_ns == 0 || now_ns - t->climb_ns > CLIMB_OLD_NS) {
        t->climbs_ns = now_ns;
        t->climb_mps = mps;
    }
    t->climb_mps += (mps - t->climb_mps) * (1 - exp(-gap_s / CLIMB_S));
    t->climb_ns = now_ns;
}

bool mavlink_thrusters_climb_known(const struct mavlink_thrusters *t, uint64_t now_ns)
{
    return t->climb_ns && now_ns <= t->climb_ns + CLIMB_OLD_NS && now_ns >= t->climbs_ns + CLIMBS_NS;
}

static void add_up(struct mavlink_thrusters *t, const struct thrust_frame *frame, const struct thrust_range now[])
{
    for (int i = 0; i < 2; i++) {
        t->push_n[i] = 0;
        for (int k = 0; k < frame->n; k++)
            t->push_n[i] += frame->motor[k].axis[i] * (now[k].least_n + now[k].most_n) / 2;
    }
}

static void step(struct mavlink_thrusters *t, const struct thrust_frame *frame, const struct thrust_range now[],
                 uint64_t t_ns)
{
    struct speed_bound_push push = {.frame = frame};
    double was[2], is[2];
    const struct mavlink_thrusters_attitude *a = &t->attitude, *b = &t->before;
    push.tilt_known =
        a->t_ns && b->t_ns && a->t_ns + ATTITUDE_OLD_NS > t_ns && b->t_ns + ATTITUDE_OLD_NS > t->t_ns;
    push.turned_rad = remainder(a->yaw_rad - b->yaw_rad, 2 * 3.14159265358979323846);
    push.climb_known = mavlink_thrusters_climb_known(t, t->heard_ns);
    push.climb_mps = fabs(t->climb_mps) + CLIMB_OFF;
    memcpy(push.down[0], b->down, sizeof push.down[0]);
    memcpy(push.down[1], a->down, sizeof push.down[1]);
    for (int k = 0; k < frame->n; k++)
        push.thrust[k] = (struct thrust_range){fmin(t->thrust[k].least_n, now[k].least_n),
                                               fmax(t->thrust[k].most_n, now[k].most_n)};
    speed_bound_mps(&t->bound, was);
    speed_bound_step(&t->bound, &push, (double)(t_ns - t->t_ns) * 1e-9);
    speed_bound_mps(&t->bound, is);
    for (int i = 0; i < 2; i++) /* one that nobody took counts until now */
        t->mps[i] = fmax(t->fresh ? t->mps[i] : 0, fmax(was[i], is[i]));
    t->fresh = true;
    add_up(t, frame, now);
}

void mavlink_thrusters_servo(struct mavlink_thrusters *t, const struct mavlink_servo_output_raw *m, uint64_t t_ns,
                             uint64_t now_ns)
{
    const struct thrust_frame *frame;
    struct thrust_range now[THRUST_MOTORS] = {{0}};
    if (m->port != 0 || !t->submarine) /* another port: further outputs */
        return;
    t->heard_ns = now_ns;
    t->in_second++;
    if (t->t_ns && t_ns <= t->t_ns) {
        if (t->t_ns - t_ns > RESTARTED_NS)
            mavlink_thrusters_forget(t);
        else if (t->t_ns - t_ns > REORDERED_NS)
            mavlink_thrusters_lose(t, MAVLINK_NO_CLOCK);
        return;
    }
    const enum mavlink_no_bound why = pushes(t, m, &frame, now);
    if (why != MAVLINK_BOUND) {
        mavlink_thrusters_lose(t, why);
        return;
    }
    if (t->t_ns && t_ns - t->t_ns <= MAVLINK_THRUSTERS_GAP_NS) {
        step(t, frame, now, t_ns);
        t->why = MAVLINK_BOUND;
    } else {
        speed_bound_start(&t->bound, &t->conf.drag);
        mavlink_thrusters_lose(t, t->t_ns && t_ns - t->t_ns <= SELDOM_NS ? MAVLINK_NO_RATE : MAVLINK_NO_MESSAGES);
    }
    memcpy(t->thrust, now, sizeof now);
    t->before = t->attitude;
    t->t_ns = t_ns;
}

bool mavlink_thrusters_take(struct mavlink_thrusters *t, uint64_t *t_ns, double mps[2])
{
    if (!t->fresh)
        return false;
    *t_ns = t->t_ns;
    memcpy(mps, t->mps, sizeof t->mps);
    t->fresh = false;
    return true;
}

enum mavlink_no_bound mavlink_thrusters_why(const struct mavlink_thrusters *t, uint64_t now_ns)
{
    const struct thrust_frame *frame;
    int output[THRUST_MOTORS];
    if (!t->submarine)
        return MAVLINK_NO_VEHICLE;
    if ((t->why == MAVLINK_BOUND && now_ns > t->heard_ns + MAVLINK_THRUSTERS_GAP_NS) ||
        (t->why == MAVLINK_NO_RATE && now_ns > t->heard_ns + SELDOM_NS))
        return MAVLINK_NO_MESSAGES;
    /* that nothing comes says less than that what comes would be of no use */
    return t->why == MAVLINK_NO_MESSAGES && wire(t, &frame, output) != MAVLINK_BOUND ? wire(t, &frame, output)
                                                                                     : t->why;
}

bool mavlink_thrusters_slow(struct mavlink_thrusters *t)
{
    const bool slow = t->submarine && t->in_second < IN_SECOND;
    t->in_second = 0;
    return slow;
}
