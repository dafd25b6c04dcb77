#!/bin/bash
# SPDX-License-Identifier: MIT
# service.sh - what `make install` puts below DESTDIR: does systemd understand every unit, is each locked up as tightly as
# promised, does `make uninstall` leave nothing but the configuration?
set -u
cd "$(dirname "$0")/.." || exit 1
command -v systemd-analyze > /dev/null || { echo "skip service: systemd-analyze is not installed"; exit 0; }
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
failed=0
verdict() { # NAME, status of what was tried, what was said
    if [ "$2" -eq 0 ]; then echo "ok service_$1"; else echo "$3"; echo "FAIL service_$1"; failed=1; fi
}

said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr install 2>&1)
verdict install $? "$said"
units=$root/usr/lib/systemd/system

# verify wants programs that are there: these are, below the root.
for unit in sonard.service sonard.socket sonard-replay@.service sonard-mavlink.service; do
    sed -i "s|/usr/sbin/|$root/usr/sbin/|" "$units/$unit"
    said=$(SYSTEMD_UNIT_PATH="$units:" systemd-analyze verify --man=no "$units/$unit" 2>&1)
    status=$?
    said=$(grep -F "${unit%.*}" <<< "$said")
    [ $status -eq 0 ] && [ -z "$said" ]
    verdict "understands_$unit" $? "$said"
done

# exposure in tenths
exposure() { # NAME, UNIT, at most
    said=$(systemd-analyze security --offline=yes --threshold="$3" --no-pager "$2" 2>&1)
    verdict "$1" $? "$(grep -v ✓ <<< "$said")"
}
exposure exposure_of_sonard_is_1.5 "$units/sonard.service" 15
exposure exposure_of_replay_is_0.5 "$units/sonard-replay@.service" 5
exposure exposure_of_mavlink_is_1.5 "$units/sonard-mavlink.service" 15
cat "$units/sonard.service" "$root/usr/share/sonard/network.conf" > "$root/network.service" # what the drop-in opens costs
exposure exposure_with_network.conf_is_2.0 "$root/network.service" 20

said=$(systemd-sysusers --root="$root" "$root/usr/lib/sysusers.d/sonard.conf" 2>&1 && grep '^sonard:' "$root/etc/passwd" 2>&1)
verdict makes_its_user $? "$said"
said=$(systemd-tmpfiles --root="$root" --create "$root/usr/lib/tmpfiles.d/sonard.conf" 2>&1 && ls -d "$root"/{run/sonard,var/lib/sonard/maps} 2>&1)
[ "$(id -u)" -eq 0 ] && verdict makes_its_folders $? "$said"
udevadm verify --help > /dev/null 2>&1 && { said=$(udevadm verify "$root/usr/lib/udev/rules.d/70-sonard.rules" 2>&1); verdict udev_rules $? "$said"; }

echo '# mine' >> "$root/etc/sonard/sonard.conf"
said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr install 2>&1 && tail -n 1 "$root/etc/sonard/sonard.conf" | grep mine)
verdict installing_again_keeps_the_configuration $? "$said"
said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr uninstall 2>&1)
left=$(find "$root/usr" -type f -o -type l)
[ -z "$left" ] && [ -e "$root/etc/sonard/sonard.conf" ]
verdict uninstall_leaves_the_configuration_only $? "$said $left"
exit $failed
