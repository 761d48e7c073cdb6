//! The registers of a circuit for a state of its program: the other way than [`Layout::state`].

use understudy_typed::{Elementary, Program};

use super::{Layout, SCANS};
use crate::extent::Extent;
use crate::system::Holds;

/// The registers for the retentive part of a state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Registers {
    /// The registers of the initial state with those of the retentive cells, packed.
    pub packed: Vec<u64>,
    /// Retentive variables with a value that the circuit does not have: their registers are those of the initial state.
    pub lost: Vec<String>,
}

impl Layout {
    /// The registers from which every scan of the circuit is that of `program` from `state`, where that differs from the initial state in retentive
    /// variables alone. A value outside of those that the program can reach has no registers: the circuit holds for all others.
    ///
    /// # Panics
    /// If `state` is shorter than a state of the program, or `initial` than the registers.
    pub fn registers(&self, program: &Program, state: &[u64], initial: &[u64]) -> Registers {
        let mut lost = Vec::new();
        let packed = self.packed(program, initial, |holds, extent| {
            let number = self.number(holds, *extent, state).filter(|it| extent.holds(*it));
            if number.is_none() {
                lost.extend(name(program, holds));
            }
            number
        });
        Registers { packed, lost }
    }

    /// The same for a state that the program may not reach: a value outside of those that it can reach becomes the nearest one of them, so that what is
    /// proved of the program holds from then on.
    ///
    /// # Panics
    /// As [`Self::registers`].
    pub fn nearest_registers(&self, program: &Program, state: &[u64], initial: &[u64]) -> Vec<u64> {
        self.packed(program, initial, |holds, extent| {
            Some(extent.nearest(self.number(holds, *extent, state)?))
        })
    }

    /// The variables that can have a value before a change which they cannot have in this program; `before` is the program before it, with the layout of
    /// its circuit where stations execute that.
    pub fn narrowed(&self, program: &Program, before: (&Program, Option<&Self>)) -> Vec<String> {
        let (old, layout) = before;
        let mut narrowed = Vec::new();
        for (holds, extent) in &self.cells {
            let (Holds::Value(..), Some(name)) = (holds, name(program, holds)) else {
                continue;
            };
            let part = old.part(&name);
            let known = part.and_then(|part| match layout {
                None => part.of.elementary().map(Extent::of),
                Some(layout) => match &layout.cells[*layout.told.get(&part.address)?] {
                    (Holds::Value(..), extent) => Some(*extent),
                    _ => None,
                },
            });
            if known.is_some_and(|known| !extent.covers(known)) {
                narrowed.push(name);
            }
        }
        narrowed
    }

    /// The registers `initial` with the numbers of the retentive cells, where they have one.
    fn packed(
        &self,
        program: &Program,
        initial: &[u64],
        mut number: impl FnMut(&Holds, &Extent) -> Option<i128>,
    ) -> Vec<u64> {
        let mut packed = initial.to_vec();
        let cells = self.cells.iter();
        let numbers =
            cells.map(
                |(holds, extent)| {
                    if holds.is_retentive(program) { number(holds, extent) } else { None }
                },
            );
        let numbers: Vec<Option<i128>> = numbers.collect();
        for (place, &(cell, weight)) in self.registers.iter().enumerate() {
            if let Some(number) = numbers[cell] {
                let unit = self.cells[cell].1.unit.max(1);
                // Weights are the powers of two of a number in two's complement, times its unit.
                let bit = (number / unit) >> (weight.abs() / unit).trailing_zeros() & 1;
                let word = &mut packed[place / 64];
                *word = *word & !(1 << (place % 64)) | (bit as u64) << (place % 64);
            }
        }
        packed
    }

    /// Whether registers hold what is at an address of the state.
    pub fn holds(&self, address: u64) -> bool {
        self.told.contains_key(&address)
    }

    /// The number of a cell in a state, which may be one that the program does not reach.
    fn number(&self, holds: &Holds, extent: Extent, state: &[u64]) -> Option<i128> {
        holds.number(state, extent.high, (self.period, self.together))
    }
}

impl Holds {
    /// The number that a cell has for a state, up to `most` where it counts the time since something; none where no number tells that state. The times
    /// are the period, and the scans after which all tasks begin together again.
    pub(crate) fn number(
        &self,
        state: &[u64],
        most: i128,
        (period, together): (i64, u64),
    ) -> Option<i128> {
        let scans = state[SCANS];
        let now = period.saturating_mul(scans as i64);
        let stored = |address: u64, of: Elementary| {
            state[(address / 64) as usize] >> (address % 64) & of.mask()
        };
        Some(match self {
            Holds::Value(address, of) if of.is_real() => i128::from(stored(*address, *of)),
            Holds::Value(address, of) => of.signed(stored(*address, *of)),
            // What is longer ago than anything compares is as long ago as that.
            Holds::Age(address) => {
                let moment = stored(*address, Elementary::Time) as i64;
                i128::from(now.saturating_sub(moment)).min(most)
            }
            Holds::Count(counted) => {
                let at = |address| stored(address, Elementary::Lword);
                i128::from(counted.count(at, now, period)?)
            }
            Holds::Clock => i128::from(now).min(most),
            Holds::Scans => i128::from(scans),
            Holds::Phase => i128::from(scans % together),
            Holds::Other | Holds::Uncounted(_) | Holds::Unused => return None,
        })
    }
}

/// The variable of a cell.
fn name(program: &Program, holds: &Holds) -> Option<String> {
    match holds {
        Holds::Value(address, _) | Holds::Age(address) => Some(program.part_at(*address)?.name),
        Holds::Count(counted) => {
            let start = program.part_at(counted.start())?.name;
            Some(start.rsplit_once('.').map_or(start.as_str(), |(timer, _)| timer).to_owned())
        }
        _ => None,
    }
}
