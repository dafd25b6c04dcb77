#!/bin/bash
# SPDX-License-Identifier: MIT
# cross.sh arm64|armhf - built for that machine and run under qemu-user: the unit tests, and the recording's answers, the
# same bytes as this machine's own. Needs the packages of `tests/deps.sh arm64` or `armhf`, and a mirror for the first run
# (libraries).
# cross.sh arm64 count - instead, the instructions of a Ping360's ping and of questions, of two runs of different length.
set -u
cd "$(dirname "$0")/.." || exit 1
arch=${1:-}
case $arch in
arm64) cross=aarch64-linux-gnu machine=aarch64 ;;
armhf) cross=arm-linux-gnueabihf machine=arm ;;
*) echo "usage: cross.sh arm64|armhf" >&2; exit 2 ;;
esac
for program in $cross-gcc qemu-$machine-static mmdebstrap; do
    command -v $program > /dev/null || { echo "skip $arch: $program is not installed"; exit 0; }
done
build=${BUILD:-build}
mkdir -p "$build/vm"
build=$(cd "$build" && pwd)
libraries=libc6-dev,libgcc-12-dev,libinih-dev,libjansson-dev,liblz4-dev,libzstd-dev,zlib1g-dev,libmodbus-dev,libgpiod-dev
root=$build/vm/$arch-$(sha256sum < tests/cross.sh | cut -c1-8)
# A library's link to /lib leaves this folder: without it the linker takes the static library, of which libm.a lacks powl.
links_stay_inside() {
    find "$1/usr/lib/$cross" -lname '/*' -exec sh -c 'for link; do ln -sfr "$0$(readlink "$link")" "$link"; done' "$1" {} +
}
if [ ! -d "$root" ]; then
    rm -rf --one-file-system "$root.new"
    mmdebstrap --quiet --arch="$arch" --variant=extract --include=$libraries "$(. /etc/os-release && echo "$VERSION_CODENAME")" \
        "$root.new" http://deb.debian.org/debian && links_stay_inside "$root.new" && mv "$root.new" "$root" ||
        { echo "FAIL ${arch}_libraries"; exit 1; }
fi

export PKG_CONFIG_LIBDIR=$root/usr/lib/$cross/pkgconfig PKG_CONFIG_SYSROOT_DIR=$root QEMU_LD_PREFIX=$root
log=$build/$arch.log
making() { # TARGET, WERROR: a warning in a program is an error; tests convert numbers that fit freely where a size has 32 bits
    make -s -j"$(nproc)" BUILD="$build/$arch" CC="$cross-gcc --sysroot=$root" AR=$cross-ar WERROR="$2" "$1" > "$log" 2>&1
}

# So many of a program's run more than of another: instructions for each. Of a Raspberry Pi 4's core (Cortex-A72, 1.5 GHz)
# that is the share beside it, if it executes one per cycle.
executed() { qemu-$machine -plugin "$build/instructions.so" "$@" 2>&1 >"$log" | sed -n 's/ instructions$//p'; }
count() { # WHAT TIMES_A_SECOND MORE, then: first run, --, longer run
    what=$1 rate=$2 more=$3
    shift 3
    first=() && while [ "$1" != -- ]; do first+=("$1"); shift; done && shift
    less=$(executed "${first[@]}") all=$(executed "$@")
    [ "$less" ] && [ "$all" ] || { tail -n 30 "$log"; echo "FAIL ${arch}_count: $what"; exit 1; }
    awk -v what="$what" -v each=$(((all - less) / more)) -v rate="$rate" 'BEGIN {
        printf "%-36s %12d %14.2f\n", what, each, each * rate / 1.5e9 * 100 }'
}
if [ "${2:-}" = count ]; then
    bench=$build/$arch/tests
    making "$bench/bench_pipeline" -Werror && making "$bench/bench_answers" -Werror &&
        cc -O2 -shared -fPIC -o "$build/instructions.so" tests/bench/instructions.c ||
        { tail -n 30 "$log"; echo "FAIL ${arch}_builds"; exit 1; }
    printf '%-36s %12s %14s\n' "$arch" instructions "% of a core"
    for mm in 0 30; do
        count "Ping360, 1200 samples, $mm mm, 10/s" 10 800 "$bench/bench_pipeline" 800 $mm -- "$bench/bench_pipeline" 1600 $mm
    done
    for question in blocked sectors limit nearest; do
        count "$question, fan of 512 beams, 1/s" 1 20 "$bench/bench_answers" counted $question 200 10 -- \
            "$bench/bench_answers" counted $question 200 30
    done
    exit 0
fi
making programs -Werror && making unit "$([ $arch = armhf ] || echo -Werror)"
status=$?
[ $status -eq 0 ] && echo "ok ${arch}_builds" || { tail -n 30 "$log"; echo "FAIL ${arch}_builds"; exit 1; }

failed=0
emulator=$(command -v qemu-$machine-static)
for threads in 0 2; do
    "$build/sonard" --replay tests/replay/box.mcap --socket none --threads $threads --answers "$build/native.jsonl" 2> "$log" &&
        "$emulator" "$build/$arch/sonard" --replay tests/replay/box.mcap --socket none --threads $threads --answers "$build/$arch.jsonl" 2>> "$log" &&
        cmp "$build/native.jsonl" "$build/$arch.jsonl" >> "$log" 2>&1
    if [ $? -eq 0 ]; then echo "ok ${arch}_same_answers_with_threads_$threads"; else
        cat "$log"
        echo "FAIL ${arch}_same_answers_with_threads_$threads"
        failed=1
    fi
done
# Terminals, sockets' credentials and counters, and other programs are the kernel's, which here is another's: these tests
# fail in the emulator (two of them with it). What takes too long there is said to be skipped.
kernel=" mavlink_bridge modbus_depth nmea port_can port_serial port_udp serial_mirror server sim_program "
for test in "$build/$arch"/tests/test_*; do
    case $test in *.d | *.o) continue ;; esac
    # the calls that it wraps have other names where files are larger than an int
    case $arch/$test in armhf/*/test_segments_outage) echo "skip ${arch}_${test##*/}: its calls have other names"; continue ;; esac
    case $kernel in *" ${test##*/test_} "*) echo "skip ${arch}_${test##*/}: needs a kernel of $arch"; continue ;; esac
    BUILD=$build/$arch timeout -k 5 120 "$emulator" "$test" > "$log" 2>&1
    status=$?
    name=${arch}_${test##*/}
    [ $status -eq 124 ] && { echo "skip $name: more than two minutes in the emulator"; continue; }
    if [ $status -eq 0 ] && ! grep -q '^FAIL' "$log"; then echo "ok $name"; else
        grep -v '^ok' "$log" | tail -n 15
        echo "FAIL $name (status $status)"
        failed=1
    fi
done
exit $failed
