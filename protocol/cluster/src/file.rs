//! A cluster file as it was written: its sections with the places of their values, before any name is looked up.

mod signals;

use std::collections::BTreeMap;
use std::net::{SocketAddr, SocketAddrV4};
use std::ops::Range;
use std::time::Duration;

use toml::de::DeTable;
use understudy_plant::{PressParameters, RobotParameters};
use understudy_text::Diagnostic;
use understudy_text::tables::Constant;
use understudy_text::tables::{Value, unknown_key};

use crate::address::Addresses;
use crate::device::{BAUD_RATES, Connection, Parity, SerialLine};
use crate::fields::{CODES, ConnectionText, Fields, PlaceEntry, Placed, SourceEntry};
use crate::format::{
    ALARM, CLUSTER, CONTROLLER, FIELD, LADDER_PARAMETERS, MODELS, NOTIFY, PLANT, PRESS_PARAMETERS,
    REMOTE_IO, ROBOT_PARAMETERS, SECTIONS, SIGNALS, Section, TWIN, UNDERSTUDY,
};
use crate::notify::Notify;

pub(crate) use signals::SignalSection;

/// What a text says; whole only where no diagnostic is an error.
#[derive(Debug)]
pub(crate) struct ClusterFile {
    pub(crate) cluster: ClusterSection,
    pub(crate) controllers: Vec<ControllerSection>,
    /// Nothing where the file does not speak of understudies.
    pub(crate) understudies: Option<Vec<UnderstudySection>>,
    pub(crate) remote_ios: Vec<RemoteIoSection>,
    pub(crate) plants: Vec<PlantSection>,
    pub(crate) alarms: Vec<AlarmSection>,
    pub(crate) notify: Option<Notify>,
    /// In the order of the file.
    pub(crate) signals: Vec<SignalSection>,
}

#[derive(Debug)]
pub(crate) struct AlarmSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) signal: Option<Placed<String>>,
    pub(crate) when: Option<Placed<Constant>>,
    pub(crate) above: Option<Placed<Constant>>,
    pub(crate) below: Option<Placed<Constant>>,
    pub(crate) hysteresis: Option<Placed<Constant>>,
    pub(crate) on_delay: Duration,
    pub(crate) off_delay: Duration,
    /// Index into [`crate::format::PRIORITIES`].
    pub(crate) priority: usize,
    pub(crate) text: Option<String>,
    pub(crate) action: Option<String>,
}

#[derive(Debug)]
pub(crate) struct ClusterSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) period: Duration,
    /// Index into [`crate::format::MODES`].
    pub(crate) mode: usize,
    /// Index into [`crate::format::SCHEDULES`].
    pub(crate) schedule: usize,
    pub(crate) copies: u32,
    pub(crate) history: u32,
    pub(crate) flag_after: u32,
    pub(crate) shadow_cycles: u32,
    pub(crate) listen_cycles: u32,
    pub(crate) retain_every: Duration,
    pub(crate) spin: bool,
    /// Index into [`crate::format::LINKS`].
    pub(crate) link: usize,
    pub(crate) multicast: Option<SocketAddrV4>,
    /// Nothing where the number is an error.
    pub(crate) networks: Option<u32>,
    /// Index into [`crate::format::SECURITIES`].
    pub(crate) security: usize,
}

#[derive(Debug)]
pub(crate) struct ControllerSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) ladder: Option<Placed<String>>,
    /// By the path in the program before: where that stands, and the path in this one.
    pub(crate) renamed: BTreeMap<String, (Range<usize>, Placed<String>)>,
    pub(crate) addresses: Addresses<Placed<SocketAddr>>,
}

#[derive(Debug)]
pub(crate) struct UnderstudySection {
    pub(crate) name: Option<Placed<String>>,
    pub(crate) addresses: Addresses<Placed<SocketAddr>>,
    pub(crate) spare: bool,
}

