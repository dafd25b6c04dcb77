#!/bin/sh
# SPDX-License-Identifier: MIT
# named.sh - warns where packaging/identity still has the addresses that are nobody's.
. "$(dirname "$0")/identity"
case $EMAIL$HOMEPAGE$VCS_GIT$VCS_BROWSER$README$SUPPORT in
*example.org*) echo "warning: packaging/identity names nobody: fill it in before you publish a package" >&2 ;;
esac
