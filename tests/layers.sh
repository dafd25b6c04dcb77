#!/bin/sh
# SPDX-License-Identifier: MIT
# layers.sh - checks the rules of who may know whom: includes of every folder, and what the grid's archive needs from
# outside. Prints ok/FAIL lines. BUILD names the build folder.
set -u
status=0

# folder, and an extended regular expression of the quoted includes that it may have (from its own place)
rule() {
    folder=$1 allowed=$2
    bad=$(grep -rnE '^#include "' --include='*.[ch]' "$folder" | grep -vE "#include \"($allowed)\"")
    if [ -n "$bad" ]; then
        echo "$bad"
        echo "FAIL layers_$folder"
        status=1
    else
        echo "ok layers_$folder"
    fi
}
own='[a-z0-9_]+\.h'
rule grid "$own|(\.\./)+([a-z]+/)?$own|(range|sphere|answer|voxel)/$own"
rule drivers "$own|\.\./grid/(ping|geometry)\.h"
rule config "$own"
rule client "$own|\.\./drivers/(mcap|ping_frame|seanet_frame)\.h|\.\./config/word\.h"
rule daemon "$own|\.\./(grid|drivers|config)/([a-z]+/)?$own"

# out of grid/ even by ../: only grid/ itself
bad=$(grep -rnE '#include "(\.\./)+(drivers|daemon|config|client)/' --include='*.[ch]' grid)
[ -n "$bad" ] && { echo "$bad"; echo "FAIL layers_grid_knows_nobody"; status=1; } || echo "ok layers_grid_knows_nobody"

# grid/ is pure: only these headers of the C library, and only memory and mathematics of its functions; __cpu_model is
# what the compiler asks which vectors the CPU has
bad=$(grep -rnhoE '#include <[^>]+>' --include='*.[ch]' grid | sort -u |
      grep -vE '<(assert|float|inttypes|limits|math|stdalign|stdatomic|stdbool|stddef|stdint|stdio|string)\.h>')
[ -n "$bad" ] && { echo "$bad"; echo "FAIL layers_grid_headers"; status=1; } || echo "ok layers_grid_headers"

archive=${BUILD:-build}/libgrid.a
defined=$(nm --defined-only "$archive" 2>/dev/null | awk 'NF == 3 { print $3 }' | sort -u)
bad=$(nm -u "$archive" | awk '$1 == "U" { print $2 }' | sort -u | grep -vxF "$defined" |
      grep -vxE '(__cpu_model|mem(cpy|set|move|cmp|chr)|str(len|cmp)|v?snprintf|__v?snprintf_chk|__mem[a-z]+_chk|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_|__u?(div|mod|divmod)ti[34]|__(asan|ubsan|tsan|sanitizer)_.*|_?(sin|cos|tan|sincos|asin|acos|atan|atan2|hypot|sqrt|exp|exp2|expm1|log|log2|log10|log1p|pow|fabs|floor|ceil|round|trunc|fmod|lgamma|lgamma_r|erf|erfc|ldexp|frexp|nextafter|fmax|fmin|lround|llround|rint)f?)')
[ -n "$bad" ] && { echo "libgrid.a needs from outside:" $bad; echo "FAIL layers_grid_symbols"; status=1; } || echo "ok layers_grid_symbols"
exit $status
