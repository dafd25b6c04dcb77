/* SPDX-License-Identifier: MIT */
#include "device.h"

#include <string.h>

#define DEVICE_ENTRY(device) &device_##device,

const struct device_ops *const device_table[] = {DEVICES(DEVICE_ENTRY) NULL};

const struct device_ops *device_find(const char *name)
{
    for (const struct device_ops *const *d = device_table; *d; d++)
        if (strcmp((*d)->name, name) == 0)
            return *d;
    return NULL;
}
