//! Which requests one exchange takes, and where in their answers each signal is.
//!
//! Signals at consecutive addresses of one table share a request; nothing is read or written that no signal names, because a
//! device may refuse all for one address that it does not have. A number is never divided between two requests: its registers
//! would be of two moments.

use std::collections::BTreeMap;

use understudy_cluster::{Binding, BitPlace, Place, RegisterTable, Side};
use understudy_wire::Image;

use crate::number;

/// Bits of one request, at most; the protocol allows 2000 to read and 1968 to write.
const MAXIMUM_BITS: u32 = 1968;
/// Registers of one request, at most; the protocol allows 125 to read and 123 to write.
const MAXIMUM_REGISTERS: u32 = 123;

/// The four tables of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Table {
    Discrete,
    Coil,
    Input,
    Holding,
}

/// Consecutive addresses of one table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) table: Table,
    pub(crate) start: u16,
    pub(crate) count: u16,
}

impl Run {
    /// Behind its last address.
    fn end(self) -> u32 {
        u32::from(self.start) + u32::from(self.count)
    }
}

/// The requests for one direction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    pub(crate) runs: Vec<Run>,
    /// The process image with the initial values of all signals without a place.
    rest: Image,
    signals: Vec<Signal>,
    /// What is written besides the signals, a word for each address of each run: bits of registers that outputs had which are gone.
    constant: Vec<Vec<u16>>,
}

/// Words of addresses that are written for the last time.
pub(crate) type Left = BTreeMap<(Table, u16), u16>;

/// The requests that write them.
pub(crate) fn requests(left: &Left) -> Vec<(Run, Vec<u16>)> {
    let mut runs: Vec<(Run, Vec<u16>)> = Vec::new();
    for (&(table, start), &word) in left {
        let follows = |run: &Run| {
            run.table == table
                && run.end() == u32::from(start)
                && u32::from(run.count) < most_of(table)
        };
        match runs.last_mut().filter(|(run, _)| follows(run)) {
            Some((run, words)) => {
                run.count += 1;
                words.push(word);
            }
            None => runs.push((Run { table, start, count: 1 }, vec![word])),
        }
    }
    runs
}

/// Addresses of one request, at most.
fn most_of(table: Table) -> u32 {
    match table {
        Table::Discrete | Table::Coil => MAXIMUM_BITS,
        Table::Input | Table::Holding => MAXIMUM_REGISTERS,
    }
}

/// A signal, and where in the answers it is.
#[derive(Debug, Clone, PartialEq)]
struct Signal {
    binding: Binding,
    run: usize,
    /// Its first address, from that of its run.
    at: usize,
}

/// Why answers make no process image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Unread {
    /// An answer has fewer words than its run.
    #[error("it answered a reading too shortly")]
    Short,
    /// A REAL that is infinite or not a number.
    #[error("`{name}` at {place} is infinite or not a number")]
    NotFinite { name: String, place: Place },
}

impl Plan {
    pub(crate) fn new(side: &Side) -> Self {
        let mut spans: Vec<Run> = side.bindings.iter().map(|it| span(&it.place)).collect();
        spans.sort_by_key(|span| (span.table, span.start, span.count));
        let mut runs: Vec<Run> = Vec::new();
        for span in spans {
            let most = most_of(span.table);
            let joined = runs.last_mut().filter(|run| {
                run.table == span.table
                    && u32::from(span.start) <= run.end()
                    && span.end() - u32::from(run.start) <= most
            });
            match joined {
                Some(run) => run.count = run.count.max(span.start - run.start + span.count),
                None => runs.push(span),
            }
        }
        let signal = |binding: &Binding| {
            let span = span(&binding.place);
            let holds = |run: &Run| {
                run.table == span.table && run.start <= span.start && span.end() <= run.end()
            };
            let run = runs.iter().position(holds)?;
            Some(Signal {
                binding: binding.clone(),
                run,
                at: usize::from(span.start - runs[run].start),
            })
        };
        let zero = runs.iter().map(|run| vec![0; usize::from(run.count)]).collect();
        Self {
            rest: side.rest.clone(),
            signals: side.bindings.iter().filter_map(signal).collect(),
            runs,
            constant: zero,
        }
    }

