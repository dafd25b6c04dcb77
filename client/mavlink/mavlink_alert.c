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
    va_start(arguments, format);
    vsnprintf(alert->text, sizeof alert->text, format, arguments);
    va_end(arguments);
}

bool mavlink_alert_due(struct mavlink_alert *alert, uint64_t now_ns, struct mavlink_statustext *out)
{
    if (alert->failed == alert->told_failed ||
        now_ns < alert->since_ns + (alert->grave && alert->failed ? 0 : LASTING_NS) ||
        (alert->told_ns && now_ns < alert->told_ns + APART_NS))
        return false;
    alert->told_failed = alert->failed;
    alert->told_ns = now_ns;
    *out = (struct mavlink_statustext){.severity = !alert->failed ? MAVLINK_SEVERITY_NOTICE
                                                   : alert->grave ? MAVLINK_SEVERITY_CRITICAL
                                                                  : MAVLINK_SEVERITY_WARNING};
    for (size_t i = 0; alert->text[i]; i++)
        out->text[i] = alert->text[i] >= ' ' && alert->text[i] <= '~' ? alert->text[i] : '?';
    return true;
}
