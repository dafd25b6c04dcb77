#!/bin/bash
# SPDX-License-Identifier: MIT
# build.sh [ARCH...] - the BlueOS extension for amd64, arm64 or armhf (default: all) into BUILD/blueos/: for each
# an archive that `docker load`, skopeo and umoci read. No registry is needed, only a mirror of Debian. The publisher and
# the addresses are those of packaging/identity.
set -eu
cd "$(dirname "$0")/../.."
build=${BUILD:-build}
. packaging/identity
mkdir -p "$build/blueos" "$build/vm"
build=$(cd "$build" && pwd)
suite=bookworm
version=$(cat VERSION)
date=$(git log -1 --format=%ct 2> /dev/null || stat -c %Y VERSION)
developed=libinih-dev,libjansson-dev,liblz4-dev,libzstd-dev,zlib1g-dev,libmodbus-dev,libgpiod-dev,libwebsockets-dev
needed=libinih1,libjansson4,liblz4-1,libzstd1,zlib1g,libmodbus5,libgpiod2,libwebsockets17,busybox-static

packaging/named.sh
say() { echo "blueos: $*" >&2; }

# ARCH: the compiler's name for it, and the names that OCI has.
triplet() { case $1 in amd64) echo x86_64-linux-gnu ;; arm64) echo aarch64-linux-gnu ;; armhf) echo arm-linux-gnueabihf ;; esac; }
platform() { case $1 in armhf) echo arm ;; *) echo "$1" ;; esac; }

# The programs of ARCH into FOLDER, against the libraries that the image has.
compile() { # ARCH, FOLDER
    local cross root programs="sonard sonarctl sonard-mavlink sonard-web"
    cross=$(triplet "$1")
    root=$build/vm/blueos-$1-$(echo "$suite $developed" | sha256sum | cut -c1-8)
    if [ ! -d "$root" ]; then
        mmdebstrap --quiet --arch="$1" --variant=extract --include="libc6-dev,libgcc-12-dev,$developed" $suite "$root.new"
        # a library's link to /lib leaves this folder: the linker would take the static library
        find "$root.new/usr/lib/$cross" -lname '/*' -exec sh -c 'for l; do ln -sfr "$0$(readlink "$l")" "$l"; done' "$root.new" {} +
        mv "$root.new" "$root"
    fi
    # shellcheck disable=SC2086
    PKG_CONFIG_LIBDIR=$root/usr/lib/$cross/pkgconfig:$root/usr/share/pkgconfig PKG_CONFIG_SYSROOT_DIR=$root \
        make -s -j"${JOBS:-$(nproc)}" BUILD="$build/blueos/$1" CC="$cross-gcc --sysroot=$root" AR="$cross-ar" programs >&2
    mkdir -p "$2"
    for program in $programs; do
        "$cross-strip" -o "$2/$program" "$build/blueos/$1/$program"
    done
}

# What the container holds: libraries, a shell, the programs. Users, and the links that lead into the bind.
fill() { # ARCH, FOLDER
    mmdebstrap --quiet --arch="$1" --variant=extract --include=$needed $suite "$2"
    # of the packages only the licences stay
    find "$2/usr/share" -mindepth 1 -maxdepth 1 ! -name doc -exec rm -rf {} +
    find "$2/usr/share/doc" ! -type d ! -name copyright -delete
    rm -rf "${2:?}"/{boot,dev,etc,home,media,mnt,opt,proc,root,run,srv,sys,tmp,var}
    find "$2/usr" -type d -empty -delete
    mkdir -p "$2"/{dev,etc,proc,run,sys,tmp,data,var/lib,usr/share/sonard/blueos}
    chmod 1777 "$2/tmp"
    for applet in sh cat cp ls mkdir chown su sleep kill ps vi grep tail env; do
        ln -sf busybox "$2/bin/$applet"
    done
    compile "$1" "$2/usr/sbin"
    install -m 755 packaging/blueos/start.sh "$2/usr/share/sonard/blueos/"
    install -m 644 packaging/blueos/sonard.conf packaging/blueos/extension.conf "$2/usr/share/sonard/blueos/"
    ln -s /data "$2/etc/sonard"
    ln -s /data "$2/var/lib/sonard"
    printf 'root:x:0:0::/data:/bin/sh\nsonard:x:990:990::/data:/bin/sh\n' > "$2/etc/passwd"
    printf 'root:x:0:\nsonard:x:990:\n' > "$2/etc/group"
}

json() { # FORMAT of jq-like text, checked: a label that is no JSON hides the extension
    python3 -c 'import json, sys; print(json.dumps(json.loads(sys.argv[1]), separators=(",", ":")))' "$1"
}

