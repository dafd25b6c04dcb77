/* SPDX-License-Identifier: MIT */
/* import - which kind of recording it is. */
#include "import.h"

#include <string.h>

enum import_kind import_kind(const uint8_t *data, size_t size)
{
    static const uint8_t viewer[] = {0, 0, 0, 52, 0, 'P', 0, 'i', 0, 'n', 0, 'g', 0, 'V'};
    static const char text[] = "ID: 2300";
    if (size >= sizeof viewer && memcmp(data, viewer, sizeof viewer) == 0)
        return IMPORT_PING_VIEWER;
    if (import_is_viewer2(data, size))
        return IMPORT_VIEWER2;
    if (size > 0 && memmem(data, size, text, sizeof text - 1))
        return IMPORT_TEXT;
    if (import_is_svlog(data, size))
        return IMPORT_SVLOG;
    if (import_is_seanet_relay(data, size))
        return IMPORT_SEANET_RELAY;
    if (import_is_seanet(data, size))
        return IMPORT_SEANET;
    if (import_is_imagenex(data, size))
        return IMPORT_IMAGENEX;
    return IMPORT_UNKNOWN;
}
