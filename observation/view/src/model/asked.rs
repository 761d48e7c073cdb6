//! What views ask of the model.

use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_ladder::{Evaluation, Observer};
use understudy_logic::Scratch;
use understudy_wire::{Moment, ProgramId, StationId};

use super::{Model, ProgramTrack, SentTurn};
use crate::alarm::Alarm;
use crate::error::ViewError;
use crate::event::Event;
use crate::history::History;
use crate::margin::Holders;
use crate::series::Series;
use crate::station::StationState;
use crate::timing::CycleTiming;

impl Model {
    /// What is run.
    pub fn cluster(&self) -> &Arc<Cluster> {
        &self.cluster
    }

    /// Who is who.
    pub fn members(&self) -> &Members {
        &self.members
    }

    /// The newest cycle that was decided, from the origin of the run.
    pub fn cycle(&self) -> Option<i64> {
        self.cycles.latest()
    }

    /// Whether it is known where cycles are counted from.
    pub fn has_origin(&self) -> bool {
        self.cycles.has_origin()
    }

    /// Records taken so far, and those that were left out, at least.
    pub fn records(&self) -> (u64, u64) {
        (self.records, self.left_out)
    }

    /// The time of the newest record.
    pub fn at_ns(&self) -> u64 {
        self.at_ns
    }

    /// The last record of the run was read.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// What the scenario came to, where it is over in this cycle and the cluster stays up.
    pub fn scenario_over(&self, cycle: i64) -> Option<&str> {
        let (over, verdict) = self.scenario_over.as_ref()?;
        (*over <= cycle).then_some(verdict)
    }

    /// What a station is now.
    pub fn station_state(&self, station: StationId) -> Option<StationState> {
        let track = self.stations.get(station.index())?;
        Some(track.state(self.cycles.latest(), 1))
    }

    /// What a program did in its last cycles.
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

    /// What the stations said in a cycle of the cluster.
    pub fn sent_turns(&self, moment: Moment) -> &[SentTurn] {
        self.turns.of(moment)
    }

    /// Who is alive, and holds what: what the margin of survival is calculated from.
    pub fn holders(&self) -> Holders {
        let latest = self.cycles.latest();
        let widths = self.cluster.controllers().iter();
        let holds = self.stations.iter().map(|track| {
            if track.state(latest, 1) == StationState::Speaking {
                track.covers.without(track.excluded)
            } else {
                Default::default()
            }
        });
        Holders {
            mode: self.cluster.agreement().mode,
            widths: widths
                .map(|controller| controller.circuit.outputs().len())
                .collect(),
            holds: holds.collect(),
            heard: self.programs.iter().map(ProgramTrack::hears).collect(),
            excluded: self.programs.iter().map(|track| track.excluded).collect(),
            blocked: (0..)
                .map(ProgramId)
                .zip(&self.programs)
                .filter(|(_, track)| track.is_blocked())
                .map(|(program, _)| program)
                .collect(),
        }
    }

    /// The scan of a program in a cycle as its station evaluated it: what the power did in every rung.
    ///
    /// # Errors
    /// Where the cycle or the state is not known.
    pub fn evaluation(&self, program: ProgramId, cycle: i64) -> Result<Evaluation, ViewError> {
        let history = self.history_of(program)?;
        let place = history
            .place_of(cycle)
            .ok_or_else(|| self.no_cycle(program, cycle))?;
        self.evaluation_at(history, place)
    }

    pub(crate) fn evaluation_at(
        &self,
        history: &History,
        place: usize,
    ) -> Result<Evaluation, ViewError> {
        let program = history.program();
        let step = &history.steps()[place];
        let no_state = |reason: &str| ViewError::NoState {
            cycle: step.cycle,
            program: self.program_name(program).to_owned(),
            reason: reason.to_owned(),
        };
        let sampled = step.sampled.as_ref().ok_or_else(|| {
            no_state(
                match step.driven.as_ref().and_then(|driven| driven.missing) {
                    Some(missing) => crate::describe::missing_text(missing),
                    None => "the journal does not reach back to where its history starts",
                },
            )
        })?;
        let controller = &self.cluster.controllers()[program.index()];
        let period = self.cluster.agreement().schedule.period();
        let observer = self.observers[program.index()]
            .get_or_init(|| Observer::new(&controller.program, period).ok());
        let observer = observer
            .as_ref()
            .ok_or_else(|| no_state("its ladder cannot be lowered"))?;
        let mut scratch = Scratch::default();
        Ok(observer.evaluate(&mut scratch, sampled.state.words(), sampled.inputs.words()))
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
        ViewError::NoCycle {
            cycle,
            program: self.program_name(program).to_owned(),
            known: ends.map_or("none".to_owned(), |(from, to)| format!("{from} to {to}")),
        }
    }

    pub(crate) fn program_name(&self, program: ProgramId) -> &str {
        crate::describe::program_name(program, &self.members)
    }
}
