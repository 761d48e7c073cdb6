#!/bin/sh
# Static binaries of `understudy` and `understudy-opcua` for Linux on x86-64 and aarch64, each with its bill of materials and its checksum.
#
#   deployment/release.sh [DIRECTORY] [TARGET...]
#
# Without targets both are built. The C parts (ring) need a C compiler for musl: Zig (`pip install ziglang`) has it for both,
# musl-gcc (Debian: musl-tools) for this machine's own. Rust brings the linker and the C library: Zig's own has an allocator on which a
# thread waits by spinning, and one in real time then waits for ever for one that is not.
set -eu
cd "$(dirname "$0")/.."

out=${1:-release}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- x86_64-unknown-linux-musl aarch64-unknown-linux-musl

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
target_directory=${CARGO_TARGET_DIR:-target}
mkdir -p "$out"

# Compilers under the names that a build asks for, and what musl has in its C library and others beside it.
prepare() {
    tools=$(mkdir -p "$target_directory/release-tools/$1" && cd "$target_directory/release-tools/$1" && pwd)
    if python3 -m ziglang version > /dev/null 2>&1; then
        # Zig knows the target by a name of its own.
        cat > "$tools/cc" << END
#!/bin/sh
for argument; do
    shift
    case \$argument in --target=*) ;; *) set -- "\$@" "\$argument" ;; esac
done
exec python3 -m ziglang cc -target ${1%%-*}-linux-musl -fno-sanitize=all "\$@"
END
        printf '#!/bin/sh\nexec python3 -m ziglang ar "$@"\n' > "$tools/ar"
    elif [ "$1" = "$(uname -m)-unknown-linux-musl" ] && command -v musl-gcc > /dev/null; then
        printf '#!/bin/sh\nexec musl-gcc "$@"\n' > "$tools/cc"
        printf '#!/bin/sh\nexec ar "$@"\n' > "$tools/ar"
    else
        echo "no C compiler for $1: pip install ziglang, or apt install musl-tools for this machine" >&2
        return 1
    fi
    chmod +x "$tools/cc" "$tools/ar"
    printf '!<arch>\n' > "$tools/libdl.a"
}

build() {
    prepare "$1"
    name=$(echo "$1" | tr - _)
    upper=$(echo "$name" | tr '[:lower:]' '[:upper:]')
    env "CC_$name=$tools/cc" "AR_$name=$tools/ar" \
        "CARGO_TARGET_${upper}_LINKER=rust-lld" "CARGO_TARGET_${upper}_RUSTFLAGS=-L native=$tools" \
        cargo build --locked --release --target "$1" \
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
