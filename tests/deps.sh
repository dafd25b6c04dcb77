#!/bin/sh
# SPDX-License-Identifier: MIT
# deps.sh [build|check|long|web|lint|report|vm|arm64|armhf|deb|blueos] - installs what is missing on a Debian 12: what building
# needs, what the gate (make check) needs too, what all other tests need (long), or what check-web, lint, the report, the
# virtual machine of check-vm, check-arm64, check-armhf, deb and check-deb, or blueos need. Needs root or sudo only when something is missing.
# INSTALL=no: installs nothing, and fails where something is missing.
set -eu
build="gcc libc6-dev make pkg-config libinih-dev libjansson-dev liblz4-dev libzstd-dev zlib1g-dev libmodbus-dev libgpiod-dev libwebsockets-dev"
check="$build python3 python3-jsonschema librsvg2-bin gnuplot-nox cmark-gfm systemd udev"
long="$check clang libclang-rt-14-dev valgrind spin nodejs npm zsh hunspell hunspell-en-gb g++ liboctomap-dev git python3-pip python3-venv python3-setuptools python3-wheel mypy"
web="$long chromium"
lint="$build clang-format clang-tidy"
report="$build gnuplot-nox cmark-gfm valgrind python3"
vm="$build e2fsprogs qemu-system-x86 busybox-static cpio kmod xz-utils iproute2 can-utils gpiod mmdebstrap python3"
arm64="$build gcc-aarch64-linux-gnu qemu-user-static qemu-user mmdebstrap"
armhf="$build gcc-arm-linux-gnueabihf qemu-user-static mmdebstrap"
deb="$build git dpkg-dev debhelper dh-python python3 mmdebstrap"
blueos="$build git python3 mmdebstrap umoci bubblewrap qemu-user-static gcc-aarch64-linux-gnu gcc-arm-linux-gnueabihf"

case "${1:-build}" in
build) want=$build ;;
check) want=$check ;;
long) want=$long ;;
web) want=$web ;;
lint) want=$lint ;;
report) want=$report ;;
vm) want=$vm ;;
arm64) want=$arm64 ;;
armhf) want=$armhf ;;
deb) want=$deb ;;
blueos) want=$blueos ;;
*) echo "usage: deps.sh [build|check|long|web|lint|report|vm|arm64|armhf|deb|blueos]" >&2; exit 2 ;;
esac

missing=
for package in $want; do
    # what another package or a hand installation already provides is not installed again
    case $package in
    gcc | g++ | make | clang | clang-format | clang-tidy | valgrind | spin | npm) command -v "$package" >/dev/null && continue ;;
    python3) [ -x /usr/bin/python3 ] && continue ;;
    systemd) command -v systemd-analyze >/dev/null && continue ;;
    nodejs) command -v node >/dev/null && continue ;;
    gnuplot-nox) command -v gnuplot >/dev/null && continue ;;
    librsvg2-bin) command -v rsvg-convert >/dev/null && continue ;;
    esac
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

if [ "${INSTALL:-yes}" = no ]; then
    echo "these packages are missing:$missing; install them, or leave INSTALL=no out" >&2
    exit 1
fi
echo "installing:$missing (INSTALL=no prevents it)"
sudo=
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "these packages are missing, and there is neither root nor sudo:$missing" >&2; exit 1; }
    sudo=sudo
fi
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086  # a list of packages
$sudo apt-get install -y -q --no-install-recommends $missing >/dev/null 2>&1 ||
    { $sudo apt-get update -q >/dev/null && $sudo apt-get install -y -q --no-install-recommends $missing >/dev/null; }
