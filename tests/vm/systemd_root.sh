#!/bin/bash
# SPDX-License-Identifier: MIT
# systemd_root.sh CACHE - makes CACHE/systemd-<this script>/, a small Debian with systemd, udev and the libraries that sonard
# is linked with, and prints that folder. Done once, half a minute; afterwards it only prints.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1"
root=$(cd "$1" && pwd)/systemd-$(sha256sum < "$here/systemd_root.sh" | cut -c1-8)
[ -d "$root" ] && { echo "$root"; exit 0; }
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
packages=systemd,systemd-sysv,udev,dbus,iproute2,kmod,procps,e2fsprogs,libgpiod2,libmodbus5,libinih1,libjansson4,liblz4-1,libzstd1,zlib1g
mmdebstrap --quiet --variant=minbase --include="$packages" "$suite" "$root.new" >&2
mv "$root.new" "$root"
echo "$root"
