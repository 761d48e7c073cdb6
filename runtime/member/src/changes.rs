//! The online change that a member has loaded, and the file that keeps it: `CLUSTER.MEMBER.change` in the folder of what it keeps.
//!
//! A member that starts again has the configurations that it had, so that its place in a change is not lost with its process.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_bus::{ChangeKeeper, Changes, FoundFile, LoadedPrograms};
use understudy_cluster::{ChangeError, ChangeTexts, Cluster};
use understudy_cycle::OnlineChange;
use understudy_wire::{
    ChangeName, ConfigurationHash, Configurations, Member, OrderRefusal, ProgramHash, ProgramId,
    RetainedProgram,
};

use crate::field::Wirings;
use crate::retained::retained_inputs;
use crate::run::MemberOptions;

/// The longest text of a change that is read from a file.
const MOST_BYTES: u64 = 32 << 20;

/// What the file keeps.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct KeptChanges {
    /// Changes that were accepted, each of which begins where the one before it ends: the first of them with a cluster file that the member had.
    accepted: Vec<ChangeTexts>,
    /// The change that is going on, with the configurations of the member.
    current: Option<(ChangeTexts, Configurations)>,
    /// The change that was accepted last: it is over, and is not loaded again.
    #[serde(default)]
    over: Option<ChangeName>,
}

/// What a member starts with.
pub(crate) struct StartedChange {
    /// The cluster, with the programs of the changes that were accepted.
    pub(crate) cluster: Cluster,
    /// The cluster in the configuration that is the member's own, as of the change that is going on: values of any other program are taken over to it.
    pub(crate) own: Cluster,
    /// The change that is going on, and the configurations that the member had.
    pub(crate) restored: Option<(Arc<OnlineChange>, Configurations)>,
    pub(crate) changes: Changes,
    /// The file, where it says nothing that can be used.
    pub(crate) found: Option<FoundFile>,
    /// What records of this member may be of, besides the programs of the cluster.
    pub(crate) programs: LoadedPrograms,
    /// Where points are in its device.
    pub(crate) wirings: Wirings,
}

/// What a member has kept of online changes, and what takes the next one; `cluster` is that of its file.
pub(crate) fn started_change(
    cluster: &Cluster,
    member: Member,
    options: &MemberOptions,
) -> StartedChange {
    let file = options
        .retain
        .as_ref()
        .map(|folder| folder.join(format!("{}.{}.change", cluster.name(), options.name)));
    let programs = LoadedPrograms::default();
    let mut keeper = Keeper {
        cluster: cluster.clone(),
        kept: KeptChanges::default(),
        loaded: None,
        file: file.clone(),
        programs: programs.clone(),
        wirings: Wirings::new(member),
    };
    let wirings = keeper.wirings.clone();
    let restored = file.as_ref().map_or(Ok(None), |file| keeper.start(file));
    let (restored, problem) = match restored {
        Ok(restored) => (restored, None),
        Err(problem) => (None, Some(problem)),
    };
    let found = file.zip(problem).map(|(path, problem)| FoundFile { path, problem: Some(problem) });
    let own = keeper.cluster.agreement().configuration;
    let first = Configurations { own, prepared: None };
    let configurations = restored.as_ref().map_or(first, |(_, configurations)| *configurations);
    let text = keeper.text(configurations.own);
    let change = restored.as_ref().map(|(change, _)| Arc::clone(change));
    let cluster = keeper.cluster.clone();
    let own = keeper.cluster_in(configurations.own).unwrap_or_else(|| cluster.clone());
    let changes = Changes::new(configurations, change, text, Some(Box::new(keeper)));
    wirings.learn(&cluster);
    StartedChange { cluster, own, restored, changes, found, programs, wirings }
}

impl StartedChange {
    /// Whether a program is one of those of the change.
    pub(crate) fn has_loaded(&self, program: ProgramId, hash: ProgramHash) -> bool {
        let change = self.restored.as_ref().and_then(|(change, _)| change.of(program));
        change.is_some_and(|change| [change.before.hash, change.after.hash].contains(&hash))
    }
}

