/* SPDX-License-Identifier: MIT */
/*
 * leftover - what a program that a signal ends (interrupt, hang-up, termination) must not leave behind: its unfinished
 * files, a temporary folder, a process of its own. The process has one list of them.
 */
#ifndef SONARD_LEFTOVER_H
#define SONARD_LEFTOVER_H

#include <signal.h>
#include <stdbool.h>
#include <sys/types.h>

/** leftover_hold - signals wait until leftover_release, so that what is made in between comes on the list, too. */
void leftover_hold(sigset_t *before);
void leftover_release(const sigset_t *before);

/** leftover_name - a file or an empty folder, to be removed until leftover_forget; it need not be there, and what is in
 * a folder comes after it. False with errno: there are too many, or its name is too long. */
bool leftover_name(const char *path);

/** leftover_forget - it is finished, or has been removed. */
void leftover_forget(const char *path);

/** leftover_process - a child: terminated and waited for before all else is removed; 0: it has been waited for. */
void leftover_process(pid_t process);

#endif
