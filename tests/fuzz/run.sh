#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds every tests/fuzz/fuzz_NAME.c with libFuzzer and the sanitizers and runs each for SECONDS (20) from its corpus.
#
#   tests/fuzz/run.sh [NAME...]        SECONDS=60 SEED=7 BUILD=dir MAX_LEN=bytes
#
# Prints one line per target and "N passed, N failed"; ends with 1 when any failed. Findings and new inputs stay in $BUILD/fuzz/NAME; the
# tracked corpus is only read. One input again: $BUILD/fuzz/fuzz_NAME FILE
# shellcheck disable=SC2046,SC2086,SC2089,SC2090,SC2012,SC3028
set -u # FLAGS, LIBS and the names are lists of words
cd "$(dirname "$0")/../.." || exit 2
SECONDS_EACH=${SECONDS:-20}
BUILD=${BUILD:-build}
SEED=${SEED:-$(date +%s)}
MAX_LEN=${MAX_LEN:-16384}
CLANG=${CLANG:-clang}
OUT=$BUILD/fuzz
FLAGS="-std=c17 -iquote . -O1 -g -fno-omit-frame-pointer -ffp-contract=off -D_GNU_SOURCE -DSONARD_VERSION=\"fuzz\" -DSONARD_GPIOD=0
       -fsanitize=address,undefined -fno-sanitize-recover=all"
LIBS="$(${PKG_CONFIG:-pkg-config} --libs libmodbus inih jansson liblz4 libzstd zlib) -lm -pthread"

mkdir -p "$OUT" || exit 2

# The whole product with coverage, in an archive: a target takes what it needs. A file that does not compile is
# told; the targets that do not need it run all the same.
objects=""
for source in core/*.c grid/*.c grid/*/*.c drivers/*/*.c protocol/*.c config/*.c daemon/*.c daemon/*/*.c client/*/*.c web/*.c; do
    case $source in *\**|daemon/main.c|client/ctl/sonarctl.c|client/mavlink/sonard-mavlink.c|web/sonard-web.c) continue ;; esac
    object=$OUT/obj/${source%.c}.o
    mkdir -p "${object%/*}"
    if "$CLANG" $FLAGS -fsanitize=fuzzer-no-link -c -o "$object" "$source" 2>"$OUT/build.log"; then
        objects="$objects $object"
    else
        echo "# $source does not compile:"
        sed 's/^/# /' "$OUT/build.log" | head -5
    fi
done
rm -f "$OUT/product.a"
ar rcsD "$OUT/product.a" $objects || exit 2

fuzz_one() {
    name=$1
    work=$OUT/$name
    mkdir -p "$work/found" "$work/artifacts"
    corpus=tests/fuzz/corpus/$name
    [ -d "$corpus" ] || corpus=""
    "$CLANG" $FLAGS -fsanitize=fuzzer -o "$OUT/fuzz_$name" "tests/fuzz/fuzz_$name.c" "$OUT/product.a" $LIBS \
        2>"$work/build.log" || { tail -5 "$work/build.log"; return 1; }
    "$OUT/fuzz_$name" -max_total_time="$SECONDS_EACH" -seed="$SEED" -max_len="$MAX_LEN" -rss_limit_mb=2048 \
        -timeout=10 -print_final_stats=1 -artifact_prefix="$work/artifacts/" "$work/found" $corpus \
        >"$work/log" 2>&1 || { grep -m 3 -E 'ERROR|SUMMARY|runtime error|deadly' "$work/log"; return 1; }
    sed -n 's/^stat::number_of_executed_units: *//p' "$work/log" >"$work/runs"
}

echo "# SEED=$SEED, $SECONDS_EACH s each"
passed=0 failed=0
[ $# -gt 0 ] || set -- $(ls tests/fuzz/fuzz_*.c 2>/dev/null | sed 's,.*/fuzz_,,; s,\.c$,,')
for name in "$@"; do
    if fuzz_one "$name"; then
        echo "ok fuzz_$name ($(cat "$OUT/$name/runs") runs)"
        passed=$((passed + 1))
    else
        echo "FAIL fuzz_$name (see $OUT/$name)"
        failed=$((failed + 1))
    fi
done
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