struct Keeper {
    /// With the programs of the changes that were accepted.
    cluster: Cluster,
    kept: KeptChanges,
    /// The texts that were loaded last, which the cycle may refuse.
    loaded: Option<ChangeTexts>,
    /// Nothing where the member keeps nothing.
    file: Option<PathBuf>,
    programs: LoadedPrograms,
    wirings: Wirings,
}

impl Keeper {
    /// Takes what the file has; the change that is going on. Changes before the cluster file that the member has now are over.
    fn start(
        &mut self,
        file: &Path,
    ) -> Result<Option<(Arc<OnlineChange>, Configurations)>, String> {
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.to_string()),
        };
        let mut kept: KeptChanges =
            serde_json::from_str(&text).map_err(|error| error.to_string())?;
        let own = self.cluster.agreement().configuration;
        let is_newest = kept.accepted.last().is_some_and(|texts| texts.after == own);
        let first = kept.accepted.iter().position(|texts| texts.before == own);
        let is_current = |(texts, _): &(ChangeTexts, Configurations)| {
            kept.accepted.is_empty() && [texts.before, texts.after].contains(&own)
        };
        if !is_newest && first.is_none() && !kept.current.as_ref().is_some_and(is_current) {
            let known = kept.accepted.last().map(|texts| texts.after);
            let known = known.or(kept.current.as_ref().map(|(texts, _)| texts.before));
            let Some(known) = known else {
                self.kept.over = kept.over;
                return Ok(None);
            };
            return Err(format!(
                "it is of changes that lead to {known}, and the cluster file is configuration {own}"
            ));
        }
        let over = if is_newest { kept.accepted.len() } else { first.unwrap_or(0) };
        kept.accepted.drain(..over);
        let mut cluster = self.cluster.clone();
        for texts in &kept.accepted {
            let changed = cluster.changed(texts, texts.after);
            cluster = changed.map_err(|error| error.to_string())?;
        }
        let restored = match &kept.current {
            None => None,
            Some((texts, configurations)) => {
                let change = texts.load(&cluster).map_err(|error| error.to_string())?;
                learn(&self.wirings, &cluster, texts);
                Some((Arc::new(change), *configurations))
            }
        };
        (self.cluster, self.kept) = (cluster, kept);
        self.tell_programs();
        Ok(restored)
    }

    fn tell_programs(&self) {
        self.programs.are(self.kept_programs());
    }

    /// Records may be of the programs of the change that goes on, of one that was loaded, and of the cluster. Those of a remote I/O have the names of the
    /// inputs that keep their values, too.
    fn kept_programs(&self) -> Vec<RetainedProgram> {
        let current = self.kept.current.as_ref().map(|(texts, _)| texts);
        let texts = current.into_iter().chain(&self.loaded);
        let programs = texts.flat_map(|texts| {
            let sides = [texts.before, texts.after].map(|side| self.cluster.changed(texts, side));
            let inputs = sides.into_iter().filter_map(|side| {
                let (side, program) = (side.ok()?, self.wirings.program()?);
                let hash = side.controllers().get(program.index())?.hash;
                Some((hash, retained_inputs(&side, program)))
            });
            let inputs: Vec<_> = inputs.collect();
            texts.kept_programs().map(move |kept| {
                let found = inputs.iter().find(|(hash, _)| *hash == kept.hash);
                let inputs = found.map_or_else(Vec::new, |(_, inputs)| inputs.clone());
                RetainedProgram { inputs, ..kept }
            })
        });
        programs.collect()
    }

    /// The cluster in one of the configurations of the change that goes on; nothing where there is none.
    fn cluster_in(&self, configuration: ConfigurationHash) -> Option<Cluster> {
        let (texts, _) = self.kept.current.as_ref()?;
        self.cluster.changed(texts, configuration).ok()
    }

    /// The canonical text of a configuration that is loaded.
    fn text(&self, own: ConfigurationHash) -> String {
        let changed = self.cluster_in(own);
        changed.as_ref().unwrap_or(&self.cluster).canonical_text().to_owned()
    }

    /// Ends the change with the configuration `own`.
    fn end(&mut self, own: ConfigurationHash) -> Result<(), ChangeError> {
        let Some((texts, _)) = self.kept.current.take() else {
            return Ok(());
        };
        if own == texts.after {
            self.kept.over = Some(texts.name());
        }
        if own != self.cluster.agreement().configuration {
            self.cluster = self.cluster.changed(&texts, own)?;
            match self.kept.accepted.last() {
                // A change back makes the one before it undone.
                Some(last) if last.before == own => {
                    self.kept.accepted.pop();
                }
                _ => self.kept.accepted.push(if own == texts.after { texts } else { texts.back() }),
            }
        }
        Ok(())
    }
}

