/* SPDX-License-Identifier: MIT */
/*
 * fuzz_surveyor - the multibeam under any bytes; see drive.h. Four bytes of the input choose the configuration and the
 * cuts, the rest is the line.
 */
#include "drive.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 4)
        return 0;
    const struct device_conf conf = {
        .range_m = 1.0 + data[0] % 199,
        .sound_speed_mps = 1350.0 + data[1],
        .gain = data[2] % 12 - 1,
        .listen_only = (data[3] & 0x30) == 0x30,
    };
    drive(&device_surveyor, &conf, data[3] * 2654435761u + data[1], data + 4, size - 4);
    return 0;
}
