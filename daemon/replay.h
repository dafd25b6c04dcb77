/* SPDX-License-Identifier: MIT */
/*
 * replay - feeds a capture to the sources as if their ports read it now: same code from the port on, on the capture's
 * clock. As fast as it goes, or paced; clients may pause it and jump in it. A log of candump -L is a capture too, of
 * every sonar whose port is an interface in it; it brings no configuration.
 */
#ifndef SONARD_REPLAY_H
#define SONARD_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/loop.h"
#include "daemon/input/aux_sensors.h"
#include "daemon/input/source.h"
#include "daemon/pipeline/pipeline.h"

struct replay;

/* Where it is played to. */
struct replay_env {
    struct loop *loop; /* of a virtual clock */
    struct pipeline *pipeline;
    const struct conf *conf;
    struct source *const *source; /* [conf->n_sonars] */
    struct aux_sensors *aux;
    /* A message of /pose, n bytes of JSON. False with what is wrong in fault. */
    bool (*pose)(void *ctx, const void *text, size_t n, struct fault *fault);
    /* Likewise the configuration that a reload put in force. */
    bool (*reload)(void *ctx, const void *text, size_t n, struct fault *fault);
    void *ctx;
};

/* How it is played. */
struct replay_state {
    double length_s; /* of the capture, from its first message to its last; below 0: it was not looked for */
    double position_s, speed;
    bool paused, jumping;
};

/**
 * replay_open - NULL with a sentence in fault. path outlives it. Damage in the file is logged as it is met. speed: so
 * many times as fast as it was recorded (0.001 to 1e6); 0: as fast as it goes.
 */
struct replay *replay_open(const char *path, double speed, struct fault *fault);

/** replay_measure - find out its length: by the summary of a capture that was closed, else by reading all of it. */
void replay_measure(struct replay *r);

void replay_state(const struct replay *r, const struct loop *loop, struct replay_state *out);

/** replay_pace - speed as replay_open has it. While it is paused, the clock stands. */
void replay_pace(struct replay *r, const struct loop *loop, double speed, bool paused);

/**
 * replay_jump - play on, as fast as it goes, to so many seconds after the start, and there as it was played before.
 * What lies in the past needs a new start: then the loop is asked to quit, and replay_again has to be called.
 */
void replay_jump(struct replay *r, struct loop *loop, double to_s);

/** replay_leads_back - has a jump asked the loop to quit, so that replay_again is to come? */
bool replay_leads_back(const struct replay *r);

/**
 * replay_again - after replay_run: does it have to be played anew, with everything that it is played to made anew? Then
 * it stands at its start, and fault is empty; false with a sentence in fault: it has to, but cannot be read any more.
 */
bool replay_again(struct replay *r, struct fault *fault);

/** replay_conf - the configuration attached to the capture, or NULL with a sentence in fault. Lives as the replay. */
const char *replay_conf(struct replay *r, size_t *size, struct fault *fault);

/** replay_has_line - did the bytes of that sonar come over its port? Not where an import made their times. */
bool replay_has_line(const struct replay *r, const char *sonar);

/** replay_told - the sonars of conf whose events (source_event.h) the capture keeps, as a set. */
uint64_t replay_told(const struct replay *r, const struct conf *conf);

/** replay_start - time of the first message: where the virtual clock is to be set; 0 when there are none. */
uint64_t replay_start(struct replay *r);

/**
 * replay_run - play all of it. After more than a minute without a message the clock jumps to the next one. False when
 * the loop was asked to quit before the end.
 */
bool replay_run(struct replay *r, const struct replay_env *env);

/**
 * replay_judge - after its end: false, with what is wrong in the log, when nothing was played, most of the file
 * could not be read, or the sonars of the configuration made no ping of what the capture has.
 */
bool replay_judge(const struct replay *r, const struct replay_env *env);

void replay_close(struct replay *r);

#endif
