# SPDX-License-Identifier: MIT
# guest.sh - sourced by the guest scripts: $work is a folder that goes away, judge NAME prints ok or FAIL for the command
# before it.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

judge() {
    local status=$?
    if [ $status -eq 0 ]; then echo "ok $1"; else echo "FAIL $1"; fi
}
