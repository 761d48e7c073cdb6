#!/bin/sh
# A target led by its coverage, with libFuzzer: `fuzz/guided.sh TARGET SECONDS FOLDER [SEED...]`, from the root of the project.
# TARGET as `cargo test -p understudy-fuzz` names it; FOLDER keeps what was found, and begins with the seeds. It needs a C++ compiler and no nightly
# Rust. The first build takes as long as one of everything.
set -e
target=$1 seconds=$2 folder=$3
shift 3
mkdir -p "$folder"
for seed in "$@"; do cp "$seed" "$folder/"; done
# An absolute place: the target runs in `fuzz/`.
folder=$(cd "$folder" && pwd)

coverage="-Cpasses=sancov-module -Ccodegen-units=1 -Clink-dead-code"
for part in level=4 inline-8bit-counters pc-table trace-compares; do
    coverage="$coverage -Cllvm-args=-sanitizer-coverage-$part"
done
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-target/guided}"
export RUSTFLAGS="--cfg fuzzing --cfg fuzzing_libfuzzer $coverage"
export BOLERO_LIBFUZZER_ARGS="$folder -max_total_time=$seconds -timeout=60 -rss_limit_mb=4000 -max_len=20000 -artifact_prefix=$folder/broken-"
exec cargo test -p understudy-fuzz --test targets --target "$(rustc -vV | sed -n 's/^host: //p')" -- --exact "$target" --nocapture
