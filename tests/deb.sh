#!/bin/bash
# SPDX-License-Identifier: MIT
# deb.sh - the package: built twice in a clean Debian (the same bytes), built for arm64, all of it clean for lintian. The
# packages are left in BUILD/deb/. Needs root, the packages of `tests/deps.sh deb`, and a mirror for the first run.
set -u
cd "$(dirname "$0")/.." || exit 1
command -v mmdebstrap > /dev/null || { echo "skip deb: mmdebstrap is not installed"; exit 0; }
[ "$(id -u)" -eq 0 ] || { echo "skip deb: a clean Debian to build in needs root"; exit 0; }
[ "$(dpkg --print-architecture)" = amd64 ] || { echo "skip deb: the cross build is from amd64"; exit 0; }
build=${BUILD:-build}
mkdir -p "$build/vm" "$build/deb"
build=$(cd "$build" && pwd)
failed=0
verdict() { # NAME, status
    if [ "$2" -eq 0 ]; then echo "ok deb_$1"; else tail -n 30 "$build/deb/log"; echo "FAIL deb_$1"; failed=1; fi
}

root=$build/vm/deb-$(sha256sum < tests/deb.sh | cut -c1-8)
libraries="libgpiod-dev libinih-dev libjansson-dev liblz4-dev libmodbus-dev libzstd-dev zlib1g-dev"
if [ ! -d "$root" ]; then
    both=$(for l in $libraries; do printf '%s,%s:arm64,' "$l" "$l"; done)
    mmdebstrap --quiet --variant=minbase --architectures=amd64,arm64 \
        --include="${both}dpkg-dev,gcc,make,libc6-dev,debhelper,dh-python,python3,lintian,gcc-aarch64-linux-gnu,libc6-dev:arm64,qemu-user-static,pkg-config" \
        "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$root.new" > "$build/deb/log" 2>&1 && mv "$root.new" "$root"
    verdict clean_debian_to_build_in $?
    [ $failed -eq 0 ] || exit 1
fi

within() { # FOLDER, COMMAND...
    unshare --mount sh -c 'mount -t proc proc "$1/proc" && cd / && exec chroot "$1" sh -c "$2"' sh "$root" "cd $1 && $2" > "$build/deb/log" 2>&1
}
for run in amd64 again arm64; do
    rm -rf "${root:?}/$run"
    mkdir -p "$root/$run/sonard"
    git ls-files -z | xargs -0 cp --parents -t "$root/$run/sonard"
    arch=${run/again/amd64}
    within "/$run/sonard" "dpkg-buildpackage -us -uc -b -j2 -a$arch -d"
    verdict "built_$run" $?
done
[ $failed -eq 0 ] || exit 1
cp "$root"/{amd64,arm64}/*.deb "$build/deb/"
for deb in "$root"/amd64/*.deb; do
    cmp "$deb" "$root/again/${deb##*/}" > "$build/deb/log" 2>&1
    verdict "same_bytes_$(basename "$deb" | cut -d_ -f1)" $?
done
for arch in amd64 arm64; do
    # whoever publishes it puts in an address and a distribution
    within "/$arch" "lintian --allow-root --no-cfg --fail-on error,warning --suppress-tags \
        bad-distribution-in-changes-file,bogus-mail-host,bogus-mail-host-in-debian-changelog *_$arch.changes"
    verdict "lintian_$arch" $?
done
exit $failed
