//! Online changes in which inputs or outputs of a program differ.
//!
//! The points of a program are a part of its version: the change mark of a history tells from which sample on which of them count.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::{
    FallbackChange, Mode, Moved, OnlineChange, OperatorInputKind, PointPlace, PointsChange,
    Program, ProgramChange,
};
use understudy_typed::Point;
use understudy_wire::{PointsHash, ProgramId};

use super::common::CommonPoints;
use super::unfit::different_point;
use super::{Between, ChangeError, ChangeTexts, Difference, NeedsStop, differences};
use crate::canonical::points_hash;
use crate::cluster::{Cluster, Controller, RemoteIo};
use crate::code::Way;
use crate::configuration::{FALLBACK, INPUT, input_line};
use crate::device::Side;
use crate::read::{Overrides, read_with};
use crate::source::GroupSignal;

/// The points of a program that change: the sections of its remote I/O before and after.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangedPoints {
    /// Its program.
    pub program: ProgramId,
    /// Section of the cluster file before.
    pub before: String,
    /// Section of the cluster file after.
    pub after: String,
}

impl ChangedPoints {
    pub(super) fn between(program: ProgramId, before: &Cluster, after: &Cluster) -> Self {
        let section = |cluster: &Cluster| cluster.remote_ios[program.index()].section.clone();
        Self { program, before: section(before), after: section(after) }
    }

    pub(super) fn back(self) -> Self {
        let Self { program, before, after } = self;
        Self { program, before: after, after: before }
    }
}

/// Why the points of a program cannot change while it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FixedPoints {
    /// It has a second remote I/O.
    Twin,
    /// A ladder diagnoses its channels.
    Diagnosis,
    /// Its plant is simulated.
    Plant,
    /// Another program reads one of its outputs.
    ReadByAnother,
    /// The cluster has the mode of the paper.
    PaperMode,
    /// Only one of the files has a device for it.
    Device,
    /// Its device is another one.
    OtherDevice,
    /// It reads other programs.
    OtherSources,
    /// It reads other signals of other groups.
    OtherGroups,
}

impl fmt::Display for FixedPoints {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Twin => "its remote I/O has a twin",
            Self::Diagnosis => "its remote I/O has a diagnosis",
            Self::Plant => "its plant is simulated",
            Self::ReadByAnother => "another program reads an output of it",
            Self::PaperMode => "the cluster has `mode = \"paper\"`",
            Self::Device => "only one of the files has a device for it",
            Self::OtherDevice => {
                "its device has another address or unit, and the remote I/O connects to that when it starts"
            }
            Self::OtherSources => {
                "it reads other programs than before, and a remote I/O learns which ones when it starts"
            }
            Self::OtherGroups => {
                "it reads other signals of other groups, and a gateway learns which ones when it starts"
            }
        })
    }
}

/// The online change from one cluster to another one, in which points of programs may differ.
///
/// # Errors
/// Why it needs a stop.
pub fn change_with_points(
    before: &Cluster,
    after: &Cluster,
) -> Result<OnlineChange, Vec<NeedsStop>> {
    let (mut programs, mut fallbacks) = (Vec::new(), Vec::new());
    for difference in differences(before, after)? {
        let Difference { program, is_replaced, points, fallback } = difference;
        if points.is_some() || fallback.is_some() {
            let settings = |cluster: &Cluster| cluster.remote_ios[program.index()].fallback.clone();
            let (before, after) = (settings(before), settings(after));
            fallbacks.push(FallbackChange { program, before, after });
        }
        if is_replaced {
            let [old, new] = [before, after].map(|cluster| &cluster.controllers[program.index()]);
            programs.push(program_change(program, (old, new), points));
        }
    }
    let [before, after] = [before, after].map(|cluster| cluster.agreement().configuration);
    Ok(OnlineChange { before, after, programs, fallbacks })
}

impl ChangeTexts {
    /// The same where points change: each side is read as a cluster.
    pub(super) fn load_with_points(&self, cluster: &Cluster) -> Result<OnlineChange, ChangeError> {
        let own = cluster.agreement().configuration;
        let is_before = own == self.before;
        let other = if is_before { self.after } else { self.before };
        let changed = cluster.changed(self, other)?;
        if changed.agreement().configuration != other {
            return Err(ChangeError::NotItsResult { claimed: other });
        }
        let (before, after) = if is_before { (cluster, &changed) } else { (&changed, cluster) };
        let change = change_with_points(before, after);
        // Such as another device than that of the tool's file: the texts do not tell it.
        let unfit = |reasons: Vec<NeedsStop>| {
            reasons.into_iter().find_map(|reason| match reason {
                NeedsStop::Unfit(unfit) => Some(ChangeError::Unfit(unfit)),
                _ => None,
            })
        };
        change.map_err(|reasons| {
            unfit(reasons).unwrap_or(ChangeError::NotItsResult { claimed: other })
        })
    }
}