#[derive(Debug)]
pub(crate) struct RemoteIoSection {
    pub(crate) name: Option<Placed<String>>,
    pub(crate) controller: Option<Placed<String>>,
    pub(crate) hold_cycles: u32,
    pub(crate) trial_cycles: u32,
    pub(crate) fail_safe: Vec<(Placed<String>, Constant)>,
    pub(crate) ramp: Vec<(Placed<String>, Constant)>,
    /// Index into [`crate::format::RELEASES`].
    pub(crate) release: usize,
    /// Index into [`crate::format::VALUE_FAULTS`].
    pub(crate) value_fault: usize,
    /// Index into [`crate::format::STALE_STATES`].
    pub(crate) stale_state: usize,
    /// Index into [`crate::format::RESTARTS`].
    pub(crate) restart: usize,
    pub(crate) diagnosis: Option<Placed<String>>,
    pub(crate) inputs: Vec<SourceEntry>,
    pub(crate) field: Option<FieldSection>,
    pub(crate) twin: Option<TwinSection>,
    pub(crate) addresses: Addresses<Placed<SocketAddr>>,
}

#[derive(Debug)]
pub(crate) struct TwinSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) take_over_after: u32,
    pub(crate) owner_timeout: Duration,
    pub(crate) is_parallel: bool,
    /// The device of a twin with modules of its own.
    pub(crate) connection: Option<ConnectionText>,
    pub(crate) discrepancy_cycles: u32,
    pub(crate) direct_link: bool,
    pub(crate) tolerance: Vec<(Placed<String>, Constant)>,
    /// Numeric outputs that both drive, and how each of them does it.
    pub(crate) share: BTreeMap<String, (Range<usize>, Placed<String>)>,
    /// Keys that only one of the wirings has, with their places.
    pub(crate) special: Vec<Placed<&'static str>>,
    pub(crate) addresses: Addresses<Placed<SocketAddr>>,
}

#[derive(Debug)]
pub(crate) struct FieldSection {
    pub(crate) span: Range<usize>,
    pub(crate) connection: Option<Connection>,
    pub(crate) unit: u8,
    pub(crate) timeout: Duration,
    pub(crate) stale_after: Duration,
    /// By signal.
    pub(crate) inputs: BTreeMap<String, PlaceEntry>,
    /// By signal.
    pub(crate) outputs: BTreeMap<String, PlaceEntry>,
}

#[derive(Debug)]
pub(crate) struct PlantSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) controller: Option<Placed<String>>,
    pub(crate) model: Option<ModelSection>,
    pub(crate) fed_by: Option<Placed<String>>,
    /// By terminal: where the terminal stands, and the signal.
    pub(crate) signals: BTreeMap<String, (Range<usize>, Placed<String>)>,
    /// By terminal: where the terminal stands, and the sensor of another plant.
    pub(crate) follows: BTreeMap<String, (Range<usize>, Placed<String>)>,
    pub(crate) watchdog_cycles: u32,
    pub(crate) addresses: Addresses<Placed<SocketAddr>>,
}

#[derive(Debug)]
pub(crate) enum ModelSection {
    Robot(RobotParameters),
    Press(PressParameters),
    Ladder(Placed<String>),
}

