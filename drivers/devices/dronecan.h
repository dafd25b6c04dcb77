/* SPDX-License-Identifier: MIT */
/*
 * dronecan - the part of DroneCAN (UAVCAN v0) that a receiver to range sensors needs: transfers put together from
 * frames, and the message uavcan.equipment.range_sensor.Measurement. Pure. The device itself is device_dronecan of
 * device.h (dronecan_device.c); of the configuration it takes:
 *
 *   node        node id of the sensor, 1 .. 127; -1: any
 *   sensor_id   0 .. 255, of the message; -1: any
 *   range       how far the sensor hears where it says "too far"
 */
#ifndef SONARD_DRONECAN_H
#define SONARD_DRONECAN_H

#include "drivers/ports/can_frame.h"

#define DRONECAN_MEASUREMENT_TYPE      1050u
#define DRONECAN_MEASUREMENT_SIGNATURE 0x68FFFE70FC771952u
#define DRONECAN_MEASUREMENT_BYTES     15u

#define DRONECAN_NODES       128
#define DRONECAN_PAYLOAD_MAX 64            /* longer transfers of this type are none */
#define DRONECAN_TIMEOUT_NS  2000000000ull /* from the first frame of a transfer */

enum dronecan_result {
    DRONECAN_MORE,      /* taken, the transfer goes on */
    DRONECAN_WHOLE,     /* the transfer is complete: node, payload and n of it are set */
    DRONECAN_DUPLICATE, /* of the transfer before */
    DRONECAN_STRAY,     /* belongs to no transfer: its beginning, or a frame between, was lost */
    DRONECAN_BAD_CRC,
    DRONECAN_BAD, /* no tail byte, or too long */
};

/* What is being put together from one node. */
struct dronecan_partial {
    bool active, known; /* a transfer is open; one was completed before */
    uint8_t transfer, last_transfer;
    bool toggle; /* of the next frame */
    uint16_t crc;
    uint64_t first_ns, last_ns; /* of this transfer; of the completed one */
    size_t n;
    uint8_t payload[DRONECAN_PAYLOAD_MAX];
};

struct dronecan_receiver {
    uint64_t signature; /* of the data type */
    struct dronecan_partial node[DRONECAN_NODES];
};

struct dronecan_transfer {
    uint8_t node;
    uint8_t missed;         /* transfers from this node between the one before and this, as far as can be told */
    uint64_t first_ns;      /* arrival of its first frame */
    const uint8_t *payload; /* lives until the next frame */
    size_t n;
};

/** dronecan_receiver_init - for one data type, of which all frames must be. */
void dronecan_receiver_init(struct dronecan_receiver *r, uint64_t signature);

/** dronecan_receiver_reset - forgets what is unfinished, and what was received before. */
void dronecan_receiver_reset(struct dronecan_receiver *r);

/** dronecan_receive - a data frame with an extended identifier that came in at now_ns. */
enum dronecan_result dronecan_receive(struct dronecan_receiver *r, const struct canfd_frame *frame,
                                      uint64_t now_ns, struct dronecan_transfer *out);

/** dronecan_crc - CRC-16-CCITT-FALSE, continued from crc (0xFFFF at first). */
uint16_t dronecan_crc(uint16_t crc, const uint8_t *bytes, size_t n);

enum { DRONECAN_SENSOR_UNDEFINED, DRONECAN_SENSOR_SONAR, DRONECAN_SENSOR_LIDAR, DRONECAN_SENSOR_RADAR };
enum { DRONECAN_READING_UNDEFINED, DRONECAN_READING_VALID, DRONECAN_READING_TOO_CLOSE, DRONECAN_READING_TOO_FAR };

struct dronecan_measurement {
    uint64_t timestamp_us; /* of the bus; 0: unknown */
    uint8_t sensor_id;
    double field_of_view_rad; /* as sent: may be 0 or NaN */
    unsigned sensor_type, reading_type;
    double range_m;      /* as sent: may be infinite or NaN */
    double resolution_m; /* step of range_m there */
};

/**
 * dronecan_decode_measurement - from a payload of at least DRONECAN_MEASUREMENT_BYTES (transfers over CAN FD are
 * padded); false when it is shorter. The orientation in the message is left out: where a beam points is configured.
 */
bool dronecan_decode_measurement(const uint8_t *payload, size_t n, struct dronecan_measurement *out);

#endif