impl Cluster {
    /// Takes the points of a program and what its remote I/O does with them from a section; the programs of this cluster are those of the section already.
    pub(super) fn take_points(
        &mut self,
        program: ProgramId,
        section: &str,
    ) -> Result<(), ChangeError> {
        let unread = |file: &str| ChangeError::Unreadable { file: file.to_owned() };
        let sources: Vec<_> = self.controllers.iter().map(|it| it.code.source()).collect();
        // Files of two controllers may have one name in two folders.
        let file = |place: usize| format!("{place}/{}", sources[place].file);
        let cluster = [("name", self.name.clone()), ("security", "off".to_owned())];
        let table = |keys: &[(&str, String)]| {
            let keys = keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone().into()));
            toml::Value::Table(keys.collect())
        };
        let controllers = self.controllers.iter().enumerate().map(|(place, controller)| {
            table(&[("name", controller.name.clone()), ("ladder", file(place))])
        });
        let document = [
            ("cluster".to_owned(), table(&cluster)),
            ("controller".to_owned(), toml::Value::Array(controllers.collect())),
        ];
        let document: toml::Table = document.into_iter().collect();
        let text = format!("{document}\n{section}");
        let overrides =
            Overrides { period: Some(self.agreement.schedule.period()), ..Overrides::default() };
        let loaded = read_with("cluster.toml", &text, overrides, &mut |name| {
            let place = (0..sources.len()).find(|place| file(*place) == name);
            place.map(|place| sources[place].text.to_string()).ok_or_else(String::new)
        });
        let read = loaded.cluster.ok_or_else(|| unread("cluster.toml"))?;
        let place = program.index();
        let (Some(own), Some(read)) = (self.remote_ios.get_mut(place), read.remote_ios.get(place))
        else {
            return Err(ChangeError::NoSuchProgram { program });
        };
        own.inputs.clone_from(&read.inputs);
        own.field.clone_from(&read.field);
        own.fallback = read.fallback.clone();
        own.section = section.to_owned();
        let inputs: Vec<String> = own.inputs.iter().map(input_line).collect();
        self.frame_text = with_inputs(&self.frame_text, &own.name, &inputs);
        Ok(())
    }
}