    /// This plan in the place of `old`, whose outputs have these last values, with the words of addresses that only the old one writes. Bits that are gone
    /// from a register that this plan writes too keep their last values.
    pub(crate) fn after(mut self, old: &Self, last: &Image) -> (Self, Left) {
        let named = self.mask();
        let mut left = Left::new();
        for (run, words) in old.runs.iter().zip(old.words(last)) {
            for (address, word) in (run.start..).zip(words) {
                match self.place_of(run.table, address) {
                    None => {
                        left.insert((run.table, address), word);
                    }
                    Some((place, at)) if run.table == Table::Holding => {
                        self.constant[place][at] |= word & !named[place][at];
                    }
                    Some(_) => {}
                }
            }
        }
        (self, left)
    }

    /// Whether it has an address.
    pub(crate) fn has(&self, table: Table, address: u16) -> bool {
        self.place_of(table, address).is_some()
    }

    /// The run of an address, and its place there.
    fn place_of(&self, table: Table, address: u16) -> Option<(usize, usize)> {
        let holds = |run: &Run| {
            run.table == table && run.start <= address && u32::from(address) < run.end()
        };
        let place = self.runs.iter().position(holds)?;
        Some((place, usize::from(address - self.runs[place].start)))
    }

    /// The image of the signals, from a word for each address of each run.
    pub(crate) fn image(&self, answers: &[Vec<u16>]) -> Result<Image, Unread> {
        let mut image = self.rest.clone();
        for Signal { binding, run, at } in &self.signals {
            let words = answers.get(*run).and_then(|answer| answer.get(*at..));
            let words = words.ok_or(Unread::Short)?;
            let stored = match &binding.place {
                Place::Bit(place) => {
                    let word = words.first().ok_or(Unread::Short)?;
                    u64::from(word >> bit_of(*place) & 1)
                }
                Place::Number(registers) => {
                    let words = words.get(..usize::from(registers.count()));
                    let words = words.ok_or(Unread::Short)?;
                    let of = binding.declared.of;
                    let value = number::value(registers, of, words);
                    let value = value.map_err(|_| Unread::NotFinite {
                        name: binding.name.clone(),
                        place: binding.place,
                    })?;
                    binding.declared.limited(value)
                }
            };
            // No signal crosses a word of the image.
            image.words_mut()[binding.bit / 64] |= stored << (binding.bit % 64);
        }
        Ok(image)
    }

    /// A word for each address of each run, from the image of the signals.
    pub(crate) fn words(&self, image: &Image) -> Vec<Vec<u16>> {
        self.fill(|binding| {
            let stored = image.words()[binding.bit / 64] >> (binding.bit % 64);
            stored & binding.declared.of.mask()
        })
    }

    /// What was read of the outputs without the bits that no signal names.
    pub(crate) fn named(&self, mut answers: Vec<Vec<u16>>) -> Vec<Vec<u16>> {
        for (answer, named) in answers.iter_mut().zip(self.mask()) {
            answer.truncate(named.len());
            for (word, named) in answer.iter_mut().zip(named) {
                *word &= named;
            }
        }
        answers
    }

    /// The bits that signals name, a word for each address of each run.
    fn mask(&self) -> Vec<Vec<u16>> {
        let mut named = self.zero();
        for signal in &self.signals {
            match &signal.binding.place {
                Place::Bit(place) => named[signal.run][signal.at] |= 1 << bit_of(*place),
                Place::Number(registers) => {
                    let count = usize::from(registers.count());
                    named[signal.run][signal.at..][..count].fill(u16::MAX);
                }
            }
        }
        named
    }

    fn zero(&self) -> Vec<Vec<u16>> {
        let runs = self.runs.iter();
        runs.map(|run| vec![0; usize::from(run.count)]).collect()
    }

