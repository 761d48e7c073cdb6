//! What may be driven as fail-safe: the configured values, and for outputs with a ramp the values on the way to them.

use understudy_remote_io::{Fallback, Ramp};
use understudy_wire::Image;

/// The outputs at which the ramps begin, and the deadlines since; nothing where they are not known.
#[derive(Debug, Clone, Default, Hash)]
pub(super) struct Descent {
    begun: Option<(Image, u32)>,
    /// The last fail-safe outputs.
    last: Option<Image>,
}

impl Descent {
    /// Outputs other than fail-safe ones were driven: ramps begin at them.
    pub(super) fn begins_at(&mut self, driven: &Image) {
        self.begun = Some((driven.clone(), 0));
        self.last = None;
    }

    /// The fail-safe values are other ones from now on: ramps begin at the last outputs.
    pub(super) fn begins_anew(&mut self) {
        if let Some(last) = self.last.take() {
            self.begun = Some((last, 0));
        }
    }

    /// The outputs are at other places from now on.
    pub(super) fn moves(&mut self, moved: impl Fn(&Image) -> Image) {
        if let Some((from, _)) = &mut self.begun {
            *from = moved(from);
        }
        self.last = self.last.as_ref().map(moved);
    }

    /// Records are missing: what the ramps began at is not known.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// One deadline with fail-safe outputs.
    pub(super) fn goes_on(&mut self) {
        if let Some((_, deadlines)) = &mut self.begun {
            *deadlines = deadlines.saturating_add(1);
        }
    }

    /// These fail-safe outputs were driven.
    pub(super) fn drives(&mut self, driven: &Image) {
        self.last = Some(driven.clone());
    }

    /// Whether fail-safe outputs are permitted.
    ///
    /// The fail-safe values themselves always are: a remote I/O that has restarted knows no value to begin at.
    pub(super) fn permits(&self, driven: &Image, fallback: &Fallback) -> bool {
        let Fallback { fail_safe, ramps, .. } = fallback;
        if driven == fail_safe {
            return true;
        }
        let of_ramp = |bit: usize| {
            ramps.iter().any(|ramp| {
                let first = usize::from(ramp.place.bit);
                (first..first + ramp.place.of.bits() as usize).contains(&bit)
            })
        };
        let others_agree = driven.width() == fail_safe.width()
            && (0..driven.width()).all(|bit| of_ramp(bit) || driven.get(bit) == fail_safe.get(bit));
        others_agree && ramps.iter().all(|ramp| self.is_on(*ramp, driven, fail_safe))
    }

    /// Whether an output has gone as far as its ramp says, up to rounding.
    fn is_on(&self, ramp: Ramp, driven: &Image, fail_safe: &Image) -> bool {
        let Some((begun, deadlines)) = &self.begun else {
            return true;
        };
        let [from, found, to] = [begun, driven, fail_safe].map(|image| number(ramp, image));
        let way = (to - from).abs();
        let gone = (ramp.step * f64::from(*deadlines)).min(way);
        let rounding = match ramp.place.of.is_real() {
            true => 1e-6 * from.abs().max(to.abs()),
            false => 1.0,
        };
        let between = from.min(to) <= found && found <= from.max(to);
        between && ((found - from).abs() - gone).abs() <= rounding
    }
}

fn number(ramp: Ramp, image: &Image) -> f64 {
    ramp.place.of.number(ramp.place.get(image))
}
