//! Cells against a naive enumeration: each box is up or down by itself, and whether the cell works is decided from the boxes and the wiring alone.

use std::collections::HashMap;

use understudy_reliability::{FieldDevices, Networks, Options, RemoteIos, left_out, single_points};

use crate::support::{check_within, hours};

/// Which boxes are down, and which of the two remote I/Os of each program is the author.
type State = (Vec<bool>, Vec<usize>);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    Controller,
    Understudy,
    /// Program, place in the pair.
    RemoteIo(usize, usize),
    /// Program, place in the pair.
    Device(usize, usize),
    Network,
}

/// A cell of one controller for each program.
struct Cell {
    parts: Vec<Part>,
    options: Options,
}

impl Cell {
    fn new(options: Options) -> Self {
        let mut parts = vec![Part::Controller; options.controllers as usize];
        parts.extend((0..options.spares).map(|_| Part::Understudy));
        let programs = options.controllers as usize;
        for program in 0..programs {
            // The programs with modules of their own are first, then the others with twins.
            let has = |count: u32| 1 + usize::from(program < count as usize);
            let twins = options.remote_ios.map_or(0, |them| has(them.twins));
            parts.extend((0..twins).map(|place| Part::RemoteIo(program, place)));
            let devices = options.field_devices.map_or(0, |them| has(them.redundant));
            parts.extend((0..devices).map(|place| Part::Device(program, place)));
        }
        let networks = options.networks.map_or(0, |them| them.count);
        parts.extend((0..networks).map(|_| Part::Network));
        Self { parts, options }
    }

    fn is_up(&self, down: &[bool], part: Part) -> bool {
        let place = self.parts.iter().position(|it| *it == part);
        place.is_none_or(|place| !down[place])
    }