impl ChangeKeeper for Keeper {
    fn load(&mut self, texts: &str) -> Result<Arc<OnlineChange>, String> {
        let texts: ChangeTexts = serde_json::from_str(texts)
            .map_err(|error| format!("U0631: these are no texts of an online change: {error}"))?;
        let runs_it = self.cluster.agreement().configuration == texts.after;
        if runs_it && self.kept.current.is_none() && self.kept.over == Some(texts.name()) {
            let refusal = OrderRefusal::IsOver;
            return Err(format!("{}: {refusal}", refusal.code()));
        }
        let change = texts.load(&self.cluster).map_err(|error| format!("U0631: {error}"))?;
        learn(&self.wirings, &self.cluster, &texts);
        self.loaded = Some(texts);
        self.tell_programs();
        Ok(Arc::new(change))
    }

    fn read(&mut self, file: &str) -> Result<String, String> {
        let unread = |reason: String| format!("U0631: {file} cannot be read: {reason}");
        let length = fs::metadata(file).map_err(|error| unread(error.to_string()))?.len();
        if length > MOST_BYTES {
            return Err(unread(format!("it has {length} bytes; at most {MOST_BYTES} are read")));
        }
        fs::read_to_string(file).map_err(|error| unread(error.to_string()))
    }

    fn keep(&mut self, configurations: Configurations) -> Result<String, String> {
        if configurations.prepared.is_some() {
            // Another change is refused by the cycle while one is loaded.
            let current = self.kept.current.take().map(|(texts, _)| texts);
            let texts = current.or_else(|| self.loaded.take());
            self.kept.current = texts.map(|texts| (texts, configurations));
        }
        let text = self.text(configurations.own);
        if configurations.prepared.is_none() {
            self.end(configurations.own).map_err(|error| format!("U0631: {error}"))?;
        }
        let KeptChanges { accepted, current, over } = &self.kept;
        let is_empty = accepted.is_empty() && current.is_none() && over.is_none();
        let kept = match &self.file {
            Some(file) if is_empty => remove(file),
            Some(file) => write(file, &self.kept),
            None => Ok(()),
        };
        kept.map_err(|error| {
            format!(
                "U0633: it is done, and not kept on the disk, so it ends with the process: {error}"
            )
        })?;
        Ok(text)
    }
}

/// The places of points before and after a change that replaces those of the member's program; those of the member's own cluster file are the ones that it has.
fn learn(wirings: &Wirings, cluster: &Cluster, texts: &ChangeTexts) {
    if texts.points.iter().any(|changed| wirings.are_of(changed)) {
        let own = cluster.agreement().configuration;
        let both = [texts.before, texts.after].map(|side| match side == own {
            true => Some(cluster.clone()),
            false => cluster.changed(texts, side).ok(),
        });
        both.into_iter().flatten().for_each(|it| wirings.learn(&it));
    }
}

fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes the file whole or not at all.
fn write(file: &Path, kept: &KeptChanges) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let beside = file.with_extension("change.new");
    let mut new = File::create(&beside)?;
    new.write_all(&serde_json::to_vec(kept)?)?;
    new.sync_all()?;
    fs::rename(&beside, file)?;
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "[cluster]\nname = \"kept\"\nsecurity = \"off\"\n\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n\n[[remote_io]]\ncontroller = \"one\"\n";

    /// The cluster whose program counts by `step`.
    fn cluster(step: u32) -> Cluster {
        let program = format!(
            "PROGRAM one\nVAR_INPUT go : BOOL; END_VAR\nVAR_OUTPUT shown : INT; END_VAR\nVAR count : INT; END_VAR\ncount := count + {step};\nshown := count;\nEND_PROGRAM"
        );
        let loaded = understudy_cluster::read("cluster.toml", FILE, &mut |_| Ok(program.clone()));
        loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
    }

    fn hash(cluster: &Cluster) -> ConfigurationHash {
        cluster.agreement().configuration
    }

    /// A member that starts with this cluster file: its configurations, and what takes changes.
    fn start(file: &Path, cluster: &Cluster) -> (Result<Configurations, String>, Keeper) {
        let (cluster, kept) = (cluster.clone(), KeptChanges::default());
        let programs = LoadedPrograms::default();
        let file_of = Some(file.to_owned());
        let mut keeper = Keeper {
            cluster,
            kept,
            loaded: None,
            file: file_of,
            programs,
            wirings: Wirings::new(Member::RemoteIo(ProgramId(0))),
        };
        let restored = keeper.start(file);
        let own = hash(&keeper.cluster);
        let none = Configurations { own, prepared: None };
        (restored.map(|it| it.map_or(none, |(_, configurations)| configurations)), keeper)
    }

    fn prepare(keeper: &mut Keeper, before: &Cluster, after: &Cluster) {
        let texts = ChangeTexts::between(before, after).expect("only a program differs");
        let texts = serde_json::to_string(&texts).expect("JSON");
        keeper.load(&texts).expect("it is of this cluster");
        let (own, prepared) = (hash(before), Some(hash(after)));
        keeper.keep(Configurations { own, prepared }).expect("kept");
    }

    fn end(keeper: &mut Keeper, own: &Cluster) -> String {
        let configurations = Configurations { own: hash(own), prepared: None };
        keeper.keep(configurations).expect("kept")
    }

    /// Texts with points, loaded by a member with either file and by one that starts again: it knows where the points of both versions are.
    #[test]
    fn a_member_learns_where_the_points_of_a_change_are() {
        let with = |outputs: &str, places: &str| {
            let device = format!(
                "[remote_io.field]\nmodbus = \"127.0.0.1:9\"\ninputs = {{ go = \"discrete:0\" }}\noutputs = {{ {places} }}\n"
            );
            let program = format!(
                "PROGRAM one\nVAR_INPUT go : BOOL; END_VAR\nVAR_OUTPUT {outputs} : BOOL; END_VAR\ny := go;\nEND_PROGRAM"
            );
            let text = format!("{FILE}{device}");
            let loaded =
                understudy_cluster::read("cluster.toml", &text, &mut |_| Ok(program.clone()));
            loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
        };
        let before = with("y", "y = \"coil:1\"");
        let after = with("z, y", "y = \"coil:2\", z = \"coil:1\"");
        let texts = ChangeTexts::between(&before, &after).expect("an online change");
        let json = serde_json::to_string(&texts).expect("JSON");
        let folder = std::env::temp_dir().join(format!("understudy-points-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let check = |keeper: &Keeper| {
            for cluster in [&before, &after] {
                let hash = cluster.controllers()[0].hash;
                let outputs = keeper.wirings.outputs(hash).expect("it is known");
                let field = cluster.remote_ios()[0].field.as_ref().expect("a device");
                assert_eq!(outputs, field.outputs);
            }
        };
        for (own, other) in [(&before, &after), (&after, &before)] {
            let file = folder.join("kept.one.change");
            let (_, mut keeper) = start(&file, own);
            keeper.load(&json).expect("it is of this cluster");
            check(&keeper);
            let (own_hash, prepared) = (hash(own), Some(hash(other)));
            let configurations = Configurations { own: own_hash, prepared };
            keeper.keep(configurations).expect("kept");
            let (found, keeper) = start(&file, own);
            assert_eq!(found, Ok(configurations));
            check(&keeper);
            fs::remove_file(&file).expect("removed");
        }
        fs::remove_dir_all(&folder).expect("removed");
    }

    /// A third program takes the values of operator inputs over by their names, so these are kept with both programs of a change.
    #[test]
    fn programs_are_kept_with_the_inputs_that_keep_their_values() {
        let with = |inputs: &str, keys: &str| {
            let program = format!(
                "PROGRAM one\nVAR_INPUT {inputs} : INT; END_VAR\nVAR_OUTPUT y : INT; END_VAR\nVAR RETAIN n : INT; END_VAR\ny := a;\nn := n + 1;\nEND_PROGRAM"
            );
            let text = format!("{FILE}inputs = {{ {keys} }}\n");
            let loaded =
                understudy_cluster::read("cluster.toml", &text, &mut |_| Ok(program.clone()));
            loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
        };
        let key = |name: &str, retain: bool| {
            format!("{name} = {{ operator = \"setpoint\", low = 0, high = 9, retain = {retain} }}")
        };
        let before = with("a, b", &[key("a", true), key("b", false)].join(", "));
        let after = with("c, a", &[key("a", true), key("c", true)].join(", "));
        let texts = ChangeTexts::between(&before, &after).expect("an online change");
        let folder = std::env::temp_dir().join(format!("understudy-inputs-{}", std::process::id()));
        let (_, mut keeper) = start(&folder.join("kept.one.change"), &before);
        keeper.load(&serde_json::to_string(&texts).expect("JSON")).expect("it is of this cluster");
        let mut kept: Vec<Vec<String>> =
            keeper.kept_programs().into_iter().map(|program| program.inputs).collect();
        kept.iter_mut().for_each(|names| names.sort());
        assert_eq!(kept, [vec!["a".to_owned()], vec!["a".to_owned(), "c".to_owned()]]);
    }

    #[test]
    fn a_member_that_starts_again_goes_on_where_it_was() {
        let folder =
            std::env::temp_dir().join(format!("understudy-changes-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("kept.one.change");
        let [first, second, third] = [1, 10, 100].map(cluster);
        let known = |file: &Path, cluster: &Cluster| start(file, cluster).0.expect("it is known");
        let alone = |cluster: &Cluster| Configurations { own: hash(cluster), prepared: None };
        let (configurations, mut keeper) = start(&file, &first);
        assert_eq!(configurations, Ok(alone(&first)));
        // Prepared, with the old file and with the new one.
        prepare(&mut keeper, &first, &second);
        let prepared = Configurations { own: hash(&first), prepared: Some(hash(&second)) };
        assert_eq!(known(&file, &first), prepared);
        assert_eq!(known(&file, &second), prepared);
        // Accepted: the old file is that of before, and a second change leads on from there.
        assert_eq!(end(&mut keeper, &second), second.canonical_text());
        assert_eq!(known(&file, &first), alone(&second));
        assert_eq!(known(&file, &second), alone(&second));
        let (_, mut keeper) = start(&file, &first);
        prepare(&mut keeper, &second, &third);
        assert_eq!(known(&file, &first).prepared, Some(hash(&third)));
        end(&mut keeper, &third);
        assert_eq!(known(&file, &first), alone(&third));
        assert_eq!(known(&file, &second), alone(&third));
        assert_eq!(known(&file, &third), alone(&third));
        // What was accepted is over, also for a member that starts again, with whichever file.
        let load = |keeper: &mut Keeper, before: &Cluster, after: &Cluster| {
            let texts = ChangeTexts::between(before, after).expect("only a program differs");
            keeper.load(&serde_json::to_string(&texts).expect("JSON")).map(|_| ())
        };
        for started in [&first, &second, &third] {
            let mut again = start(&file, started).1;
            let refused = load(&mut again, &second, &third).expect_err("it is over");
            assert!(refused.starts_with("U0632: "), "{refused}");
            load(&mut again, &third, &second).expect("the change back is another one");
        }
        // One that was cancelled leaves nothing, and one back undoes the one before it.
        prepare(&mut keeper, &third, &first);
        end(&mut keeper, &third);
        assert_eq!(known(&file, &first), alone(&third));
        prepare(&mut keeper, &third, &second);
        end(&mut keeper, &second);
        assert_eq!(known(&file, &first), alone(&second));
        load(&mut keeper, &second, &third).expect("it can be made again");
        // A cluster file of something else is not changed to what was accepted of another one.
        let other = cluster(7);
        let problem = start(&file, &other).0.expect_err("it is of other changes");
        assert!(problem.contains(&hash(&other).to_string()), "{problem}");
        fs::write(&file, "no JSON").expect("written");
        assert!(start(&file, &first).0.is_err());
        fs::remove_dir_all(&folder).expect("removed");
    }
}
