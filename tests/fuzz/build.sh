#!/bin/sh
# SPDX-License-Identifier: MIT
# build.sh - every fuzz target for a fuzzing service, as OSS-Fuzz wants it: compiled by $CC with $CFLAGS, linked with
# $LIB_FUZZING_ENGINE by $CXX, into $OUT, each with the corpus that is tracked as NAME_seed_corpus.zip. Without these in the
# environment: by clang with libFuzzer and the address sanitizer, into build/fuzz/service.
# shellcheck disable=SC2086  # lists of words
set -eu
cd "$(dirname "$0")/../.."
: "${CC:=clang}" "${CXX:=clang++}" "${OUT:=$PWD/build/fuzz/service}" "${WORK:=$PWD/build/fuzz/service-work}"
if [ -z "${LIB_FUZZING_ENGINE:-}" ]; then
    LIB_FUZZING_ENGINE=-fsanitize=fuzzer
    CFLAGS="${CFLAGS:--O1 -g -fsanitize=address,undefined,fuzzer-no-link}"
    CXXFLAGS="${CXXFLAGS:-$CFLAGS}"
fi
FLAGS="$CFLAGS -std=c17 -iquote . -ffp-contract=off -D_GNU_SOURCE -DSONARD_VERSION=\"fuzz\" -DSONARD_GPIOD=0"
LIBS="$(${PKG_CONFIG:-pkg-config} --libs libmodbus inih jansson liblz4 libzstd zlib) -lm -pthread"
mkdir -p "$OUT" "$WORK"

compile() { # SOURCE: its object's name is printed
    object=$WORK/${1%.c}.o
    mkdir -p "${object%/*}"
    $CC $FLAGS -c -o "$object" "$1"
    echo "$object"
}
web="web/web_guard.c web/web_metrics.c web/web_query.c web/web_settings.c" # what needs no libwebsockets
objects=$(for source in core/*.c grid/*.c grid/*/*.c drivers/*/*.c protocol/*.c config/*.c daemon/*.c daemon/*/*.c \
              client/*.c client/*/*.c $web; do
    case $source in *\**|daemon/main.c|client/ctl/sonarctl.c|client/mavlink/sonard-mavlink.c) continue ;; esac
    compile "$source"
done)
rm -f "$WORK/product.a"
ar rcsD "$WORK/product.a" $objects

[ $# -gt 0 ] || set -- $(ls tests/fuzz/fuzz_*.c | sed 's,.*/fuzz_,,; s,\.c$,,')
for name in "$@"; do
    $CXX $CXXFLAGS -o "$OUT/fuzz_$name" "$(compile "tests/fuzz/fuzz_$name.c")" "$WORK/product.a" \
        $LIB_FUZZING_ENGINE $LIBS
    if [ -d "tests/fuzz/corpus/$name" ]; then
        rm -f "$OUT/fuzz_${name}_seed_corpus.zip"
        python3 -m zipfile -c "$OUT/fuzz_${name}_seed_corpus.zip" "tests/fuzz/corpus/$name/"*
    fi
    echo "ok $OUT/fuzz_$name"
done
