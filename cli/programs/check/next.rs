//! Next steps after a successful check.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::answer::{Answer, Status};
use crate::kind::Kind;
use crate::programs::init::from::{Known, can_draft};

/// A command with more files is not shown.
const READABLE: usize = 8;

/// The folder that is proposed for a new cluster.
const FOLDER: &str = "cell";

/// The files of a check.
pub(super) struct Files<'a> {
    /// All that were named.
    pub(super) given: &'a [(Kind, &'a Path)],
    /// What was read of those of one program.
    pub(super) known: &'a [Known<'a>],
    /// Those that are a program only together with other ones.
    pub(super) parts: &'a [PathBuf],
    /// Those without a program.
    pub(super) libraries: &'a [PathBuf],
}

/// `program` is the one that was chosen of a file with several.
pub(super) fn after_check(answer: Answer, program: Option<&str>, files: &Files<'_>) -> Answer {
    let Files { given, known, parts, libraries } = files;
    if answer.status != Status::Done {
        return answer;
    }
    let all = |wanted| given.iter().filter(move |(kind, _)| *kind == wanted);
    let first = |wanted| all(wanted).map(|(_, path)| *path).next();
    let programs = all(Kind::Program).map(|(_, path)| *path);
    let programs: Vec<&Path> =
        programs.filter(|path| !libraries.iter().any(|library| library == path)).collect();
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
        (None, None) if programs.iter().any(|path| parts.iter().any(|part| part == path)) => {
            with_draft(answer, &programs, known)
        }
        (None, None) if !programs.is_empty() => match program {
            Some(program) => answer.and_next(&[&"verify", &programs[0], &"--program", &program]),
            None => with_draft(answer.and_next(&[&"verify", &programs[0]]), &programs, known),
        },
        (None, None) => {
            let command = |kind| match kind {
                Kind::Model | Kind::Module => Some("synth"),
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

/// Adds the command that drafts a cluster of these programs, where it does so.
fn with_draft(answer: Answer, programs: &[&Path], known: &[Known<'_>]) -> Answer {
    let folder = Path::new(FOLDER);
    let files: Vec<PathBuf> = programs.iter().map(|path| path.to_path_buf()).collect();
    if files.len() > READABLE || folder.exists() || !can_draft(folder, &files, known) {
        return answer;
    }
    let mut from: Vec<&dyn AsRef<OsStr>> = vec![&"init", &FOLDER, &"--from"];
    from.extend(programs.iter().map(|path| path as &dyn AsRef<OsStr>));
    answer.and_next(&from)
}
