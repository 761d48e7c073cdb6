//! An online change between two cluster files: what it replaces, and why it needs a stop where it does.

mod settings;
mod unfit;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::{Agreement, Conversion, OnlineChange, Program, ProgramChange};
use understudy_typed::{CarriedPath, Fate, Fault, Program as TypedProgram, Renamed, Successor};
use understudy_wire::{ChangeName, ConfigurationHash, ProgramHash, ProgramId, RetainedProgram};

pub use self::settings::ChangedSetting;
use self::settings::changed_settings;
pub use self::unfit::{PairReason, Unfit};
use crate::cluster::Cluster;
use crate::code::Code;
use crate::configuration::with_programs;
use crate::source_text::read_kept;

/// The online changes of one run, one after another: each is loaded by what the ones before it have led to.
#[derive(Debug, Clone)]
pub struct OnlineChanges {
    cluster: Arc<Cluster>,
    last: Option<ChangeTexts>,
}

impl OnlineChanges {
    /// Of a run that begins with this cluster.
    pub fn of(cluster: Arc<Cluster>) -> Self {
        Self { cluster, last: None }
    }

    /// The next change; none where its texts are not of this cluster, and so were refused by its members.
    pub fn load(&mut self, texts: &ChangeTexts) -> Option<OnlineChange> {
        if let Some(last) = self.last.take()
            && last.after == texts.before
            && let Ok(changed) = self.cluster.changed(&last, last.after)
        {
            self.cluster = Arc::new(changed);
        }
        self.last = Some(texts.clone());
        texts.load(&self.cluster).ok()
    }
}

/// What every member is given to prepare an online change: the texts of the programs that change, before and after.
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
    /// Something else than a program differs.
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
        if before.name() != after.name() {
            let (before, after) = (before.name().to_owned(), after.name().to_owned());
            return Err(vec![NeedsStop::OtherCluster { before, after }]);
        }
        let mut reasons = Vec::new();
        let changed = changed_settings(&before.frame_text, &after.frame_text);
        reasons.extend(changed.into_iter().map(NeedsStop::Setting));
        let pairs = before.controllers().iter().zip(after.controllers());
        let pairs = pairs.filter(|(old, new)| old.name == new.name);
        let mut programs = Vec::new();
        for (place, (old, new)) in (0..).zip(pairs) {
            reasons.extend(Unfit::points(&old.name, &old.code, &new.code).map(NeedsStop::from));
            if old.hash != new.hash {
                let of_program = Unfit::memory(&old.name, &old.code, &new.code).into_iter();
                let of_program = of_program.chain(Unfit::pairs(&old.name, &old.code, &new.code));
                reasons.extend(of_program.map(NeedsStop::from));
                programs.push(ChangedText {
                    program: ProgramId(place),
                    before: ProgramText::of(&old.code, old.hash),
                    after: ProgramText::of(&new.code, new.hash),
                });
            }
        }
        if reasons.is_empty() {
            Ok(Self {
                cluster: before.agreement().cluster.0,
                before: before.agreement().configuration,
                after: after.agreement().configuration,
                programs,
            })
        } else {
            Err(reasons)
        }
    }

    /// The two configurations.
    pub fn name(&self) -> ChangeName {
        ChangeName { before: self.before, after: self.after }
    }

    /// The change back.
    #[must_use]
    pub fn back(self) -> Self {
        let Self { cluster, before, after, programs } = self;
        let programs = programs.into_iter().map(|changed| {
            let ChangedText { program, before, after } = changed;
            ChangedText { program, before: after, after: before }
        });
        Self { cluster, before: after, after: before, programs: programs.collect() }
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
                forward: Arc::new(Between::new(&before, &after)),
                back: Arc::new(Between::new(&after, &before)),
            });
        }
        let change = OnlineChange { before: self.before, after: self.after, programs };
        for (side, claimed) in [(false, self.before), (true, self.after)] {
            let text = text_with(cluster, &codes, side);
            if ConfigurationHash::of(text.as_bytes()) != claimed {
                return Err(ChangeError::NotItsResult { claimed });
            }
        }
        Ok(change)
    }
}

impl Cluster {
    /// The same cluster with the programs of one of the two configurations of a change, as if its file named them.
    ///
    /// # Errors
    /// A text that is read as another program here.
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
            controller.code = code;
        }
        // It was generated from the programs of the file.
        cluster.parity = cluster.parity.filter(|_| !is_changed);
        cluster.programs = programs.into();
        cluster.canonical_text = text_with(&cluster, &[], false);
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

