#!/bin/sh
# Makes all release packages from one commit, for Linux on x86-64 and aarch64. Publishes nothing and needs no root.
#
#   deployment/release.sh [DIRECTORY] [TARGET...]
#
# For each target: static binaries of `understudy`, `understudy-runtime` and `understudy-opcua` with their bills of materials,
# a Python wheel, a Debian package and a container image. For all targets: the cell of compose.yaml, and SHA256SUMS. The default is both
# targets. docs/how-to/install.md describes the packages.
#
# The C parts (ring) need a C compiler for musl: Zig (`pip install ziglang`) for both targets, or musl-gcc (Debian:
# musl-tools) for the target of this machine. The linker and the C library are those of Rust. The allocator of Zig's C
# library uses spin locks, on which a real-time thread can wait indefinitely for a thread of lower priority.
set -eu
cd "$(dirname "$0")/.."
umask 022

out=${1:-release}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- x86_64-unknown-linux-musl aarch64-unknown-linux-musl

version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
mkdir -p "${CARGO_TARGET_DIR:-target}"
target_directory=$(cd "${CARGO_TARGET_DIR:-target}" && pwd)
# Packages are made here and moved to the release directory when all of them are complete.
work=$target_directory/release-packages
# The same commit gives the same bytes on every machine.
remapped="--remap-path-prefix=$PWD=. --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"

refuse() {
    echo "release.sh: $*" >&2
    exit 1
}

# Makes compilers under the names that the build requires, and an empty libdl, which is part of the C library in musl.
prepare() {
    tools=$target_directory/release-tools/$1
    mkdir -p "$tools"
    if python3 -m ziglang version > /dev/null 2>&1; then
        # Zig has another name for the target.
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
        refuse "no C compiler for $1: pip install ziglang, or apt install musl-tools for this machine"
    fi
    chmod +x "$tools/cc" "$tools/ar"
    printf '!<arch>\n' > "$tools/libdl.a"
    [ -d "$(rustc --print target-libdir --target "$1")" ] || rustup target add "$1"
}

build() {
    target=$1
    tools=$target_directory/release-tools/$1
    name=$(echo "$1" | tr - _)
    upper=$(echo "$name" | tr '[:lower:]' '[:upper:]')
    cargo_build() {
        env "CC_$name=$tools/cc" "AR_$name=$tools/ar" \
            "CARGO_TARGET_${upper}_LINKER=rust-lld" "CARGO_TARGET_${upper}_RUSTFLAGS=-L native=$tools $remapped" \
            cargo build --locked --target "$target" "$@"
    }
    cargo_build --release -p understudy -p understudy-opcua-gateway --bin understudy --bin understudy-opcua
    cargo_build --profile runtime --bin understudy-runtime
    for built in release/understudy runtime/understudy-runtime release/understudy-opcua; do
        binary=${built#*/}
        case $binary in understudy-opcua) package=understudy-opcua-gateway ;; *) package=understudy ;; esac
        name="$work/$binary-$version-$1"
        cp "$target_directory/$1/$built" "$name"
        python3 deployment/bill_of_materials.py "$1" "$package" > "$name.cdx.json"
        # A static binary has no interpreter.
        if readelf --program-headers "$name" | grep -q INTERP; then
            refuse "$name is not static"
        fi
    done
}

# The manual page and the completions, from the first binary that this machine can run.
describe() {
    for binary in "$work/understudy-$version"-*-musl; do
        if "$binary" man > "$texts/understudy.1" 2> /dev/null; then
            "$binary" completions bash > "$texts/understudy"
            "$binary" completions zsh > "$texts/_understudy"
            gzip --best --no-name "$texts/understudy.1"
            return
        fi
    done
    refuse "none of the targets runs on this machine, and the Debian package needs the manual page: name the target of this machine too"
}

