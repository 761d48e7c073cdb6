//! u(i) of a sample: a list of overlays, each on top of those before it.
//!
//! The list ([`Overlay::IN_ORDER`]) is the rule which of several values an input has.

#[cfg(test)]
mod tests;

use smallvec::SmallVec;
use understudy_cycle::{Layout, Passage};
use understudy_wire::{Image, Moment};

use super::forcing::Forcing;
use super::points::Sensed;
use super::signals::Signals;
use super::writing::{WithoutEffect, Writing};
use crate::diagnosis::{Diagnosing, Diagnosis, Observation};
use crate::settings::Settings;

/// Where the values of u(i) come from.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Inputs {
    pub(super) sensed: Sensed,
    /// What the sensors show; `None` where it is not known: there is no u(i), and the program is not stepped.
    pub(super) sensors: Option<Image>,
    /// What the program sees of it, as of the last sample.
    pub(super) field: Image,
    pub(super) diagnosing: Diagnosing,
    /// Statuses that the diagnosis found to be 1 in the last scan.
    pub(super) diagnosed: Image,
    pub(super) forcing: Forcing,
    pub(super) writing: Writing,
    pub(super) signals: Signals,
}

/// One source of values of inputs, on top of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Overlay {
    /// What the sensors show.
    Sensors,
    /// The findings of the diagnosis: statuses that are 1, and inputs that keep their last good value.
    Channels,
    /// Values that an operator wrote.
    Operator,
    /// Outputs of other programs.
    Signals,
    /// Values that an operator forces. A sample has u(i) without them too.
    Forces,
    /// The reset of a program that a fault has stopped.
    Reset,
}

impl Overlay {
    pub(super) const IN_ORDER: [Self; 6] =
        [Self::Sensors, Self::Channels, Self::Operator, Self::Signals, Self::Forces, Self::Reset];
}

/// What is known when a sample is taken.
pub(super) struct Sampling<'a> {
    pub(super) moment: Moment,
    pub(super) layout: &'a Layout,
    pub(super) sensors: Image,
    pub(super) diagnosis: Option<&'a Diagnosis>,
    /// The outputs as they were driven at the last deadline, and whether they were proved.
    pub(super) driven: (&'a Image, bool),
    /// u(i) of the sample before.
    pub(super) newest: Option<&'a Image>,
    pub(super) resets: bool,
}

/// u(i) of a sample.
#[derive(Debug, Default)]
pub(super) struct SampledInputs {
    pub(super) inputs: Image,
    /// The same without forces.
    pub(super) unforced: Image,
    /// Statuses that the diagnosis has found, where they have changed.
    pub(super) diagnosed: Option<Image>,
    /// Inputs for signals whose validity has changed.
    pub(super) validity: SmallVec<[(u16, bool); 1]>,
}

impl Inputs {
    pub(super) fn new(settings: &Settings) -> Self {
        let layout = &settings.layout;
        Self {
            sensed: Sensed::new(settings.hash, layout),
            sensors: settings.pair.is_none().then(|| layout.undriven.clone()),
            field: layout.undriven.clone(),
            diagnosing: Diagnosing::new(settings.diagnosis.as_deref()),
            diagnosed: Image::zero(layout.input_width()),
            forcing: Forcing::default(),
            writing: Writing::new(&layout.operator_inputs),
            signals: Signals::of(layout),
        }
    }

    /// The newest u(i) without forces.
    fn unforced(&self, layout: &Layout) -> Image {
        let mut inputs = self.field.clone();
        self.writing.put(&layout.operator_inputs, None, &mut inputs);
        self.signals.put_newest(&layout.signals, &mut inputs);
        inputs
    }

    /// Inputs have the places and the sources of the layout that `passage` leads to. One that comes from elsewhere has its newest value until the first
    /// one from there. Answers with the writes that have no effect.
    pub(super) fn lay_out(
        &mut self,
        old: &Layout,
        passage: Passage<'_>,
        moment: Moment,
    ) -> WithoutEffect {
        let layout = passage.to();
        let newest = passage.inputs(&self.unforced(old), &layout.undriven);
        let shown = |sensors: &Image| passage.field_inputs(old, sensors, &newest);
        self.sensors = self.sensors.as_ref().map(shown);
        self.field = shown(&self.field);
        self.diagnosed = Image::zero(layout.input_width());
        self.signals.lay_out(old, layout, &|place| passage.input(place));
        let operated = (&old.operator_inputs[..], &layout.operator_inputs[..]);
        self.writing.lay_out(operated, moment, (passage, &newest))
    }

    /// u(i) of a sample.
    pub(super) fn sample(&mut self, mut sampling: Sampling<'_>) -> SampledInputs {
        let mut sampled = SampledInputs::default();
        for overlay in Overlay::IN_ORDER {
            self.lay(overlay, &mut sampling, &mut sampled);
        }
        sampled
    }

    /// Lays one overlay on top of the values before.
    fn lay(&mut self, overlay: Overlay, sampling: &mut Sampling<'_>, sampled: &mut SampledInputs) {
        let (layout, moment) = (sampling.layout, sampling.moment);
        match overlay {
            Overlay::Sensors => sampled.inputs = std::mem::take(&mut sampling.sensors),
            Overlay::Channels => {
                let shown = &mut sampled.inputs;
                let found = sampling.diagnosis.map(|diagnosis| {
                    let (outputs, is_true) = sampling.driven;
                    let driven = &self.forcing.outputs(outputs);
                    let observation = Observation { sensors: shown, driven, is_true };
                    self.diagnosing.scan(diagnosis, observation)
                });
                if let Some(found) = &found {
                    for status in (0..shown.width()).filter(|&place| found.failed.get(place)) {
                        shown.set(status, true);
                    }
                    if self.diagnosed != found.failed {
                        self.diagnosed = found.failed.clone();
                        sampled.diagnosed = Some(found.failed.clone());
                    }
                }
                let unsteady = found.as_ref().map(|found| &found.unsteady);
                self.field = layout.seen(&self.field, shown, unsteady);
                *shown = self.field.clone();
            }
            Overlay::Operator => {
                let inputs = &layout.operator_inputs;
                self.writing.put(inputs, sampling.newest, &mut sampled.inputs);
            }
            Overlay::Signals => {
                let signals = &layout.signals;
                sampled.validity = self.signals.put(signals, moment, &mut sampled.inputs);
            }
            Overlay::Forces => {
                sampled.unforced = sampled.inputs.clone();
                sampled.inputs = self.forcing.inputs(std::mem::take(&mut sampled.inputs));
            }
            Overlay::Reset => {
                if let Some(stop) = layout.stop
                    && sampling.resets
                {
                    sampled.inputs.set(stop.reset, true);
                    sampled.unforced.set(stop.reset, true);
                }
            }
        }
    }
}
