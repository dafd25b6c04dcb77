/* SPDX-License-Identifier: MIT */
/*
 * dead_line - judges by the silence of a line whether its port is dead: open, without an error, and deaf until it is
 * closed and opened again, as a USB adapter is whose transfers have stopped. Knows no port, no loop and no clock.
 *
 * A line that is asked should answer: it is due after 10 s, or three of its usual intervals where these are longer. A
 * line that is only listened to is judged once its usual interval is known. A line that stays silent is due again after
 * twice as long each time, up to 5 min.
 */
#ifndef SONARD_DEAD_LINE_H
#define SONARD_DEAD_LINE_H

#include <stdbool.h>
#include <stdint.h>

#define DEAD_LINE_LEAST_NS 10000000000u
#define DEAD_LINE_MOST_NS  300000000000u
#define DEAD_LINE_LOOK_NS  1000000000u /* between two looks */
#define DEAD_LINE_HELD_NS  5000000000u /* a longer time between two looks is no silence: the process was held up */

/* Zeroed but for what the owner gives. */
struct dead_line {
    bool asked;        /* the owner's: it should answer */
    uint64_t first_ns; /* the owner's, if not 0: due no later than this, or three usual intervals */
    uint64_t looked_ns;
    uint64_t silent_ns;    /* since the last message, or since it was opened */
    uint64_t since_ns;     /* the same since it was last due */
    uint64_t usual_ns;     /* the longest silence that has ended by itself lately: the greater of ... */
    uint64_t longest_ns;   /* ... this, since it was noted last, ... */
    uint64_t before_ns;    /* ... and this, before */
    unsigned times_heard;  /* since then */
    uint64_t heard_for_ns; /* time over which that was found out */
    bool heard;            /* at least once */
    unsigned due;          /* times in this silence */
};

/** dead_line_opened - the port was opened at now_ns, not because it was due: the silence starts anew. */
void dead_line_opened(struct dead_line *d, uint64_t now_ns);

/** dead_line_look - has a message come since the last look? True: close the port now, and open it again. */
bool dead_line_look(struct dead_line *d, uint64_t now_ns, bool heard);

#endif