    fn has(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    /// Of a program: a remote I/O that is up with a device that it reaches.
    fn is_wired(&self, down: &[bool], program: usize) -> bool {
        // A kind that has no times does not fail.
        let serves =
            |first: Part, it: Part| !self.has(first) || self.has(it) && self.is_up(down, it);
        (0..2).any(|place| {
            let own = if self.has(Part::Device(program, 1)) { place } else { 0 };
            serves(Part::RemoteIo(program, 0), Part::RemoteIo(program, place))
                && serves(Part::Device(program, 0), Part::Device(program, own))
        })
    }

    fn works(&self, down: &[bool]) -> bool {
        let of = |part: Part| {
            let places = self.parts.iter().zip(down).filter(move |(it, _)| **it == part);
            places.map(|(_, down)| *down).collect::<Vec<bool>>()
        };
        let stations =
            !of(Part::Controller).contains(&true) || of(Part::Understudy).contains(&false);
        let networks = of(Part::Network).is_empty() || of(Part::Network).contains(&false);
        let programs = 0..self.options.controllers as usize;
        stations && networks && programs.into_iter().all(|program| self.is_wired(down, program))
    }

    fn rates(&self, part: Part) -> (f64, f64) {
        let options = &self.options;
        let (mtbf, mttr) = match part {
            Part::Controller | Part::Understudy => (options.mtbf, options.mttr),
            Part::RemoteIo(..) => {
                options.remote_ios.map(|them| (them.mtbf, them.mttr)).expect("remote I/Os")
            }
            Part::Device(..) => {
                options.field_devices.map(|them| (them.mtbf, them.mttr)).expect("devices")
            }
            Part::Network => options.networks.map(|them| (them.mtbf, them.mttr)).expect("networks"),
        };
        (1.0 / mtbf.get(), 1.0 / mttr.get())
    }

    /// Probability that the failure of a box is masked, as far as enough others are up.
    fn masked(&self, (down, authors): &State, part: Part) -> f64 {
        match part {
            Part::RemoteIo(program, place)
                if self.has(Part::RemoteIo(program, 1)) && authors[program] == place =>
            {
                self.options.remote_ios.expect("remote I/Os").switchover
            }
            Part::Device(program, place)
                if self.has(Part::Device(program, 1))
                    && self.is_up(down, Part::RemoteIo(program, place)) =>
            {
                self.options.field_devices.expect("devices").coverage
            }
            _ => 1.0,
        }
    }

    /// Rate of what takes both of a pair.
    fn common(&self) -> f64 {
        let pairs = |second: fn(usize) -> Part| {
            let programs = 0..self.options.controllers as usize;
            programs.filter(|program| self.has(second(*program))).count() as f64
        };
        let of = |count: f64, beta: f64, mtbf: f64| count * beta / mtbf;
        let options = &self.options;
        let remote_ios = options.remote_ios.map_or(0.0, |them| {
            of(pairs(|program| Part::RemoteIo(program, 1)), them.beta, them.mtbf.get())
        });
        let devices = options.field_devices.map_or(0.0, |them| {
            of(pairs(|program| Part::Device(program, 1)), them.beta, them.mtbf.get())
        });
        let networks = options.networks.filter(|them| them.count > 1);
        remote_ios + devices + networks.map_or(0.0, |them| them.beta / them.mtbf.get())
    }

    /// Steps out of a state; those to the failure of the cell have none.
    fn steps(&self, state: &State) -> Vec<(Option<State>, f64)> {
        let (down, authors) = state;
        let failed = down.iter().filter(|down| **down).count() as f64;
        let crew = self.options.crews.map_or(1.0, |crews| (f64::from(crews) / failed).min(1.0));
        let mut found = vec![(None, self.common())];
        for (place, part) in self.parts.iter().enumerate() {
            let (failure, repair) = self.rates(*part);
            let mut after = (down.clone(), authors.clone());
            after.0[place] = !down[place];
            if down[place] {
                found.push((Some(after), repair * crew));
                continue;
            }
            if let Part::RemoteIo(program, of_pair) = *part
                && self.has(Part::RemoteIo(program, 1))
                && authors[program] == of_pair
            {
                after.1[program] = 1 - of_pair;
            }
            let masked = self.masked(state, *part);
            found.push((None, failure * (1.0 - masked)));
            let works = self.works(&after.0);
            found.push((works.then_some(after), failure * masked));
        }
        found
    }

    /// The mean time to failure, by elimination on the equations of all states.
    fn mttf(&self) -> f64 {
        let first: State =
            (vec![false; self.parts.len()], vec![0; self.options.controllers as usize]);
        let mut numbers: HashMap<State, usize> = HashMap::from([(first.clone(), 0)]);
        let mut states = vec![first];
        let mut rows: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut totals = Vec::new();
        while let Some(state) = states.get(rows.len()).cloned() {
            let steps = self.steps(&state);
            totals.push(steps.iter().map(|(_, rate)| rate).sum::<f64>());
            let row = steps.into_iter().filter(|(_, rate)| *rate > 0.0);
            let row = row.filter_map(|(to, rate)| {
                let to = to?;
                let next = states.len();
                let number = *numbers.entry(to.clone()).or_insert(next);
                if number == next {
                    states.push(to);
                }
                Some((number, rate))
            });
            let row: Vec<(usize, f64)> = row.collect();
            rows.push(row);
        }
        let count = states.len();
        assert!(count <= 600, "{count} states");
        let mut matrix = vec![vec![0.0; count + 1]; count];
        for (place, (row, total)) in rows.iter().zip(&totals).enumerate() {
            matrix[place][place] += total;
            matrix[place][count] = 1.0;
            row.iter().for_each(|(to, rate)| matrix[place][*to] -= rate);
        }
        for pivot in (1..count).rev() {
            let (above, from) = matrix.split_at_mut(pivot);
            let from = &from[0];
            for row in above {
                let factor = row[pivot] / from[pivot];
                if factor != 0.0 {
                    (0..pivot).for_each(|column| row[column] -= factor * from[column]);
                    row[count] -= factor * from[count];
                }
            }
        }
        matrix[0][count] / matrix[0][0]
    }
}

/// A cell of these programs, of which some have twins, and some of those modules of their own.
fn cell(programs: u32, twins: u32, redundant: u32, (switchover, coverage): (f64, f64)) -> Options {
    let mut options = Options::new(programs, hours(300.0), hours(20.0));
    options.remote_ios = Some(RemoteIos {
        count: programs,
        twins,
        mtbf: hours(200.0),
        mttr: hours(10.0),
        switchover,
        beta: 0.01,
    });
    options.field_devices = Some(FieldDevices {
        count: programs,
        redundant,
        mtbf: hours(150.0),
        mttr: hours(30.0),
        coverage,
        beta: 0.02,
    });
    options
}

fn check(options: &Options, what: &str) {
    let found = options.system().expect("a system").chain().expect("a chain").mttf();
    check_within(found.expect("a mean"), Cell::new(options.clone()).mttf(), 1e-9, what);
}

/// One device: single whatever the remote I/Os are. Two: a remote I/O with its own, or the other one with its own.
#[test]
fn the_wiring_decides_whether_devices_are_redundant() {
    for coverages in [(1.0, 1.0), (0.9, 1.0), (1.0, 0.8), (0.7, 0.6), (0.0, 1.0)] {
        for (twins, redundant) in [(0, 0), (1, 0), (1, 1)] {
            let mut options = cell(1, twins, redundant, coverages);
            check(&options, &format!("{twins} {redundant} {coverages:?}"));
            options.crews = Some(1);
            check(&options, &format!("{twins} {redundant} {coverages:?}, one crew"));
            options.networks =
                Some(Networks { count: 2, mtbf: hours(100.0), mttr: hours(5.0), beta: 0.03 });
            options.spares = 0;
            check(&options, &format!("{twins} {redundant} {coverages:?}, two networks"));
        }
    }
}

/// Programs of one cell may differ.
#[test]
fn one_cell_can_have_both_wirings() {
    let mut options = cell(2, 2, 1, (0.9, 0.95));
    options.spares = 0;
    check(&options, "exclusive and parallel");
    options.crews = Some(2);
    check(&options, "exclusive and parallel, two crews");
}

/// Devices alone, where remote I/Os do not fail.
#[test]
fn two_devices_are_a_pair_where_remote_ios_do_not_fail() {
    for coverage in [1.0, 0.7, 0.2] {
        let mut options = cell(2, 2, 1, (1.0, coverage));
        options.remote_ios = None;
        check(&options, &format!("{coverage}"));
    }
}

/// What is single follows the wiring, and what the model leaves out is said.
#[test]
fn single_points_follow_the_wiring() {
    let single = |twins, redundant| -> Vec<(String, u32)> {
        let points = single_points(&cell(4, twins, redundant, (1.0, 1.0)));
        points.into_iter().map(|point| (point.part, point.count)).collect()
    };
    let named = |part: &str, count: u32| (part.to_owned(), count);
    assert_eq!(single(0, 0), [named("remote I/O", 4), named("field device", 4)]);
    assert_eq!(single(4, 0), [named("field device", 4)]);
    assert_eq!(single(4, 3), [named("field device", 1)]);
    assert_eq!(single(4, 4), []);
    assert_eq!(left_out(&cell(1, 1, 1, (1.0, 1.0))), ["networks", "sensors", "actuators"]);
    // No more modules of their own than twins.
    let errors = cell(4, 2, 3, (1.0, 1.0)).system().expect_err("too many");
    assert!(errors[0].to_string().contains("twins with modules of their own is 3"), "{errors:?}");
}
