#!/bin/sh
# Static binaries of `understudy` and `understudy-opcua` for Linux on x86-64 and aarch64, each with its bill of materials and its checksum.
#
#   deployment/release.sh [DIRECTORY] [TARGET...]
#
# Without targets both are built. The C parts (ring, SQLite) need a C compiler for musl: either cargo-zigbuild with Zig
# (`pip install ziglang cargo-zigbuild`), which has both, or musl-gcc (Debian: musl-tools), which has that of this machine.
set -eu
cd "$(dirname "$0")/.."

out=${1:-release}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- x86_64-unknown-linux-musl aarch64-unknown-linux-musl

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
target_directory=${CARGO_TARGET_DIR:-target}
mkdir -p "$out"

build() {
    if command -v cargo-zigbuild > /dev/null; then
        how=zigbuild
    elif [ "$1" = "$(uname -m)-unknown-linux-musl" ] && command -v musl-gcc > /dev/null; then
        how=build
    else
        echo "no C compiler for $1: pip install ziglang cargo-zigbuild, or apt install musl-tools for this machine" >&2
        return 1
    fi
    cargo "$how" --locked --release --target "$1" \
        -p understudy -p understudy-opcua-gateway --bin understudy --bin understudy-opcua
}

for target in "$@"; do
    rustup target add "$target"
    build "$target"
    for package in understudy understudy-opcua-gateway; do
        binary=${package%-gateway}
        name="$binary-$version-$target"
        cp "$target_directory/$target/release/$binary" "$out/$name"
        python3 deployment/bill_of_materials.py "$target" "$package" > "$out/$name.cdx.json"
        (cd "$out" && sha256sum "$name" "$name.cdx.json" > "$name.sha256")
        # A static binary needs no interpreter.
        if readelf --program-headers "$out/$name" | grep -q INTERP; then
            echo "$name is not static" >&2
            exit 1
        fi
        echo "$out/$name"
    done
done
