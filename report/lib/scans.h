/* SPDX-License-Identifier: MIT */
/*
 * scans - scans of a Ping360 in the made-up sea through the daemon's own pipeline, wired as the daemon wires it from a
 * configuration. The vehicle stands still at the origin and knows its pose. Ends the program with a sentence where
 * something cannot be. Knows no truth and no errors.
 */
#ifndef SONARD_REPORT_SCANS_H
#define SONARD_REPORT_SCANS_H

#include "config/conf.h"
#include "daemon/pipeline/pipeline.h"
#include "grid/answer/answer.h"
#include "tests/sound/sea.h"

/** scans_start - the pipeline of a configuration, for pings of so many beams; pipeline_free ends it. */
struct pipeline *scans_start(const struct conf *conf, uint32_t beams);

/** scans_submit - one ping of the sea goes in. */
void scans_submit(struct pipeline *pipeline, const struct sea_ping *sea);

/** scans_now, scans_limits - what a question needs besides the picture. */
struct answer_now scans_now(uint64_t t_ns);
struct answer_conf scans_limits(const struct conf *conf);

#endif
