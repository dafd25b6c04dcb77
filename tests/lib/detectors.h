/* SPDX-License-Identifier: MIT */
/* detectors.h - what the tables of detectors have beside numbers. */
#ifndef SONARD_TEST_DETECTORS_H
#define SONARD_TEST_DETECTORS_H

#include "grid/range/cfar.h"
#include "table.h"

static inline enum cfar_detector table_detector(const struct table *t, int column)
{
    const char *name = t->field[column];
    return !strcmp(name, "CA")     ? CFAR_CA
           : !strcmp(name, "GOCA") ? CFAR_GOCA
           : !strcmp(name, "SOCA") ? CFAR_SOCA
                                   : CFAR_OS;
}

static inline uint32_t table_count(const struct table *t, int column)
{
    return (uint32_t)table_int(t, column);
}

#endif
