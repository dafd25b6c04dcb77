/* SPDX-License-Identifier: MIT */
/*
 * replay - feeds a capture to the sources as if their ports read it now: same code from the port on, on the capture's
 * clock. As fast as it goes, or paced. A log of candump -L is a capture too, of every sonar whose port is an interface in
 * it; it brings no configuration.
 */
#ifndef SONARD_REPLAY_H
#define SONARD_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon.h"

struct replay;

/** replay_open - NULL with a sentence in err. Damage in the file is logged as it is met. */
struct replay *replay_open(const char *path, char *err, size_t err_size);

/** replay_conf - the configuration attached to the capture, or NULL with a sentence in err. Lives as the replay. */
const char *replay_conf(struct replay *r, size_t *size, char *err, size_t err_size);

/** replay_start - time of the first message: where the virtual clock is to be set; 0 when there are none. */
uint64_t replay_start(struct replay *r);

/**
 * replay_run - play all of it on d->loop (virtual clock), speed (0.001 to 1e6) times as fast as it was recorded;
 * speed 0: as fast as it goes. After more than a minute without a message the clock jumps to the next one. False
 * when the loop was asked to quit before the end.
 */
bool replay_run(struct replay *r, struct daemon *d, double speed);

void replay_close(struct replay *r);

#endif
