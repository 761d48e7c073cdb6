//! What a transition waits for: its delay, and what may hold it back for a scan.

use super::reference::{Joint, Now, Reference, Seen};
use super::verdict::HybridDeviation;
use crate::petri::NetTransition;

impl Reference<'_> {
    /// A delay lasts while its transition has been enabled from the beginning of the scan, with its condition, by tokens that did
    /// not come in the last one, and it has not just fired.
    pub(super) fn check_delay(
        &self,
        joint: &Joint,
        now: &Now<'_>,
        number: usize,
        seen: &Seen,
    ) -> Result<(), HybridDeviation> {
        let Some(runs) = seen.powers[number] else {
            return Ok(());
        };
        let transition = &self.net.transitions()[number];
        let given = |place: usize, is_gain: bool| {
            let transitions = self.net.transitions().iter().zip(&joint.fired);
            let mut fired = transitions.filter(|(_, fired)| **fired);
            fired.any(|(giver, _)| {
                let taken = if is_gain { giver.taken(place) } else { 0 };
                giver.given(place) > taken
            })
        };
        let takes = |is_gain| transition.takes.iter().any(|arc| given(arc.place, is_gain));
        let may_run = !joint.fired[number]
            && self.net.fire(&joint.marking, transition).is_some()
            && self.holds(&transition.condition, now)
            && !takes(true);
        let counts = |place| self.is_counter[place] && joint.still[place] < 2;
        // A token that is taken and given back at once may begin the delay anew, or not.
        let must_run = may_run && !takes(false) && !places(transition).any(counts);
        if if runs { may_run } else { !must_run } {
            return Ok(());
        }
        Err(HybridDeviation::Delay { transition: transition.name.clone() })
    }

    /// Whether nothing holds back a transition that has not fired: it is enabled, by tokens that did not come in this scan, and
    /// no counter among its places has just counted.
    pub(super) fn must_fire(
        &self,
        joint: &Joint,
        now: &Now<'_>,
        number: usize,
        seen: &Seen,
    ) -> bool {
        let transition = &self.net.transitions()[number];
        let came = |place: usize| {
            let mut fired = now.fired.iter();
            fired.any(|&giver| self.net.transitions()[giver].given(place) > 0)
        };
        let counts = |place: usize| {
            let moves = |&other: &usize| {
                let other = &self.net.transitions()[other];
                other.taken(place) + other.given(place) > 0
            };
            self.is_counter[place] && (joint.still[place] == 0 || now.fired.iter().any(moves))
        };
        let waits = self.disabling(now, transition);
        self.net.fire(&now.marking, transition).is_some()
            && self.condition(now, number, seen)
            && waits.is_none_or(|_| !transition.label.is_some_and(|label| label.is_controllable()))
            && !transition.takes.iter().any(|arc| came(arc.place))
            && !places(transition).any(counts)
    }
}

/// The places that a transition touches or reads.
fn places(transition: &NetTransition) -> impl Iterator<Item = usize> {
    let arcs = transition.takes.iter().chain(&transition.gives);
    let arcs = arcs.chain(&transition.inhibitors).chain(&transition.enablers);
    arcs.map(|arc| arc.place)
}
