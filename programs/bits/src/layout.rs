//! What the registers of an exact circuit are in the state of its program.

mod registers;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use understudy_logic::Variable as Bit;
use understudy_typed::{Elementary, Program};

use crate::System;
use crate::circuit::Derivation;
use crate::exact::registers;
use crate::execute::timers::RUNNING;
use crate::extent::Extent;
use crate::program::together;
use crate::system::Holds;

pub use self::registers::Registers;

/// The slot of the scans since the start.
const SCANS: usize = Program::HEADER as usize - 1;

/// The state of a program by the registers of its circuit.
#[derive(Debug, Clone)]
pub struct Layout {
    initial: Vec<u64>,
    period: i64,
    together: u64,
    /// The cells that registers hold, those with one value, and between which numbers their values lie.
    cells: Vec<(Holds, Extent)>,
    /// For each register its cell, and the weight of its bit.
    registers: Vec<(usize, i128)>,
    /// For each address of the state that a cell tells this cell: of a timer and of its output the latter.
    told: HashMap<u64, usize>,
}

impl Layout {
    pub(crate) fn new(
        program: &Program,
        system: &System,
        derivation: &Derivation,
        live: &BTreeSet<Bit>,
    ) -> Self {
        let mut places = BTreeMap::new();
        let mut cells = Vec::new();
        let registers = registers(live).filter_map(|register| derivation.held[register]);
        let registers = registers.map(|held| {
            let place = *places.entry(held.cell).or_insert_with(|| {
                let cell = &system.cells[held.cell as usize];
                cells.push((cell.holds.clone(), derivation.extent(cell.term)));
                cells.len() - 1
            });
            (place, held.weight)
        });
        let registers = registers.collect();
        let mut told: HashMap<u64, usize> = HashMap::new();
        for (place, (holds, _)) in cells.iter().enumerate() {
            if let Holds::Count(counted) = holds {
                told.extend(counted.addresses().map(|address| (address, place)));
            }
        }
        // What never changes has no register, and the circuit has its one value.
        for &cell in system.seen.iter().filter(|cell| !places.contains_key(cell)) {
            let cell = &system.cells[cell as usize];
            let extent = derivation.extent(cell.term);
            let Holds::Value(address, _) = cell.holds else {
                continue;
            };
            if extent.low == extent.high && !told.contains_key(&address) {
                cells.push((cell.holds.clone(), extent));
            }
        }
        for (place, (holds, _)) in cells.iter().enumerate() {
            if let Holds::Value(address, _) | Holds::Age(address) = holds {
                told.insert(*address, place);
            }
        }
        let initial = program.initial_state();
        let together = together(program);
        Self { initial, period: program.period.max(1), together, cells, registers, told }
    }

    /// The same with BOOLs behind all others, each with its address: one that can change has the next register.
    pub(crate) fn keeping(&self, bits: &[(u64, Extent)]) -> Self {
        let mut layout = self.clone();
        for &(address, extent) in bits {
            let place = layout.cells.len();
            layout.cells.push((Holds::Value(address, Elementary::Bool), extent));
            layout.told.insert(address, place);
            if extent.low < extent.high {
                layout.registers.push((place, 1));
            }
        }
        layout
    }

    /// Whether a cell has the value at an address, and not what follows from it alone.
    pub(crate) fn has_value(&self, address: u64) -> bool {
        let cell = self.told.get(&address).map(|&place| &self.cells[place].0);
        matches!(cell, Some(Holds::Value(..)))
    }

    /// The registers that a warm start keeps, packed; see [`Program::retentive_mask`].
    pub fn retentive_mask(&self, program: &Program) -> Vec<u64> {
        let kept = self.cells.iter().map(|(holds, _)| holds.is_retentive(program));
        let kept: Vec<bool> = kept.collect();
        let mut mask = vec![0; self.registers.len().div_ceil(64)];
        for (place, &(cell, _)) in self.registers.iter().enumerate() {
            mask[place / 64] |= u64::from(kept[cell]) << (place % 64);
        }
        mask
    }

    /// A state of the program from which every scan is that of the circuit from `registers`, packed. What no scan depends on is as it was at the
    /// start.
    ///
    /// # Panics
    /// If there are fewer registers than the circuit has.
    pub fn state(&self, registers: &[u64]) -> Vec<u64> {
        let only = |extent: &Extent| if extent.low == extent.high { extent.low } else { 0 };
        let mut values: Vec<i128> = self.cells.iter().map(|(_, extent)| only(extent)).collect();
        for (place, &(cell, weight)) in self.registers.iter().enumerate() {
            if registers[place / 64] >> (place % 64) & 1 == 1 {
                values[cell] += weight;
            }
        }
        let scans = self.scans(&values);
        let now = self.period.saturating_mul(scans as i64);
        let mut state = self.initial.clone();
        state[SCANS] = scans;
        let mut put = |address: u64, mask: u64, value: u64| {
            let (slot, bit) = (&mut state[(address / 64) as usize], address % 64);
            *slot = *slot & !(mask << bit) | (value & mask) << bit;
        };
        // What a timer keeps comes first: its output may be a register too.
        for ((holds, _), &value) in self.cells.iter().zip(&values) {
            match holds {
                Holds::Count(counted) => {
                    let kept = counted.kept(value as u64, now, self.period);
                    kept.into_iter().for_each(|(address, value)| put(address, u64::MAX, value));
                }
                Holds::Age(address) => {
                    put(*address, u64::MAX, now.saturating_sub(value as i64) as u64);
                }
                _ => {}
            }
        }
        let own = self.cells.iter().zip(&values).filter_map(|((holds, _), &value)| match holds {
            Holds::Value(address, of) => Some((*address, of.mask(), value)),
            _ => None,
        });
        for (address, mask, value) in own {
            put(address, mask, value as u64);
        }
        // One whose time is over in the next scan has the count of one that was over before.
        for ((holds, _), &value) in self.cells.iter().zip(&values) {
            if let Holds::Count(counted) = holds
                && let Some((output, when_over, of)) = counted.over(value as u64)
                && (state[(output / 64) as usize] >> (output % 64) & 1 == 1) != when_over
            {
                state[(of / 64) as usize] = RUNNING;
            }
        }
        state
    }

    /// Scans since the start that all times reach back from.
    fn scans(&self, values: &[i128]) -> u64 {
        let mut least = 0;
        let mut phase = 0;
        for ((holds, _), &value) in self.cells.iter().zip(values) {
            match holds {
                Holds::Count(counted) => least = least.max(counted.reach()),
                Holds::Age(_) => least = least.max(value as u64 / self.period as u64),
                Holds::Clock => return value as u64 / self.period as u64,
                Holds::Scans => return value as u64,
                Holds::Phase => phase = value as u64,
                Holds::Value(..) | Holds::Other | Holds::Uncounted(_) | Holds::Unused => {}
            }
        }
        let late = least % self.together;
        least + (self.together + phase - late) % self.together
    }
}
