//! Observed values of a ladder after a scan.

use super::reference::{Now, Reference, Seen};
use super::verdict::HybridDeviation;

impl Reference<'_> {
    /// Tokens, states and actions against the bits.
    pub(super) fn compare(&self, now: &Now<'_>, seen: &Seen) -> Result<(), HybridDeviation> {
        let places = self.net.places().iter().zip(&now.marking);
        for ((place, &expected), tokens) in places.zip(&seen.tokens) {
            if *tokens != Some(expected) {
                return Err(HybridDeviation::Tokens { place: place.name.clone(), expected });
            }
        }
        let supervisors = self.supervisors.iter().zip(&now.states);
        for ((supervisor, &expected), bits) in supervisors.zip(&seen.states) {
            if supervisor.states().zip(bits).any(|(state, on)| (state == expected) != *on) {
                return Err(HybridDeviation::State {
                    supervisor: supervisor.name().to_owned(),
                    expected: supervisor.state_name(expected).into_owned(),
                });
            }
        }
        for ((signal, drivers), on) in self.actions.iter().zip(&seen.actions) {
            let came = |place: usize| {
                let mut fired = now.fired.iter();
                fired.any(|&giver| self.net.transitions()[giver].given(place) > 0)
            };
            let drives = |&(place, is_level): &(usize, bool)| {
                if is_level { now.marking[place] > 0 } else { came(place) }
            };
            if *on != drivers.iter().any(drives) {
                return Err(HybridDeviation::Action { signal: signal.to_string() });
            }
        }
        Ok(())
    }
}
