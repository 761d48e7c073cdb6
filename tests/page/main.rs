//! The page of a run from outside: every path by HTTP, commands against a real laboratory, and a browser where there is one.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod attach;
mod browser;
mod commands;
mod demo;
mod elsewhere;
mod notify;
mod paths;
mod plant;
mod points;
mod present;
#[allow(dead_code, reason = "each test uses its part")]
#[path = "../shared/mod.rs"]
mod shared;

use std::fs;
use std::path::{Path, PathBuf};

use shared::page::{Page, member};
use shared::{answer, empty_folder, one_at_a_time, understudy};

/// A simulated run in which the robot's station is killed in cycle 50 and started again in cycle 150: its directory.
fn simulated_run(folder: &Path) -> PathBuf {
    simulated_run_of(
        folder,
        "title = \"kill and restart\"\ncycles = 300\n\n[[step]]\nat = 50\naction = \"crash\"\nstation = \"robot\"\n\n[[step]]\nat = 150\naction = \"restart\"\nstation = \"robot\"\n",
    )
}

/// The directory of a simulated run of the press cell.
fn simulated_run_of(folder: &Path, text: &str) -> PathBuf {
    let scenario = folder.join("scenario.toml");
    fs::write(&scenario, text).expect("written");
    let runs = folder.join("runs");
    let text = |path: &Path| path.to_str().expect("text").to_owned();
    let (scenario, out) = (text(&scenario), text(&runs));
    let simulate = ["simulate", "examples/press-cell/cluster.toml"];
    let more = ["--seed", "7", "--scenario", &scenario, "--out", &out];
    let (_, _, said) = answer(&[&simulate[..], &more].concat());
    assert!(runs.join("latest").exists(), "{said}");
    fs::canonicalize(runs.join("latest")).expect("a run")
}
