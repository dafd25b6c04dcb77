/* SPDX-License-Identifier: MIT */
/* journal - see journal.h. */
#include "journal.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "datagram.h"

#define ENTRY_MAX 2048 /* a message of LOG_TEXT_MAX and the other fields */

static int journal = -1; /* connected; below 0: none */

/* The variable is inherited by those whose standard error goes elsewhere. */
bool journal_is_stderr(void)
{
    const char *stream = getenv("JOURNAL_STREAM");
    unsigned long long device, inode;
    struct stat st;
    return stream && sscanf(stream, "%llu:%llu", &device, &inode) == 2 && fstat(STDERR_FILENO, &st) == 0 &&
           st.st_dev == device && st.st_ino == inode;
}

void journal_open(void)
{
    const char *other = getenv("SONARD_JOURNAL");
    if (journal >= 0)
        close(journal);
    journal = journal_is_stderr() ? datagram_to(other ? other : "/run/systemd/journal/socket") : -1;
}

struct entry {
    size_t used;
    char bytes[ENTRY_MAX];
};

/* No value has a line feed (readable.h). No room: left out. */
static void add(struct entry *e, const char *field, const char *value)
{
    const size_t name = strlen(field), n = strlen(value);
    if (name + n + 2 > sizeof e->bytes - e->used)
        return;
    char *to = e->bytes + e->used;
    memcpy(to, field, name);
    to += name;
    *to++ = '=';
    memcpy(to, value, n);
    to[n] = '\n';
    e->used = (size_t)(to - e->bytes) + n + 1;
}

static void add_number(struct entry *e, const char *field, uint64_t value)
{
    char digits[24];
    snprintf(digits, sizeof digits, "%llu", (unsigned long long)value);
    add(e, field, digits);
}

bool journal_send(int syslog_priority, const struct log_about *about, const char *message)
{
    struct entry e = {0};
    if (journal < 0)
        return false;
    add(&e, "MESSAGE", message);
    add_number(&e, "PRIORITY", (uint64_t)syslog_priority);
    add(&e, "SYSLOG_IDENTIFIER", "sonard");
    add(&e, "SONARD_EVENT", about->event);
    if (about->sonar)
        add(&e, "SONARD_SONAR", about->sonar);
    if (about->count)
        add_number(&e, "SONARD_COUNT", about->count);
    add(&e, "CODE_FILE", about->file);
    add_number(&e, "CODE_LINE", (uint64_t)about->line);
    add(&e, "CODE_FUNC", about->function);
    return send(journal, e.bytes, e.used, MSG_NOSIGNAL | MSG_DONTWAIT) == (ssize_t)e.used;
}
