//! How much memory a program takes in a family:
//!
//! ```text
//! program = instructions * program_bytes_per_instruction + timers * program_bytes_per_timer + counters * program_bytes_per_counter
//! data    = bits * data_bytes_per_bit + timers * data_bytes_per_timer + counters * data_bytes_per_counter
//! ```
//!
//! or, where only a rule for both together is known, `memory_bytes_base + points * memory_bytes_per_point`, and what timers and counters take where
//! that is known. A term of the sums whose factor is not known makes the sum unknown, unless the program has nothing of its kind.

use crate::controller::Family;
use crate::figures::FamilyQuantity;
use crate::need::Terms;
use crate::resources::Resources;

/// An amount of bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Bytes {
    /// Known number of bytes with its sources; `fixed` of them are taken once, whatever the number of programs.
    Known { bytes: u64, fixed: u64, sources: Vec<String> },
    /// These figures of the family are missing; the first counts for `units` of the program.
    Unknown { missing: Vec<FamilyQuantity>, units: u64 },
}

/// Memory of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Memory {
    /// Program and data, each for itself.
    Apart { program: Bytes, data: Bytes },
    /// Memory by a common rule for program and data.
    Together(Bytes),
}

pub(crate) fn memory(program: &Resources, family: Option<&Family>, terms: &Terms) -> Memory {
    let figure = |quantity| terms.of_family(family, quantity);
    let rule =
        (figure(FamilyQuantity::MemoryBytesBase), figure(FamilyQuantity::MemoryBytesPerPoint));
    // What is known of each instruction is nearer to the truth than a rule of thumb.
    let by_instruction = figure(FamilyQuantity::ProgramBytesPerInstruction);
    if let ((Some(base), Some(per_point)), None) = (rule, by_instruction) {
        let mut bytes = program.points().saturating_mul(per_point.value);
        let mut sources = vec![base.source, per_point.source];
        let blocks = [
            (program.timers, FamilyQuantity::DataBytesPerTimer),
            (program.counters, FamilyQuantity::DataBytesPerCounter),
        ];
        for (count, quantity) in blocks {
            if let (Some(each), true) = (figure(quantity), count > 0) {
                bytes = bytes.saturating_add(count.saturating_mul(each.value));
                sources.push(each.source);
            }
        }
        sources.dedup();
        return Memory::Together(Bytes::Known {
            bytes: bytes.saturating_add(base.value),
            fixed: base.value,
            sources,
        });
    }
    let sum = |terms_of: [(u64, FamilyQuantity); 3]| {
        let (mut bytes, mut sources) = (0_u64, Vec::new());
        let (mut missing, mut units) = (Vec::new(), 0);
        for (count, quantity) in terms_of {
            match figure(quantity) {
                _ if count == 0 => {}
                Some(figure) => {
                    bytes = bytes.saturating_add(count.saturating_mul(figure.value));
                    if !sources.contains(&figure.source) {
                        sources.push(figure.source);
                    }
                }
                None => {
                    if missing.is_empty() {
                        units = count;
                    }
                    missing.push(quantity);
                }
            }
        }
        if missing.is_empty() {
            let fixed = 0;
            Bytes::Known { bytes, fixed, sources }
        } else {
            Bytes::Unknown { missing, units }
        }
    };
    Memory::Apart {
        program: sum([
            (program.instructions, FamilyQuantity::ProgramBytesPerInstruction),
            (program.timers, FamilyQuantity::ProgramBytesPerTimer),
            (program.counters, FamilyQuantity::ProgramBytesPerCounter),
        ]),
        data: sum([
            (program.data_bits, FamilyQuantity::DataBytesPerBit),
            (program.timers, FamilyQuantity::DataBytesPerTimer),
            (program.counters, FamilyQuantity::DataBytesPerCounter),
        ]),
    }
}
