#!/bin/sh
# SPDX-License-Identifier: MIT
# Holds our MAVLink against node-mavlink, an independent implementation from npm, both ways. Skips where there is no
# node, or where npm cannot get it.
set -u
cd "$(dirname "$0")/../.." || exit 2
BUILD=${BUILD:-build}
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
    echo "skip node_mavlink: needs node and npm"
    exit 0
fi
MAVLINK_MODULES=$BUILD/mavlink
export MAVLINK_MODULES
mkdir -p "$MAVLINK_MODULES" || exit 2
if [ ! -d "$MAVLINK_MODULES/node_modules/node-mavlink" ] &&
   ! (cd "$MAVLINK_MODULES" && echo '{}' >package.json &&
      timeout 120 npm install --silent --no-audit --no-fund node-mavlink@2.3.0) >/dev/null 2>&1; then
    echo "skip node_mavlink: npm cannot get node-mavlink"
    exit 0
fi
node tests/mavlink/check.mjs "$BUILD/tests/mavlink_pipe"
