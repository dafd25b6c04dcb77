#!/bin/bash
# SPDX-License-Identifier: MIT
# guest_kernel.sh - the buses themselves, without sonard: when these fail, look at the virtual machine first.
. tests/vm/guest.sh

ip link add vcan0 type vcan && ip link set vcan0 mtu 72 && ip link set vcan0 up
judge "a virtual CAN interface with room for FD frames"
candump -L vcan0,0:0,#FFFFFFFF > "$work/dump" &
dump=$!
sleep 0.5
cansend vcan0 123#DEADBEEF
cansend vcan0 20000040#0000000000000000
sleep 0.3
kill $dump
grep -q '123#DEADBEEF' "$work/dump"
judge "a frame is received"
grep -q '20000040#' "$work/dump"
judge "an injected error frame reaches a reader who asked for errors"

mkdir -p /sys/kernel/config/gpio-sim/kernel/bank0
echo 2 > /sys/kernel/config/gpio-sim/kernel/bank0/num_lines
echo 1 > /sys/kernel/config/gpio-sim/kernel/live
judge "a simulated GPIO chip"
gpiodetect | grep -q gpio-sim
judge "gpiodetect finds it"
echo 0 > /sys/kernel/config/gpio-sim/kernel/live
ip link del vcan0
