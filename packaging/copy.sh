#!/bin/sh
# SPDX-License-Identifier: MIT
# copy.sh FOLDER - what a Debian package is built from: the tracked files, with the publisher of packaging/identity.
set -eu
cd "$(dirname "$0")/.."
folder=$1
. packaging/identity
packaging/named.sh
mkdir -p "$folder"
git ls-files -z | xargs -0 cp --parents -t "$folder"
sed -i -e "s|^Maintainer: .*|Maintainer: $MAINTAINER <$EMAIL>|" -e "s|^Homepage: .*|Homepage: $HOMEPAGE|" \
    -e "s|^Vcs-Git: .*|Vcs-Git: $VCS_GIT|" -e "s|^Vcs-Browser: .*|Vcs-Browser: $VCS_BROWSER|" "$folder/debian/control"
sed -i "s|^ -- .* <.*>  | -- $MAINTAINER <$EMAIL>  |" "$folder/debian/changelog"
