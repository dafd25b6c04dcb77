#!/bin/sh
# SPDX-License-Identifier: MIT
# gpiod2.sh - GPIO through both libraries called libgpiod, and without any: each must compile without warnings. The one
# that is not installed here (2.x on Debian 12) is unpacked below BUILD from the backports of the mirror that this machine
# uses; nothing is installed. Prints ok/FAIL/skip lines.
set -u
build=${BUILD:-build}
work=$build/gpiod2
status=0

compile() { # NAME VERSION COMPILER-FLAGS...
    name=$1 version=$2
    shift 2
    for cc in gcc clang; do
        command -v $cc >/dev/null || { echo "skip ${name}_$cc: there is no $cc"; continue; }
        bad=
        for file in drivers/gpio/gpio_*.c core/fault.c core/readable.c; do
            $cc -std=c17 -iquote . -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror -O2 -fPIC -D_GNU_SOURCE \
                -DSONARD_GPIOD="$version" "$@" -c -o "$work/$(basename "$file" .c).o" "$file" || bad=1
        done
        # the test's main asks for one operation of the library, so that a missing symbol shows in the link
        [ -z "$bad" ] && $cc -iquote . -o "$work/program" "$work/main.c" "$work"/*.o $libs || bad=1
        [ -z "$bad" ] && "$work/program" || bad=1
        if [ -z "$bad" ]; then echo "ok ${name}_$cc"; else echo "FAIL ${name}_$cc"; status=1; fi
    done
}

unpack() {
    uri=$(awk '/^URIs:/ { print $2; exit }' /etc/apt/sources.list.d/debian.sources 2>/dev/null)
    suite=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")-backports
    [ -n "$uri" ] || return 1
    mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/etc" "$work/sysroot" || return 1
    top=$(cd "$work" && pwd)
    : > "$work/status"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $uri $suite main" > "$work/etc/sources.list"
    cat > "$work/apt.conf" <<CONF
Dir::Etc::sourcelist "$top/etc/sources.list"; Dir::Etc::sourceparts "-"; Dir::State::lists "$top/lists";
Dir::Cache "$top/cache"; Dir::State::status "$top/status"; APT::Sandbox::User "root"; Acquire::Languages "none";
CONF
    (cd "$work" && APT_CONFIG=$top/apt.conf && export APT_CONFIG && apt-get update -qq &&
        apt-get download -qq libgpiod-dev libgpiod3 && for p in ./*.deb; do dpkg -x "$p" sysroot; done) >"$work/log" 2>&1
}

mkdir -p "$work"
cat > "$work/main.c" <<'C'
#include <stdio.h>
#include <string.h>
#include "drivers/gpio/gpio.h"
int main(void)
{
    struct gpio_line line;
    struct gpio_want want = {.line = "no-such-line", .output = true};
    struct fault fault = {""};
    int opened = gpio_library.open(&line, &want, &fault);
    gpio_library.close(&line);
    if (!opened && fault.text[0])
        return 0;
    printf("%s: opened a line that is not there\n", gpio_library.library);
    return 1;
}
C

libs=
compile without_libgpiod 0
case $(pkg-config --modversion libgpiod 2>/dev/null) in
1.*) libs=-lgpiod && compile libgpiod_1 1 ;;
*) echo "skip libgpiod_1: it is not installed" ;;
esac
case $(pkg-config --modversion libgpiod 2>/dev/null) in
2.*) libs=-lgpiod && compile libgpiod_2 2 ;;
*)
    if [ -e "$work/sysroot/usr/include/gpiod.h" ] || unpack; then
        lib=$(cd "$work"/sysroot/usr/lib/*-linux-gnu && pwd)
        libs="-L$lib -Wl,-rpath,$lib -lgpiod"
        compile libgpiod_2 2 -I"$work/sysroot/usr/include"
    else
        echo "skip libgpiod_2: it could not be downloaded"
    fi
    ;;
esac
exit $status
