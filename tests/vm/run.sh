#!/bin/bash
# SPDX-License-Identifier: MIT
# run.sh [--systemd] [GUEST-SCRIPT ...] - boots a throw-away virtual machine with a plain Debian kernel, which has the CAN and GPIO that
# the build machine's may lack, runs the scripts in it (without arguments: every tests/vm/guest_*) as tests/run.sh does,
# and ends with their status. What was built is taken from BUILD. LIMIT=seconds for all of it (180; 420 with systemd).
#
# With --systemd the root is a Debian of its own with systemd as process 1, sonard installed in it as `make install` does,
# and a virtual Ping360 behind a USB adapter that is pulled out and plugged in by the files /run/out/plug (every
# tests/vm/service_*). Without arguments the power fails afterwards as well: tests/vm/powercut_sonard.sh saves to a disk
# of the machine's own, the emulator is killed at a random moment, and the next boot must find what was confirmed; CUTS
# times (5), and POWERCUT_SEED repeats the moments.
#
# A guest script runs as root, one at a time, with the source tree as working directory, BUILD set, and the host's programs at hand.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
repo=$(cd "$here/../.." && pwd)
build=$(cd "${BUILD:-$repo/build}" && pwd)
begun=$SECONDS
kind=guest limit=${LIMIT:-180}
[ "${1:-}" = --systemd ] && { kind=service limit=${LIMIT:-420}; shift; }
cuts=0
[ $# -gt 0 ] || { cd "$repo"; set -- tests/vm/${kind}_*; [ $kind = guest ] || cuts=${CUTS:-5}; }

kernel=$("$here/setup.sh" "$build/vm" | tail -n 1)
echo "kernel ${kernel##*/}, ready after $((SECONDS - begun)) s"
out=$(mktemp -d)
peer=
trap 'if [ -n "$peer" ]; then kill "$peer"; fi; rm -rf "$out"' EXIT
mkdir -p "$out"/{ram/{bin,dev,proc,sys,low,rw,new},shared}
cp -r "$kernel/modules" "$out/ram/"
cp "$(command -v busybox)" "$out/ram/bin/busybox"
install -m755 "$here/init" "$out/ram/init"
(cd "$out/ram" && find . | cpio -o -H newc --quiet) | gzip -1 > "$out/initrd"
echo "BUILD=/run/build JOBS=1 LIMIT=$((limit * 2 / 3)) tests/run.sh $* > /run/out/results 2>&1" > "$out/shared/cmd"

share() { # TAG FOLDER [,readonly=on]
    echo "-fsdev local,id=$1,path=$2,security_model=none,multidevs=remap${3:-} -device virtio-9p-pci,fsdev=$1,mount_tag=$1"
}
# can0 and can1, two controllers on one wire
can="-object can-bus,id=wire -device kvaser_pci,canbus=wire -device kvaser_pci,canbus=wire"
root=/ boots= usb= disk=
if [ $kind = service ]; then
    root=$("$here/systemd_root.sh" "$build/vm" | tail -n 1)
    boots="systemd systemd.unit=test.service systemd.show_status=0 systemd.firstboot=off"
    usb="-device piix3-usb-uhci -chardev socket,path=$out/usb,server=on,wait=off,id=usb -device usb-serial,chardev=usb,serial=A1B2C3"
    MAKEFLAGS='' make -s -C "$repo" BUILD="$build" DESTDIR="$out/shared/installed" PREFIX=/usr install > /dev/null
    "$here/usb_peer.py" "$out/usb" "$out/shared/plug" "$build/tests/ping360_sim" &
    peer=$!
fi
# A virtual machine of its own accord takes KVM where that only seems to work: say tcg.
emulate() { # ACCELERATOR
    rm -f "$out"/{pid,shared/{rc,results,life}}
    status=0
    # shellcheck disable=SC2046,SC2086
    timeout -k 5 "$limit" qemu-system-x86_64 -cpu max -accel "$1" -smp 2 -m 768 \
        -nodefaults -no-user-config -display none -no-reboot -serial stdio -device virtio-rng-pci \
        -kernel "$kernel/vmlinuz" -initrd "$out/initrd" -append "console=ttyS0 quiet panic=-1 $boots" \
        $(share root "$root" ,readonly=on) $(share repo "$repo" ,readonly=on) $(share build "$build" ,readonly=on) \
        $(share out "$out/shared") $can $usb $disk -pidfile "$out/pid" < /dev/null > "$out/console" 2>&1 || status=$?
}

# An emulator that ends by itself before the guest runs its command (seen: of a segmentation fault while the kernel
# boots, and without a word) has said nothing about what is tested. Once more, with one thread for both processors, which
# leaves its threads nothing to disagree on.
boot() {
    emulate tcg
    [ "$status" -ne 124 ] && [ "$status" -ne 137 ] && [ ! -e "$out/shared/results" ] && [ ! -e "$out/shared/life" ] || return 0
    tail -n 5 "$out/console"
    echo "the emulator ended by itself, with status $status; once more, with one thread"
    emulate tcg,thread=single
}

# One life of the vehicle's computer: END=yes to its end, else until the emulator is killed SECONDS after it began to save.
life() { # END, SECONDS
    rm -f "$out/shared/saving"
    echo "END=$1 bash tests/vm/powercut_sonard.sh > /run/out/life 2>&1" > "$out/shared/cmd"
    boot &
    until [ -e "$out/shared/saving" ] || ! kill -0 $! 2> /dev/null; do sleep 0.2; done
    sleep "$2"
    [ "$1" = yes ] || kill -9 "$(cat "$out/pid")" || echo "FAIL the virtual machine ended by itself"
    wait $! 2> /dev/null || true
    cat "$out/shared/life"
}

power_cuts() {
    truncate -s 64M "$out/disk"
    mkfs.ext4 -q "$out/disk"
    disk="-drive file=$out/disk,format=raw,if=none,id=disk -device virtio-blk-pci,drive=disk"
    rm -f "$out"/shared/confirmed.*
    touch "$out/shared/plug"
    RANDOM=${POWERCUT_SEED:=$RANDOM}
    for cut in $(seq "$cuts"); do
        after=$((RANDOM % 20)).$((RANDOM % 10))
        echo "# power cut $cut of $cuts, $after s after the first save; POWERCUT_SEED=$POWERCUT_SEED"
        life no "$after"
    done
    life yes 0
}

boot

# What the guest's run.sh says of each script, and a line for the run.sh that called this one to count.
[ -s "$out/shared/results" ] && cat "$out/shared/results" && sed -n '/FAILED/d; s/^ *\(tests[^ ]*\) *[0-9]* ok.*/ok \1/p' "$out/shared/results"
if [ -s "$out/shared/rc" ]; then
    status=$(cat "$out/shared/rc")
else
    [ "$status" -eq 124 ] && echo "FAIL the virtual machine did not end within $limit s" ||
        echo "FAIL the virtual machine died (status $status)"
    tail -n 30 "$out/console"
    status=1
fi
if [ "$cuts" -gt 0 ]; then
    power_cuts > "$out/cuts" 2>&1 || status=1
    cat "$out/cuts"
    if grep -q '^FAIL' "$out/cuts" || [ "$(grep -c '^ok something had been saved' "$out/cuts")" -ne 1 ]; then
        status=1
        tail -n 30 "$out/console"
    fi
fi
echo "virtual machine: $((SECONDS - begun)) s in all"
exit "$status"
