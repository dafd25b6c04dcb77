#!/bin/bash
# SPDX-License-Identifier: MIT
# deb.sh - the package: built twice in a clean Debian (the same bytes), built for arm64, all of it clean for lintian, and
# installed in a clean Debian, where a virtual sonar leads to the first "clear", to the page and to Python (the transcript:
# BUILD/deb/first_clear.txt).
# The packages are left in BUILD/deb/. Needs root, the packages of `tests/deps.sh deb`, and a mirror for the first run.
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

# One Debian for each architecture that is built for: not all of the libraries can be installed for two of them at once.
key=$(sed -n '/^libraries=/,/^clean_debian user/p' tests/deb.sh | sha256sum | cut -c1-8)
libraries="libgpiod-dev libinih-dev libjansson-dev liblz4-dev libmodbus-dev libwebsockets-dev libzstd-dev zlib1g-dev libc6-dev"
tools=dpkg-dev,gcc,make,libc6-dev,debhelper,dh-python,python3,pkg-config
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
clean_debian() { # NAME, architectures, packages
    [ ! -d "$build/vm/$1-$key" ] || return 0
    rm -rf --one-file-system "$build/vm/$1-$key.new"
    mmdebstrap --variant=minbase --architectures="$2" ${3:+--include="$3"} "$suite" "$build/vm/$1-$key.new" > "$build/deb/log" 2>&1 &&
        mv "$build/vm/$1-$key.new" "$build/vm/$1-$key"
    verdict "clean_debian_$1" $?
    [ $failed -eq 0 ] || exit 1
}
joined() { # SUFFIX: the libraries with it, behind commas
    for l in $libraries; do printf ',%s%s' "$l" "$1"; done
}
clean_debian amd64 amd64 "$tools,lintian$(joined '')"
clean_debian arm64 amd64,arm64 "$tools,gcc-aarch64-linux-gnu,pkgconf:arm64,qemu-user-static$(joined :arm64)"
clean_debian user amd64 ''

within() { # NAME, FOLDER, COMMAND...: in that Debian, with a /proc
    unshare --mount sh -c 'mount -t proc proc "$1/proc" && cd / && exec chroot "$1" sh -c "$2"' sh "$build/vm/$1-$key" "cd $2 && $3" \
        > "$build/deb/log" 2>&1
}
for run in amd64 again arm64; do
    arch=${run/again/amd64}
    root=$build/vm/$arch-$key
    rm -rf "${root:?}/$run"
    packaging/copy.sh "$root/$run/sonard"
    within "$arch" "/$run/sonard" "dpkg-buildpackage -us -uc -b -j2 -a$arch -d"
    verdict "built_$run" $?
done
[ $failed -eq 0 ] || exit 1
native=$build/vm/amd64-$key
cp "$native"/amd64/*.deb "$build/vm/arm64-$key"/arm64/*_arm64.deb "$build/deb/"
for deb in "$native"/amd64/*.deb; do
    cmp "$deb" "$native/again/${deb##*/}" > "$build/deb/log" 2>&1
    verdict "same_bytes_$(basename "$deb" | cut -d_ -f1)" $?
done
rm -rf "$native/arm64"
mkdir "$native/arm64"
cp "$build/vm/arm64-$key"/arm64/sonard*_arm64.* "$build/vm/arm64-$key"/arm64/*_all.deb "$build/vm/arm64-$key"/arm64/lib*_arm64.deb "$native/arm64/"
for arch in amd64 arm64; do
    # whoever publishes it puts in an address and a distribution
    within amd64 "/$arch" "lintian --allow-root --no-cfg --fail-on error,warning --suppress-tags \
        bad-distribution-in-changes-file,bogus-mail-host,bogus-mail-host-in-debian-changelog *_$arch.changes"
    verdict "lintian_$arch" $?
done

# A person with the package and a virtual sonar; the copy is thrown away.
within amd64 /again/sonard "make build/tests/ping360_sim"
verdict virtual_sonar $?
user=$build/vm/user-run
rm -rf --one-file-system "$user"
cp -a "$build/vm/user-$key" "$user"
mkdir "$user/srv/try"
cp "$native"/amd64/sonard_*_amd64.deb "$native"/amd64/sonard-web_*_amd64.deb "$native"/amd64/python3-sonard_*_all.deb "$native/again/sonard/build/tests/ping360_sim" tests/first_clear.sh "$user/srv/try/"
cp -L /etc/resolv.conf "$user/etc/"
unshare --mount --pid --fork --kill-child sh -c 'mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" && cd / &&
    exec chroot "$1" /srv/try/first_clear.sh' sh "$user" > "$build/deb/log" 2>&1
verdict first_clear $?
cp "$build/deb/log" "$build/deb/first_clear.txt"
rm -rf --one-file-system "$user"
exit $failed