/// Reads all sections; where the text is no TOML, says so and nothing else.
pub(crate) fn read(text: &str, diagnostics: &mut Vec<Diagnostic>) -> Option<ClusterFile> {
    let root = understudy_text::tables::parse(text, &CODES, diagnostics)?;
    let root = root.get_ref();
    let known: Vec<&str> = SECTIONS.iter().map(|section| section.name).chain([SIGNALS]).collect();
    for key in root.keys() {
        if !known.contains(&key.get_ref().as_ref()) {
            diagnostics.push(unknown_key(&CODES, "a cluster file", key, &known));
        }
    }
    let empty = DeTable::new();
    let cluster = cluster(root, diagnostics);
    let controllers: Vec<_> = tables(root, &CONTROLLER, diagnostics)
        .unwrap_or_default()
        .iter()
        .map(|fields| ControllerSection {
            span: fields.span.clone(),
            name: fields.name("name", diagnostics),
            ladder: fields.text("ladder", diagnostics),
            renamed: fields.names("renamed", diagnostics),
            addresses: fields.addresses(diagnostics),
        })
        .collect();
    if controllers.is_empty() && !root.contains_key(CONTROLLER.name) {
        diagnostics.push(missing(&CONTROLLER));
    }
    let understudies = tables(root, &UNDERSTUDY, diagnostics).map(|tables| {
        let read = |fields: &Fields<'_, '_>| UnderstudySection {
            name: fields.name("name", diagnostics),
            addresses: fields.addresses(diagnostics),
            spare: fields.flag("spare", diagnostics),
        };
        tables.iter().map(read).collect()
    });
    let remote_ios = tables(root, &REMOTE_IO, diagnostics).unwrap_or_default();
    let remote_ios = remote_ios
        .iter()
        .map(|fields| RemoteIoSection {
            name: fields.name("name", diagnostics),
            controller: fields.text("controller", diagnostics),
            hold_cycles: fields.count("hold_cycles", diagnostics),
            trial_cycles: fields.count("trial_cycles", diagnostics),
            fail_safe: fields.values("fail_safe", diagnostics),
            ramp: fields.values("ramp", diagnostics),
            release: fields.word("release", diagnostics),
            value_fault: fields.word("value_fault", diagnostics),
            stale_state: fields.word("stale_state", diagnostics),
            restart: fields.word("restart", diagnostics),
            diagnosis: fields.text("diagnosis", diagnostics),
            inputs: fields.sources("inputs", diagnostics),
            field: field(fields, &empty, diagnostics),
            twin: twin(fields, &empty, diagnostics),
            addresses: fields.addresses(diagnostics),
        })
        .collect();
    let plants = tables(root, &PLANT, diagnostics).unwrap_or_default();
    let plants = plants
        .iter()
        .map(|fields| PlantSection {
            span: fields.span.clone(),
            name: fields.name("name", diagnostics),
            controller: fields.text("controller", diagnostics),
            model: model(fields, &empty, diagnostics),
            fed_by: fields.text("fed_by", diagnostics),
            signals: fields.names("signals", diagnostics),
            follows: fields.names("follows", diagnostics),
            watchdog_cycles: fields.count("watchdog_cycles", diagnostics),
            addresses: fields.addresses(diagnostics),
        })
        .collect();
    let alarms = tables(root, &ALARM, diagnostics).unwrap_or_default();
    let alarms = alarms
        .iter()
        .map(|fields| AlarmSection {
            span: fields.span.clone(),
            name: fields.name("name", diagnostics),
            signal: fields.text("signal", diagnostics),
            when: fields.constant("when", diagnostics),
            above: fields.constant("above", diagnostics),
            below: fields.constant("below", diagnostics),
            hysteresis: fields.constant("hysteresis", diagnostics),
            on_delay: fields.time("on_delay", diagnostics),
            off_delay: fields.time("off_delay", diagnostics),
            priority: fields.word("priority", diagnostics),
            text: fields.text("text", diagnostics).map(|text| text.value),
            action: fields.text("action", diagnostics).map(|text| text.value),
        })
        .collect();
    let notify = notify(root, diagnostics);
    Some(ClusterFile {
        cluster: cluster?,
        controllers,
        understudies,
        remote_ios,
        plants,
        alarms,
        notify,
        signals: signals::read(root, diagnostics),
    })
}

fn notify(root: &DeTable<'_>, diagnostics: &mut Vec<Diagnostic>) -> Option<Notify> {
    let value = Value::new(NOTIFY.name, root.get(NOTIFY.name)?, &CODES);
    let table = value.table("a table, [notify]", diagnostics)?;
    let fields = Fields::new(&NOTIFY, table, diagnostics);
    let timeout = fields.time("timeout", diagnostics);
    let (program, arguments) = fields.command("command", diagnostics)?;
    Some(Notify { program, arguments, timeout })
}

