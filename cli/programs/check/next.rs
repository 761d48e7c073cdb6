//! Next steps after a successful check.

use std::ffi::OsStr;
use std::path::Path;

use crate::answer::Answer;
use crate::kind::Kind;

/// A command with more files is not shown.
const READABLE: usize = 8;

pub(super) fn after_check(answer: Answer, given: &[(Kind, &Path)]) -> Answer {
    let all = |wanted| given.iter().filter(move |(kind, _)| *kind == wanted);
    let first = |wanted| all(wanted).map(|(_, path)| *path).next();
    let ladders: Vec<&Path> = all(Kind::Program).map(|(_, path)| *path).collect();
    match (first(Kind::Cluster), first(Kind::Scenario)) {
        (Some(cluster), Some(scenario)) => answer
            .and_next(&[&"simulate", &cluster, &"--scenario", &scenario])
            .and_next(&[&"lab", &cluster, &"--scenario", &scenario]),
        (Some(cluster), None) => {
            answer.and_next(&[&"simulate", &cluster]).and_next(&[&"lab", &cluster])
        }
        (None, Some(scenario)) => {
            let cluster = scenario.with_file_name("cluster.toml");
            if cluster.exists() {
                answer.and_next(&[&"simulate", &cluster, &"--scenario", &scenario])
            } else {
                answer
            }
        }
        (None, None) if !ladders.is_empty() => {
            let answer = answer.and_next(&[&"verify", &ladders[0]]);
            if ladders.len() > READABLE {
                return answer;
            }
            let mut from: Vec<&dyn AsRef<OsStr>> = vec![&"init", &"cell", &"--from"];
            from.extend(ladders.iter().map(|path| path as &dyn AsRef<OsStr>));
            answer.and_next(&from)
        }
        (None, None) => {
            let command = |kind| match kind {
                Kind::Model => Some("synth"),
                Kind::Project => Some("reconfigure"),
                _ => None,
            };
            let mut known = given.iter();
            match known.find_map(|(kind, path)| Some((command(*kind)?, path))) {
                Some((command, path)) => answer.and_next(&[&command, path]),
                None => answer,
            }
        }
    }
}
