#!/bin/bash
# SPDX-License-Identifier: MIT
# udev.sh RULES VENDOR:MODEL - prints what udev knows of a USB-serial adapter, then of its port, under these rules and one of
# brltty's for that adapter. In a mount namespace (`unshare -m`), with /sys and the folder of rules of its own.
set -eu
rules=$1 vendor=${2%:*} model=${2#*:}
mkdir -p /etc/udev/rules.d
mount -t tmpfs none /sys
mount -t tmpfs none /etc/udev/rules.d
cp "$rules" /etc/udev/rules.d/
# As on Ubuntu; the later one of the two names that the file has there.
cat > /etc/udev/rules.d/90-brltty-device.rules <<RULE
SUBSYSTEM=="usb", KERNEL!="*:*", ENV{PRODUCT}=="$vendor/$model/*", ENV{BRLTTY_BRAILLE_DRIVER}="bm", TAG+="systemd", ENV{SYSTEMD_WANTS}+="brltty-device@.service"
RULE
device=/sys/devices/usb1/1-1
interface=$device/1-1:1.0
port=$interface/ttyUSB0/tty/ttyUSB0
mkdir -p /sys/bus/usb /sys/class/tty $port
printf 'DEVTYPE=usb_device\nPRODUCT=%s/%s/264\n' "$vendor" "$model" > $device/uevent
echo "$vendor" > $device/idVendor
echo "$model" > $device/idProduct
echo 0264 > $device/bcdDevice
printf 'DEVTYPE=usb_interface\n' > $interface/uevent
echo ff > $interface/bInterfaceClass
printf 'MAJOR=188\nMINOR=0\nDEVNAME=ttyUSB0\n' > $port/uevent
ln -s /sys/bus/usb $device/subsystem
ln -s /sys/bus/usb $interface/subsystem
ln -s /sys/class/tty $port/subsystem
export SYSTEMD_DEVICE_VERIFY_SYSFS=0 # this /sys is none
for node in $device $port; do
    udevadm test --action=add $node 2> /dev/null
done
