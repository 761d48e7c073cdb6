//! The register map: the meaning of each bit and each register of Modbus.
//!
//! ```text
//!   discrete inputs   the BOOLs of u(1), u(2), ... one after the other, in order of declaration
//!   coils             the BOOLs of y(1), y(2), ... as driven; then those that operators write
//!   registers         0..16 the run, 16.. the stations, 96.. the programs, 1120.. the numbers of u(1), y(1), u(2), ...;
//!                     read as input or as holding registers; setpoints of operators can be written
//! ```
//!
//! Numbers of 32 bits take two registers and numbers of 64 bits four, the most significant one first. Addresses are those on the wire, from 0.

mod image;
mod tags;

use std::borrow::Cow;
use std::collections::BTreeMap;

use tokio_modbus::ExceptionCode;
use understudy_cluster::{CardFacts, Cluster, OperatorDeclaration, value_text};
use understudy_executable::Interface;
use understudy_remote_io::OperatorInputKind;
use understudy_typed::{Declared, Elementary, Point};
use understudy_wire::{MAXIMUM_PROGRAMS, Member, ProgramId};

use crate::error::GatewayError;

pub use image::ProcessImage;

/// Version of the map, in register 0; it changes when a place changes.
const VERSION: u16 = 1;

/// First register of the stations, one register each.
const STATIONS: usize = 16;

/// First register of the programs.
const PROGRAMS: usize = 96;

/// Number of registers of a program.
const OF_PROGRAM: usize = 16;

/// First register of the numbers among the inputs and outputs of the programs, behind as many programs as there can be.
const NUMBERS: usize = PROGRAMS + MAXIMUM_PROGRAMS * OF_PROGRAM;

/// Number of addresses of 16 bits.
const ADDRESSES: usize = 1 << 16;

/// One of the tables of Modbus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Area {
    /// Read by function 2.
    DiscreteInput,
    /// Read by function 1, and written by 5 and 15.
    Coil,
    /// Read by functions 3 and 4, and written by 6 and 16.
    Register,
}

/// One line of the map.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Place {
    /// Its table.
    pub area: Area,
    /// Its address, from 0.
    pub address: u16,
    /// Number of registers: 1, 2 for a number of 32 bits, 4 for one of 64 bits.
    pub width: u16,
    /// A signal as `program.signal`, or the name of the register.
    pub name: String,
    /// Meaning of its values.
    pub meaning: Cow<'static, str>,
    /// Whether it is an operator input.
    pub writable: bool,
    /// Its type, `REAL`; of a register that is no signal an unsigned integer.
    #[serde(rename = "type")]
    pub of: Cow<'static, str>,
    /// How a signal is shown.
    #[serde(flatten)]
    pub card: CardFacts,
}

/// An operator input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Target {
    /// Remote I/O of its program.
    pub(crate) member: Member,
    /// The input.
    pub(crate) point: Point,
    /// Number of registers.
    width: usize,
}

/// The map of one cluster.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisterMap {
    places: Vec<Place>,
    /// u(i) and y(i), point by point.
    interfaces: Vec<Interface>,
    /// Registers of all numbers.
    numbers: usize,
    stations: usize,
    /// The operator inputs behind the outputs among the coils.
    coils: Vec<Target>,
    /// Address of the first of these coils.
    first_coil: usize,
    /// Setpoints by their first registers.
    setpoints: BTreeMap<usize, Target>,
}

/// The numbers of [`StationState::ALL`].
const STATION_STATES: &str = "0 not-started, 1 publishing, 2 not-received, 3 flagged, 4 joining, 5 shadow-mode, 6 refused, 7 suspended, 8 killed, 9 ended, 10 standby";

/// Meaning of an input.
const INPUT: &str = "input, as last sampled";

/// Meaning of an output.
const OUTPUT: &str = "output, as driven";

const SOURCES: &str = "0 not known, 1 direct, 2 reconstructed, 3 held, 4 fail-safe";

