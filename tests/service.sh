#!/bin/bash
# SPDX-License-Identifier: MIT
# service.sh - does systemd understand the unit as it is installed?
set -u
cd "$(dirname "$0")/.." || exit 1
command -v systemd-analyze > /dev/null || { echo "skip service_unit: systemd-analyze is not installed"; exit 0; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
sed "s|@SBINDIR@/sonard|$(command -v true)|" config/sonard.service.in > "$folder/sonard.service"
said=$(systemd-analyze verify --man=no "$folder/sonard.service" 2>&1)
status=$?
said=$(grep -F sonard.service <<< "$said")
[ $status -eq 0 ] && [ -z "$said" ] && echo "ok service_unit" && exit 0
echo "$said"
echo "FAIL service_unit"
exit 1
