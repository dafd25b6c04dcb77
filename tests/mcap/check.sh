#!/bin/sh
# SPDX-License-Identifier: MIT
# Holds our captures against @mcap/core, an independent reader from npm. Skips where there is no node or npm.
#
#   tests/mcap/check.sh [FILE...]      default: the captures in tests/replay, and one made by capture repair; the exported map
#                                      comes from tests/live/test_map.py
set -u
cd "$(dirname "$0")/../.." || exit 2
BUILD=${BUILD:-build}
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
    echo "skip mcap_core: needs node and npm"
    exit 0
fi
MCAP_MODULES=$(mktemp -d) || exit 2
export MCAP_MODULES
trap 'rm -rf "$MCAP_MODULES"' EXIT
if ! (cd "$MCAP_MODULES" && echo '{}' >package.json &&
      timeout 60 npm install --silent --no-audit --no-fund @mcap/core@2.2.1 lz4js@0.2.0 fzstd@0.1.1) >/dev/null 2>&1; then
    echo "skip mcap_core: npm cannot get @mcap/core"
    exit 0
fi
if [ $# -eq 0 ]; then
    set -- tests/replay/*.mcap
    if [ -x "$BUILD/sonarctl" ]; then
        head -c 125000 tests/replay/box.mcap >"$MCAP_MODULES/cut.mcap"
        "$BUILD/sonarctl" capture repair "$MCAP_MODULES/cut.mcap" "$MCAP_MODULES/repaired.mcap" >/dev/null 2>&1 &&
            set -- "$@" "$MCAP_MODULES/repaired.mcap"
    fi
fi
node tests/mcap/check.mjs "$@"