const PROTECTION: &str = "0 not known, 1 protected, 2 not protected: the failure of one station would not be masked, 3 state lost";

/// Of the run, with address, width and meaning.
#[rustfmt::skip]
const OF_RUN: [(u16, u16, &str, &str); 8] = [
    (0, 1, "map.version", "1"),
    (1, 1, "run.state", "0 starting, 1 running, 2 finished, 3 interrupted, 4 not current"),
    (2, 2, "run.cycle", "the newest cycle, from the origin"),
    (4, 2, "run.period_us", "microseconds"),
    (6, 1, "margin.survives", "remaining redundancy: any further failures of stations that would be masked"),
    (7, 1, "alarms.open", "alarms that last or are not acknowledged; 65535 while earlier records are read"),
    (8, 1, "cluster.programs", "number of programs"),
    (9, 1, "cluster.stations", "number of stations"),
];

/// Of a program, with its place behind the program's first register.
#[rustfmt::skip]
const PROGRAM_REGISTERS: [(u16, u16, &str, &str); 10] = [
    (0, 1, "source", SOURCES),
    (1, 1, "awaits_release", "1 where the operator has to release the outputs"),
    (2, 1, "forced", "number of forced signals"),
    (3, 1, "protection", PROTECTION),
    (4, 2, "direct", "deadlines, from the origin of the run on"),
    (6, 2, "reconstructed", "deadlines, from the origin of the run on"),
    (8, 2, "held", "deadlines, from the origin of the run on"),
    (10, 2, "fail_safe", "deadlines, from the origin of the run on"),
    (12, 2, "finished", "finished parts"),
    (14, 2, "plant_faults", "plant faults"),
];

