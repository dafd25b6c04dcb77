/* SPDX-License-Identifier: MIT */
/*
 * fuzz_ping1d - the echosounder under any bytes; see drive.h. Four bytes of the input choose the configuration and the
 * cuts, the rest is the line.
 */
#include "drive.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const unsigned bauds[] = {0, 9600, 115200, 4000000};
    if (size < 4)
        return 0;
    const struct device_conf conf = {
        .range_m = 1.5 + data[0] % 198,
        .sound_speed_mps = 1350.0 + data[1],
        .gain = data[2] % 8 - 1,
        .min_confidence = (1 + (data[2] >> 4)) / 16.0,
        .request_response = data[3] & 8,
        .listen_only = (data[3] & 0x30) == 0x30,
        .baud = bauds[data[3] & 3],
    };
    drive(&device_ping1d, &conf, data[3] * 2654435761u + data[1], data + 4, size - 4);
    return 0;
}
