/* SPDX-License-Identifier: MIT */
/*
 * device_table - the devices there are. A new one is a new .c and a line here.
 */
#include "device.h"

#include <string.h>

const struct device_ops *const device_table[] = {
    &device_micron,
    &device_echolist,
    &device_imagenex852,
    &device_imagenex881a,
    &device_ping360,
    &device_dronecan,
    &device_nmea2000,
    &device_ping1d,
    &device_surveyor,
    NULL,
};

const struct device_ops *device_find(const char *name)
{
    for (const struct device_ops *const *d = device_table; *d; d++)
        if (strcmp((*d)->name, name) == 0)
            return *d;
    return NULL;
}
