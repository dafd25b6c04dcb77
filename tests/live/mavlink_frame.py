# SPDX-License-Identifier: MIT
"""MAVLink 2 frames as an autopilot sends them, written out by hand: nothing here is shared with the bridge."""
import hashlib
import struct
import time

HEARTBEAT, ATTITUDE, COMMAND_LONG, TIMESYNC = 0, 30, 76, 111
DISTANCE_SENSOR, STATUSTEXT, OBSTACLE_DISTANCE, OBSTACLE_DISTANCE_3D = 132, 253, 330, 11037
SCALED_PRESSURE, SCALED_PRESSURE2, SCALED_PRESSURE3 = 29, 137, 143
LOCAL_POSITION_NED, EKF_STATUS_REPORT = 32, 193
PARAM_REQUEST_READ, PARAM_VALUE, SERVO_OUTPUT_RAW = 20, 22, 36
VFR_HUD = 74
CRC_EXTRA = {VFR_HUD: 20, PARAM_REQUEST_READ: 214, PARAM_VALUE: 220, SERVO_OUTPUT_RAW: 222,
             LOCAL_POSITION_NED: 185, EKF_STATUS_REPORT: 71,
             SCALED_PRESSURE: 115, SCALED_PRESSURE2: 195, SCALED_PRESSURE3: 131,
             HEARTBEAT: 50, ATTITUDE: 39, COMMAND_LONG: 152, TIMESYNC: 34, DISTANCE_SENSOR: 85, STATUSTEXT: 83,
             OBSTACLE_DISTANCE: 23, OBSTACLE_DISTANCE_3D: 130}


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        byte ^= crc & 0xFF
        byte ^= (byte << 4) & 0xFF
        crc = (crc >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
    return crc


def signature(key, data):
    return hashlib.sha256(key + data).digest()[:6]


def frame(message_id, payload, sequence, key=None, system=1):
    payload = payload.rstrip(b"\0") or b"\0"
    head = struct.pack("<BBBBBB", len(payload), 1 if key else 0, 0, sequence & 255, system, 1)
    head += message_id.to_bytes(3, "little")
    crc = crc16(head + payload + bytes([CRC_EXTRA[message_id]]))
    whole = b"\xfd" + head + payload + struct.pack("<H", crc)
    if key:
        stamp = int((time.time() - 1420070400) * 1e5) + sequence  # rising even within 10 us
        whole += b"\x01" + stamp.to_bytes(6, "little")
        whole += signature(key, whole)
    return whole