debian_package() {
    tree=$(mktemp -d)
    install -D -m 755 "$work/understudy-$version-$1" "$tree/usr/bin/understudy"
    install -m 755 "$work/understudy-runtime-$version-$1" "$tree/usr/bin/understudy-runtime"
    install -m 755 "$work/understudy-opcua-$version-$1" "$tree/usr/bin/understudy-opcua"
    install -d "$tree/usr/lib/systemd/system" "$tree/etc/understudy" "$tree/DEBIAN"
    for unit in deployment/*.service; do
        sed 's|/usr/local/bin/|/usr/bin/|' "$unit" > "$tree/usr/lib/systemd/system/${unit##*/}"
    done
    install -D -m 644 deployment/understudy-journal.logrotate "$tree/etc/logrotate.d/understudy"
    echo /etc/logrotate.d/understudy > "$tree/DEBIAN/conffiles"
    install -D -m 644 "$texts/understudy.1.gz" "$tree/usr/share/man/man1/understudy.1.gz"
    install -D -m 644 "$texts/understudy" "$tree/usr/share/bash-completion/completions/understudy"
    install -D -m 644 "$texts/_understudy" "$tree/usr/share/zsh/vendor-completions/_understudy"
    install -D -m 644 LICENSE-MIT "$tree/usr/share/doc/understudy/copyright"
    install -m 644 LICENSE-APACHE "$work"/understudy*-"$version-$1.cdx.json" "$tree/usr/share/doc/understudy"
    size=$(find "$tree" -type f -printf '%s\n' | awk '{ bytes += $1 } END { print int(bytes / 1024) }')
    sed "s/@version@/$version/; s/@architecture@/$2/; s/@size@/$size/" deployment/deb/control > "$tree/DEBIAN/control"
    install -m 755 deployment/deb/postinst deployment/deb/prerm deployment/deb/postrm "$tree/DEBIAN"
    chmod 755 "$tree"
    # The number of threads changes the compressed bytes.
    DPKG_DEB_THREADS_MAX=1 dpkg-deb --root-owner-group --build "$tree" "$work/understudy_${version}_$2.deb" > /dev/null
    rm -rf "$tree"
}

# Makes the press cell with an address for each member, and its services.
cell() {
    folder=$(mktemp -d)
    cp examples/press-cell/*.ladder "$folder"
    awk '{ print } /^\[\[/ { print "address = \"127.0.0.1:" 7450 + members++ "\"" }' examples/press-cell/cluster.toml > "$folder/cluster.toml"
    sed "s/@version@/$version/" deployment/compose.yaml > "$folder/compose.yaml"
    tar --create --directory "$folder" --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=a+rX,u+w \
        --transform "s|^\.|understudy-cell-$version|" . | gzip --best --no-name > "$work/understudy-cell-$version.tar.gz"
    rm -rf "$folder"
}

missing=
for tool in git cargo rustc python3 readelf dpkg-deb gzip awk sha256sum; do
    command -v "$tool" > /dev/null || missing="$missing $tool"
done
[ -z "$missing" ] || refuse "not installed:$missing (Debian: git, cargo, rustc, python3, binutils, dpkg, gzip, mawk, coreutils)"
python3 -c 'import tomllib' 2> /dev/null || refuse "python3 is older than 3.11, and the bills of materials need its tomllib"
[ ! -e "$out" ] || refuse "$out exists: name another directory, or remove it"
[ -z "$(git status --porcelain)" ] || refuse "the tree differs from its commit (git status): commit first"
commit=$(git rev-parse HEAD)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

rm -rf "$work"
mkdir -p "$work"
for target in "$@"; do
    prepare "$target"
done
for target in "$@"; do
    build "$target"
done
texts=$(mktemp -d)
trap 'rm -rf "$texts"' EXIT
describe
for target in "$@"; do
    machine=${target%%-*}
    case $machine in x86_64) debian=amd64 ;; aarch64) debian=arm64 ;; *) refuse "no packages are known for $target" ;; esac
    command="understudy=$work/understudy-$version-$target"
    runtime="understudy-runtime=$work/understudy-runtime-$version-$target"
    opcua="understudy-opcua=$work/understudy-opcua-$version-$target"
    python3 deployment/wheel.py "$version" "$machine" "$work" "$command" "$opcua" "$work"/understudy*-"$version-$target.cdx.json"
    python3 deployment/image.py "$version" "$debian" "$commit" "$work/understudy-$version-$machine.oci.tar" "$command" "$runtime" "$opcua"
    debian_package "$target" "$debian"
done
cell
(cd "$work" && sha256sum -- * > SHA256SUMS)
mkdir -p "$(dirname "$out")"
mv "$work" "$out"
echo "$out, from commit $commit:"
ls "$out"
