/* SPDX-License-Identifier: MIT */
/*
 * errand - methods whose answer is with the owner of the grids and the map: what they send there, and how the clients
 * that wait go on when it is done.
 */
#ifndef SONARD_ERRAND_H
#define SONARD_ERRAND_H

#include "daemon.h"

/**
 * errand_start - from now on clients go on whose errands are done; false with a sentence in err. errand_end - no longer: all
 * are dropped, and none is being done when it returns. Before what errands work on ends.
 */
bool errand_start(struct daemon *d, char *err, size_t err_size);
void errand_end(struct daemon *d);

/**
 * errand_done - have the owner call fn with the request's work, which begins with a struct errand. False with *error set
 * to RPC_UNFINISHED while it is not done: then the method is called again, and asks again.
 */
bool errand_done(const struct rpc_call *call, pipeline_owner_fn *fn, struct rpc_error *error);

#define ERRANDS_LEFT_MAX 100

/**
 * errand_room - may a request send one that changes something? False with a refusal in *error, before anything is changed:
 * ERRANDS_LEFT_MAX wait for which nobody waits, be it that their client has gone or was answered before. Who waits has one.
 */
bool errand_room(const struct rpc_call *call, struct rpc_error *error);

/**
 * errand_free - for struct rpc_work: frees a malloced state that begins with a struct errand, as soon as nobody uses it.
 * errand_leave - the same of what changes something: when it was sent it is done, and its client may have gone.
 */
void errand_free(void *state);
void errand_leave(void *state);

#endif
