//! The trends: images and sources of each program, and states of each station, over the cycles.
//!
//! The images of a program are kept in stretches in which the same points counted. A point that stays over a change of points, by name and type, has one series
//! through all of them; any other one begins or ends there.

use std::collections::VecDeque;

use understudy_cluster::{Controller, same_point};
use understudy_executable::Interface;
use understudy_typed::{Point, Points};
use understudy_wire::{Image, ProgramId, Source, StationId};

use crate::coarse::{Coarse, Extremes, MAXIMUM_COLUMNS, widened};
use crate::station::StationState;
use crate::timeline::{Span, Timeline};

/// Stretches with the same points that are kept of a program, at most.
const MOST_STRETCHES: usize = 16;

/// Over cycles from the origin of the run.
#[derive(Debug, Clone)]
pub struct Series {
    inputs: Vec<Images>,
    outputs: Vec<Images>,
    sources: Vec<Timeline<Source>>,
    stations: Vec<Timeline<StationState>>,
}

/// The inputs or the outputs of a program.
#[derive(Debug, Clone)]
pub struct Images {
    /// The newest last; never empty.
    stretches: VecDeque<Stretch>,
    most: usize,
}

/// Cycles in which the same points counted.
#[derive(Debug, Clone)]
struct Stretch {
    /// Nothing where they are not known.
    points: Option<Points>,
    exact: Timeline<Image>,
    /// The same over ranges of cycles, further back.
    coarse: Coarse,
}

impl Stretch {
    fn new(points: Option<&Points>, most: usize) -> Self {
        Self {
            coarse: Coarse::new(points.unwrap_or(&Points::default())),
            exact: Timeline::new(most),
            points: points.cloned(),
        }
    }

    /// The point that a point is here.
    fn point(&self, of: &Point) -> Option<&Point> {
        same_point(of, self.points.as_ref()?)
    }
}

impl Images {
    fn new(points: &Points, most: usize) -> Self {
        Self { stretches: [Stretch::new(Some(points), most)].into(), most }
    }

    /// Other points count from now on, which may not be known.
    fn lay_out(&mut self, points: Option<&Points>) {
        if self.stretches.len() == MOST_STRETCHES {
            self.stretches.pop_front();
        }
        self.stretches.push_back(Stretch::new(points, self.most));
    }

    fn push(&mut self, cycle: i64, image: &Image) {
        let is_before = |stretch: &Stretch| {
            let extent = stretch.exact.extent();
            extent.is_none_or(|(_, end)| end <= cycle)
        };
        // A cycle that has a value by the points of before keeps it.
        if let Some((newest, earlier)) = self.stretches.make_contiguous().split_last_mut()
            && earlier.iter().all(is_before)
        {
            newest.exact.push(cycle, image);
            newest.coarse.push(cycle, image);
        }
    }

    fn shift(&mut self, by: i64) {
        for stretch in &mut self.stretches {
            stretch.exact.shift(by);
            stretch.coarse.shift(by);
        }
    }

    /// The image of a cycle, with its points; nothing where it or they are not known.
    pub fn at(&self, cycle: i64) -> Option<(&Points, &Image)> {
        let found = self.stretches.iter().find_map(|it| Some((it, it.exact.at(cycle)?)));
        let (stretch, image) = found?;
        Some((stretch.points.as_ref()?, image))
    }

    /// The stored value of a point in a cycle; nothing where it is not known, and where the program did not have the point.
    pub fn stored_at(&self, point: &Point, cycle: i64) -> Option<u64> {
        let (points, image) = self.at(cycle)?;
        Some(same_point(point, points)?.get(image.words()))
    }

    /// The stored values of a point in the cycles `from` to below `to`, where they are known and the program had the point.
    pub fn spans(&self, point: &Point, from: i64, to: i64) -> impl Iterator<Item = Span<u64>> {
        let stretches = self.stretches.iter().filter_map(|it| Some((it, it.point(point)?)));
        stretches.flat_map(move |(stretch, own)| {
            stretch.exact.spans(from, to).map(|span| Span {
                from: span.from,
                to: span.to,
                value: own.get(span.value.words()),
            })
        })
    }

    /// The cycles at which an image begins or ends, from `from` to `to`.
    pub(crate) fn borders(&self, from: i64, to: i64) -> Vec<i64> {
        let spans = self.stretches.iter().flat_map(|it| it.exact.spans(from, to));
        spans.flat_map(|span| [span.from, span.to]).collect()
    }

    /// The least and the greatest value of a point in each of `count` columns of `width` cycles, from a cycle on, further back than [`Images::spans`];
    /// nothing where no value is known.
    pub fn columns(
        &self,
        point: &Point,
        from: i64,
        width: i64,
        count: usize,
    ) -> Vec<Option<Extremes>> {
        let mut columns = vec![None; count.min(MAXIMUM_COLUMNS)];
        for (stretch, own) in self.stretches.iter().filter_map(|it| Some((it, it.point(point)?))) {
            let found = stretch.coarse.columns(own, from, width, count);
            for (column, found) in columns.iter_mut().zip(found) {
                *column = match (*column, found) {
                    (Some(known), Some(found)) => Some(widened(known, found)),
                    (known, found) => known.or(found),
                };
            }
        }
        columns
    }
}

impl Series {
    pub(crate) fn new(controllers: &[Controller], stations: usize, most: usize) -> Self {
        let interfaces = || controllers.iter().map(|controller| &controller.interface);
        Self {
            inputs: interfaces().map(|of| Images::new(&of.inputs, most)).collect(),
            outputs: interfaces().map(|of| Images::new(&of.outputs, most)).collect(),
            sources: vec![Timeline::new(most); controllers.len()],
            stations: vec![Timeline::new(most); stations],
        }
    }

    /// u(i), where it was sampled.
    pub fn inputs(&self, program: ProgramId) -> Option<&Images> {
        self.inputs.get(program.index())
    }

    /// y(i) as driven.
    pub fn outputs(&self, program: ProgramId) -> Option<&Images> {
        self.outputs.get(program.index())
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
        self.inputs.iter_mut().chain(&mut self.outputs).for_each(|images| images.shift(by));
        self.sources.iter_mut().for_each(|timeline| timeline.shift(by));
        self.stations.iter_mut().for_each(|timeline| timeline.shift(by));
    }

    /// Other points of a program count from now on; nothing where they are not known.
    pub(crate) fn lay_out(&mut self, program: ProgramId, interface: Option<&Interface>) {
        if let Some(images) = self.inputs.get_mut(program.index()) {
            images.lay_out(interface.map(|it| &it.inputs));
        }
        if let Some(images) = self.outputs.get_mut(program.index()) {
            images.lay_out(interface.map(|it| &it.outputs));
        }
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
        }
        self.outputs[place].push(cycle, outputs);
        self.sources[place].push(cycle, &source);
    }

    pub(crate) fn station_was(&mut self, rank: usize, cycle: i64, state: StationState) {
        if let Some(timeline) = self.stations.get_mut(rank) {
            timeline.push(cycle, &state);
        }
    }
}
