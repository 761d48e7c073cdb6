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
        let mut packed = initial.to_vec();
        let mut lost = Vec::new();
        let mut values: Vec<Option<i128>> = Vec::with_capacity(self.cells.len());
        for (holds, extent) in &self.cells {
            if !holds.is_retentive(program) {
                values.push(None);
                continue;
            }
            let value = self.value(holds, *extent, state);
            if value.is_none() {
                lost.extend(name(program, holds));
            }
            values.push(value);
        }
        for (place, &(cell, weight)) in self.registers.iter().enumerate() {
            if let Some(value) = values[cell] {
                let unit = self.cells[cell].1.unit.max(1);
                // Weights are the powers of two of a number in two's complement, times its unit.
                let bit = (value / unit) >> (weight.abs() / unit).trailing_zeros() & 1;
                let word = &mut packed[place / 64];
                *word = *word & !(1 << (place % 64)) | (bit as u64) << (place % 64);
            }
        }
        Registers { packed, lost }
    }

    /// Whether registers hold what is at an address of the state.
    pub fn holds(&self, address: u64) -> bool {
        self.cells.iter().any(|(holds, _)| match holds {
            Holds::Value(at, _) | Holds::Age(at) => *at == address,
            Holds::Count(counted) => counted.keeps(address),
            _ => false,
        })
    }

    /// The number of a cell, where it is one that the circuit has.
    fn value(&self, holds: &Holds, extent: Extent, state: &[u64]) -> Option<i128> {
        let scans = state[SCANS];
        let now = self.period.saturating_mul(scans as i64);
        let stored = |address: u64, of: Elementary| {
            state[(address / 64) as usize] >> (address % 64) & of.mask()
        };
        let number = match holds {
            Holds::Value(address, of) if of.is_real() => i128::from(stored(*address, *of)),
            Holds::Value(address, of) => of.signed(stored(*address, *of)),
            // What is longer ago than anything compares is as long ago as that.
            Holds::Age(address) => {
                let moment = stored(*address, Elementary::Time) as i64;
                i128::from(now.saturating_sub(moment)).min(extent.high)
            }
            Holds::Count(counted) => {
                let at = |address| stored(address, Elementary::Lword);
                i128::from(counted.count(at, now, self.period)?)
            }
            Holds::Clock => i128::from(now).min(extent.high),
            Holds::Scans => i128::from(scans),
            Holds::Phase => i128::from(scans % self.together),
            Holds::Other => return None,
        };
        let is_within = (extent.low..=extent.high).contains(&number);
        (is_within && number % extent.unit.max(1) == 0).then_some(number)
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
