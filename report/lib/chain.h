/* SPDX-License-Identifier: MIT */
/*
 * chain - the stages from a ping to its echoes, put together as the daemon's pipeline does, each only if it is asked
 * for; and the naive method to compare with. Makes its own templates of the made-up vehicles. Knows no errors.
 */
#ifndef SONARD_REPORT_CHAIN_H
#define SONARD_REPORT_CHAIN_H

#include "config/conf.h"
#include "grid/range/cleanup.h"
#include "grid/range/extract.h"
#include "tests/sound/sea.h"

enum chain_background {
    CHAIN_NO_TEMPLATE,
    CHAIN_TEMPLATE,       /* learnt in open water; masks what is louder than CHAIN_MASK */
    CHAIN_EMPTY_TEMPLATE, /* masks nothing, and is taken along all the same */
};

#define CHAIN_MASK 64 /* counts, as [background] mask */

struct chain_conf {
    struct extract_conf extract;
    enum chain_background background;
    struct cleanup_conf cleanup;
    int threshold; /* > 0: the naive method instead: the first sample of so many counts behind half a metre */
};

struct chain;

/** chain_configure - as a configuration has its first sonar; without a template. */
void chain_configure(const struct conf *conf, struct chain_conf *out);

/** chain_make - of the heap; ends the program with a sentence when the configuration is out of range. */
struct chain *chain_make(const struct chain_conf *conf);
void chain_free(struct chain *chain);

/** chain_bytes - memory that its stages hold. */
size_t chain_bytes(const struct chain *chain);

/** chain_begin - another vehicle: forgets earlier pings, takes its template, has seen one turn of the scene. */
void chain_begin(struct chain *chain, const struct sea_scene *scene, enum sound_head head);

/** chain_run - one ping; what comes out, of this beam or of one before it, goes to its place in found[SEA_BEAMS]. This
 * is what callgrind counts. */
void chain_run(struct chain *chain, const struct ping *ping, struct beam_echoes *found);

/** chain_end - the last beams of the scan, which were held back. */
void chain_end(struct chain *chain, struct beam_echoes *found);

#endif
