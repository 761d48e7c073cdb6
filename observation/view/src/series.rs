//! The trends: images and sources of each program, and states of each station, over the cycles.

use understudy_cluster::Controller;
use understudy_wire::{Image, ProgramId, Source, StationId};

use crate::coarse::Coarse;
use crate::station::StationState;
use crate::timeline::Timeline;

/// Over cycles from the origin of the run.
#[derive(Debug, Clone)]
pub struct Series {
    inputs: Vec<Timeline<Image>>,
    outputs: Vec<Timeline<Image>>,
    sources: Vec<Timeline<Source>>,
    stations: Vec<Timeline<StationState>>,
    coarse_inputs: Vec<Coarse>,
    coarse_outputs: Vec<Coarse>,
}

impl Series {
    pub(crate) fn new(controllers: &[Controller], stations: usize, most: usize) -> Self {
        let programs = controllers.len();
        let interfaces = || controllers.iter().map(|controller| &controller.interface);
        Self {
            coarse_inputs: interfaces().map(|of| Coarse::new(&of.inputs)).collect(),
            coarse_outputs: interfaces().map(|of| Coarse::new(&of.outputs)).collect(),
            inputs: vec![Timeline::new(most); programs],
            outputs: vec![Timeline::new(most); programs],
            sources: vec![Timeline::new(most); programs],
            stations: vec![Timeline::new(most); stations],
        }
    }

    /// u(i), where it was sampled.
    pub fn inputs(&self, program: ProgramId) -> Option<&Timeline<Image>> {
        self.inputs.get(program.index())
    }

    /// y(i) as driven.
    pub fn outputs(&self, program: ProgramId) -> Option<&Timeline<Image>> {
        self.outputs.get(program.index())
    }

    /// u(i) over ranges of cycles, further back than [`Series::inputs`].
    pub fn coarse_inputs(&self, program: ProgramId) -> Option<&Coarse> {
        self.coarse_inputs.get(program.index())
    }

    /// y(i) as driven over ranges of cycles, further back than [`Series::outputs`].
    pub fn coarse_outputs(&self, program: ProgramId) -> Option<&Coarse> {
        self.coarse_outputs.get(program.index())
    }

    /// Sources of its outputs.
    pub fn sources(&self, program: ProgramId) -> Option<&Timeline<Source>> {
        self.sources.get(program.index())
    }

    /// States of a station.
    pub fn station(&self, station: StationId) -> Option<&Timeline<StationState>> {
        self.stations.get(station.index())
    }

    pub(crate) fn shift(&mut self, by: i64) {
        let images = self.inputs.iter_mut().chain(&mut self.outputs);
        images.for_each(|timeline| timeline.shift(by));
        let coarse = self.coarse_inputs.iter_mut().chain(&mut self.coarse_outputs);
        coarse.for_each(|coarse| coarse.shift(by));
        self.sources.iter_mut().for_each(|timeline| timeline.shift(by));
        self.stations.iter_mut().for_each(|timeline| timeline.shift(by));
    }

    pub(crate) fn applied(
        &mut self,
        program: ProgramId,
        cycle: i64,
        inputs: Option<&Image>,
        outputs: &Image,
        source: Source,
    ) {
        let place = program.index();
        if place >= self.outputs.len() {
            return;
        }
        if let Some(inputs) = inputs {
            self.inputs[place].push(cycle, inputs);
            self.coarse_inputs[place].push(cycle, inputs);
        }
        self.coarse_outputs[place].push(cycle, outputs);
        self.outputs[place].push(cycle, outputs);
        self.sources[place].push(cycle, &source);
    }

    pub(crate) fn station_was(&mut self, rank: usize, cycle: i64, state: StationState) {
        if let Some(timeline) = self.stations.get_mut(rank) {
            timeline.push(cycle, &state);
        }
    }
}
