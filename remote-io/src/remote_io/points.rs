//! The points that count: those of the program that takes the newest sample.
//!
//! ```text
//!   sample without a change mark   the points stay
//!   sample with one                the points of the new program count from here on: for this u(i), and for the outputs of this very cycle
//!   a history that was adopted     the points of the program whose state it continues from, as the station names it
//! ```
//!
//! Values of points that stay go with them, by name and type ([`understudy_cycle::Passage`]). Forces end. A history of which it is not known what its
//! points are is not sampled: no member could tell what a bit of it means.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use understudy_cycle::{Layout, OnlineChange, Output, Passage};
use understudy_wire::{Header, Holding, Image, PointsHash, ProgramHash, Recalled};

use super::RemoteIo;
use super::actuation::Execution;
use crate::event::{Event, ForceEnd};

/// The layout by which the device is read, with the version of the program that it is of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sensed {
    version: ProgramHash,
    layout: Arc<Layout>,
}

/// Two remote I/Os that differ in it alone are not told apart: a device is told of other points before it is read again.
impl Hash for Sensed {
    fn hash<H: Hasher>(&self, _: &mut H) {}
}

impl Sensed {
    pub(super) fn new(version: ProgramHash, layout: &Arc<Layout>) -> Self {
        Self { version, layout: Arc::clone(layout) }
    }
}

impl RemoteIo {
    /// It says by which points it begins, to those who follow its events from the start; after [`Self::changed`].
    #[must_use]
    pub fn telling_points(mut self) -> Self {
        self.report(Event::Points { version: self.laid_out });
        self
    }

