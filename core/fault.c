/* SPDX-License-Identifier: MIT */
#include "fault.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "readable.h"

bool fault_set(struct fault *fault, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    vsnprintf(fault->text, sizeof fault->text, fmt, args);
    va_end(args);
    readable(fault->text);
    return false;
}

bool fault_add(struct fault *fault, const char *fmt, ...)
{
    const size_t used = strlen(fault->text);
    va_list args;
    va_start(args, fmt);
    vsnprintf(fault->text + used, sizeof fault->text - used, fmt, args);
    va_end(args);
    readable(fault->text);
    return false;
}
