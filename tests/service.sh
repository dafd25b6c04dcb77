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

# Other tests run the programs meanwhile.
program() { stat -c '%i %y' "${BUILD:-build}/sonard"; }
was=$(program)
said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr install-built 2>&1)
verdict install $? "$said"
[ "$was" = "$(program)" ]
verdict install_of_what_was_built_builds_nothing $? "it was $was and is $(program)"
units=$root/usr/lib/systemd/system

# verify wants programs that are there: these are, below the root.
for unit in sonard.service sonard.socket sonard-replay@.service sonard-mavlink.service sonard-web.service; do
    sed -i "s|/usr/sbin/|$root/usr/sbin/|" "$units/$unit"
    said=$(SYSTEMD_UNIT_PATH="$units:" systemd-analyze verify --man=no "$units/$unit" 2>&1)
    status=$?
    said=$(grep -F "${unit%.*}" <<< "$said")
    [ $status -eq 0 ] && [ -z "$said" ]
    verdict "understands_$unit" $? "$said"
done

said=$(grep '^RestartPreventExitStatus=' "$units/sonard.service")
[ "$said" = 'RestartPreventExitStatus=2 3' ]
verdict does_not_restart_for_a_fault_of_the_configuration $? "$said"

# exposure in tenths
exposure() { # NAME, UNIT, at most
    said=$(systemd-analyze security --offline=yes --threshold="$3" --no-pager "$2" 2>&1)
    verdict "$1" $? "$(grep -v ✓ <<< "$said")"
}
exposure exposure_of_sonard_is_1.5 "$units/sonard.service" 15
exposure exposure_of_replay_is_0.5 "$units/sonard-replay@.service" 5
exposure exposure_of_mavlink_is_1.5 "$units/sonard-mavlink.service" 15
exposure exposure_of_web_is_1.5 "$units/sonard-web.service" 15
cat "$units/sonard.service" "$root/usr/share/sonard/network.conf" > "$root/network.service" # what the drop-in opens costs
exposure exposure_with_network.conf_is_2.0 "$root/network.service" 20

said=$(systemd-sysusers --root="$root" "$root/usr/lib/sysusers.d/sonard.conf" 2>&1 && grep '^sonard:' "$root/etc/passwd" 2>&1)
verdict makes_its_user $? "$said"
said=$(systemd-tmpfiles --root="$root" --create "$root/usr/lib/tmpfiles.d/sonard.conf" 2>&1 && ls -d "$root"/{run/sonard,var/lib/sonard/maps} 2>&1)
[ "$(id -u)" -eq 0 ] && verdict makes_its_folders $? "$said"
rules=$root/usr/lib/udev/rules.d/91-sonard.rules
udevadm verify --help > /dev/null 2>&1 && { said=$(udevadm verify "$rules" 2>&1); verdict udev_rules $? "$said"; }
# Neither ModemManager nor brltty takes a plain adapter, and both are left a modem of its own.
if command -v udevadm > /dev/null && unshare -m true 2> /dev/null; then
    said=$(unshare -m tests/udev.sh "$rules" 1a86:7523 2>&1)
    [ "$(grep -cx ID_MM_DEVICE_IGNORE=1 <<< "$said")" -eq 2 ] && ! grep -qE '^(BRLTTY|SYSTEMD_WANTS)' <<< "$said"
    verdict an_adapter_is_no_modem_and_no_braille_display $? "$said"
    said=$(unshare -m tests/udev.sh "$rules" 1199:68a2 2>&1)
    ! grep -q '^ID_MM_DEVICE_IGNORE' <<< "$said" && grep -q '^SYSTEMD_WANTS=brltty' <<< "$said"
    verdict other_devices_are_left_to_them $? "$said"
else
    echo "skip service: the rules of udev, which want udevadm and root"
fi

echo '# mine' >> "$root/etc/sonard/sonard.conf"
said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr install-built 2>&1 && tail -n 1 "$root/etc/sonard/sonard.conf" | grep mine)
verdict installing_again_keeps_the_configuration $? "$said"
said=$(MAKEFLAGS='' make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr uninstall 2>&1)
left=$(find "$root/usr" -type f -o -type l)
[ -z "$left" ] && [ -e "$root/etc/sonard/sonard.conf" ]
verdict uninstall_leaves_the_configuration_only $? "$said $left"

# A systemctl that notes what it is asked, and whether the units are there then.
mkdir -p "$root/bin" "$root/alone/lib/systemd/system"
printf '#!/bin/sh\ntest -e %s || echo gone >> %s\necho "$@" >> %s\n' "$root/alone/lib/systemd/system/sonard.service" \
    "$root/asked" "$root/asked" > "$root/bin/systemctl"
chmod +x "$root/bin/systemctl"
touch "$root/alone/lib/systemd/system/sonard.service"
said=$(MAKEFLAGS='' PATH="$root/bin:$PATH" make -s BUILD="${BUILD:-build}" PREFIX="$root/alone" uninstall 2>&1; cat "$root/asked" 2>&1)
grep -q '^disable --now .*sonard.service' "$root/asked" && grep -q '^stop sonard-replay@' "$root/asked" &&
    ! grep -q gone "$root/asked" && [ ! -e "$root/alone/lib/systemd/system/sonard.service" ]
verdict uninstall_stops_and_disables_first $? "$said"
rm -f "$root/asked"
MAKEFLAGS='' PATH="$root/bin:$PATH" make -s BUILD="${BUILD:-build}" DESTDIR="$root" PREFIX=/usr uninstall > /dev/null 2>&1
[ ! -e "$root/asked" ]
verdict uninstall_elsewhere_stops_nothing $? "it stopped the services of this computer"
exit $failed
