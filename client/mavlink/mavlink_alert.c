/* SPDX-License-Identifier: MIT */
#include "mavlink_alert.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define LASTING_NS 1000000000u
#define APART_NS   5000000000u

void mavlink_alert_set(struct mavlink_alert *alert, bool failed, uint64_t now_ns, const char *format, ...)
{
    va_list arguments;
    if (failed != alert->failed)
        alert->since_ns = now_ns;
    else if (alert->text[0])
        return;
    alert->failed = failed;
    alert->goes_on = false;
    alert->told = 0;
    va_start(arguments, format);
    vsnprintf(alert->text, sizeof alert->text, format, arguments);
    va_end(arguments);
}

/* The next part of the text; the last has room left, which ends it. A short text is a part by itself. */
static void next_part(struct mavlink_alert *alert, struct mavlink_statustext *out)
{
    const size_t left = strlen(alert->text) - alert->told, part = sizeof out->text;
    const bool is_long = alert->told || left >= part;
    *out = (struct mavlink_statustext){.severity = !alert->failed ? MAVLINK_SEVERITY_NOTICE
                                                   : alert->grave ? MAVLINK_SEVERITY_CRITICAL
                                                                  : MAVLINK_SEVERITY_WARNING,
                                       .id = is_long ? alert->id : 0,
                                       .chunk_seq = (uint8_t)(alert->told / part)};
    for (size_t i = 0; i < part && i < left; i++) {
        const char c = alert->text[alert->told + i];
        out->text[i] = c >= ' ' && c <= '~' ? c : '?';
    }
    alert->goes_on = left >= part;
    alert->told = alert->goes_on ? alert->told + part : 0;
}

bool mavlink_alert_due(struct mavlink_alert *alert, uint64_t now_ns, struct mavlink_statustext *out)
{
    if (!alert->goes_on) {
        if (alert->failed == alert->told_failed ||
            now_ns < alert->since_ns + (alert->grave && alert->failed ? 0 : LASTING_NS) ||
            (alert->told_ns && now_ns < alert->told_ns + APART_NS))
            return false;
        alert->told_failed = alert->failed;
        alert->told_ns = now_ns;
        alert->id = (uint16_t)(alert->id == UINT16_MAX ? 1 : alert->id + 1);
    }
    next_part(alert, out);
    return true;
}
