#!/bin/bash
# SPDX-License-Identifier: MIT
# setup.sh CACHE - makes CACHE/<kernel>-<this script>/ with vmlinuz and modules/ for run.sh and prints that folder. Debian's
# own kernel is downloaded and unpacked, never installed. Done once, about a minute; afterwards it only prints.
#
# No Debian kernel has gpio-sim, so it is built here, together with irq_sim which it needs, from Debian's kernel source
# against Debian's headers. irq_to_desc() is not exported to modules; generic_handle_irq() does the same.
set -euo pipefail
mkdir -p "$1"
cache=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
modules="virtio_pci 9pnet_virtio 9p overlay virtio_rng configfs
    vcan vxcan can-raw can-isotp kvaser_pci
    uhci_hcd ftdi_sio cdc_acm virtio_blk ext4"

mine=$(sha256sum < "$here/setup.sh" | cut -c1-8)
for done in "$cache"/*-"$mine"/vmlinuz; do
    [ -s "$done" ] && { dirname "$done"; exit 0; }
done

[ "$(dpkg --print-architecture)" = amd64 ] || { echo "setup.sh: the virtual machine runs amd64 programs only" >&2; exit 1; }
work=$(mktemp -d "$cache/tmp.XXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir kernel headers source gpio out out/modules
get() { apt-get download -qq -o APT::Sandbox::User=root "$@"; }
apt-cache show linux-image-amd64 > /dev/null 2>&1 || apt-get update -qq

image=$(apt-cache depends linux-image-amd64 | awk '/Depends: linux-image/ {print $2; exit}')
kernel=${image#linux-image-}
series=$(cut -d. -f1-2 <<< "$kernel")
get "$image" "linux-headers-$kernel" "linux-headers-${kernel%-*}-common" "linux-kbuild-$series" "linux-source-$series"
dpkg -x "$image"_*.deb kernel
depmod -b kernel "$kernel"
for package in linux-headers-*.deb linux-kbuild-*.deb; do dpkg -x "$package" headers; done
sed -i "s#/usr/src/linux-headers#$work/headers/usr/src/linux-headers#" "headers/usr/src/linux-headers-$kernel/Makefile"

dpkg-deb --fsys-tarfile linux-source-*.deb | tar xO "./usr/src/linux-source-$series.tar.xz" | xz -dc |
    tar x -C source --strip-components=1 "linux-source-$series"/{drivers/gpio/gpio{-sim.c,lib.h},kernel/irq/irq_sim.c}
cp source/drivers/gpio/gpiolib.h gpio/
cp source/drivers/gpio/gpio-sim.c gpio/gpio-sim-core.c
sed 's/handle_simple_irq(irq_to_desc(irqnum));/generic_handle_irq(irqnum);/' source/kernel/irq/irq_sim.c > gpio/irq_sim.c
printf 'obj-m := gpio-sim.o\ngpio-sim-y := gpio-sim-core.o irq_sim.o\n' > gpio/Makefile
make -s -C "headers/usr/src/linux-headers-$kernel" ARCH=x86 M="$work/gpio" modules > gpio/log 2>&1 || { cat gpio/log >&2; exit 1; }

# in the order in which they are to be loaded, each behind those that it needs
n=100
for m in $modules; do modprobe -d kernel -S "$kernel" --show-depends "$m"; done | awk '/^insmod/ && !seen[$2]++ {print $2}' |
    while read -r file; do
        n=$((n + 1))
        case $file in
        *.xz) xz -dc "$file" > "out/modules/$n-$(basename "$file" .xz)" ;;
        *) cp "$file" "out/modules/$n-$(basename "$file")" ;;
        esac
    done
cp gpio/gpio-sim.ko out/modules/900-gpio-sim.ko
cp "kernel/boot/vmlinuz-$kernel" out/vmlinuz
rm -rf "$cache/$kernel-$mine"
mv out "$cache/$kernel-$mine"
echo "$cache/$kernel-$mine"
