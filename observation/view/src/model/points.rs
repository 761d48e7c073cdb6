//! Which points count of each program, as the records come, and what follows from other ones.

use std::sync::Arc;

use understudy_cycle::OnlineChange;
use understudy_journal::{Record, Turn, moment};
use understudy_wire::ProgramId;

use super::Model;
use super::standing::{Change, ProgramChange};
use crate::describe::program_name;

/// The alarm of a program whose inputs and outputs are not shown here, because their points are not known.
pub(super) const POINTS_NOT_KNOWN: &str = "points-not-known";

impl Model {
    /// Other points may count from a record on.
    pub(super) fn turned(&mut self, record: &Record) {
        match self.present.take(record) {
            Some(Turn::Loaded(change)) => self.learn(&change),
            Some(Turn::Points(program)) => self.lay_out(record, program),
            None => {}
        }
    }

    /// Programs may change by this from now on.
    fn learn(&mut self, change: &Arc<OnlineChange>) {
        for changed in &change.programs {
            let Some(versions) = self.versions.get_mut(changed.program.index()) else {
                continue;
            };
            for hash in [changed.before.hash, changed.after.hash] {
                let found = self.present.controller_of(changed.program, hash);
                found.into_iter().for_each(|controller| versions.learn(controller));
            }
        }
        self.histories.iter_mut().for_each(|history| history.learn(change));
    }

    fn lay_out(&mut self, record: &Record, program: ProgramId) {
        let place = program.index();
        let version = self.present.versions().get(place).copied();
        let (Some(version), Some(track)) = (version, self.programs.get_mut(place)) else {
            return;
        };
        // By the points of before.
        track.inputs = None;
        let known = self.present.controller(program);
        self.series.lay_out(program, known.map(|known| &known.interface));
        let is_known = known.is_some();
        let alarms = self.process_alarms.fold.lay_out(program, &self.present);
        if let Some(history) = self.histories.get_mut(place) {
            history.lay_out(version, is_known);
        }
        // The deadline of the cycle before has passed.
        let next = self.cycles.of(None).saturating_add(i64::from(self.cycles.latest().is_some()));
        let of_moment = moment(&record.event).and_then(|moment| self.cycles.of_known(moment));
        let cycle = of_moment.unwrap_or(next);
        if !self.cycles.is_fixed() {
            self.process_alarms_changed(&record.name, cycle, &alarms);
        }
        self.changes.push(cycle, Change::Program(program, ProgramChange::Points));
        let subject = (record.name.clone(), POINTS_NOT_KNOWN);
        if is_known {
            self.alarms.over(&subject, cycle);
        } else {
            let of = program_name(program, self.members());
            let text = points_not_known_text(of, &version.to_string());
            self.alarms.raise(subject, cycle, text);
        }
    }
}

/// Why inputs and outputs of a program are not shown by name.
fn points_not_known_text(program: &str, version: &str) -> String {
    format!(
        "U0588: the inputs and outputs of {program} are those of the program {version}, which this journal does not contain: start the view again with the \
         new cluster file"
    )
}
