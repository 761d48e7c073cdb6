//! An online change between two cluster files: what it replaces, and why it needs a stop where it does.

mod common;
mod configurations;
mod differences;
mod error;
mod fallback;
mod later;
mod plan;
mod point_fates;
mod points;
mod settings;
mod unfit;

use std::collections::BTreeSet;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::{
    Agreement, Conversion, Fallback, FallbackChange, OnlineChange, Program, ProgramChange,
};
use understudy_typed::{Fault, Program as TypedProgram, Renamed, Successor};
use understudy_wire::{ChangeName, ConfigurationHash, ProgramHash, ProgramId, RetainedProgram};

pub use self::common::{CommonPoints, input_name_after, same_point};
pub use self::configurations::OnlineChanges;
use self::differences::{Difference, differences};
pub use self::error::ChangeError;
pub use self::fallback::{ChangedFallback, FallbackText};
pub use self::later::later_settings;
pub use self::plan::{ChangedInitial, changed_fallbacks, changed_initials, done_pairs, fates};
pub use self::point_fates::{ChangedPoint, PointFate, changed_points};
pub use self::points::{ChangedPoints, FixedPoints, change_with_points};
pub use self::settings::ChangedSetting;
pub use self::unfit::{PairReason, PointList, Unfit};
use crate::canonical::points_hash;
use crate::cluster::Cluster;
use crate::code::{Code, Way};
use crate::configuration::{fallback_text, filled};
use crate::source_text::read_kept;

/// What every member is given to prepare an online change: the programs and the settings of remote I/Os that change, before and after.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangeTexts {
    /// Hash of the cluster, as in frames.
    pub cluster: u64,
    /// The configuration before.
    pub before: ConfigurationHash,
    /// The configuration after.
    pub after: ConfigurationHash,
    /// The programs that change, each once, in the order of the cluster.
    pub programs: Vec<ChangedText>,
    /// What the remote I/Os do where nothing is proved, of each for which that changes, once, in the order of the cluster.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fallbacks: Vec<ChangedFallback>,
    /// The programs whose points change, each once, in the order of the cluster; their settings are in the sections.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<ChangedPoints>,
}

/// One program that changes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangedText {
    /// Which program.
    pub program: ProgramId,
    /// Its text before.
    pub before: ProgramText,
    /// Its text after.
    pub after: ProgramText,
}

/// The text of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProgramText {
    /// Hash of the program.
    pub hash: ProgramHash,
    /// The name of its file, whose ending tells the language.
    pub file: String,
    /// Period of the cluster in nanoseconds.
    pub period: u64,
    /// The text.
    pub text: String,
    /// Paths of the program before and the ones that they have in this one, as the cluster file pairs them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renamed: Vec<Renamed>,
}

/// A difference between two configurations that no online change can make.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NeedsStop {
    /// They are of two clusters.
    #[error("the two files are of different clusters, `{before}` and `{after}`")]
    OtherCluster {
        /// Name of the cluster before.
        before: String,
        /// Name of the cluster after.
        after: String,
    },
    /// A program cannot be replaced while it runs.
    #[error(transparent)]
    Unfit(#[from] Unfit),
    /// Something differs that no online change replaces.
    #[error("{0}")]
    Setting(ChangedSetting),
}

impl NeedsStop {
    /// The code of its page.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unfit(unfit) => unfit.code(),
            Self::OtherCluster { .. } | Self::Setting(_) => "U0630",
        }
    }
}

impl ChangeTexts {
    /// The change from one cluster file to another one.
    ///
    /// # Errors
    /// Why it needs a stop.
    pub fn between(before: &Cluster, after: &Cluster) -> Result<Self, Vec<NeedsStop>> {
        differences(before, after).map(|found| Self::of(before, after, found))
    }

