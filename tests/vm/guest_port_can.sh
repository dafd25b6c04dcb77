#!/bin/sh
# SPDX-License-Identifier: MIT
# guest_port_can.sh - the unit test of the CAN ports where the kernel has CAN: what it skips elsewhere.
exec "$BUILD/tests/test_port_can"
