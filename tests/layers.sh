#!/bin/sh
# SPDX-License-Identifier: MIT
# layers.sh - checks the rules of who may know whom: includes of every folder, what the grid's archive needs from
# outside, and that no module needs another which needs it. Prints ok/FAIL lines. BUILD names the build folder.
set -u
status=0

# rule ROOM REGEX...: the quoted includes that the files of a folder may have, beside those of the folder itself. Includes name
# files from the top of the tree.
rule() {
    room=$1
    shift
    allowed='[a-z0-9_]+\.h'
    for one in "$@"; do allowed="$allowed|$one"; done
    bad=$(grep -nE '^ *# *include "' "$room"/*.[ch] | grep -vE "include \"($allowed)\"")
    if [ -n "$bad" ]; then
        echo "$bad"
        echo "FAIL layers_$room"
        status=1
    else
        echo "ok layers_$room"
    fi
    ruled="$ruled $room"
}
ruled=
own='[a-z0-9_]+\.h'
grid="grid/([a-z]+/)?$own"
core="core/$own"
conf='config/conf\.h'
fault='core/fault\.h'
protocol='protocol/protocol\.h'

rule core
rule protocol '(methods|shapes)\.def'
rule config $fault
rule grid $fault
rule grid/range "grid/$own" $fault
rule grid/voxel "grid/$own" $fault
rule grid/water "grid/$own" $fault
# the picture is published as everything between threads is: core/snapshot.h is a header of pure functions, with no archive behind it
rule grid/picture "grid/$own" $fault 'core/snapshot\.h'
rule grid/sphere "grid/$own" "grid/picture/$own" $fault
rule grid/answer "grid/$own" "grid/picture/$own" "grid/water/$own" 'grid/sphere/clusters\.h' $fault
rule drivers/ports $fault
rule drivers/gpio $fault
rule drivers/nmea 'grid/geometry\.h'
rule drivers/devices $fault "drivers/ports/$own" 'drivers/nmea/nmea0183\.h' 'grid/(ping|geometry)\.h'
rule drivers/pose $fault 'grid/geometry\.h'
rule drivers/capture $fault 'drivers/ports/can_frame\.h'
rule daemon/record "$core" "drivers/capture/$own"
rule daemon/pipeline "$core" "$grid"
rule daemon/input "$core" $conf "drivers/$own" "drivers/[a-z]+/$own" 'grid/(ping|geometry)\.h' \
    'daemon/(pipeline/pipeline|record/record)\.h'
rule daemon/rpc "$core" 'config/word\.h' $protocol
rule daemon/map "$core" $conf "grid/voxel/$own" 'drivers/capture/point_cloud\.h' 'daemon/(pipeline/pipeline|input/discontinuity|rpc/work)\.h'
rule daemon/background "$core" $conf "grid/range/$own" 'drivers/devices/device\.h' \
    'daemon/(pipeline/pipeline|rpc/(rpc|work))\.h'
rule daemon/methods "$core" $conf "$grid" 'protocol/(protocol\.h|methods\.def)' "daemon/[a-z]+/$own" \
    'daemon/(fit|plan|plan_show|reload|replay|request_job|wiring)\.h'
rule daemon "$core" $conf 'config/word\.h' 'protocol/(man|protocol|schema)\.h' "$grid" "drivers/[a-z]+/$own" "daemon/[a-z]+/$own"
rule client $fault 'config/word\.h'
rule client/lib
rule client/view $fault $protocol
# daemon/settings.h: `setup` checks what it writes as the daemon will read it, not by rules of its own
rule client/ctl $fault $conf 'daemon/settings\.h' $protocol "client/((lib|view)/)?$own" 'config/word\.h' 'drivers/(capture/(mcap|point_cloud)|ports/port|devices/(device|micron|ping_frame|seanet_frame))\.h'
rule client/mavlink $fault "client/(lib/)?$own"
rule web $fault 'client/view/[a-z_]+\.h' 'client/lib/(sonard|sonard_json)\.h' 'client/arguments\.h' 'protocol/(protocol|schema)\.h'

# methods stand above the services of the process: main alone knows both
bad=$(grep -n 'include "daemon/methods/' daemon/*.[ch] | grep -v '^daemon/main\.c:')
[ -n "$bad" ] && { echo "$bad"; echo "FAIL layers_methods_above"; status=1; } || echo "ok layers_methods_above"

# no folder without a rule
for room in $(find core protocol config grid drivers daemon client web -name '*.[ch]' | sed 's,/[^/]*$,,' | sort -u); do
    case " $ruled " in *" $room "*) ;; *) echo "no rule for $room/"; echo "FAIL layers_every_room"; status=1 ;; esac
done

# grid/ is pure: only these headers of the C library, and only memory and mathematics of its functions, beside
# fault_set; __cpu_model is what the compiler asks which vectors the CPU has
bad=$(grep -rnhoE '#include <[^>]+>' --include='*.[ch]' grid | sort -u |
      grep -vE '<(assert|float|inttypes|limits|math|stdalign|stdatomic|stdbool|stddef|stdint|string)\.h>')
[ -n "$bad" ] && { echo "$bad"; echo "FAIL layers_grid_headers"; status=1; } || echo "ok layers_grid_headers"

archive=${BUILD:-build}/libgrid.a
defined=$(nm --defined-only "$archive" 2>/dev/null | awk 'NF == 3 { print $3 }' | sort -u)
bad=$(nm -u "$archive" | awk '$1 == "U" { print $2 }' | sort -u | grep -vxF "$defined" |
      grep -vxE '(fault_set|__cpu_model|mem(cpy|set|move|cmp|chr)|str(len|cmp)|__mem[a-z]+_chk|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_|__u?(div|mod|divmod)ti[34]|__(asan|ubsan|tsan|sanitizer)_.*|_?(sin|cos|tan|sincos|asin|acos|atan|atan2|hypot|sqrt|exp|exp2|expm1|log|log2|log10|log1p|pow|fabs|floor|ceil|round|trunc|fmod|lgamma|lgamma_r|erf|erfc|ldexp|frexp|nextafter|fmax|fmin|lround|llround|rint)f?)')
[ -n "$bad" ] && { echo "libgrid.a needs from outside:" $bad; echo "FAIL layers_grid_symbols"; status=1; } || echo "ok layers_grid_symbols"

# No module needs one that needs it, be it by way of others: each archive's objects in order.
for name in core protocol config grid drivers daemon client web; do
    archive=${BUILD:-build}/lib$name.a
    [ -f "$archive" ] || continue
    loop=$(nm -A "$archive" 2>/dev/null | awk '
        { sub(/^.*\.a:/, ""); object = $0; sub(/\.o:.*/, "", object); type = $(NF - 1); symbol = $NF }
        type == "U" { needs[object, symbol] = 1 }
        type ~ /^[TDBRC]$/ { home[symbol] = object }
        END {
            for (need in needs) {
                split(need, part, SUBSEP)
                if (part[2] in home && home[part[2]] != part[1])
                    print part[1], home[part[2]]
            }
        }' | tsort 2>&1 >/dev/null)
    [ -n "$loop" ] && { echo "$loop"; echo "FAIL layers_no_circle_$name"; status=1; } || echo "ok layers_no_circle_$name"
done
exit $status
