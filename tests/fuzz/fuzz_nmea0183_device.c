/* SPDX-License-Identifier: MIT */
/*
 * fuzz_nmea0183_device - any bytes for the NMEA 0183 echosounder: see drive_can.h, whose records are pieces of the line
 * here. The first byte chooses the configuration.
 */
#include "drive_can.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1)
        return 0;
    const struct device_conf conf = {.range_m = 50,
                                     .sound_speed_mps = 1500,
                                     .gain = -1,
                                     .node = -1,
                                     .sensor_id = -1,
                                     .listen_only = data[0] & 1};
    drive_can(&device_nmea0183, &conf, data + 1, size - 1);
    return 0;
}