    fn of(before: &Cluster, after: &Cluster, differences: Vec<Difference>) -> Self {
        let (mut programs, mut fallbacks, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for difference in differences {
            let Difference { program, is_replaced, points: moved, fallback } = difference;
            let [old, new] = [before, after].map(|cluster| &cluster.controllers[program.index()]);
            if is_replaced {
                programs.push(ChangedText {
                    program,
                    before: ProgramText::of(&old.code, old.hash),
                    after: ProgramText::of(&new.code, new.hash),
                });
            }
            match moved {
                // What its remote I/O does is in its section too.
                Some(_) => points.push(ChangedPoints::between(program, before, after)),
                None => fallbacks.extend(fallback),
            }
        }
        Self {
            cluster: before.agreement().cluster.0,
            before: before.agreement().configuration,
            after: after.agreement().configuration,
            programs,
            fallbacks,
            points,
        }
    }

    /// The two configurations.
    pub fn name(&self) -> ChangeName {
        ChangeName { before: self.before, after: self.after }
    }

    /// The programs of which the text changes, or what their remote I/Os do, in the order of the cluster.
    pub fn touched(&self) -> BTreeSet<ProgramId> {
        let programs = self.programs.iter().map(|changed| changed.program);
        programs.chain(self.fallbacks.iter().map(|changed| changed.program)).collect()
    }

    /// The programs before and after, as records of members keep them.
    pub fn kept_programs(&self) -> impl Iterator<Item = RetainedProgram> {
        self.programs.iter().flat_map(|changed| [changed.before.kept(), changed.after.kept()])
    }

    /// The change back.
    #[must_use]
    pub fn back(self) -> Self {
        let Self { cluster, before, after, programs, fallbacks, points } = self;
        let programs = programs.into_iter().map(|changed| {
            let ChangedText { program, before, after } = changed;
            ChangedText { program, before: after, after: before }
        });
        let (programs, (before, after)) = (programs.collect(), (after, before));
        let fallbacks = fallbacks.into_iter().map(ChangedFallback::back).collect();
        let points = points.into_iter().map(ChangedPoints::back).collect();
        Self { cluster, before, after, programs, fallbacks, points }
    }

    /// What a member loads, whose cluster file is `cluster`: that before the change, or that after it.
    ///
    /// # Errors
    /// Why these texts are not a change of that cluster.
    pub fn load(&self, cluster: &Cluster) -> Result<OnlineChange, ChangeError> {
        let agreement = cluster.agreement();
        if self.cluster != agreement.cluster.0 {
            return Err(ChangeError::OtherCluster);
        }
        let own = agreement.configuration;
        if own != self.before && own != self.after {
            return Err(ChangeError::OtherConfiguration { own, before: self.before });
        }
        if !self.points.is_empty() {
            return self.load_with_points(cluster);
        }
        let (mut programs, mut codes) = (Vec::new(), Vec::new());
        for changed in &self.programs {
            let controller = cluster.controllers().get(changed.program.index());
            let Some(controller) = controller else {
                return Err(ChangeError::NoSuchProgram { program: changed.program });
            };
            let read = |text: &ProgramText| {
                let code = read_kept(&text.kept());
                code.ok_or_else(|| ChangeError::Unreadable { file: text.file.clone() })
            };
            let (before, after) = (read(&changed.before)?, read(&changed.after)?);
            let name = &controller.name;
            let unfit = Unfit::points(name, &before, &after)
                .or_else(|| Unfit::points(name, &controller.code, &after))
                .or_else(|| Unfit::memory(name, &before, &after))
                .or_else(|| Unfit::pairs(name, &before, &after).into_iter().next());
            if let Some(unfit) = unfit {
                return Err(unfit.into());
            }
            let of_file = if own == self.before { &changed.before } else { &changed.after };
            if of_file.hash != controller.hash {
                return Err(ChangeError::OtherProgram { program: controller.name.clone() });
            }
            codes.push((changed.program, [before.clone(), after.clone()]));
            let program = |code: &Code, text: &ProgramText| Program {
                hash: text.hash,
                executable: code.executable(),
            };
            programs.push(ProgramChange {
                program: changed.program,
                before: program(&before, &changed.before),
                after: program(&after, &changed.after),
                forward: Arc::new(Between::new(&before, &after, Way::There)),
                back: Arc::new(Between::new(&after, &before, Way::Back)),
                points: None,
                known_by: [&before, &after].map(|code| points_hash(&code.interface())),
            });
        }
        let fallbacks = self.load_fallbacks(cluster)?;
        let change = OnlineChange { before: self.before, after: self.after, programs, fallbacks };
        for (side, claimed) in [self.before, self.after].into_iter().enumerate() {
            let code_of = |program| {
                let found = codes.iter().find(|(of, _)| *of == program);
                found.map(|(_, both): &(_, [Code; 2])| &both[side])
            };
            let text = text_with(cluster, code_of, |program| change.fallback_in(claimed, program));
            if ConfigurationHash::of(text.as_bytes()) != claimed {
                return Err(ChangeError::NotItsResult { claimed });
            }
        }
        Ok(change)
    }

    /// The settings of remote I/Os, before and after; those of the member's own configuration are those of its cluster file.
    fn load_fallbacks(&self, cluster: &Cluster) -> Result<Vec<FallbackChange>, ChangeError> {
        let is_before = cluster.agreement().configuration == self.before;
        let read = |changed: &ChangedFallback| {
            let program = changed.program;
            let missing = ChangeError::NoSuchProgram { program };
            let place = program.index();
            let places = (cluster.controllers.get(place), cluster.remote_ios.get(place));
            let (Some(controller), Some(remote_io)) = places else {
                return Err(missing);
            };
            let outputs = &controller.interface.outputs;
            let read = |text: &FallbackText| {
                let fallback = text.read(outputs).filter(|fallback| {
                    fallback.restart.is_some() == remote_io.fallback.restart.is_some()
                });
                fallback.ok_or_else(|| ChangeError::NoSettings { program: controller.name.clone() })
            };
            let (before, after) = (read(&changed.before)?, read(&changed.after)?);
            if *if is_before { &before } else { &after } != remote_io.fallback {
                return Err(ChangeError::OtherSettings { program: controller.name.clone() });
            }
            Ok(FallbackChange { program, before, after })
        };
        self.fallbacks.iter().map(read).collect()
    }
}

impl Cluster {
    /// The same cluster with the programs and settings of one of the two configurations of a change, as if its file named them.
    ///
    /// # Errors
    /// A text that is read as another program here, and settings that do not fit its program.
    pub fn changed(&self, texts: &ChangeTexts, to: ConfigurationHash) -> Result<Self, ChangeError> {
        let mut cluster = self.clone();
        let mut programs = cluster.programs.to_vec();
        let mut is_changed = false;
        for changed in &texts.programs {
            let text = if to == texts.after { &changed.after } else { &changed.before };
            let code = read_kept(&text.kept());
            let code = code.ok_or_else(|| ChangeError::Unreadable { file: text.file.clone() })?;
            let place = changed.program.index();
            let missing = || ChangeError::NoSuchProgram { program: changed.program };
            let controller = cluster.controllers.get_mut(place).ok_or_else(missing)?;
            is_changed |= controller.hash != text.hash;
            controller.hash = text.hash;
            programs[place] = Program { hash: text.hash, executable: code.executable() };
            // The same points, which have their values at other places of its memory.
            controller.interface = code.interface();
            controller.code = code;
        }
        for changed in &texts.fallbacks {
            let text = if to == texts.after { &changed.after } else { &changed.before };
            let place = changed.program.index();
            let missing = || ChangeError::NoSuchProgram { program: changed.program };
            let controller = cluster.controllers.get(place).ok_or_else(missing)?;
            let fallback = text.read(&controller.interface.outputs);
            let unread = || ChangeError::NoSettings { program: controller.name.clone() };
            cluster.remote_ios.get_mut(place).ok_or_else(missing)?.fallback =
                fallback.ok_or_else(unread)?;
        }
        for changed in &texts.points {
            let section = if to == texts.after { &changed.after } else { &changed.before };
            cluster.take_points(changed.program, section)?;
        }
        // It was generated from the programs of the file.
        cluster.parity = cluster.parity.filter(|_| !is_changed);
        cluster.programs = programs.into();
        cluster.canonical_text = text_with(&cluster, |_| None, |_| None);
        let configuration = ConfigurationHash::of(cluster.canonical_text.as_bytes());
        cluster.agreement = Arc::new(Agreement { configuration, ..(*cluster.agreement).clone() });
        Ok(cluster)
    }
}

impl ProgramText {
    fn of(code: &Code, hash: ProgramHash) -> Self {
        let RetainedProgram { hash, file, period, text, renamed, inputs: _ } =
            code.source().kept(hash);
        Self { hash, file, period, text, renamed }
    }