impl RegisterMap {
    /// The map of a cluster.
    ///
    /// # Errors
    /// More signals than addresses.
    pub fn new(cluster: &Cluster) -> Result<Self, GatewayError> {
        let programs = cluster.controllers();
        let mut places = Vec::new();
        let (mut coils, mut first_coil) = (Vec::new(), 0);
        for (area, meaning) in [(Area::DiscreteInput, INPUT), (Area::Coil, OUTPUT)] {
            let signals = (0..).map(ProgramId).zip(programs).flat_map(|(of, program)| {
                let Interface { inputs, outputs } = &program.interface;
                let points = match area {
                    Area::DiscreteInput => inputs,
                    _ => outputs,
                };
                let bits = points.iter().filter(|point| point.of == Elementary::Bool);
                bits.map(move |point| {
                    let card = cluster.card(of, &point.name).facts(point.of);
                    (format!("{}.{}", program.name, point.name), card)
                })
            });
            let first = places.len();
            places.extend(signals.enumerate().map(|(address, (name, card))| Place {
                area,
                address: address as u16,
                width: 1,
                name,
                meaning: described(meaning, &card),
                writable: false,
                of: "BOOL".into(),
                card,
            }));
            if area == Area::Coil {
                first_coil = places.len() - first;
                for target in targets(cluster, |of| of == Elementary::Bool) {
                    places.push(Place {
                        area,
                        address: (places.len() - first) as u16,
                        width: 1,
                        name: target.name,
                        meaning: described(&target.meaning, &target.card),
                        writable: true,
                        of: "BOOL".into(),
                        card: target.card,
                    });
                    coils.push(target.target);
                }
            }
            let bits = places.len() - first;
            if bits > ADDRESSES {
                return Err(GatewayError::TooManyBits { bits, most: ADDRESSES });
            }
        }
        let register = |address: usize, width, name, meaning: &'static str| Place {
            area: Area::Register,
            address: address as u16,
            width,
            name,
            meaning: meaning.into(),
            writable: false,
            of: if width == 1 { "UINT" } else { "UDINT" }.into(),
            card: CardFacts::default(),
        };
        for (address, width, name, meaning) in OF_RUN {
            places.push(register(address.into(), width, name.to_owned(), meaning));
        }
        let stations = programs
            .iter()
            .map(|controller| &controller.name)
            .chain(cluster.understudies().iter().map(|station| &station.name));
        let mut count = 0;
        for (rank, name) in stations.enumerate() {
            places.push(register(STATIONS + rank, 1, format!("{name}.state"), STATION_STATES));
            count = rank + 1;
        }
        for (index, program) in programs.iter().enumerate() {
            for (offset, width, name, meaning) in PROGRAM_REGISTERS {
                let address = PROGRAMS + index * OF_PROGRAM + usize::from(offset);
                let name = format!("{}.{name}", program.name);
                places.push(register(address, width, name, meaning));
            }
        }
        let interfaces: Vec<Interface> = programs.iter().map(|it| it.interface.clone()).collect();
        let mut address = NUMBERS;
        let mut setpoints = BTreeMap::new();
        let mut written: BTreeMap<String, WritableInput> =
            targets(cluster, |of| of != Elementary::Bool)
                .map(|target| (target.name.clone(), target))
                .collect();
        for (of, (program, interface)) in (0..).map(ProgramId).zip(programs.iter().zip(&interfaces))
        {
            for (points, meaning) in [(&interface.inputs, INPUT), (&interface.outputs, OUTPUT)] {
                for point in points.iter().filter(|point| point.of != Elementary::Bool) {
                    let width = registers_of(point);
                    let name = format!("{}.{}", program.name, point.name);
                    let target = written.remove(&name);
                    let meaning = target.as_ref().map_or(meaning, |target| &target.meaning);
                    let card = cluster.card(of, &point.name).facts(point.of);
                    let unit = match &card.unit {
                        Some(unit) => format!(" in {unit}"),
                        None if point.of.is_time() => " in nanoseconds".to_owned(),
                        None => String::new(),
                    };
                    let meaning = format!("{}{unit}: {meaning}", type_of(point));
                    places.push(Place {
                        area: Area::Register,
                        address: address as u16,
                        width: width as u16,
                        name,
                        meaning: described(&meaning, &card),
                        writable: target.is_some(),
                        of: point.declared().to_string().into(),
                        card,
                    });
                    if let Some(target) = target {
                        setpoints.insert(address, target.target);
                    }
                    address += width;
                }
            }
        }
        if address > ADDRESSES {
            return Err(GatewayError::TooManyRegisters { registers: address, most: ADDRESSES });
        }
        Ok(Self {
            places,
            interfaces,
            numbers: address - NUMBERS,
            stations: count,
            coils,
            first_coil,
            setpoints,
        })
    }

    /// The operator inputs of `values` from a coil on, each with its value as stored.
    pub(crate) fn written_coils(
        &self,
        address: u16,
        values: &[bool],
    ) -> Result<Vec<(&Target, u64)>, ExceptionCode> {
        let first = usize::from(address).checked_sub(self.first_coil);
        let targets = first.and_then(|first| self.coils.get(first..first + values.len()));
        let targets = targets.ok_or(ExceptionCode::IllegalDataAddress)?;
        let values = values.iter().map(|value| u64::from(*value));
        Ok(targets.iter().zip(values).collect())
    }

    /// The setpoints of `words` from a register on, each with its value as stored. Half a setpoint has no address.
    pub(crate) fn written_registers(
        &self,
        address: u16,
        words: &[u16],
    ) -> Result<Vec<(&Target, u64)>, ExceptionCode> {
        let mut address = usize::from(address);
        let mut left = words;
        let mut written = Vec::new();
        while !left.is_empty() {
            let target = self.setpoints.get(&address);
            let target = target.filter(|target| target.width <= left.len());
            let target = target.ok_or(ExceptionCode::IllegalDataAddress)?;
            let (own, rest) = left.split_at(target.width);
            let stored = stored_of(target.point.of, own).ok_or(ExceptionCode::IllegalDataValue)?;
            written.push((target, stored));
            address += target.width;
            left = rest;
        }
        Ok(written)
    }

    /// Every place, by table and address.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Whether these registers are all of the run itself, and of no station or program.
    pub fn is_of_run(address: u16, count: u16) -> bool {
        usize::from(address) + usize::from(count) <= STATIONS
    }
}

