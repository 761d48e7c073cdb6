//! The `understudy-runtime` command: members of clusters, for plant machines.

use std::process::ExitCode;

fn main() -> ExitCode {
    understudy::runtime()
}
