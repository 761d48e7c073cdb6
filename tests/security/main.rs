//! Keys, calls, examinations and strangers, from outside: the binary on real sockets.

#![allow(
    clippy::disallowed_methods,
    reason = "what is waited for has a deadline on the real clock"
)]

mod clocks;
mod crowd;
mod deployment;
mod duplicates;
mod keys;
mod lost_answers;
mod members;
#[allow(dead_code, reason = "each test uses its part")]
#[path = "../shared/mod.rs"]
mod shared;
mod spares;
mod strangers;
mod systemd;

use serde_json::Value;

use shared::deployed::{Running, addressed_cell, text};
use shared::{DEADLINE, answer, empty_folder, one_at_a_time, some_at_a_time, understudy};

fn codes(document: &Value) -> Vec<&str> {
    let failures = document["failures"].as_array().expect("a list");
    failures.iter().filter_map(|failure| failure["code"].as_str()).collect()
}
