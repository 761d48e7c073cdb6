//! Answers of the model.

use std::sync::Arc;

use understudy_cluster::{Card, Cluster, Controller, same_point};
use understudy_journal::{Members, PointsInEffect, Present, SourceCounts, TimeOfDay};
use understudy_ladder::Evaluation;
use understudy_typed::{Point, Trace};
use understudy_wire::{Member, Moment, ProgramHash, ProgramId, StationId};

use super::{Counters, Model, SentTurn};
use crate::alarm::Alarm;
use crate::error::ViewError;
use crate::event::Event;
use crate::history::{History, Sampled};
use crate::series::Series;
use crate::station::StationState;
use crate::timing::CycleTiming;
use crate::version::Version;

/// Why a scan after an online change is not explained.
const NOT_KNOWN: &str =
    "an online change has replaced its program, and the journal does not contain the new one";

impl Model {
    /// The cluster of the run.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// Names of the members.
    pub fn members(&self) -> &Members {
        self.present.members()
    }

    /// The newest cycle that was decided, from the origin of the run.
    pub fn cycle(&self) -> Option<i64> {
        self.cycles.latest()
    }

    /// Whether the origin of the cycles is known.
    pub fn has_origin(&self) -> bool {
        self.cycles.has_origin()
    }

    /// Records taken so far, and those that were left out, at least.
    pub fn records(&self) -> (u64, u64) {
        (self.records, self.left_out)
    }

    /// Time of the newest record.
    pub fn at_ns(&self) -> u64 {
        self.at_ns
    }

    /// The run was ended early, on request or by the end of the process that wrote it.
    pub fn is_interrupted(&self) -> bool {
        self.interrupted
    }

    /// The last record of the run was read.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// Events that are counted from the first record on.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Deadlines of a program by source, from the origin up to a cycle.
    pub(crate) fn source_counts(&self, program: ProgramId, cycle: Option<i64>) -> SourceCounts {
        let track = self.programs.get(program.index()).zip(cycle);
        track.map_or_else(SourceCounts::default, |(track, cycle)| track.tally.counts(cycle))
    }

    /// The first cycle of those in a row that have the source of `cycle`.
    pub(crate) fn since(&self, program: ProgramId, cycle: i64) -> Option<i64> {
        self.programs.get(program.index())?.tally.since(cycle)
    }

    /// The present state of a station.
    pub(crate) fn station_state(&self, station: StationId) -> Option<StationState> {
        let standing = self.changes.now();
        standing.station(station)?;
        Some(self.station_state_in(standing, station, self.newest()))
    }

    /// The last cycles of a program.
    pub fn history(&self, program: ProgramId) -> Option<&History> {
        self.histories.get(program.index())
    }

