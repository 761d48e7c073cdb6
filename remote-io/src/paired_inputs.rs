//! Inputs that two modules read, one at each remote I/O of a program: which value counts, and which module is excluded. The rule is that of redundant
//! input modules of the S7-400H.
//!
//! ```text
//!   Agree ── the readings differ ──► Differ ── in `discrepancy_cycles` samples in a row ──► Doubted ── one of the two moves ──► Excluded: the other one
//!     ▲                                 │                                                      │                                   │
//!     └────────── they agree ───────────┴──────────── both move, and agree ────────────────────┴──────── the operator releases it ─┘
//! ```
//!
//! Samples with one reading count for nothing here: they end no doubt and no count, since they say nothing of the module that is not read.
//!
//! Invariant: while two readings differ and neither module is excluded, the value that was sampled last counts. A doubt ends by two readings, by an
//! exclusion, or by the operator, and by nothing else.

use understudy_cycle::PointPlace;
use understudy_wire::Image;

/// An input that modules of both remote I/Os read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedInput {
    /// Its place in u(i).
    pub place: PointPlace,
    /// Greatest difference of two readings of a number that agree; 0 of a BOOL or a bit string.
    pub tolerance: f64,
}

impl PairedInput {
    /// Inputs whose readings agree only where they are equal.
    pub fn exact(places: &[PointPlace]) -> Vec<Self> {
        places.iter().map(|place| Self { place: *place, tolerance: 0.0 }).collect()
    }

    /// The value of two readings that agree: their mean, where they are numbers.
    fn agreed(self, [one, other]: [u64; 2]) -> Option<u64> {
        if one == other {
            return Some(one);
        }
        let of = self.place.of;
        if of.bits() == 1 || of.is_bit_string() || !self.is_within(one, other) {
            return None;
        }
        Some(match (of.is_real(), of.bits()) {
            (true, 32) => {
                let mean = (of.number(one) + of.number(other)) / 2.0;
                u64::from((mean as f32).to_bits())
            }
            (true, _) => (of.number(one) / 2.0 + of.number(other) / 2.0).to_bits(),
            (false, _) => (of.signed(one) + of.signed(other)).div_euclid(2) as u64 & of.mask(),
        })
    }

    fn is_within(self, one: u64, other: u64) -> bool {
        let of = self.place.of;
        let difference = if of.is_real() {
            of.number(one) - of.number(other)
        } else {
            (of.signed(one) - of.signed(other)) as f64
        };
        difference.abs() <= self.tolerance
    }

    /// Whether a module shows another value than it did.
    fn moves(self, before: u64, now: u64) -> bool {
        let of = self.place.of;
        before != now && (of.bits() == 1 || of.is_bit_string() || !self.is_within(before, now))
    }
}

/// One of two modules that read an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Module {
    /// At the first remote I/O.
    First,
    /// At the twin of that remote I/O.
    Twin,
}

/// How the two modules of an input stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Standing {
    /// They show the same.
    Agree,
    /// They have differed in this number of samples in a row, of those in which both were read.
    Differ(u32),
    /// They differ for too long, since they showed these values; `None` where one of them was not read since: both may have moved.
    Doubted(Option<[u64; 2]>),
    /// This one does not count until the operator releases it.
    Excluded(Module),
}

impl Standing {
    /// Takes two readings. The value that counts; `None` for the one that counted before.
    fn take(&mut self, input: PairedInput, readings: [u64; 2], patience: u32) -> Option<u64> {
        let [first, twin] = readings;
        let agreed = input.agreed(readings);
        let next = match *self {
            Self::Excluded(_) => *self,
            Self::Doubted(Some([old_first, old_twin])) => {
                match (input.moves(old_first, first), input.moves(old_twin, twin)) {
                    (true, false) => Self::Excluded(Module::Twin),
                    (false, true) => Self::Excluded(Module::First),
                    _ if agreed.is_some() => Self::Agree,
                    (true, true) => Self::Doubted(Some(readings)),
                    (false, false) => *self,
                }
            }
            _ if agreed.is_some() => Self::Agree,
            Self::Agree if patience > 1 => Self::Differ(1),
            Self::Differ(cycles) if cycles + 1 < patience => Self::Differ(cycles + 1),
            Self::Agree | Self::Differ(_) | Self::Doubted(None) => Self::Doubted(Some(readings)),
        };
        *self = next;
        match next {
            Self::Excluded(Module::First) => Some(twin),
            Self::Excluded(Module::Twin) => Some(first),
            _ => agreed,
        }
    }

