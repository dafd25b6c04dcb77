#!/bin/sh
# SPDX-License-Identifier: MIT
# unused.sh - every public function of the product has a caller in a program that is installed: what only tests call is
# no feature. libsonard's are for other people's programs. Builds without optimisation, so that a call within a module
# counts. Prints ok/FAIL lines.
set -u
build=${BUILD:-build}/unused
folders='core grid drivers config daemon client web'

# NAME why it may have no caller
allowed='
imagenex_decode_switch the simulators speak the side of the device
imagenex_encode_reply the simulators speak the side of the device
surveyor_encode_atof the simulators speak the side of the device
surveyor_encode_yz the simulators speak the side of the device
ping1d_encode_reading the simulators speak the side of the device
ping360_encode_data the simulators speak the side of the device
mcap_open_memory what tests read has no file
cast_slack the definition by which tests judge cast_run
cfar_ln_pfa the definition by which tests judge the factor
clahe_image the exact filter by which tests judge the causal one
clahe_grid_ok what clahe_image wants of its caller
merge_sum what merge_at judges
resample_cell what merge_sum asks of a corrected submap
merge_at the definition by which tests judge merge_block
components_remove a single change, as the random walk of the tests makes them
answer_direction what the grid alone has free, by which tests and measurements judge records
answer_sectors the same of sectors
extract_defaults what measurements and tests begin with
'

make --no-print-directory BUILD="$build" SAN= CFLAGS='-O0 -ffunction-sections' LDFLAGS=-Wl,--gc-sections \
    programs > "$build.log" 2>&1 || { tail -n 20 "$build.log"; echo "FAIL unused_builds"; exit 1; }

functions() {
    nm --defined-only -g "$@" 2>/dev/null | awk 'NF == 3 && $2 == "T" { print $3 }' | sort -u
}
defined=$(for f in $folders; do functions "$build/lib$f.a"; done)
used=$(functions "$build/sonard" "$build/sonarctl" "$build/sonard-mavlink" "$build/sonard-web" "$build/libsonard.so.0" | sed "s/@.*//" | sort -u)
unused=$(printf '%s\n' $defined | sort -u | grep -vxF "$used")

status=0
for name in $unused; do
    printf '%s' "$allowed" | grep -q "^$name " && continue
    echo "no program calls $name: $(grep -rlw "$name" $folders --include='*.h' | tr '\n' ' ')"
    status=1
done
for name in $(printf '%s' "$allowed" | cut -d' ' -f1); do
    printf '%s\n' $unused | grep -qx "$name" || { echo "the list of exceptions names $name, which has a caller or is gone"; status=1; }
done
[ $status -eq 0 ] && echo "ok every_public_function_has_a_caller" || echo "FAIL every_public_function_has_a_caller"
exit $status
