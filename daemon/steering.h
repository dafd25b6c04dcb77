/* SPDX-License-Identifier: MIT */
/*
 * steering - twice a second tells the heads that are steered (plan.h) where to look, by what is known of the vehicle's
 * way. The rule is active_sensing's.
 */
#ifndef SONARD_STEERING_H
#define SONARD_STEERING_H

#include "daemon/input/pose_log.h"
#include "daemon/input/push.h"
#include "daemon/input/source.h"
#include "daemon/pipeline/active_sensing.h"
#include "plan.h"

/* All of it outlives the steering, and belongs to the loop's thread. */
struct steering_env {
    struct loop *loop;
    struct pipeline *pipeline;
    const struct plan *plan;
    const struct pose_log *poses;
    const struct push *push;
    const struct mount *mount; /* [CONF_MAX_SONARS] */
    struct source *const *source;
};

struct steering {
    struct loop_timer timer;
    struct steering_env env;
    struct next_look_features features[CONF_MAX_SONARS];
};

/** steering_start - until steering_stop, if any head is steered. *s stays where it is meanwhile. */
void steering_start(struct steering *s, const struct steering_env *env);
void steering_stop(struct steering *s);

#endif
