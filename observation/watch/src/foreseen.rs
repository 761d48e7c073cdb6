//! The margin of survival in any cycle that is remembered: who published for what then, and whom each remote I/O heard.

use std::sync::{Arc, Mutex, PoisonError};

use understudy_remote_io::Missing;
use understudy_view::{Holders, Margin, Step};
use understudy_wire::{Moment, ProgramSet, StationSet};

use crate::model::Known;

/// The last answer: it only changes when somebody comes or goes.
#[derive(Debug, Default)]
pub(crate) struct Foresight(Mutex<Option<(Holders, Arc<Margin>)>>);

impl Foresight {
    pub(crate) fn margin(&self, known: &Known, cycle: i64, excluded: &[StationSet]) -> Arc<Margin> {
        let holders = holders(known, cycle, excluded);
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, margin)) = last.as_ref()
            && *of == holders
        {
            return Arc::clone(margin);
        }
        let margin = Arc::new(holders.margin());
        *last = Some((holders, Arc::clone(&margin)));
        margin
    }
}

/// Whether somebody started the cycle. A deadline without one has the moment of the last cycle that there was.
pub(crate) fn began(step: &Step) -> bool {
    let missing = step.driven.as_ref().and_then(|driven| driven.missing);
    missing != Some(Missing::NoCycle)
}

/// Who published for which programs in this cycle or the one before it: a single frame may be lost.
fn holders(known: &Known, cycle: i64, excluded: &[StationSet]) -> Holders {
    let run = &known.run;
    let cluster = run.cluster();
    let step = |program, cycle| run.history(program).and_then(|history| history.at(cycle));
    let mut moments: Vec<Moment> = known
        .programs()
        .flat_map(|program| [step(program, cycle - 1), step(program, cycle)])
        .flatten()
        .filter(|step| began(step))
        .map(|step| step.moment)
        .collect();
    moments.sort();
    moments.dedup();
    let holds = known.stations().map(|station| {
        let turns = moments
            .iter()
            .rev()
            .flat_map(|moment| run.sent_turns(*moment));
        let mut own = turns.filter(|turn| turn.station == station);
        let words = own.next().map(|turn| turn.words.iter());
        let members = words.into_iter().flatten().map(|word| word.mask);
        members.fold(ProgramSet::EMPTY, ProgramSet::or)
    });
    let driven = |program, cycle| step(program, cycle).and_then(|step| step.driven.as_ref());
    let heard = known.programs().map(|program| {
        let deadlines = [driven(program, cycle - 1), driven(program, cycle)];
        let heard = deadlines.into_iter().flatten().map(|driven| driven.heard);
        heard.fold(StationSet::EMPTY, StationSet::or)
    });
    let blocked = known.programs().filter(|&program| {
        let missing = driven(program, cycle).and_then(|driven| driven.missing);
        matches!(
            missing,
            Some(
                Missing::BadQuality
                    | Missing::NoHistory
                    | Missing::NotReleased
                    | Missing::ValueFault
                    | Missing::TooLate
            )
        ) || driven(program, cycle).is_none()
    });
    let widths = cluster.controllers().iter();
    Holders {
        mode: cluster.agreement().mode,
        widths: widths
            .map(|controller| controller.circuit.outputs().len())
            .collect(),
        holds: holds.collect(),
        heard: heard.collect(),
        excluded: excluded.to_vec(),
        blocked: blocked.collect(),
    }
}
