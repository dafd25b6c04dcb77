/* SPDX-License-Identifier: MIT */
/*
 * terminal - the terminal as a screen for a while: no echo, no line by line, another screen than the shell's, and all
 * of it given back whatever ends or stops the program. Knows nothing of what is shown.
 */
#ifndef SONARD_TERMINAL_H
#define SONARD_TERMINAL_H

#include <stdbool.h>
#include <termios.h>

struct terminal {
    int signals; /* a signalfd: to be polled; terminal_signal when it is ready */
    struct termios before;
};

enum terminal_event { TERMINAL_NOTHING, TERMINAL_CHANGED, TERMINAL_END };

/** terminal_size - that of standard output, else $COLUMNS and $LINES, else 80 by 24. */
void terminal_size(int *columns, int *rows);

/** terminal_enter - false with errno when standard input and output are no terminal. */
bool terminal_enter(struct terminal *terminal);

/**
 * terminal_signal - takes the signals that came: CHANGED when the screen must be drawn anew (another size, or the
 * program was stopped and goes on), END when it is to end.
 */
enum terminal_event terminal_signal(struct terminal *terminal);

/** terminal_leave - as it was before. */
void terminal_leave(struct terminal *terminal);

#endif