    /// Takes the reading of one module, where the other one is not received or has no value.
    fn take_one(&mut self, module: Module, reading: u64) -> Option<u64> {
        match self {
            Self::Excluded(excluded) => (*excluded != module).then_some(reading),
            Self::Doubted(since) => {
                *since = None;
                Some(reading)
            }
            Self::Agree | Self::Differ(_) => Some(reading),
        }
    }

    /// The modules whose readings are not trusted: one that is excluded, or both where they are in doubt.
    fn distrusts(self, module: Module) -> bool {
        match self {
            Self::Agree | Self::Differ(_) => false,
            Self::Doubted(_) => true,
            Self::Excluded(excluded) => excluded == module,
        }
    }

    /// What an operator is told of it.
    fn told(self) -> InputChange {
        match self {
            Self::Agree | Self::Differ(_) => InputChange::Agrees,
            Self::Doubted(_) => InputChange::Differs,
            Self::Excluded(module) => InputChange::Excluded(module),
        }
    }
}

/// What has changed for an input, as an operator is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum InputChange {
    /// Its modules are not in doubt, and none is excluded.
    Agrees,
    /// They differ for too long.
    Differs,
    /// This module is excluded.
    Excluded(Module),
}

/// The inputs of a program that two modules read.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct PairedInputs {
    /// How the modules of each input stand, in the order of the inputs.
    standings: Vec<Standing>,
    /// u(i) as it counted last.
    last: Image,
    /// What an operator was not told yet, by the first bits of the inputs.
    changes: Vec<(u16, InputChange)>,
}

impl PairedInputs {
    /// The inputs where nothing is known of their modules yet, and these values counted last.
    pub(crate) fn new(inputs: &[PairedInput], last: Image) -> Self {
        Self { standings: vec![Standing::Agree; inputs.len()], last, changes: Vec::new() }
    }

    /// u(i) as it counted last.
    pub(crate) fn last(&self) -> &Image {
        &self.last
    }

    /// Takes the readings of the first remote I/O and of the twin. u(i) as it counts now; `None` where neither has a value.
    pub(crate) fn take(
        &mut self,
        inputs: &[PairedInput],
        readings: [Option<&Image>; 2],
        patience: u32,
    ) -> Option<Image> {
        let mut merged = readings.into_iter().flatten().next()?.clone();
        for (input, standing) in inputs.iter().zip(&mut self.standings) {
            let before = standing.told();
            let value = match readings.map(|image| image.map(|image| input.place.get(image))) {
                [Some(first), Some(twin)] => standing.take(*input, [first, twin], patience),
                [Some(first), None] => standing.take_one(Module::First, first),
                [None, Some(twin)] => standing.take_one(Module::Twin, twin),
                [None, None] => None,
            };
            let value = value.unwrap_or_else(|| input.place.get(&self.last));
            input.place.set(&mut merged, value);
            if standing.told() != before {
                self.changes.push((input.place.bit, standing.told()));
            }
        }
        self.last.clone_from(&merged);
        Some(merged)
    }

    /// What has changed since the last call, by the first bits of the inputs.
    pub(crate) fn take_changes(&mut self) -> Vec<(u16, InputChange)> {
        std::mem::take(&mut self.changes)
    }

    /// The operator releases all modules.
    pub(crate) fn release(&mut self, inputs: &[PairedInput]) {
        for (input, standing) in inputs.iter().zip(&mut self.standings) {
            if standing.told() != InputChange::Agrees {
                self.changes.push((input.place.bit, InputChange::Agrees));
            }
            *standing = Standing::Agree;
        }
    }

    /// The first bits of the inputs whose module is not trusted, at the first remote I/O and at the twin: at one of them where it is excluded, at both where
    /// they are in doubt.
    pub(crate) fn distrusted(&self, inputs: &[PairedInput]) -> [Image; 2] {
        [Module::First, Module::Twin].map(|module| {
            let mut image = Image::zero(self.last.width());
            for (input, standing) in inputs.iter().zip(&self.standings) {
                if standing.distrusts(module) {
                    image.set(usize::from(input.place.bit), true);
                }
            }
            image
        })
    }

    /// Goes on with the exclusions and the doubts of the other remote I/O.
    pub(crate) fn distrust(&mut self, inputs: &[PairedInput], distrusted: &[Image; 2]) {
        for (input, standing) in inputs.iter().zip(&mut self.standings) {
            let place = usize::from(input.place.bit);
            let found = distrusted.each_ref().map(|it| place < it.width() && it.get(place));
            *standing = match found {
                [false, false] => continue,
                [true, false] => Standing::Excluded(Module::First),
                [false, true] => Standing::Excluded(Module::Twin),
                [true, true] => Standing::Doubted(None),
            };
            self.changes.push((input.place.bit, standing.told()));
        }
    }
}

#[cfg(test)]
mod tests;