/// The text of a configuration with these lines for the inputs of a remote I/O.
fn with_inputs(text: &str, remote_io: &str, inputs: &[String]) -> String {
    let heading = format!("remote io {remote_io}");
    let mut is_its = false;
    let mut lines: Vec<&str> = Vec::new();
    for line in text.lines() {
        if !line.starts_with(' ') {
            is_its = line == heading;
        }
        if is_its && line.starts_with(INPUT) {
            continue;
        }
        lines.push(line);
        // A program whose points change has neither a twin nor a diagnosis: the inputs are the last lines of its remote I/O.
        if is_its && line == FALLBACK {
            lines.extend(inputs.iter().map(String::as_str));
        }
    }
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

fn program_change(
    program: ProgramId,
    (old, new): (&Controller, &Controller),
    points: Option<PointsChange>,
) -> ProgramChange {
    let version = |it: &Controller| Program { hash: it.hash, executable: it.code.executable() };
    ProgramChange {
        program,
        before: version(old),
        after: version(new),
        forward: Arc::new(Between::new(&old.code, &new.code, Way::There)),
        back: Arc::new(Between::new(&new.code, &old.code, Way::Back)),
        points: points.map(Arc::new),
        known_by: [old, new].map(|it| points_hash(&it.interface)),
    }
}

/// What becomes of the points of a program; nothing where it has the same ones, by name, type and place, and from the same sources.
pub(super) fn points_change(
    before: &Cluster,
    after: &Cluster,
    program: ProgramId,
) -> Option<PointsChange> {
    let [old, new] = [before, after].map(|cluster| cluster.controllers.get(program.index()));
    let (old, new) = (old?, new?);
    // Without a mark, nothing tells when other points of the same program count.
    if old.hash == new.hash || !are_other_points(before, after, program) {
        return None;
    }
    let common = CommonPoints::of(old, new, Way::There);
    Some(PointsChange {
        before: Arc::new(before.layout(program)?),
        after: Arc::new(after.layout(program)?),
        inputs: moved(&common.inputs),
        outputs: moved(&common.outputs),
    })
}

/// Whether the points of a program differ: by name, type or place, in what they come from, or in where they are in the device. More names of values leave
/// them as they are, and so do other points of a program that it reads.
pub(super) fn are_other_points(before: &Cluster, after: &Cluster, program: ProgramId) -> bool {
    let place = program.index();
    let clusters = [before, after];
    let layouts = clusters.map(|cluster| {
        let mut layout = cluster.layout(program)?;
        layout.hash = PointsHash(0);
        layout.signal_sources.clear();
        layout.signals.iter_mut().for_each(|signal| signal.output = 0);
        Some(layout)
    });
    let read = clusters.map(|cluster| {
        let remote_io = cluster.remote_ios.get(place)?;
        let signals = remote_io.signals().map(|signal| (signal.input.from, &signal.output));
        Some((signals.collect::<Vec<_>>(), groups_read(remote_io)))
    });
    let wired = clusters.map(|cluster| {
        let field = cluster.remote_ios.get(place)?.field.as_ref()?;
        let side = |side: &Side| {
            let places = side.bindings.iter().map(|it| (it.name.clone(), it.bit, it.place));
            (side.rest.clone(), places.collect::<Vec<_>>())
        };
        Some((side(&field.inputs), side(&field.outputs)))
    });
    let [old, new] = clusters.map(|cluster| cluster.controllers.get(place));
    let has_other =
        old.zip(new).is_some_and(|(old, new)| different_point(&old.code, &new.code).is_some());
    has_other || layouts[0] != layouts[1] || read[0] != read[1] || wired[0] != wired[1]
}

/// The places of points that both versions have.
fn moved(common: &[[Point; 2]]) -> Vec<Moved> {
    let moved = common.iter().map(|both| {
        let [before, after] = both.each_ref().map(PointPlace::of);
        Moved { before, after }
    });
    moved.collect()
}

/// Why the points of a program cannot change while it runs.
pub(super) fn fixed_points(
    before: &Cluster,
    after: &Cluster,
    program: ProgramId,
) -> impl Iterator<Item = FixedPoints> {
    let place = program.index();
    let clusters = [before, after];
    let has = move |is: &dyn Fn(&Cluster) -> bool| clusters.iter().any(|cluster| is(cluster));
    let fields = clusters.map(|it| it.remote_ios[place].field.as_ref());
    let connections = fields.map(|field| field.map(|it| (&it.connection, it.unit)));
    let sources: [BTreeSet<ProgramId>; 2] =
        clusters.map(|it| it.remote_ios[place].signals().map(|signal| signal.input.from).collect());
    let groups = clusters.map(|it| groups_read(&it.remote_ios[place]));
    let reasons = [
        (FixedPoints::Twin, has(&|it| it.remote_ios[place].twin.is_some())),
        (FixedPoints::Diagnosis, has(&|it| it.remote_ios[place].diagnosis.is_some())),
        (FixedPoints::Plant, has(&|it| it.plants[place].is_some())),
        (
            FixedPoints::ReadByAnother,
            has(&|it| {
                let mut signals = it.remote_ios.iter().flat_map(|reader| reader.signals());
                signals.any(|signal| signal.input.from == program)
            }),
        ),
        (FixedPoints::PaperMode, has(&|it| it.agreement.mode == Mode::Paper)),
        (FixedPoints::Device, fields[0].is_some() != fields[1].is_some()),
        (
            FixedPoints::OtherDevice,
            fields.iter().all(Option::is_some) && connections[0] != connections[1],
        ),
        (FixedPoints::OtherSources, sources[0] != sources[1]),
        (FixedPoints::OtherGroups, groups[0] != groups[1]),
    ];
    reasons.into_iter().filter_map(|(why, is_so)| is_so.then_some(why))
}

/// The signals of other groups that a remote I/O reads, with the samples for which a value holds: a gateway writes each under the name of its input.
fn groups_read(remote_io: &RemoteIo) -> BTreeMap<&str, (Option<&GroupSignal>, u32)> {
    let read = remote_io.inputs.iter().filter_map(|source| {
        let operator = source.operator()?;
        match operator.input.kind {
            OperatorInputKind::Group { stale_after, .. } => {
                Some((source.name.as_str(), (operator.group.as_ref(), stale_after)))
            }
            _ => None,
        }
    });
    read.collect()
}