    /// The way of the points from one version of its program to another one; nothing where they stay.
    fn passage(&self, from: ProgramHash, to: ProgramHash) -> Option<Passage<'_>> {
        let change = self.member.changing().change()?;
        change.passage(self.settings.program, (from, to))
    }

    /// Whether the change that it has loaded replaces its points.
    pub(super) fn replaces_points(&self) -> bool {
        let change = self.member.changing().change();
        change.and_then(|change| change.of(self.settings.program)?.points.as_ref()).is_some()
    }

    /// The layout of a version of its program; nothing where that is not known.
    pub(super) fn layout_of(&self, version: ProgramHash) -> Option<&Arc<Layout>> {
        let change = self.member.changing().change();
        let replaced = change.and_then(|change| change.layout(self.settings.program, version));
        let stays = !self.replaces_points() && self.is_loaded(version);
        replaced.or_else(|| stays.then_some(&self.layout))
    }

    /// Whether it knows the points of a state that a station holds.
    pub(super) fn can_read(&self, holding: &Holding) -> bool {
        holding.version.is_none_or(|version| self.layout_of(version).is_some())
    }

    /// What the samples of its program name: its version, where the hash tells the points.
    pub(super) fn named(&self, version: Option<ProgramHash>) -> Option<ProgramHash> {
        version.filter(|_| self.replaces_points())
    }

    /// The version of its program that the frame of a station is of, where the frame does not name it: that of the only configuration of the sender.
    pub(super) fn version_in(
        &self,
        header: &Header,
        named: Option<ProgramHash>,
    ) -> Option<ProgramHash> {
        let change = self.member.changing().change().filter(|_| self.replaces_points());
        let implied = change.filter(|_| header.prepared.is_none()).and_then(|change| {
            let configuration = header.configuration;
            let has = change.name().has(configuration);
            change.program_in(configuration, self.settings.program).filter(|_| has)
        });
        named.or(implied.map(|program| program.hash))
    }

    /// The width of inputs of a version; where none is named, those of the points that count.
    pub(super) fn has_width(&self, inputs: &Image, version: Option<ProgramHash>) -> bool {
        let layout = version.map_or(Some(&self.layout), |version| self.layout_of(version));
        layout.is_some_and(|layout| layout.input_width() == inputs.width())
    }

    /// A u(i) of a version of the program by the points that count, where those are other ones.
    pub(super) fn by_these_points(
        &self,
        inputs: &Image,
        version: Option<ProgramHash>,
    ) -> Option<Image> {
        let passage = self.passage(version?, self.laid_out)?;
        Some(passage.inputs(inputs, &self.layout.initial()))
    }

    /// What stations recall of a sample, by the points that count.
    pub(super) fn recalled_by_these_points(&self, mut recalled: Recalled) -> Recalled {
        let passage = recalled.version.and_then(|version| self.passage(version, self.laid_out));
        if let Some(passage) = passage {
            recalled.inputs = passage.inputs(&recalled.inputs, &self.layout.initial());
            recalled.pulses.retain(|pulse| {
                let input = passage.input_at(pulse.input);
                pulse.input = input.unwrap_or(pulse.input);
                input.is_some()
            });
            recalled.pulses.sort_unstable_by_key(|pulse| pulse.input);
        }
        recalled
    }

    /// Whether a signal that was found by these points is the one that has its place now. Who says nothing of points means those that count, as long as no
    /// loaded change can replace them. A change that leaves them has two names for them.
    pub(super) fn counts_by(&self, points: Option<PointsHash>) -> bool {
        let change = self.member.changing().change();
        let change = change.and_then(|change| change.of(self.settings.program));
        match (points, change) {
            (None, _) => !self.replaces_points(),
            (Some(points), _) if points == self.layout.hash => true,
            (Some(points), Some(change)) => {
                change.points.is_none() && change.known_by.contains(&points)
            }
            (Some(_), None) => false,
        }
    }

    /// The sensors show these values, by the points that the device is read by.
    pub(super) fn take_sensors(&mut self, sensors: &Image) {
        let Sensed { version, layout } = &self.inputs.sensed;
        if sensors.width() != layout.input_width() {
            return;
        }
        if *layout == self.layout {
            self.inputs.sensors = Some(sensors.clone());
        } else if let Some(passage) = self.passage(*version, self.laid_out) {
            // The device is not told yet, or has not changed yet: new inputs keep what they have.
            let values = self.inputs.sensors.as_ref().unwrap_or(&self.layout.undriven);
            self.inputs.sensors = Some(passage.field_inputs(layout, sensors, values));
        }
    }

    /// From now on the device is read by the points of a version of the program.
    pub(super) fn is_read_by(&mut self, version: ProgramHash) {
        if let Some(layout) = self.layout_of(version) {
            self.inputs.sensed = Sensed::new(version, layout);
        }
    }

    /// A version of the program takes the next sample: its points count from now on. Whether they are other ones.
    pub(super) fn lay_out(&mut self, version: ProgramHash) -> bool {
        let change = self.member.changing().change().cloned();
        change.is_some_and(|change| self.lay_out_by(&change, version))
    }

    /// The same by a change that may be over.
    pub(super) fn lay_out_by(&mut self, change: &OnlineChange, version: ProgramHash) -> bool {
        let from = std::mem::replace(&mut self.laid_out, version);
        let program = self.settings.program;
        let Some(passage) = change.passage(program, (from, version)) else {
            self.are_known_by(change.of(program).and_then(|change| change.known_by(version)));
            return false;
        };
        let moment = self.moment();
        self.end_all_forces(ForceEnd::OnlineChange);
        let old = std::mem::replace(&mut self.layout, Arc::clone(passage.to()));
        // By changes of the program alone, the device may be of an earlier version with the same points.
        if self.inputs.sensed.layout == old {
            self.inputs.sensed.version = from;
        }
        let void = self.inputs.lay_out(&old, passage, moment);
        if self.layout.stop.is_none() {
            self.actuation.execution = Execution::Running;
        }
        self.member.put(Output::LayOut(version));
        self.carry_outputs(change, passage);
        self.report(Event::PointsChanged { moment, from, to: version });
        self.report_void(&void);
        true
    }

    /// The points stay, and are those of another version.
    fn are_known_by(&mut self, points: Option<PointsHash>) {
        let Some(hash) = points.filter(|points| *points != self.layout.hash) else {
            return;
        };
        let is_read_by_them = self.inputs.sensed.layout == self.layout;
        Arc::make_mut(&mut self.layout).hash = hash;
        if is_read_by_them {
            self.inputs.sensed.layout = Arc::clone(&self.layout);
        }
    }

    /// Outputs that stay are held, and go to their fail-safe values, from where they are. New ones have their fail-safe values until they are proved.
    fn carry_outputs(&mut self, change: &OnlineChange, passage: Passage<'_>) {
        let own = self.configurations().own;
        let native = change.fallback_in(own, self.settings.program).cloned();
        let native = native.unwrap_or_else(|| self.settings.fallback.clone());
        let fitted = change.fitted((&native, own), self.settings.program, self.laid_out);
        let moved = |outputs: &Image| passage.outputs(outputs, &fitted.fail_safe);
        self.actuation.carry(moved);
        self.take_settings(fitted);
    }

    /// A station holds a state of this program by points that are not known here: nothing is sampled before they are. Said once for each version.
    pub(super) fn miss_points(&mut self, version: Option<ProgramHash>) {
        if self.unknown_points != version {
            self.unknown_points = version;
            if let Some(version) = version {
                let moment = self.moment();
                self.report(Event::PointsUnknown { moment, version });
            }
        }
    }
}
