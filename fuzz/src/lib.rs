//! Fuzz targets for everything that reads bytes from outside; they are the tests of this crate.
//!
//! Each target replays its regressions (`regressions/<target>/`), reads its corpus (`corpus/<target>/` and the files of the
//! project that are meant for it), and then changed ones: pieces doubled, removed, moved and replaced. A target
//! may refuse what it reads, and must not panic, hang or take much memory. `FUZZ_SECONDS=600 cargo test -p understudy-fuzz` takes ten
//! minutes for each target in place of a few hundred tries.
//!
//! `fuzz/guided.sh TARGET SECONDS FOLDER SEED...` leads a target by its coverage instead, with libFuzzer: it makes inputs from the seeds that
//! take ways through the reader which none took before. What is new in them goes to `corpus/`, what broke a reader to `regressions/`.
