//! The values of the registers.

use std::ops::Range;

use understudy_typed::{Elementary, Point};
use understudy_view::{ImageSide, RunState, Snapshot, StationState};
use understudy_wire::{Member, ProgramId};

use super::{Area, NUMBERS, OF_PROGRAM, PROGRAMS, RegisterMap, STATIONS, VERSION, registers_of};
use crate::feed::Feed;
use crate::followed::Observation;

/// The process image that clients read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ProcessImage {
    /// Discrete inputs.
    pub inputs: Vec<bool>,
    /// Coils.
    pub coils: Vec<bool>,
    /// Input and holding registers.
    pub registers: Vec<u16>,
    /// Places without a value, by table: the remote I/O of their program does not report. They hold 0, and no client gets it.
    pub unknown: Vec<(Area, Range<usize>)>,
}

impl ProcessImage {
    /// Whether all values of a range are known.
    pub fn is_known(&self, area: Area, range: &Range<usize>) -> bool {
        let meets = |other: &Range<usize>| range.start < other.end && other.start < range.end;
        !self.unknown.iter().any(|(of, other)| *of == area && meets(other))
    }

    /// Bits and registers of each table so far.
    fn lengths(&self) -> [(Area, usize); 3] {
        [
            (Area::DiscreteInput, self.inputs.len()),
            (Area::Coil, self.coils.len()),
            (Area::Register, self.registers.len()),
        ]
    }

    /// The next place of a point: a BOOL is a bit, a number takes registers.
    fn add(&mut self, point: &Point, side: ImageSide, stored: u64) {
        if point.of == Elementary::Bool {
            let bits = match side {
                ImageSide::Inputs => &mut self.inputs,
                ImageSide::Outputs => &mut self.coils,
            };
            return bits.push(stored != 0);
        }
        // A SINT keeps its sign.
        let value = match point.of.is_signed() {
            true => point.of.signed(stored) as u64,
            false => stored,
        };
        let places = (0..registers_of(point)).rev();
        self.registers.extend(places.map(|place| (value >> (16 * place)) as u16));
    }

    /// What was added since then has no value.
    fn unknown_since(&mut self, before: [(Area, usize); 3]) {
        let added = before.into_iter().zip(self.lengths());
        let added = added.map(|((area, from), (_, to))| (area, from..to));
        for (area, range) in added.filter(|(_, range)| !range.is_empty()) {
            let mut own = self.unknown.iter_mut().rev().filter(|(of, _)| *of == area);
            match own.next() {
                Some((_, last)) if last.end == range.start => last.end = range.end,
                _ => self.unknown.push((area, range)),
            }
        }
    }
}

/// The register of the number of open alarms.
const OPEN_ALARMS: usize = 7;

impl RegisterMap {
    /// The process image of an observation, whose run has this feed.
    pub(crate) fn image_of(&self, present: &Observation, feed: Feed) -> ProcessImage {
        let mut image = self.image(&present.snapshot, feed);
        if present.past_percent.is_some() {
            image.registers[OPEN_ALARMS] = u16::MAX;
        }
        image
    }

    /// The process image of a snapshot, whose run has this feed.
    pub fn image(&self, snapshot: &Snapshot, feed: Feed) -> ProcessImage {
        let mut image = ProcessImage {
            registers: vec![0; PROGRAMS + self.interfaces.len() * OF_PROGRAM],
            ..ProcessImage::default()
        };
        let set = |registers: &mut Vec<u16>, address: usize, value: u64| {
            let value = u32::try_from(value).unwrap_or(u32::MAX);
            registers[address] = (value >> 16) as u16;
            registers[address + 1] = value as u16;
        };
        let small = |value: usize| u16::try_from(value).unwrap_or(u16::MAX);
        let registers = &mut image.registers;
        registers[0] = VERSION;
        registers[1] = match (feed, snapshot.run) {
            (Feed::Silent, _) => 4,
            (_, RunState::Starting) => 0,
            (_, RunState::Running) => 1,
            (_, RunState::Finished) => 2,
            (_, RunState::Interrupted) => 3,
        };
        set(registers, 2, snapshot.cycle.unwrap_or_default().max(0) as u64);
        set(registers, 4, snapshot.period_us);
        registers[6] = u16::from(snapshot.margin.survives);
        registers[OPEN_ALARMS] = small(snapshot.alarms.len());
        registers[8] = small(self.interfaces.len());
        registers[9] = small(self.stations);
        for (rank, station) in snapshot.stations.iter().enumerate().take(self.stations) {
            registers[STATIONS + rank] = state_number(station.state);
        }
        for (index, program) in snapshot.programs.iter().enumerate().take(self.interfaces.len()) {
            let base = PROGRAMS + index * OF_PROGRAM;
            registers[base] = match program.source {
                None => 0,
                Some("direct") => 1,
                Some("reconstructed") => 2,
                Some("held") => 3,
                Some(_) => 4,
            };
            registers[base + 1] = u16::from(program.awaits_release);
            registers[base + 2] = small(program.forced.len());
            registers[base + 3] = match (&program.lost, &program.protection) {
                (Some(_), _) => 3,
                (None, None) => 0,
                (None, Some(protection)) if protection.protected => 1,
                (None, Some(_)) => 2,
            };
            set(registers, base + 4, program.direct);
            set(registers, base + 6, program.reconstructed);
            set(registers, base + 8, program.held);
            set(registers, base + 10, program.fail_safe);
            set(registers, base + 12, program.finished.unwrap_or_default());
            set(registers, base + 14, program.plant_faults.unwrap_or_default());
        }
        if self.numbers > 0 {
            image.registers.resize(NUMBERS, 0);
        }
        for (program, interface) in (0..).map(ProgramId).zip(&self.interfaces) {
            let sides =
                [(ImageSide::Inputs, &interface.inputs), (ImageSide::Outputs, &interface.outputs)];
            for (point, side) in
                sides.into_iter().flat_map(|(side, points)| points.iter().map(move |it| (it, side)))
            {
                let before = image.lengths();
                let value = snapshot.stored(program, side, point);
                image.add(point, side, value.unwrap_or_default());
                // An online change may have taken the point away.
                if value.is_none() {
                    image.unknown_since(before);
                }
            }
        }
        for target in &self.coils {
            let Member::RemoteIo(program) = target.member else {
                continue;
            };
            let value = snapshot.stored(program, ImageSide::Inputs, &target.point);
            let before = image.lengths();
            image.coils.push(value == Some(1));
            if value.is_none() {
                image.unknown_since(before);
            }
        }
        image
    }
}

/// The place of a state in [`StationState::ALL`].
fn state_number(state: StationState) -> u16 {
    let place = StationState::ALL.iter().position(|known| *known == state);
    place.map_or(0, |place| place as u16)
}
