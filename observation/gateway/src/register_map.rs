//! The register map: the meaning of each bit and each register of Modbus.
//!
//! ```text
//!   discrete inputs   u(1), u(2), ... one after the other, element 1 first
//!   coils             y(1), y(2), ... as driven; read-only
//!   registers         0..16 the run, 16.. the stations, 96.. the programs; read as input or as holding registers
//! ```
//!
//! Numbers of 32 bits take two registers, the upper half first. Addresses are those on the wire, from 0.

use understudy_cluster::Cluster;
use understudy_view::{RunState, Snapshot, StationState};

use crate::error::GatewayError;

/// Version of the map, in register 0; it changes when a place changes.
const VERSION: u16 = 1;

/// First register of the stations, one register each.
const STATIONS: usize = 16;

/// First register of the programs.
const PROGRAMS: usize = 96;

/// Number of registers of a program.
const OF_PROGRAM: usize = 16;

/// Number of addresses of 16 bits.
const MOST_BITS: usize = 1 << 16;

/// One of the tables of Modbus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Area {
    /// Read by function 2.
    DiscreteInput,
    /// Read by function 1.
    Coil,
    /// Read by functions 3 and 4.
    Register,
}

/// One line of the map.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Place {
    /// Its table.
    pub area: Area,
    /// Its address, from 0.
    pub address: u16,
    /// 1, or 2 for a number of 32 bits.
    pub width: u16,
    /// A signal as `program.signal`, or the name of the register.
    pub name: String,
    /// Meaning of its values.
    pub meaning: &'static str,
}

/// The map of one cluster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RegisterMap {
    places: Vec<Place>,
    /// Widths of u(i) and y(i).
    widths: Vec<(usize, usize)>,
    stations: usize,
}

/// The process image that clients read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ProcessImage {
    /// Discrete inputs.
    pub inputs: Vec<bool>,
    /// Coils.
    pub coils: Vec<bool>,
    /// Input and holding registers.
    pub registers: Vec<u16>,
}

/// The numbers of [`StationState::ALL`].
const STATION_STATES: &str = "0 not-started, 1 publishing, 2 not-received, 3 flagged, 4 joining, 5 shadow-mode, 6 refused, 7 suspended, 8 killed, 9 ended";

const SOURCES: &str = "0 not known, 1 direct, 2 reconstructed, 3 held, 4 fail-safe";

const PROTECTION: &str = "0 not known, 1 protected, 2 not protected: the failure of one station would not be masked, 3 state lost";

/// Of the run, with address, width and meaning.
#[rustfmt::skip]
const OF_RUN: [(u16, u16, &str, &str); 8] = [
    (0, 1, "map.version", "1"),
    (1, 1, "run.state", "0 starting, 1 running, 2 finished, 3 interrupted"),
    (2, 2, "run.cycle", "the newest cycle, from the origin"),
    (4, 2, "run.period_us", "microseconds"),
    (6, 1, "margin.survives", "remaining redundancy: any further failures of stations that would be masked"),
    (7, 1, "alarms.open", "alarms that last or are not acknowledged"),
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
        for (area, meaning) in [
            (Area::DiscreteInput, "input, as last sampled"),
            (Area::Coil, "output, as driven"),
        ] {
            let names: Vec<String> = programs
                .iter()
                .flat_map(|program| {
                    let signals = match area {
                        Area::DiscreteInput => program.interface.inputs.bit_names(),
                        _ => program.interface.outputs.bit_names(),
                    };
                    let named = move |signal| format!("{}.{signal}", program.name);
                    signals.into_iter().map(named)
                })
                .collect();
            if names.len() > MOST_BITS {
                return Err(GatewayError::TooManyBits {
                    bits: names.len(),
                    most: MOST_BITS,
                });
            }
            places.extend(names.into_iter().enumerate().map(|(address, name)| Place {
                area,
                address: address as u16,
                width: 1,
                name,
                meaning,
            }));
        }
        let register = |address: usize, width, name, meaning| Place {
            area: Area::Register,
            address: address as u16,
            width,
            name,
            meaning,
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
            places.push(register(
                STATIONS + rank,
                1,
                format!("{name}.state"),
                STATION_STATES,
            ));
            count = rank + 1;
        }
        for (index, program) in programs.iter().enumerate() {
            for (offset, width, name, meaning) in PROGRAM_REGISTERS {
                let address = PROGRAMS + index * OF_PROGRAM + usize::from(offset);
                let name = format!("{}.{name}", program.name);
                places.push(register(address, width, name, meaning));
            }
        }
        let widths = programs.iter().map(|program| {
            let interface = &program.interface;
            (interface.inputs.width(), interface.outputs.width())
        });
        Ok(Self {
            places,
            widths: widths.collect(),
            stations: count,
        })
    }

    /// Every place, by table and address.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The process image of a snapshot.
    pub fn image(&self, snapshot: &Snapshot) -> ProcessImage {
        let mut image = ProcessImage {
            registers: vec![0; PROGRAMS + self.widths.len() * OF_PROGRAM],
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
        registers[1] = match snapshot.run {
            RunState::Starting => 0,
            RunState::Running => 1,
            RunState::Finished => 2,
            RunState::Interrupted => 3,
        };
        set(
            registers,
            2,
            snapshot.cycle.unwrap_or_default().max(0) as u64,
        );
        set(registers, 4, snapshot.period_us);
        registers[6] = u16::from(snapshot.margin.survives);
        registers[7] = small(snapshot.alarms.len());
        registers[8] = small(self.widths.len());
        registers[9] = small(self.stations);
        for (rank, station) in snapshot.stations.iter().enumerate().take(self.stations) {
            registers[STATIONS + rank] = state_number(station.state);
        }
        for (index, (width, program)) in self.widths.iter().zip(&snapshot.programs).enumerate() {
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
            set(
                registers,
                base + 14,
                program.plant_faults.unwrap_or_default(),
            );
            add_bits(&mut image.inputs, program.inputs.as_deref(), width.0);
            add_bits(&mut image.coils, program.outputs.as_deref(), width.1);
        }
        image
    }
}

/// `width` bits of a text such as `0110`; 0 where nothing is known.
fn add_bits(bits: &mut Vec<bool>, text: Option<&str>, width: usize) {
    let end = bits.len() + width;
    let known = text.unwrap_or_default().bytes().take(width);
    bits.extend(known.map(|byte| byte == b'1'));
    bits.resize(end, false);
}

/// The place of a state in [`StationState::ALL`].
fn state_number(state: StationState) -> u16 {
    let place = StationState::ALL.iter().position(|known| *known == state);
    place.map_or(0, |place| place as u16)
}
