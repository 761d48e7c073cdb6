//! Which requests one exchange takes, and where in their answers each signal stands.
//!
//! Signals at consecutive addresses of one table share a request; nothing is read or written that no signal names, because a
//! device may refuse all for one address that it does not have.

use std::collections::BTreeSet;

use understudy_cluster::Point;
use understudy_wire::Image;

/// Bits of one request, at most; the protocol allows 2000 to read and 1968 to write.
const MAXIMUM_BITS: usize = 1968;
/// Registers of one request, at most; the protocol allows 125 to read and 123 to write.
const MAXIMUM_REGISTERS: usize = 123;

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

/// The requests for one direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Plan {
    pub(crate) runs: Vec<Run>,
    /// For each signal: which run, which of its addresses, and which bit there.
    places: Vec<Option<(usize, usize, u8)>>,
}

impl Plan {
    pub(crate) fn new(points: &[Option<Point>]) -> Self {
        let addresses: BTreeSet<(Table, u16)> = points
            .iter()
            .flatten()
            .map(|point| split(*point).0)
            .collect();
        let mut runs: Vec<Run> = Vec::new();
        for (table, address) in addresses {
            let most = match table {
                Table::Discrete | Table::Coil => MAXIMUM_BITS,
                Table::Input | Table::Holding => MAXIMUM_REGISTERS,
            };
            match runs.last_mut() {
                Some(run)
                    if run.table == table
                        && u32::from(run.start) + u32::from(run.count) == u32::from(address)
                        && usize::from(run.count) < most =>
                {
                    run.count += 1;
                }
                _ => runs.push(Run {
                    table,
                    start: address,
                    count: 1,
                }),
            }
        }
        let place = |point: Point| {
            let ((table, address), bit) = split(point);
            let holds = |run: &Run| {
                run.table == table
                    && address
                        .checked_sub(run.start)
                        .is_some_and(|at| at < run.count)
            };
            let run = runs.iter().position(holds)?;
            Some((run, usize::from(address - runs[run].start), bit))
        };
        let places = points.iter().map(|point| point.and_then(place)).collect();
        Self { runs, places }
    }

    /// The image of the signals, from a word for each address of each run; nothing where an answer is too short.
    pub(crate) fn image(&self, answers: &[Vec<u16>]) -> Option<Image> {
        let mut bits = Vec::with_capacity(self.places.len());
        for place in &self.places {
            bits.push(match *place {
                None => false,
                Some((run, at, bit)) => answers.get(run)?.get(at)? >> bit & 1 == 1,
            });
        }
        Some(Image::from_bits(bits))
    }

    /// A word for each address of each run, from the image of the signals.
    pub(crate) fn words(&self, image: &Image) -> Vec<Vec<u16>> {
        let mut words: Vec<Vec<u16>> = self
            .runs
            .iter()
            .map(|run| vec![0; usize::from(run.count)])
            .collect();
        for (place, set) in self.places.iter().zip(image.bits()) {
            if let Some((run, at, bit)) = *place {
                words[run][at] |= u16::from(set) << bit;
            }
        }
        words
    }
}

/// The address of a point, and the bit there; a bit table has one bit at each address.
fn split(point: Point) -> ((Table, u16), u8) {
    match point {
        Point::Discrete(address) => ((Table::Discrete, address), 0),
        Point::Coil(address) => ((Table::Coil, address), 0),
        Point::Input(register, bit) => ((Table::Input, register), bit),
        Point::Holding(register, bit) => ((Table::Holding, register), bit),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn runs(points: &[&str]) -> Vec<(Table, u16, u16)> {
        let points: Vec<Option<Point>> = points.iter().map(|point| point.parse().ok()).collect();
        let plan = Plan::new(&points);
        let run = |run: &Run| (run.table, run.start, run.count);
        plan.runs.iter().map(run).collect()
    }

    #[test]
    fn neighbours_share_a_request_and_gaps_do_not() {
        assert_eq!(
            runs(&["coil:3", "coil:1", "coil:2", "coil:5", "discrete:4"]),
            [
                (Table::Discrete, 4, 1),
                (Table::Coil, 1, 3),
                (Table::Coil, 5, 1)
            ]
        );
        assert_eq!(
            runs(&["holding:7.3", "holding:7.0", "holding:8.15"]),
            [(Table::Holding, 7, 2)]
        );
        assert_eq!(
            runs(&["coil:65535", "coil:65534"]),
            [(Table::Coil, 65534, 2)]
        );
        let many: Vec<String> = (0..200).map(|number| format!("input:{number}.0")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert_eq!(
            runs(&many),
            [(Table::Input, 0, 123), (Table::Input, 123, 77)]
        );
    }

    #[test]
    fn an_answer_that_is_too_short_is_none() {
        let plan = Plan::new(&["coil:0".parse().ok(), "coil:1".parse().ok()]);
        assert_eq!(plan.image(&[vec![1]]), None);
        assert_eq!(plan.image(&[]), None);
    }

    proptest! {
        /// What is written to a device and read back from the same places is the same.
        #[test]
        fn what_is_written_is_read_back(
            places in proptest::collection::btree_set((0_u16..40, 0_u8..16), 1..64),
            bits in proptest::collection::vec(any::<bool>(), 64),
        ) {
            let points: Vec<Option<Point>> = places
                .iter()
                .map(|&(register, bit)| Some(Point::Holding(register, bit)))
                .chain([None])
                .collect();
            let plan = Plan::new(&points);
            let mut image: Vec<bool> = bits[..points.len() - 1].to_vec();
            image.push(false);
            let image = Image::from_bits(image);
            prop_assert_eq!(plan.image(&plan.words(&image)), Some(image));
        }
    }
}