fn missing(section: &Section) -> Diagnostic {
    let message = format!("a cluster file needs {}", section.header());
    Diagnostic::error("U0203", message, 0..0).with_help(format!("add it: {}", section.meaning))
}

fn cluster(root: &DeTable<'_>, diagnostics: &mut Vec<Diagnostic>) -> Option<ClusterSection> {
    let Some(value) = root.get(CLUSTER.name) else {
        diagnostics.push(missing(&CLUSTER));
        return None;
    };
    let table = Value::new(CLUSTER.name, value, &CODES).table("a table, [cluster]", diagnostics)?;
    let fields = Fields::new(&CLUSTER, table, diagnostics);
    let known = diagnostics.len();
    let networks = fields.count("networks", diagnostics);
    let networks = Some(networks).filter(|_| diagnostics.len() == known);
    Some(ClusterSection {
        span: fields.span.clone(),
        name: fields.name("name", diagnostics),
        period: fields.time("period", diagnostics),
        mode: fields.word("mode", diagnostics),
        schedule: fields.word("schedule", diagnostics),
        copies: fields.count("copies", diagnostics),
        history: fields.count("history", diagnostics),
        flag_after: fields.count("flag_after", diagnostics),
        shadow_cycles: fields.count("shadow_cycles", diagnostics),
        listen_cycles: fields.count("listen_cycles", diagnostics),
        retain_every: fields.time("retain_every", diagnostics),
        spin: fields.flag("spin", diagnostics),
        link: fields.word("link", diagnostics),
        multicast: fields.multicast("multicast", diagnostics),
        networks,
        security: fields.word("security", diagnostics),
    })
}

/// All tables of a repeated section; nothing where the file has no such key.
pub(crate) fn tables<'a, 't>(
    root: &'a DeTable<'t>,
    section: &'static Section,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Vec<Fields<'a, 't>>> {
    let value = root.get(section.name)?;
    let tables = Value::new(section.name, value, &CODES).tables(diagnostics);
    let tables = tables.into_iter();
    Some(tables.map(|table| Fields::new(section, table, diagnostics)).collect())
}