label() { # LAYOUT, of the image in it
    local author=$MAINTAINER email=$EMAIL
    umoci config --image "$1:$version" --created "$(date -u -d "@$date" +%FT%TZ)" \
        --config.entrypoint /usr/share/sonard/blueos/start.sh --config.workingdir /data --config.env PATH=/usr/sbin:/usr/bin:/sbin:/bin --config.env SONARD_USER=sonard \
        --config.volume /data --config.exposedports 9360/tcp --config.stopsignal SIGTERM \
        --config.label "version=$version" --config.label type=device-integration --config.label 'requirements=core >= 1.1' \
        --config.label "permissions=$(json '{"ExposedPorts": {"9360/tcp": {}}, "HostConfig": {"NetworkMode": "host",
            "Binds": ["/usr/blueos/extensions/sonard:/data"]}}')" \
        --config.label "authors=$(json "[{\"name\": \"$author\", \"email\": \"$email\"}]")" \
        --config.label "company=$(json "{\"name\": \"sonard\", \"about\": \"Obstacles and free water from the sonar\", \"email\": \"$email\"}")" \
        --config.label "links=$(json "{\"website\": \"$HOMEPAGE\", \"source\": \"$VCS_BROWSER\", \"support\": \"$SUPPORT\"}")" \
        --config.label "readme=$README" --config.label "tags=$(json '["sonar", "navigation", "obstacle-avoidance"]')" \
        --no-history
}

# docker load of any age wants a list of its own beside the OCI layout.
pack() { # LAYOUT, ARCHIVE
    python3 - "$1" "sonard-blueos:$version" << 'EOF'
import hashlib, json, os, sys
layout, name = sys.argv[1:]
blob = lambda digest: os.path.join(layout, "blobs", *digest.split(":"))
def keep(value):
    data = json.dumps(value, separators=(",", ":")).encode()
    digest = "sha256:" + hashlib.sha256(data).hexdigest()
    with open(blob(digest), "wb") as f:
        f.write(data)
    return digest, len(data)
def read(path):
    with open(path, encoding="utf-8") as f:
        return json.load(f)
index = read(os.path.join(layout, "index.json"))
entry = index["manifests"][0]
manifest = read(blob(entry["digest"]))
config = read(blob(manifest["config"]["digest"]))
if config["architecture"] == "arm": # Debian's armhf is ARMv7
    config["variant"] = "v7"
entry["platform"] = {"os": "linux", **{k: config[k] for k in ("architecture", "variant") if k in config}}
manifest["config"]["digest"], manifest["config"]["size"] = keep(config)
entry["digest"], entry["size"] = keep(manifest)
used = {entry["digest"], manifest["config"]["digest"], *(l["digest"] for l in manifest["layers"])}
for file in os.listdir(os.path.join(layout, "blobs", "sha256")):
    if "sha256:" + file not in used:
        os.unlink(os.path.join(layout, "blobs", "sha256", file))
with open(os.path.join(layout, "index.json"), "w", encoding="utf-8") as f:
    json.dump(index, f)
with open(os.path.join(layout, "manifest.json"), "w", encoding="utf-8") as f:
    json.dump([{"Config": os.path.relpath(blob(manifest["config"]["digest"]), layout), "RepoTags": [name],
                "Layers": [os.path.relpath(blob(l["digest"]), layout) for l in manifest["layers"]]}], f)
EOF
    tar_same -cf "$2" -C "$1" .
}

# The same bytes whenever it is made of the same commit.
tar_same() { tar --sort=name --mtime="@$date" --owner=0 --group=0 --numeric-owner --format=gnu "$@"; }

make_image() { # ARCH
    local work=$build/blueos/$1.work archive=$build/blueos/sonard-blueos-$version-$1.tar
    rm -rf "$work"
    mkdir "$work"
    say "$1: root file system"
    fill "$1" "$work/root"
    tar_same -cf "$work/layer.tar" -C "$work/root" .
    umoci init --layout "$work/image"
    umoci new --image "$work/image:$version"
    umoci config --image "$work/image:$version" --architecture "$(platform "$1")" --os linux --no-history
    umoci raw add-layer --image "$work/image:$version" --no-history "$work/layer.tar"
    label "$work/image"
    pack "$work/image" "$archive"
    say "$archive: $(($(stat -c %s "$archive") / 1000000)) MB, unpacked $(($(stat -c %s "$work/layer.tar") / 1000000)) MB"
    rm -rf "$work"
}

[ $# -gt 0 ] || set -- amd64 arm64 armhf
for arch; do
    [ -n "$(triplet "$arch")" ] || { echo "build.sh: $arch: expected amd64, arm64 or armhf" >&2; exit 2; }
done
for arch; do
    make_image "$arch"
done
