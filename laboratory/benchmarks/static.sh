#!/bin/sh
# Builds understudy-bench as one file that runs on any machine with Linux on x86-64, and prints where it is:
#
#     laboratory/benchmarks/static.sh
#
# The serial port of a device names `cfsetspeed` by its version in the shared C library, which the static one does not have; no benchmark opens one.
set -e
cd "$(dirname "$0")/../.."
target=target/static
mkdir -p "$target"
printf '%s\n' 'int no_cfsetspeed(void) { return -1; }' '__asm__(".symver no_cfsetspeed,cfsetspeed@GLIBC_2.2.5");' \
    | cc -c -fPIE -x c - -o "$target/cfsetspeed.o"
RUSTFLAGS="-C target-feature=+crt-static" cargo rustc --release --package understudy-benchmarks --bin understudy-bench \
    --target x86_64-unknown-linux-gnu --target-dir "$target" -- -C strip=symbols -C link-arg="$PWD/$target/cfsetspeed.o"
ls -l "$target/x86_64-unknown-linux-gnu/release/understudy-bench"
