//! `understudy retained`: what members have kept for the time after a power failure.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;
use understudy_bus::{FoundFile, RetainedFiles};
use understudy_cluster::{Cluster, Code, Overrides, read_kept};
use understudy_member::{last_state, station_files};
use understudy_typed::{Fate, Program};
use understudy_wire::{Member, ProgramId, RetainedRun};

use crate::answer::{Answer, Status};
use crate::files;

/// Show what members have kept for the time after a power failure
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy retained show /var/lib/understudy/retained
  understudy retained show runs/latest/retained --for cell/cluster.toml

With --for, it shows what the changed program of that cluster takes over at its next start, before anything is stopped: kept, converted, new and dropped
values.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Show the retentive values in files of members
    #[command(
        after_help = "Example:\n  understudy retained show /var/lib/understudy/retained --for cell/cluster.toml"
    )]
    Show {
        /// Folders of --retain, or .retained files in them
        #[arg(value_name = "PATH", required = true)]
        paths: Vec<PathBuf>,
        /// Show what the programs of this cluster take over
        #[arg(long = "for", value_name = "CLUSTER.toml")]
        cluster: Option<PathBuf>,
    },
}

/// What one member has kept of one program.
#[derive(Serialize)]
struct Kept {
    /// Name of the files, without their endings.
    name: String,
    /// Cycle of the state, or of the newest applied output; null without a record.
    cycle: Option<u64>,
    /// Hash of the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    program: Option<String>,
    /// Retentive values of a station.
    values: Vec<KeptValue>,
    /// What cannot be read or taken over.
    problems: Vec<String>,
}

#[derive(Serialize)]
struct KeptValue {
    path: String,
    /// `kept`, `converted`, `new` or `dropped`; only with `--for`.
    #[serde(skip_serializing_if = "Option::is_none")]
    fate: Option<&'static str>,
    /// Type in the program that was kept.
    before: Option<String>,
    /// Type in the program of the cluster.
    #[serde(skip_serializing_if = "Option::is_none")]
    now: Option<String>,
    /// The kept values, or the initial ones of a new path.
    #[serde(flatten)]
    values: Values,
}

/// Parts of a value that are shown, at most.
const MOST_PARTS: usize = 1000;

/// Values of a path.
#[derive(Serialize)]
struct Values {
    /// That of a path without parts; null otherwise.
    value: Option<String>,
    /// Those of its parts, the first of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parts: Vec<PartValue>,
    /// Whether there are more parts.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    more: bool,
}

#[derive(Serialize)]
struct PartValue {
    path: String,
    value: String,
}

impl Values {
    fn of(program: &Program, path: &str, state: &[u64]) -> Self {
        let Some(part) = program.part(path) else {
            return Self { value: None, parts: Vec::new(), more: false };
        };
        if let value @ Some(_) = part.text(state) {
            return Self { value, parts: Vec::new(), more: false };
        }
        let leaves = program.leaves(part, MOST_PARTS + 1);
        let more = leaves.len() > MOST_PARTS;
        let leaves = leaves.into_iter().take(MOST_PARTS);
        let parts = leaves.filter_map(|part| {
            let value = part.text(state)?;
            Some(PartValue { path: part.name, value })
        });
        Self { value: None, parts: parts.collect(), more }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let What::Show { paths, cluster } = &arguments.what;
    let (cluster, reports) = match cluster {
        Some(path) => {
            let (cluster, reports) = files::cluster(path, Overrides::default())?;
            (Some(cluster), reports)
        }
        None => (None, Vec::new()),
    };
    let mut kept = Vec::new();
    let mut answer = Answer::done("", serde_json::Value::Null);
    for path in paths {
        match RetainedFiles::at(path) {
            Ok(pairs) if pairs.is_empty() => {
                let message = format!("{}: no member has kept anything here", path.display());
                answer = answer.and_failure(Status::BadInput, "U0626", message);
            }
            Ok(pairs) => kept.extend(pairs.iter().map(|files| Kept::of(files, cluster.as_ref()))),
            Err(error) => {
                let message = format!("{}: {error}", path.display());
                answer = answer.and_failure(Status::BadInput, "U0601", message);
            }
        }
    }
    let text: Vec<String> = kept.iter().map(Kept::text).collect();
    answer.text = text.join("\n");
    answer.result = serde_json::json!({ "members": kept });
    Ok(answer.with_used(reports))
}

impl Kept {
    fn of(files: &RetainedFiles, cluster: Option<&Cluster>) -> Self {
        let (runs, found) = files.runs(None);
        let notes = files.notes(None);
        let found = if runs.is_empty() { &notes.files } else { &found };
        let problems = found.iter().filter_map(|FoundFile { path, problem }| {
            Some(format!("{}: {}", path.display(), problem.as_ref()?))
        });
        let mut kept = Self {
            name: files.name().to_owned(),
            cycle: notes.newest.as_ref().and_then(|note| Some(note.applied()?.cycle.0)),
            program: None,
            values: Vec::new(),
            problems: problems.collect(),
        };
        if let Some(run) = runs.iter().max_by_key(|run| run.state.number) {
            kept.cycle = Some(run.stepped().cycle.0);
            kept.program = Some(format!("{:016x}", run.state.hash.0));
            if let Err(problem) = kept.read(files, run, cluster) {
                kept.problems.push(problem);
            }
        }
        kept
    }