/// An operator input as a place of the map.
struct WritableInput {
    name: String,
    meaning: String,
    card: CardFacts,
    target: Target,
}

/// The operator inputs of all programs whose type is `wanted`.
fn targets(
    cluster: &Cluster,
    wanted: impl Fn(Elementary) -> bool + Copy,
) -> impl Iterator<Item = WritableInput> {
    let programs = cluster.controllers().iter().zip(cluster.remote_ios());
    programs.enumerate().flat_map(move |(index, (controller, remote_io))| {
        let program = ProgramId(index as u8);
        let member = Member::RemoteIo(program);
        let inputs = remote_io.inputs.iter();
        inputs.filter_map(move |source| {
            let declaration = source.operator()?;
            let point = controller.interface.inputs.find(&source.name)?;
            wanted(point.of).then(|| WritableInput {
                name: format!("{}.{}", controller.name, source.name),
                meaning: meaning_of(declaration),
                card: cluster.card(program, &source.name).facts(point.of),
                target: Target { member, point: point.clone(), width: registers_of(point) },
            })
        })
    })
}

/// What a place holds, with the description of its signal.
fn described(meaning: &str, card: &CardFacts) -> Cow<'static, str> {
    match &card.description {
        Some(description) => format!("{meaning}; {description}").into(),
        None => meaning.to_owned().into(),
    }
}

/// Values of an enumeration that a meaning names.
const MOST_NAMES: usize = 16;

/// The type of a register's point, with the values of an enumeration: `INT, 0 Off, 1 Auto`.
fn type_of(point: &Point) -> String {
    let known = point.values.iter().flat_map(|known| &known.values);
    let values = known.take(MOST_NAMES).map(|(name, value)| format!(", {value} {name}"));
    // The register has the number of a value, so an enumeration is told by its integer.
    let of = Declared { values: None, ..point.declared() };
    format!("{of}{}", values.collect::<String>())
}

/// How an operator writes an input.
fn meaning_of(declaration: &OperatorDeclaration) -> String {
    let input = &declaration.input;
    let role = input.role.word();
    match input.kind {
        OperatorInputKind::Level => format!("level, written by the role {role}"),
        OperatorInputKind::Pulse(_) => format!("pulse: TRUE presses it, by the role {role}"),
        OperatorInputKind::Setpoint { low, high } => {
            let text = |stored| value_text(&declaration.declared, stored);
            format!("setpoint, {} to {}, written by the role {role}", text(low), text(high))
        }
        OperatorInputKind::Group { .. } => {
            format!("signal of another group, written by the role {role}")
        }
    }
}

/// The value of registers, as a signal of that type stores it; nothing where it does not fit.
fn stored_of(of: Elementary, words: &[u16]) -> Option<u64> {
    let value = words.iter().fold(0, |value, word| value << 16 | u64::from(*word));
    if of.bits() >= 16 {
        return Some(value);
    }
    let stored = value & of.mask();
    let is_whole = match of.is_signed() {
        true => of.signed(stored) == i128::from(value as u16 as i16),
        false => stored == value,
    };
    is_whole.then_some(stored)
}

/// Registers that a number takes: one for 8 or 16 bits, two for 32, four for 64.
fn registers_of(point: &Point) -> usize {
    point.of.bits().div_ceil(16) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_hold_the_values_that_fit() {
        let check = |of, words: &[u16], expected| {
            assert_eq!(stored_of(of, words), expected, "{of} {words:?}");
        };
        check(Elementary::Real, &[0x42f0, 0], Some(0x42f0_0000));
        check(Elementary::Int, &[0xffff], Some(0xffff));
        check(Elementary::Sint, &[0xffff], Some(0xff));
        check(Elementary::Sint, &[127], Some(127));
        check(Elementary::Sint, &[128], None);
        check(Elementary::Usint, &[255], Some(255));
        check(Elementary::Usint, &[256], None);
    }
}
