//! The newest sample of a program that a station remembers, for a remote I/O that has lost its memory, and which other stations cannot have proved
//! an output of a newer one.

use understudy_cycle::Versions;
use understudy_wire::{Holding, Moment, Recalled, Sample, SamplesReceived, StationId, StationSet};

use super::Replica;

/// The newest sample of the program that this station remembers, for a remote I/O that has lost its memory.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Remembered {
    /// None.
    Nothing,
    /// None of its own; what another station remembers.
    Relayed(Recalled),
    /// The sample that this station received last.
    Received(Recalled),
}

impl Replica {
    /// Remembers the sample of `moment`, whether it can be followed or not.
    pub(crate) fn remember(
        &mut self,
        versions: Versions<'_>,
        moment: Moment,
        sample: &Sample,
        received: SamplesReceived,
    ) {
        let Some(inputs) = sample.without_forces() else {
            return;
        };
        if versions.has_inputs(inputs.width()) {
            if let Remembered::Received(known) = &mut self.remembered {
                // A copy of it, or of one before it, says nothing of the stations that were received since.
                if moment.epoch == known.sampled.epoch && moment <= known.sampled {
                    return;
                }
                if known.sampled < moment {
                    known.received = SamplesReceived::Later;
                }
                known.sampled = moment;
                known.applied = sample.applied;
                known.excluded = sample.excluded;
                known.accounted_for = sample.gone;
                self.given = StationSet::EMPTY;
                self.witnessed = StationSet::EMPTY;
                known.writes.clone_from(&sample.writes);
                known.pulses.clone_from(&sample.pulses);
                known.inputs.clone_from(inputs);
                known.version = sample.version;
                return;
            }
            let recalled = Recalled {
                program: self.id,
                sampled: moment,
                received,
                applied: sample.applied,
                excluded: sample.excluded,
                accounted_for: sample.gone,
                writes: sample.writes.clone(),
                pulses: sample.pulses.clone(),
                inputs: inputs.clone(),
                version: sample.version,
            };
            self.remembered = Remembered::Received(recalled);
        }
    }

    /// A station reports at `now` the state that it holds. If that is no newer than the newest sample
    /// received here, `silent_after` cycles after it, the remote I/O is not received there either. No newer output was computed from its state
    /// if that station received samples itself, as it recalls, or if it has received none since it started, or none after the one that accounts
    /// for it, and holds the state that it was given here after that; unless it is taking over another one.
    pub(crate) fn receive_holding(
        &mut self,
        station: StationId,
        holding: &Holding,
        theirs: Option<&Recalled>,
        (now, silent_after): (Moment, u32),
    ) {
        let stepped = holding.stepped;
        self.is_taken_over(station, holding.lineage);
        let gives_to = self.gives_to(station);
        let Remembered::Received(recalled) = &mut self.remembered else {
            return;
        };
        let was_given = self.given.contains(station);
        let theirs = theirs.filter(|theirs| match theirs.received {
            SamplesReceived::Later => true,
            SamplesReceived::First => was_given && theirs.sampled <= recalled.sampled,
            SamplesReceived::Nothing => was_given,
        });
        // With a state that the next sample's history reaches, it follows without one from another station, however long the remote I/O has not
        // received it.
        let is_fresh = now <= recalled.sampled && stepped.plus(self.history as u64) >= now;
        if stepped > recalled.sampled || is_fresh {
            recalled.accounted_for.remove(station);
            self.given.remove(station);
            self.witnessed.remove(station);
        } else if let Some(theirs) = theirs
            && now >= recalled.sampled.plus(u64::from(silent_after))
            && !gives_to
        {
            if !recalled.accounted_for.contains(station) {
                self.witnessed.insert(station);
            }
            recalled.accounted_for.insert(station);
            recalled.applied = recalled.applied.max(theirs.applied);
        }
    }

    /// A station asks for the state and has no part of it: it may have proved outputs with the one that it was given here, and have lost its memory.
    pub(crate) fn asked(&mut self, station: StationId) {
        self.given.remove(station);
    }

    /// This station has received no other member for a cycle: others may have proved newer outputs meanwhile.
    ///
    /// Where it received others than the program's remote I/O until then (`from_several`), one that was gone may have started cold meanwhile. Where it
    /// received the remote I/O alone, only that one may be away, and a station that was gone stays gone.
    pub(crate) fn was_isolated(&mut self, from_several: bool) {
        if let Remembered::Received(recalled) = &mut self.remembered {
            let known = if from_several { StationSet::EMPTY } else { recalled.accounted_for };
            recalled.accounted_for = known.without(self.witnessed);
        }
        self.witnessed = StationSet::EMPTY;
        self.given = StationSet::EMPTY;
    }

    /// Takes what another station remembers, where this one has received no sample.
    pub(crate) fn take_recalled(&mut self, versions: Versions<'_>, recalled: &Recalled) {
        if self.remembered == Remembered::Nothing && versions.has_inputs(recalled.inputs.width()) {
            let recalled = Recalled { received: SamplesReceived::Nothing, ..recalled.clone() };
            self.remembered = Remembered::Relayed(recalled);
        }
    }

    /// What it remembers of the newest sample, where none was received in the cycle `moment`.
    pub(crate) fn recalled(&self, moment: Moment) -> Option<&Recalled> {
        match &self.remembered {
            Remembered::Nothing => None,
            Remembered::Relayed(recalled) => Some(recalled),
            Remembered::Received(recalled) => (recalled.sampled != moment).then_some(recalled),
        }
    }
}
