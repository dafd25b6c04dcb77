#!/bin/sh
# SPDX-License-Identifier: MIT
# Holds our captures against @mcap/core, an independent reader from npm, and what is exported of them against Foxglove's and
# ROS 2's own readers and schemas. Skips where there is no node or npm.
#
#   tests/mcap/check.sh [FILE...]      default: the captures in tests/replay, one made by capture repair, and exports of one;
#                                      the exported map comes from tests/live/test_map.py
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
      timeout 60 npm install --silent --no-audit --no-fund @mcap/core@2.2.2 lz4js@0.2.0 fzstd@0.1.1 protobufjs@8.8.1 \
          @foxglove/schemas@2.1.0 @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0 @foxglove/rosmsg-msgs-common@3.2.3) >/dev/null 2>&1; then
    echo "skip mcap_core: npm cannot get @mcap/core"
    exit 0
fi
if [ $# -eq 0 ]; then
    set -- tests/replay/*.mcap
    if [ -x "$BUILD/sonarctl" ]; then
        head -c 125000 tests/replay/box.mcap >"$MCAP_MODULES/cut.mcap"
        "$BUILD/sonarctl" capture repair "$MCAP_MODULES/cut.mcap" "$MCAP_MODULES/repaired.mcap" >/dev/null 2>&1 &&
            set -- "$@" "$MCAP_MODULES/repaired.mcap"
        for form in foxglove ros2; do
            "$BUILD/sonarctl" capture export --$form tests/replay/box.mcap "$MCAP_MODULES/$form.mcap" || exit 1
            set -- "$@" "$MCAP_MODULES/$form.mcap"
        done
    fi
fi
node tests/mcap/check.mjs "$@"
