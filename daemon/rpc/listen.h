/* SPDX-License-Identifier: MIT */
/*
 * listen - a listening UNIX stream socket at a path, without ever taking away what is not a dead daemon's: a stale
 * socket file is replaced, a living one and any other file are left alone. Knows nothing of clients.
 */
#ifndef SONARD_LISTEN_H
#define SONARD_LISTEN_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"

/**
 * listen_unix - a non-blocking, close-on-exec listening descriptor at `path` (at most 107 bytes) with the permission
 * bits `mode` (0..0777), in place before anybody can connect. -1 with a sentence in fault. Two daemons that start at
 * the same time are kept apart by a lock on the directory; one that others hold for a second is an error.
 */
int listen_unix(const char *path, unsigned mode, struct fault *fault);

/**
 * listen_inherited - the listening UNIX stream socket that the service manager opened for this process
 * (sd_listen_fds(3): $LISTEN_PID, $LISTEN_FDS), made non-blocking and close-on-exec; *fd is 0 when there is none. Ask
 * once. False with a sentence in fault when what was handed over is something else, or more than one.
 */
bool listen_inherited(int *fd, struct fault *fault);

#endif
