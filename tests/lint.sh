#!/bin/sh
# SPDX-License-Identifier: MIT
# lint.sh [format] - the layout of all C files, the length of their lines and, for the product's, the checks of .clang-tidy.
# format: lays the files out anew instead. Prints ok/FAIL lines. Needs the packages of `tests/deps.sh lint`.
set -u
widest=120 # columns, of a comment: clang-format holds code to its own limit
product='core grid protocol drivers config daemon client web'

files() {
    find "$@" -type f \( -name '*.[ch]' -o -name '*.cc' \) | sort
}
all=$(files $product report tests examples)

if [ "${1:-}" = format ]; then
    # shellcheck disable=SC2086  # names without blanks
    exec clang-format -i $all
fi

for tool in clang-format clang-tidy; do
    command -v $tool >/dev/null || { echo "FAIL lint: no $tool"; exit 1; }
done
status=0
# verdict NAME: by the lines on standard input, which say what is wrong
verdict() {
    if said=$(grep .); then
        printf '%s\n' "$said"
        echo "FAIL $1"
        status=1
    else
        echo "ok $1"
    fi
}

verdict lint_format <<END
$(clang-format --dry-run $all 2>&1 | grep 'warning:' | sed 's/ code should be.*/ `make format` lays it out anew/')
END
verdict lint_columns <<END
$(LC_ALL=C.UTF-8 grep -nE "^.{$((widest + 1)),}" $all /dev/null | sed "s/\(:[0-9]*\):.*/\1: more than $widest columns/")
END
tidy='clang-tidy --quiet "$@" -- -std=c17 -iquote . -D_GNU_SOURCE -DSONARD_VERSION="\"0\"" -DSONARD_GPIOD="$0" 2>&1'
verdict lint_tidy <<END
$(files $product | grep '\.c$' | xargs -P "$(nproc)" -n 8 sh -c "$tidy" "${GPIOD:-0}" | grep -E ': (warning|error): ')
END
exit $status