fn field<'a, 't>(
    fields: &Fields<'a, 't>,
    empty: &'a DeTable<'t>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<FieldSection> {
    if !fields.has("field") {
        return None;
    }
    let fields = fields.table("field", &FIELD, empty, diagnostics);
    Some(FieldSection {
        span: fields.span.clone(),
        connection: connection(&fields, diagnostics),
        unit: fields.count("unit", &mut Vec::new()) as u8,
        timeout: fields.time("timeout", diagnostics),
        stale_after: fields.time("stale_after", diagnostics),
        inputs: fields.places("inputs", diagnostics),
        outputs: fields.places("outputs", diagnostics),
    })
}

fn twin<'a, 't>(
    fields: &Fields<'a, 't>,
    empty: &'a DeTable<'t>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<TwinSection> {
    if !fields.has("twin") {
        return None;
    }
    let fields = fields.table("twin", &TWIN, empty, diagnostics);
    let special = ["owner_timeout", "modbus", "discrepancy_cycles", "tolerance", "share"];
    let special = special.into_iter();
    Some(TwinSection {
        is_parallel: fields.word("wiring", diagnostics) == 1,
        connection: fields
            .has("modbus")
            .then(|| fields.connection("modbus", diagnostics))
            .flatten(),
        discrepancy_cycles: fields.count("discrepancy_cycles", diagnostics),
        direct_link: fields.flag("direct_link", diagnostics),
        tolerance: fields.values("tolerance", diagnostics),
        share: fields.names("share", diagnostics),
        special: special
            .filter_map(|value| Some(Placed { value, span: fields.place_of(value)? }))
            .collect(),
        span: fields.span.clone(),
        name: fields.name("name", diagnostics),
        take_over_after: fields.count("take_over_after", diagnostics),
        owner_timeout: fields.time("owner_timeout", diagnostics),
        addresses: fields.addresses(diagnostics),
    })
}

/// How the device is reached; nothing where that has errors.
fn connection(fields: &Fields<'_, '_>, diagnostics: &mut Vec<Diagnostic>) -> Option<Connection> {
    let before = diagnostics.len();
    let connection = fields.connection("modbus", diagnostics);
    let line = SerialLine {
        path: String::new(),
        baud: fields.count("baud", diagnostics),
        parity: [Parity::Even, Parity::Odd, Parity::None][fields.word("parity", diagnostics)],
        stop_bits: fields.count("stop_bits", diagnostics) as u8,
    };
    let unit = fields.count("unit", diagnostics);
    let connection = match connection? {
        ConnectionText::Tcp(address) => {
            for name in ["baud", "parity", "stop_bits"] {
                if let Some(span) = fields.place_of(name) {
                    let message = format!("`{name}` of a device that is reached by TCP");
                    diagnostics.push(Diagnostic::error("U0202", message, span).with_help(
                        "only a serial line has it, such as modbus = \"rtu:/dev/ttyUSB0\"",
                    ));
                }
            }
            Connection::Tcp(address)
        }
        ConnectionText::Rtu(path) => {
            if !BAUD_RATES.contains(&line.baud)
                && let Some(span) = fields.place_of("baud")
            {
                let rates = BAUD_RATES.map(|rate| rate.to_string()).join(", ");
                let message = format!("no serial line has {} bits per second", line.baud);
                diagnostics.push(
                    Diagnostic::error("U0205", message, span).with_help(format!("one of {rates}")),
                );
            }
            if unit == 0
                && let Some(span) = fields.place_of("unit")
            {
                let message =
                    "unit 0 of a serial line is all of its devices, and none of them answers";
                diagnostics.push(
                    Diagnostic::error("U0205", message, span)
                        .with_help("the number of the device, 1 to 247"),
                );
            }
            Connection::Rtu(SerialLine { path, ..line })
        }
    };
    (diagnostics.len() == before).then_some(connection)
}

fn model<'a, 't>(
    fields: &Fields<'a, 't>,
    empty: &'a DeTable<'t>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<ModelSection> {
    let either = "a plant is either a built-in `model` or a `ladder`";
    match (fields.has("model"), fields.has("ladder")) {
        (true, true) | (false, false) => {
            diagnostics.push(Diagnostic::error("U0214", either, fields.span.clone()).with_help(
                format!("models are {}; a ladder is named by its file", MODELS.join(", ")),
            ));
            None
        }
        (false, true) => {
            fields.table("parameters", &LADDER_PARAMETERS, empty, diagnostics);
            fields.text("ladder", diagnostics).map(ModelSection::Ladder)
        }
        (true, false) => {
            let before = diagnostics.len();
            let model = MODELS[fields.word("model", diagnostics)];
            // The parameters of a model that does not exist cannot be judged.
            if diagnostics.len() > before {
                return None;
            }
            Some(match model {
                "robot" => {
                    let parameters =
                        fields.table("parameters", &ROBOT_PARAMETERS, empty, diagnostics);
                    ModelSection::Robot(RobotParameters {
                        horizontal_cycles: parameters.count("horizontal_cycles", diagnostics),
                        vertical_cycles: parameters.count("vertical_cycles", diagnostics),
                        feed_cycles: parameters.count("feed_cycles", diagnostics),
                    })
                }
                _ => {
                    let parameters =
                        fields.table("parameters", &PRESS_PARAMETERS, empty, diagnostics);
                    ModelSection::Press(PressParameters {
                        ram_cycles: parameters.count("ram_cycles", diagnostics),
                        feed_cycles: parameters.count("feed_cycles", diagnostics),
                    })
                }
            })
        }
    }
}