/// Why a member does not load an online change.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ChangeError {
    /// It is one of another cluster.
    #[error("the change is one of another cluster")]
    OtherCluster,
    /// The member runs neither configuration.
    #[error("the change leads on from configuration {before}, and this member runs {own}")]
    OtherConfiguration {
        /// Configuration of the member.
        own: ConfigurationHash,
        /// Configuration that the change leads on from.
        before: ConfigurationHash,
    },
    /// The cluster has no program in the place of one of the change.
    #[error("the cluster has no program {}", .program.0)]
    NoSuchProgram {
        /// The program.
        program: ProgramId,
    },
    /// The program of the change is another one than that of the cluster file.
    #[error("the change is of another text of `{program}` than that which this member runs")]
    OtherProgram {
        /// Name of the controller.
        program: String,
    },
    /// The texts do not make the configuration that they are said to make.
    #[error(
        "these texts do not make configuration {claimed} of the cluster file that this member runs"
    )]
    NotItsResult {
        /// That configuration.
        claimed: ConfigurationHash,
    },
    /// A text is not the program that its hash names.
    #[error("`{file}` is read as another program here: this release differs from that of the tool")]
    Unreadable {
        /// File of the text.
        file: String,
    },
    /// A program cannot be replaced while it runs.
    #[error(transparent)]
    Unfit(#[from] Unfit),
}

/// The way from one program to another one: by the names and types of its variables.
#[derive(Debug)]
struct Between {
    from: Code,
    to: Code,
    successor: Successor,
}

impl Between {
    fn new(from: &Code, to: &Code) -> Self {
        let successor = to.successor(from);
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

/// What becomes of each variable of a program in an online change.
pub fn fates(before: &Code, after: &Code) -> Vec<CarriedPath> {
    after.fates(before)
}

/// The pairs of a program that have done their work: the program before has the new name already.
pub fn done_pairs(before: &Code, after: &Code) -> Vec<Renamed> {
    let is_done = |pair: &&Renamed| before.typed().has_path(&pair.1);
    after.source().renamed.iter().filter(is_done).cloned().collect()
}

/// An initial value that differs between two programs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedInitial {
    /// The path.
    pub path: String,
    /// The two values, as they are written; nothing of what has parts.
    pub values: Option<[String; 2]>,
}

/// Which of these paths, that go on with every value, begin with other ones in the program after: those count at its next start only.
pub fn changed_initials(before: &Code, after: &Code, paths: &[CarriedPath]) -> Vec<ChangedInitial> {
    let programs = [before, after].map(|code| code.typed());
    let states = programs.map(|program| program.initial_state());
    let goes_on = |path: &&CarriedPath| matches!(path.fate, Fate::Kept | Fate::Converted);
    let changed = paths.iter().filter(goes_on).filter_map(|path| {
        let was = path.renamed_from.as_ref().unwrap_or(&path.path);
        let [old, new] = [programs[0].part(was), programs[1].part(&path.path)];
        let parts = [old?, new?];
        let values = [0, 1].map(|side: usize| {
            let (_, stored) = parts[side].stored(&states[side])?;
            Some(parts[side].declared()?.text(stored))
        });
        let [slots, others] = [0, 1].map(|side: usize| {
            let first = (parts[side].address / 64) as usize;
            states[side].get(first..first + parts[side].of.slots() as usize)
        });
        let values = match values {
            [Some(one), Some(other)] => Some([one, other]),
            _ => None,
        };
        let is_equal = match &values {
            Some([one, other]) => one == other,
            None => slots == others,
        };
        (!is_equal).then(|| ChangedInitial { path: path.path.clone(), values })
    });
    changed.collect()
}

/// The canonical text of a cluster in which these programs stand in the place of its own: those before the change, or those after it.
fn text_with(cluster: &Cluster, codes: &[(ProgramId, [Code; 2])], is_after: bool) -> String {
    let mut controllers = (0..).map(ProgramId).zip(cluster.controllers());
    with_programs(&cluster.frame_text, || {
        let Some((place, controller)) = controllers.next() else {
            return String::new();
        };
        match codes.iter().find(|(program, _)| *program == place) {
            Some((_, [before, after])) => if is_after { after } else { before }.text(),
            None => controller.code.text(),
        }
    })
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
