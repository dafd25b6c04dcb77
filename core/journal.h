/* SPDX-License-Identifier: MIT */
/*
 * journal - lines of the log as entries of systemd's journal, with fields, by its native protocol: one datagram of
 * FIELD=value lines (systemd.io/JOURNAL_NATIVE_PROTOCOL).
 */
#ifndef SONARD_JOURNAL_H
#define SONARD_JOURNAL_H

#include <stdbool.h>

#include "log.h"

/** journal_is_stderr - does standard error go to the journal? systemd says so in JOURNAL_STREAM. */
bool journal_is_stderr(void);

/** journal_open - finds the journal's socket, the one named by SONARD_JOURNAL if that is set.
 * Before there are threads. */
void journal_open(void);

/** journal_send - one entry; false when the journal is not there or does not take it now. Never waits. */
bool journal_send(int syslog_priority, const struct log_about *about, const char *message);

#endif