    /// The trends.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The newest events, oldest first.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &Event> {
        self.events.iter()
    }

    /// Events so far, the forgotten ones too: the number of the newest.
    pub fn event_count(&self) -> u64 {
        self.events.count()
    }

    /// Alarms, oldest first.
    pub fn alarms(&self) -> impl DoubleEndedIterator<Item = &Alarm> {
        self.alarms.iter()
    }

    /// Times of the newest cycles, oldest first.
    pub fn timings(&self) -> impl DoubleEndedIterator<Item = &CycleTiming> {
        self.timings.iter()
    }

    /// The cycle of the run that the cluster counts as `cycle`, as the newest deadlines of a remote I/O tell; nothing before the origin of the
    /// run is known.
    pub fn cycle_of(&self, remote_io: Member, cycle: u64) -> Option<i64> {
        let program = remote_io.sampled_program()?;
        if !self.cycles.has_origin() {
            return None;
        }
        let steps = self.history(program)?.steps();
        if let Some(step) = steps.iter().rev().find(|step| step.moment.cycle.0 == cycle) {
            return Some(step.cycle);
        }
        // Not read yet.
        let newest = steps.back()?;
        let later = i64::try_from(cycle.checked_sub(newest.moment.cycle.0)?).ok()?;
        newest.cycle.checked_add(later)
    }

    /// The first cycles of stretches in which cycles are a period apart, with their times of day: those of a range of cycles.
    pub fn times(&self, from: i64, to: i64) -> impl Iterator<Item = (i64, TimeOfDay)> {
        self.times.stretches(from).take_while(move |(first, _)| *first <= to)
    }

    /// Time of day of a cycle; nothing where no wall clock was recorded.
    pub fn time_of(&self, cycle: i64) -> Option<TimeOfDay> {
        self.times.of_cycle(cycle)
    }

    /// The turns of the stations in a cycle of the cluster.
    pub fn sent_turns(&self, moment: Moment) -> &[SentTurn] {
        self.turns.of(moment)
    }

    /// The scan of a program in a cycle as its station evaluated it: the power flow of every rung.
    ///
    /// # Errors
    /// Where the cycle or the state is not known.
    pub fn evaluation(&self, program: ProgramId, cycle: i64) -> Result<Evaluation, ViewError> {
        let history = self.history_of(program)?;
        let place = history.place_of(cycle).ok_or_else(|| self.no_cycle(program, cycle))?;
        self.evaluation_at(history, place)
    }

    pub(crate) fn evaluation_at(
        &self,
        history: &History,
        place: usize,
    ) -> Result<Evaluation, ViewError> {
        let sampled = self.sampled_at(history, place)?;
        let version = self.version_at(history, place)?;
        let observer = version.observer().ok_or_else(|| ViewError::NoState {
            cycle: history.steps()[place].cycle,
            program: self.program_name(history.program()).to_owned(),
            reason: "only a ladder has a power flow".to_owned(),
        })?;
        Ok(observer.evaluate(sampled.state.words(), sampled.inputs.words()))
    }

    /// The scan of a program in a cycle, statement by statement.
    ///
    /// # Errors
    /// Where the cycle or the state is not known.
    pub fn trace(&self, program: ProgramId, cycle: i64) -> Result<Trace, ViewError> {
        let history = self.history_of(program)?;
        let place = history.place_of(cycle).ok_or_else(|| self.no_cycle(program, cycle))?;
        self.trace_at(history, place)
    }

    pub(crate) fn trace_at(&self, history: &History, place: usize) -> Result<Trace, ViewError> {
        let (version, state) = self.typed_state_at(history, place)?;
        let inputs = self.sampled_at(history, place)?.inputs.words();
        Ok(version.interpreter().trace(&state, inputs))
    }

    /// The program that took the sample of a step, and x(t) in the order of its variables.
    pub(crate) fn typed_state_at(
        &self,
        history: &History,
        place: usize,
    ) -> Result<(&Version, Vec<u64>), ViewError> {
        let version = self.version_at(history, place)?;
        let sampled = self.sampled_at(history, place)?;
        let mut state = version.controller().code.typed_state(sampled.state.words()).into_owned();
        state.resize(version.interpreter().state_words(), 0);
        Ok((version, state))
    }

    /// The program that took the sample of a step, or that before it where it has none.
    pub(crate) fn version_at(
        &self,
        history: &History,
        place: usize,
    ) -> Result<&Version, ViewError> {
        let program = history.program();
        let hash = history.program_at(place);
        let version = self.versions.get(program.index()).and_then(|it| it.find(hash));
        version.ok_or_else(|| self.not_known(program, history.steps()[place].cycle))
    }

    /// The program that runs, or that with which the run began where that one is not known.
    pub(crate) fn running_version(&self, program: ProgramId) -> Option<&Version> {
        let versions = self.versions.get(program.index())?;
        let running = self.history(program).map(History::running);
        Some(running.and_then(|it| versions.find(it)).unwrap_or_else(|| versions.first()))
    }

    /// The program that took the sample of a cycle; where nothing is known of the cycle, the one that runs.
    pub(crate) fn version_in(&self, program: ProgramId, cycle: Option<i64>) -> Option<&Version> {
        let history = self.history(program)?;
        let place = cycle.and_then(|cycle| history.place_of(cycle));
        let version = place.and_then(|place| self.version_at(history, place).ok());
        version.or_else(|| self.running_version(program))
    }

    /// The controller with the program that took the sample of a cycle; where nothing is known of the cycle, with the one that runs.
    pub fn controller_at(&self, program: ProgramId, cycle: Option<i64>) -> Option<&Controller> {
        self.version_in(program, cycle).map(Version::controller)
    }

    /// A program as the version by whose points its inputs and outputs of a cycle are named, where nothing is known of the cycle those that count now;
    /// nothing where they are not known.
    pub fn points_at(&self, program: ProgramId, cycle: Option<i64>) -> Option<&Controller> {
        let version = self.points_version(program, cycle)?;
        self.present.controller_of(program, version)
    }

    /// The version of a program by whose points its inputs and outputs of a cycle are named.
    pub(crate) fn points_version(
        &self,
        program: ProgramId,
        cycle: Option<i64>,
    ) -> Option<ProgramHash> {
        let step = cycle.and_then(|cycle| self.deadline(program, cycle));
        let driven = step.and_then(|step| step.driven.as_ref());
        let counts = || self.present.versions().get(program.index()).copied();
        driven.map(|driven| driven.points).or_else(counts)
    }

    /// A program as the version by whose points its outputs of a moment of the cluster are named; nothing where that is not known.
    pub(crate) fn points_of(&self, program: ProgramId, moment: Moment) -> Option<&Controller> {
        let mut steps = self.history(program)?.steps().iter().rev();
        let step = steps.find(|step| step.moment == moment && !step.void);
        let of_step = step.and_then(|step| {
            let driven = step.driven.as_ref().map(|driven| driven.points);
            step.sampled.as_ref().map(|sampled| sampled.program).or(driven)
        });
        let version = of_step.or_else(|| self.points_version(program, None))?;
        self.present.controller_of(program, version)
    }

    /// The stored value of the input that a point of another scan is in the scan of the step at `place`; nothing where its program has none, or the sample is not
    /// known.
    pub(crate) fn input_at(&self, history: &History, place: usize, point: &Point) -> Option<u64> {
        let sampled = history.steps()[place].sampled.as_ref()?;
        let version = self.version_at(history, place).ok()?;
        let own = same_point(point, &version.controller().interface.inputs)?;
        Some(own.get(sampled.inputs.words()))
    }

    /// The points by which the inputs and outputs of a cycle are named.
    pub fn points_in(&self, cycle: Option<i64>) -> PointsInEffect {
        let versions = self.program_ids().filter_map(|program| self.points_version(program, cycle));
        self.present.with(&versions.collect::<Vec<_>>())
    }

    /// How an input or output is shown that counts in a cycle.
    pub fn card(&self, program: ProgramId, name: &str, cycle: i64) -> Card {
        self.points_in(Some(cycle)).cluster().card(program, name)
    }

    /// The points that count after the newest record.
    pub fn present(&self) -> &Present {
        &self.present
    }

    /// The sample of a step, where the state before it is known.
    pub(crate) fn sampled_at<'h>(
        &self,
        history: &'h History,
        place: usize,
    ) -> Result<&'h Sampled, ViewError> {
        let step = &history.steps()[place];
        step.sampled.as_ref().ok_or_else(|| {
            let missing = step.driven.as_ref().and_then(|driven| driven.missing);
            let reason = match missing {
                Some(missing) => crate::describe::missing_text(missing),
                None if history.is_replaced(step.moment) => NOT_KNOWN,
                None => "the journal does not contain the start of its history",
            };
            ViewError::NoState {
                cycle: step.cycle,
                program: self.program_name(history.program()).to_owned(),
                reason: reason.to_owned(),
            }
        })
    }

    /// An online change has brought a program that the journal does not contain.
    pub(crate) fn not_known(&self, program: ProgramId, cycle: i64) -> ViewError {
        ViewError::NoState {
            cycle,
            program: self.program_name(program).to_owned(),
            reason: NOT_KNOWN.to_owned(),
        }
    }

    /// The run has another program in the place of one after a cycle than the one that is asked for.
    pub(crate) fn other_program(&self, program: ProgramId, cycle: i64) -> ViewError {
        ViewError::NoState {
            cycle,
            program: self.program_name(program).to_owned(),
            reason: "the run has another program there, after an online change".to_owned(),
        }
    }

    pub(crate) fn history_of(&self, program: ProgramId) -> Result<&History, ViewError> {
        self.history(program).ok_or_else(|| ViewError::NoName {
            kind: "program",
            name: program.0.to_string(),
            hint: format!("it has {}", self.programs.len()),
        })
    }

    pub(crate) fn no_cycle(&self, program: ProgramId, cycle: i64) -> ViewError {
        let steps = self.history(program).map(History::steps);
        let ends = steps.and_then(|steps| Some((steps.front()?.cycle, steps.back()?.cycle)));
        ViewError::NoCycle { cycle, program: self.program_name(program).to_owned(), known: ends }
    }

    pub(crate) fn program_name(&self, program: ProgramId) -> &str {
        crate::describe::program_name(program, self.members())
    }
}