    fn fill(&self, stored: impl Fn(&Binding) -> u64) -> Vec<Vec<u16>> {
        let mut words = self.constant.clone();
        for Signal { binding, run, at } in &self.signals {
            let stored = stored(binding);
            let target = &mut words[*run][*at..];
            match &binding.place {
                Place::Bit(place) => target[0] |= (stored as u16 & 1) << bit_of(*place),
                Place::Number(registers) => {
                    let numbers = number::words(registers, binding.declared.of, stored);
                    for (target, word) in target.iter_mut().zip(numbers) {
                        *target = word;
                    }
                }
            }
        }
        words
    }
}

/// The addresses of a place.
fn span(place: &Place) -> Run {
    let (table, start, count) = match *place {
        Place::Bit(BitPlace::Discrete(address)) => (Table::Discrete, address, 1),
        Place::Bit(BitPlace::Coil(address)) => (Table::Coil, address, 1),
        Place::Bit(BitPlace::Input(register, _)) => (Table::Input, register, 1),
        Place::Bit(BitPlace::Holding(register, _)) => (Table::Holding, register, 1),
        Place::Number(registers) => {
            let table = match registers.table {
                RegisterTable::Input => Table::Input,
                RegisterTable::Holding => Table::Holding,
            };
            (table, registers.address, registers.count())
        }
    };
    Run { table, start, count }
}

