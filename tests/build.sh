#!/bin/sh
# SPDX-License-Identifier: MIT
# build.sh - what make makes anew, and with what: another VERSION, other flags and a .c that is gone leave nothing stale,
# and what has not changed is left alone. Works on a copy of core/. The programs are hardened, and making them installs
# nothing. Prints ok/FAIL lines.
set -u
build=${BUILD:-build}
status=0
check() { # NAME COMMAND...
    name=$1
    shift
    if "$@"; then echo "ok $name"; else echo "FAIL $name"; status=1; fi
}
fails() { ! "$@"; }

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp -r Makefile VERSION core "$copy"
cat > "$copy/core/probe.c" <<'C'
const char *probe(void);
const char *probe(void)
{
#ifdef PROBE
    return "probe flags";
#else
    return "probe " SONARD_VERSION;
#endif
}
C
made() { # FLAGS...: the archive; what the compiler was run for is in "log"
    make --no-print-directory -C "$copy" BUILD=out SAN= out/libcore.a "$@" > "$copy/log" 2>&1 || cat "$copy/log"
}
compiled() {
    grep -q '^  CC ' "$copy/log"
}
holds() { # TEXT
    grep -q "$1" "$copy/out/libcore.a"
}

made CFLAGS=-O0
check build_has_the_version holds "probe $(cat VERSION)"
made CFLAGS=-O0
check build_nothing_changed_nothing_done fails compiled
echo 99.88.77 > "$copy/VERSION"
made CFLAGS=-O0
check build_another_version holds 'probe 99\.88\.77'
made CFLAGS='-O0 -DPROBE'
check build_other_flags holds 'probe flags'
rm "$copy/core/probe.c"
made CFLAGS='-O0 -DPROBE'
check build_a_source_is_gone fails holds 'probe'
made CFLAGS='-O0 -DPROBE'
check build_and_stays_gone fails compiled
archive() { stat -c '%i %y' "$copy/out/libcore.a"; }
was=$(archive)
make --no-print-directory -C "$copy" BUILD="$copy/out" SAN= CFLAGS='-O0 -DPROBE' "$copy/out/libcore.a" > "$copy/log" 2>&1
check build_the_folder_has_two_names test "$was" = "$(archive)"

for program in sonard sonarctl sonard-mavlink sonard-web libsonard.so.0; do
    check "build_${program}_binds_at_the_start" sh -c 'readelf -dW "$0" | grep -q BIND_NOW' "$build/$program"
    check "build_${program}_checks_the_stack" sh -c 'readelf -sW "$0" | grep -q __stack_chk_fail@' "$build/$program"
    check "build_${program}_checks_buffers" sh -c 'readelf -sW "$0" | grep -q "_chk@GLIBC"' "$build/$program"
done
check build_is_position_independent sh -c 'readelf -hW "$0" | grep -q "Type: *DYN"' "$build/sonard"
check build_installs_nothing fails sh -c 'make -n BUILD="$0" all 2>&1 | grep -E "deps\.sh|apt-get"' "$copy/none"
exit $status