    /// Reads the values of a state.
    fn read(
        &mut self,
        files: &RetainedFiles,
        run: &RetainedRun,
        cluster: Option<&Cluster>,
    ) -> Result<(), String> {
        let path = files.program_path(run.state.hash).display().to_string();
        let of_path = |reason: String| format!("{path}: {reason}");
        let program = files.program(run.state.hash).map_err(of_path)?;
        let before = read_kept(&program).ok_or_else(|| {
            of_path("this release reads another program from its text".to_owned())
        })?;
        let state = last_state(&before, run)
            .ok_or_else(|| of_path("its program has another state".to_owned()))?;
        let typed_state = before.typed_state(state.words());
        let Some(cluster) = cluster else {
            let names = before.typed().retentive_names();
            self.values.extend(names.into_iter().map(|path| KeptValue {
                fate: None,
                before: before.typed().part(&path).map(|it| before.typed().type_name(&it.of)),
                now: None,
                values: Values::of(before.typed(), &path, &typed_state),
                path,
            }));
            return Ok(());
        };
        let code = code_of(cluster, files.name())
            .ok_or_else(|| format!("no station of the cluster has the files {}", files.name()))?;
        let carried = code.carried(&before, state.words());
        let initial = code.typed().initial_state();
        self.values.extend(carried.paths.into_iter().map(|path| KeptValue {
            fate: Some(path.fate.name()),
            values: match path.fate {
                Fate::New => Values::of(code.typed(), &path.path, &initial),
                _ => Values::of(before.typed(), &path.path, &typed_state),
            },
            before: path.before,
            now: path.now,
            path: path.path,
        }));
        Ok(())
    }

    fn text(&self) -> String {
        let mut text = match (self.cycle, &self.program) {
            (Some(cycle), Some(_)) => format!("{}  state of cycle {cycle}\n", self.name),
            (Some(cycle), None) => {
                format!("{}  the newest applied output is of cycle {cycle}\n", self.name)
            }
            (None, _) => format!("{}  no record\n", self.name),
        };
        let width = self.values.iter().map(|value| value.path.len()).max().unwrap_or(0);
        for KeptValue { path, fate, before, now, values: Values { value, parts, more } } in
            &self.values
        {
            let fate = fate.map_or(String::new(), |fate| format!("{fate:9}  "));
            let of = match (before, now) {
                (Some(before), Some(now)) if before != now => format!("{before} → {now}"),
                (Some(of), _) | (None, Some(of)) => of.clone(),
                (None, None) => String::new(),
            };
            let value = value.as_ref().map_or(String::new(), |value| format!("  {value}"));
            let line = format!("  {fate}{path:width$}  {of}{value}");
            writeln!(text, "{}", line.trim_end()).expect("a string takes everything");
            for PartValue { path, value } in parts {
                writeln!(text, "    {path}  {value}").expect("a string takes everything");
            }
            if *more {
                writeln!(text, "    …").expect("a string takes everything");
            }
        }
        let dropped = self.values.iter().filter(|value| value.fate == Some("dropped")).count();
        if dropped > 0 {
            let what = if dropped == 1 { "1 value is" } else { &format!("{dropped} values are") };
            writeln!(
                text,
                "  {what} dropped: the operator is asked before the program starts warm"
            )
            .expect("a string takes everything");
        }
        for problem in &self.problems {
            writeln!(text, "  {problem}").expect("a string takes everything");
        }
        text
    }
}

/// The program whose files have this name, of a station or a spare that runs it.
fn code_of<'c>(cluster: &'c Cluster, name: &str) -> Option<&'c Code> {
    let stations = cluster.members().filter(|member| matches!(member, Member::Station(_)));
    let stations: Vec<&str> = stations.filter_map(|member| cluster.member_name(member)).collect();
    (0u8..).map(ProgramId).zip(cluster.controllers()).find_map(|(program, controller)| {
        let has_name = |station: &&&str| {
            station_files(cluster, Path::new(""), station, program).name() == name
        };
        stations.iter().find(has_name).map(|_| &controller.code)
    })
}
