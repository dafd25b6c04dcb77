#!/bin/sh
# SPDX-License-Identifier: MIT
# valgrind.sh - a whole replay and the tests that finish in reasonable time under memcheck: no error, no leak. And under
# callgrind the instructions of the longest turn of the loop that a question of each method takes: at most 10 million.
set -u
build=${BUILD:-build}
status=0
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT

check() { # name, command...
    name=$1
    shift
    if valgrind -q --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite,possible \
        "$@" >"$tmp/out" 2>&1; then
        echo "ok valgrind_$name"
    else
        tail -n 30 "$tmp/out"
        echo "FAIL valgrind_$name"
        status=1
    fi
}

command -v valgrind >/dev/null || { echo "skip valgrind: not installed"; exit 0; }
check replay "$build/sonard" --replay tests/replay/box.mcap --socket none --threads 0 --answers "$tmp/a"
check replay_threads "$build/sonard" --replay tests/replay/box.mcap --socket none --threads 2 --answers "$tmp/a"
for t in conf rpc loop pose_log layers ping_frame ping360 record capture; do
    check "$t" "$build/tests/test_$t"
done

# METHOD MILLIONS: what looks at all directions of one picture does so in one turn. Of 41253 directions of
# 1 degree, all told, at the greatest parameters.
longer='nearest 12 sectors 12'
if valgrind -q --tool=callgrind --instr-atstart=no --callgrind-out-file="$tmp/turn" "$build/tests/test_rig_turns" \
    >"$tmp/out" 2>&1; then
    awk -v longer="$longer" '
        BEGIN { n = split(longer, word, " "); for (i = 1; i < n; i += 2) limit[word[i]] = word[i + 1] }
        /^desc: Trigger: Client Request:/ { question = substr($0, 32) }
        /^totals:/ {
            method = question
            sub(/.*"method":"/, "", method)
            sub(/".*/, "", method)
            if ($2 > most[method]) { most[method] = $2; asked[method] = question }
            question = ""
        }
        END {
            for (method in most) {
                bad = most[method] > 1e6 * (method in limit ? limit[method] : 10)
                printf "%s valgrind_turn_%s: at most %.1f million instructions%s\n", bad ? "FAIL" : "ok", method,
                    most[method] / 1e6, bad ? ": " asked[method] : ""
                failed += bad
                methods++
            }
            exit failed > 0 || methods < 40
        }' "$tmp"/turn.* || status=1
else
    tail -n 30 "$tmp/out"
    echo "FAIL valgrind_turns"
    status=1
fi
exit $status