    fn kept(&self) -> RetainedProgram {
        let Self { hash, file, period, text, renamed } = self.clone();
        RetainedProgram { hash, file, period, text, inputs: Vec::new(), renamed }
    }
}

/// The way from one program to another one: by the names and types of its variables.
#[derive(Debug)]
struct Between {
    from: Code,
    to: Code,
    successor: Successor,
}

impl Between {
    fn new(from: &Code, to: &Code, way: Way) -> Self {
        let successor = to.successor(from, way);
        Self { from: from.clone(), to: to.clone(), successor }
    }
}

impl Conversion for Between {
    fn convert(&self, state: &[u64]) -> Vec<u64> {
        self.to.changed(&self.from, state, &self.successor)
    }

    fn release(&self, state: &mut [u64], inputs: &[u64]) {
        // Only programs on the register machine have a reset, and their state is that of the typed program.
        let reset = self.to.typed().inputs.find(TypedProgram::RESET);
        let reset = reset.filter(|point| point.slot == 0);
        if reset.is_some_and(|reset| reset.get(inputs) != 0) {
            Fault::clear(state);
        }
    }
}

/// The canonical text of a cluster in which these programs and settings stand in the place of its own.
fn text_with<'a>(
    cluster: &'a Cluster,
    code_of: impl Fn(ProgramId) -> Option<&'a Code>,
    fallback_of: impl Fn(ProgramId) -> Option<&'a Fallback>,
) -> String {
    let controllers = (0..).map(ProgramId).zip(cluster.controllers());
    let codes = controllers
        .map(|(program, controller)| code_of(program).unwrap_or(&controller.code).text());
    let remote_ios = (0..).map(ProgramId).zip(cluster.remote_ios());
    let fallbacks = remote_ios.map(|(program, remote_io)| {
        fallback_text(fallback_of(program).unwrap_or(&remote_io.fallback))
    });
    filled(&cluster.frame_text, codes, fallbacks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Unnamed;

    const FILE: &str = "[cluster]\nname = \"one\"\nsecurity = \"off\"\n\n[[controller]]\nname = \"one\"\nladder = \"FILE\"\n\n[[remote_io]]\ncontroller = \"one\"\n";

    fn cluster(file: &str, text: &str) -> Cluster {
        let cluster = FILE.replace("FILE", file);
        let loaded = crate::read("cluster.toml", &cluster, &mut |_| Ok(text.to_owned()));
        loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
    }

    fn program(input: &str, body: &str) -> String {
        format!(
            "PROGRAM one\nVAR_INPUT {input}; END_VAR\nVAR_OUTPUT y : BOOL; END_VAR\nVAR t : TON; e : R_TRIG; n : INT; END_VAR\n{body}\nEND_PROGRAM"
        )
    }

    /// What cannot be found by a name in the new program would begin anew without a word: a latch falls, and an edge is seen again.
    #[test]
    fn programs_with_memory_without_a_name_need_a_stop() {
        let between = |file: &str, before: &str, after: &str| {
            ChangeTexts::between(&cluster(file, before), &cluster(file, after))
        };
        let rungs = |rung: &str| {
            let rest = "rung\n    +m ( z )\nrung\n    a ( m )\n";
            format!("program one\ninput a\noutput y = 0\noutput z\nmemory m = 0\n{rest}{rung}")
        };
        let [one, other] = ["rung\n    +a ( y )\n", "rung\n    -a ( y )\n"].map(rungs);
        assert!(between("one.ladder", &one, &other).is_ok());
        // Which of the two contacts of `m` is that of before?
        let several = rungs("rung\n    +m ( y )\n");
        let found = between("one.ladder", &one, &several);
        assert!(matches!(
            found.as_ref().map_err(Vec::as_slice),
            Err([NeedsStop::Unfit(Unfit::Memory { why: Unnamed::SeveralEdges(of), .. })]) if of == "m"
        ));
        for input in ["a : BOOL", "a : BOOL R_EDGE"] {
            let [one, other] =
                ["y := a;", "t(IN := a); e(CLK := t.Q); IF e.Q THEN n := n + 1; END_IF; y := t.Q;"]
                    .map(|body| program(input, body));
            assert!(between("one.st", &one, &other).is_ok());
        }
    }
}