/// The bit in the word of its address; a bit table has one bit at each address.
fn bit_of(place: BitPlace) -> u8 {
    match place {
        BitPlace::Discrete(_) | BitPlace::Coil(_) => 0,
        BitPlace::Input(_, bit) | BitPlace::Holding(_, bit) => bit,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use understudy_typed::{Elementary, Points};

    use super::*;

    /// Signals of these types at these places, in the image of a program.
    fn side(places: &[(Elementary, String)]) -> Side {
        let mut points = Points::default();
        for (at, (of, _)) in places.iter().enumerate() {
            points.push(format!("s{at}"), *of, 0);
        }
        let binding = |(point, (_, place)): (&understudy_typed::Point, &(Elementary, String))| {
            // A program may have signals without a place.
            let place = place.parse().ok()?;
            Some(Binding {
                name: point.name.clone(),
                declared: point.declared(),
                bit: point.bit as usize,
                place,
            })
        };
        Side {
            rest: Image::zero(points.width()),
            bindings: points.iter().zip(places).filter_map(binding).collect(),
        }
    }

    fn of(place: &str) -> Elementary {
        match place.parse() {
            Ok(Place::Number(registers)) => registers.of,
            _ => Elementary::Bool,
        }
    }

    fn plan(places: &[&str]) -> Plan {
        let places: Vec<_> = places.iter().map(|it| (of(it), (*it).to_owned())).collect();
        Plan::new(&side(&places))
    }

    fn runs(places: &[&str]) -> Vec<(Table, u16, u16)> {
        let run = |run: &Run| (run.table, run.start, run.count);
        plan(places).runs.iter().map(run).collect()
    }

    #[test]
    fn neighbours_share_a_request_and_gaps_do_not() {
        assert_eq!(
            runs(&["coil:3", "coil:1", "coil:2", "coil:5", "discrete:4"]),
            [(Table::Discrete, 4, 1), (Table::Coil, 1, 3), (Table::Coil, 5, 1)]
        );
        assert_eq!(runs(&["holding:7.3", "holding:7.0", "holding:8.15"]), [(Table::Holding, 7, 2)]);
        assert_eq!(runs(&["coil:65535", "coil:65534"]), [(Table::Coil, 65534, 2)]);
        assert_eq!(
            runs(&["input:8 real", "input:4 lreal", "input:10.3", "input:12 int", "input:9 int"]),
            [(Table::Input, 4, 7), (Table::Input, 12, 1)]
        );
        let many: Vec<String> = (0..200).map(|number| format!("input:{number}.0")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert_eq!(runs(&many), [(Table::Input, 0, 123), (Table::Input, 123, 77)]);
        // 123 registers would end in the middle of a REAL.
        let many: Vec<String> =
            (0..80).map(|number| format!("input:{} real", 2 * number)).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert_eq!(runs(&many), [(Table::Input, 0, 122), (Table::Input, 122, 38)]);
    }

    #[test]
    fn an_answer_that_is_too_short_is_none() {
        let plan = plan(&["coil:0", "coil:1"]);
        assert_eq!(plan.image(&[vec![1]]), Err(Unread::Short));
        assert_eq!(plan.image(&[]), Err(Unread::Short));
        let plan = super::tests::plan(&["input:0 real"]);
        assert_eq!(plan.image(&[vec![1]]), Err(Unread::Short));
        let infinite = plan.image(&[vec![0x7F80, 0]]).expect_err("infinity");
        assert_eq!(infinite.to_string(), "`s0` at input:0 real is infinite or not a number");
    }

    /// A signal of each width, with gaps in the image between them.
    #[test]
    fn numbers_have_their_bits_of_the_image() {
        let plan = plan(&["coil:0", "holding:0 int", "coil:1", "holding:1 real", "holding:3 lint"]);
        let answers = [vec![1, 1], vec![0xFFFE, 0x4148, 0, 0, 0, 0, 7]];
        let image = plan.image(&answers).expect("whole");
        assert_eq!(image.words(), [0x0000_0001_FFFE_0001, 0x4148_0000, 7]);
    }

    #[test]
    fn bits_that_no_signal_names_are_not_compared() {
        let plan = plan(&["holding:0.3", "holding:1 int"]);
        let read = vec![vec![0xFFFF, 0x1234]];
        assert_eq!(plan.named(read), [vec![8, 0x1234]]);
    }

    /// Addresses that only the old plan has, and bits that are gone from a register of the new one.
    #[test]
    fn what_is_gone_keeps_its_last_values() {
        let old = plan(&["coil:1", "coil:9", "holding:5.0", "holding:5.3", "holding:7 int"]);
        let last = old.image(&[vec![1], vec![0], vec![0b1001], vec![0x1234]]).expect("whole");
        let (new, left) = plan(&["coil:1", "holding:5.0", "holding:6 int"]).after(&old, &last);
        let run = |table, start| Run { table, start, count: 1 };
        let expected = [(run(Table::Coil, 9), vec![0]), (run(Table::Holding, 7), vec![0x1234])];
        assert_eq!(requests(&left), expected);
        let nothing = Image::zero(128);
        assert_eq!(new.words(&nothing), [vec![0], vec![0b1000, 0]]);
        assert_eq!(new.named(new.words(&nothing)), [vec![0], vec![0, 0]]);
    }

    proptest! {
        /// What is written to a device and read back from the same places is the same.
        #[test]
        fn what_is_written_is_read_back(
            places in proptest::collection::btree_set((0_u16..40, 0_u8..16), 1..64),
            numbers in proptest::collection::vec(any::<bool>(), 64),
            words in proptest::collection::vec(any::<u64>(), 64),
        ) {
            let place = |(register, bit): (u16, u8), is_number| match is_number {
                true => (Elementary::Dint, format!("holding:{} dint", 100 + 32 * register + 2 * u16::from(bit))),
                false => (Elementary::Bool, format!("holding:{register}.{bit}")),
            };
            let places: Vec<_> = places.into_iter().zip(numbers).map(|(at, is)| place(at, is)).collect();
            let side = side(&places);
            let plan = Plan::new(&side);
            let mut image = Image::zero(side.rest.width());
            for (binding, word) in side.bindings.iter().zip(words) {
                image.words_mut()[binding.bit / 64] |= (word & binding.declared.of.mask()) << (binding.bit % 64);
            }
            prop_assert_eq!(plan.image(&plan.words(&image)), Ok(image));
        }
    }
}
