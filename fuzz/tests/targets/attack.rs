//! Changed files into a reader.

use std::fs;
use std::panic::{AssertUnwindSafe, RefUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Tries of a target where no time is asked for.
const TRIES: usize = 300;

/// No input is longer.
const MAXIMUM_BYTES: usize = 64 * 1024;

/// One change of a file: what, where, and two numbers for it.
type Change = (u8, u32, u16, u16);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files in `folder` of this crate, in the order of their names; none where there is no such folder.
fn files(folder: &Path) -> Vec<Vec<u8>> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths.iter().filter_map(|path| fs::read(path).ok()).collect()
}

/// Replays, reads and changes; `seeds` are files of the project, relative to its root. Where libFuzzer leads, it does all of that.
pub(crate) fn attack(target: &str, seeds: &[&str], read: impl Fn(&[u8]) + RefUnwindSafe) {
    if std::env::var_os("BOLERO_LIBFUZZER_ARGS").is_some() {
        bolero::check!().for_each(|bytes: &[u8]| read(bytes));
        return;
    }
    for regression in files(&root().join("regressions").join(target)) {
        read(&regression);
    }
    let mut corpus = files(&root().join("corpus").join(target));
    for seed in seeds {
        let path = root().join("..").join(seed);
        corpus.push(fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())));
    }
    corpus.push(Vec::new());
    for seed in &mut corpus {
        seed.truncate(MAXIMUM_BYTES);
        read(seed);
    }
    let time = std::env::var("FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let run = bolero::check!().with_type::<(u16, Vec<Change>, Vec<u8>)>();
    let run = match time {
        Some(seconds) => {
            run.with_iterations(usize::MAX).with_test_time(Duration::from_secs(seconds))
        }
        None => run.with_iterations(TRIES).with_test_time(Duration::from_secs(600)),
    };
    run.for_each(|(seed, changes, bytes)| {
        let mut input = corpus[usize::from(*seed) % corpus.len()].clone();
        for change in changes.iter().take(24) {
            apply(&mut input, *change, bytes, &corpus);
        }
        input.truncate(MAXIMUM_BYTES);
        // What breaks a reader is kept, so that it can be replayed.
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| read(&input))) {
            let path = std::env::temp_dir().join(format!("understudy-fuzz-{target}"));
            let _ = fs::write(&path, &input);
            eprintln!("this input breaks `{target}`: {}", path.display());
            resume_unwind(panic);
        }
    });
}

fn apply(input: &mut Vec<u8>, (what, at, first, second): Change, bytes: &[u8], corpus: &[Vec<u8>]) {
    let at = at as usize % (input.len() + 1);
    let end = (at + usize::from(first) % 64).min(input.len());
    match what % 9 {
        0 => drop(input.drain(at..end)),
        1 => {
            let piece = input[at..end].to_vec();
            let place = usize::from(second) % (input.len() + 1);
            input.splice(place..place, piece);
        }
        2 => {
            if let Some(byte) = input.get_mut(at) {
                *byte ^= 1 << (first % 8);
            }
        }
        3 => drop(input.splice(at..at, bytes.iter().copied().take(64))),
        4 => input.truncate(at),
        5 => {
            const WORDS: [&str; 16] = [
                "\"",
                "[",
                "]",
                "{",
                "}",
                "(",
                ")",
                "=",
                "-1",
                "99999999999999999999",
                "1e308",
                "\0",
                "\u{e9}",
                "\n",
                ".",
                "''",
            ];
            let word = WORDS[usize::from(second) % WORDS.len()];
            input.splice(at..at, word.bytes());
        }
        6 => {
            let other = &corpus[usize::from(second) % corpus.len()];
            let from = usize::from(first) % (other.len() + 1);
            let to = (from + 200).min(other.len());
            input.splice(at..at, other[from..to].iter().copied());
        }
        7 => {
            // A line again.
            let start =
                input[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |place| place + 1);
            let stop = input[at..]
                .iter()
                .position(|byte| *byte == b'\n')
                .map_or(input.len(), |place| at + place + 1);
            let line = input[start..stop].to_vec();
            input.splice(start..start, line);
        }
        _ => {
            if let Some(byte) = input.get_mut(at) {
                *byte = second as u8;
            }
        }
    }
}
