//! Recognises the kind of a file, to report a file of the wrong kind as such.

use std::path::Path;

use understudy_cluster::looks_like_a_plant_file;
use understudy_interchange::Format;
use understudy_reconfiguration::project::looks_like_a_project;
use understudy_scenarios::looks_like_a_scenario;
use understudy_supervisor::FileKind;

use crate::answer::{Answer, Status};

/// Kind of an input file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Cluster,
    Plant,
    Scenario,
    Project,
    Model,
    Net,
    Map,
    Ads,
    /// A module of Supremica.
    Module,
    /// A generator of libFAUDES.
    Generator,
    Program,
    /// Neither the name nor the content determines the kind.
    Unknown,
}

impl Kind {
    /// Determines the kind by file extension, for TOML by characteristic keys, for programs by their first lines. Other TOML is
    /// considered a cluster file.
    pub(crate) fn of(path: &Path, text: &str) -> Self {
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let of_automata = [("ads", Self::Ads), ("wmod", Self::Module), ("gen", Self::Generator)];
        if let Some((_, kind)) = of_automata.into_iter().find(|(known, _)| ending == *known) {
            return kind;
        }
        if ending != "toml" {
            return match Format::of(&path.to_string_lossy(), text) {
                Some(_) => Self::Program,
                None => Self::Unknown,
            };
        }
        match FileKind::of(text) {
            Some(FileKind::Net) => Self::Net,
            Some(FileKind::SignalMap) => Self::Map,
            Some(FileKind::Model) => Self::Model,
            None if looks_like_a_scenario(text) => Self::Scenario,
            None if looks_like_a_project(text) => Self::Project,
            None if looks_like_a_plant_file(text) => Self::Plant,
            None => Self::Cluster,
        }
    }

    /// Name in the answers of `check`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Cluster => "cluster",
            Self::Plant => "plant",
            Self::Scenario => "scenario",
            Self::Project => "project",
            Self::Model => "model",
            Self::Net => "net",
            Self::Map => "map",
            Self::Ads => "ADS",
            Self::Module => "module",
            Self::Generator => "generator",
            Self::Program => "program",
            Self::Unknown => "unknown",
        }
    }

    fn in_a_sentence(self) -> &'static str {
        match self {
            Self::Cluster => "a cluster file",
            Self::Plant => "a plant file",
            Self::Scenario => "a scenario",
            Self::Project => "a reconfiguration project",
            Self::Model => "a model of plants and specifications",
            Self::Net => "a Petri net",
            Self::Map => "a signal map",
            Self::Ads => "a TCT automaton",
            Self::Module => "a module of Supremica",
            Self::Generator => "a generator of libFAUDES",
            Self::Program => "a program",
            Self::Unknown => "a file of unknown format",
        }
    }
}

/// Fails if a file is not of the `wanted` kind. Unrecognised files pass; their reader reports the errors.
pub(crate) fn expect(wanted: Kind, path: &Path, text: &str) -> Result<(), Answer> {
    let found = Kind::of(path, text);
    let is_sure = match found {
        Kind::Cluster => text.lines().any(|line| line.trim() == "[cluster]"),
        Kind::Unknown => false,
        _ => true,
    };
    if found == wanted || !is_sure {
        return Ok(());
    }
    let way_out = match (wanted, found) {
        (Kind::Cluster, Kind::Scenario) => {
            "give a scenario to `lab` and `simulate` by --scenario, after the cluster file"
        }
        (Kind::Cluster, Kind::Program) => {
            "a cluster file names programs by `ladder = \"FILE\"`; `understudy init` writes a first one"
        }
        (Kind::Program, Kind::Cluster) => "name one of its programs",
        (Kind::Cluster, _) => "`understudy init` writes a first one",
        _ => "`understudy check` reports the kind of a file and its errors",
    };
    let message = format!(
        "{} is {}; expected {}: {way_out}",
        path.display(),
        found.in_a_sentence(),
        wanted.in_a_sentence()
    );
    Err(Answer::failed(Status::BadInput, "U0616", message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_the_wrong_place_is_told_by_what_it_is() {
        let check = |wanted, path: &str, text: &str, passes: bool| {
            let said = expect(wanted, Path::new(path), text);
            assert_eq!(said.is_ok(), passes, "{path}");
        };
        let cluster = "[cluster]\nname = \"cell\"\n";
        let scenario = "title = \"one\"\ncycles = 10\n";
        check(Kind::Cluster, "a.toml", cluster, true);
        check(Kind::Cluster, "a.toml", scenario, false);
        check(Kind::Cluster, "a.ladder", "program a\n", false);
        check(Kind::Cluster, "SUPER.ADS", "SUPER\n", false);
        check(Kind::Cluster, "cluster.txt", cluster, true);
        check(Kind::Cluster, "empty.toml", "", true);
        check(Kind::Cluster, "a.scl", "", false);
        check(Kind::Cluster, "a.txt", "program a\n", false);
        check(Kind::Program, "a.clp", "_FILES_CLASSICLADDER\n", true);
        check(Kind::Scenario, "a.toml", scenario, true);
        check(Kind::Scenario, "a.toml", cluster, false);
        check(Kind::Scenario, "empty.toml", "", true);
    }
}
