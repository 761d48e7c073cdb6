//! Every key of a cluster file, once: the reader, the schema and the documentation are made from these tables.
//!
//! Invariant: a value is in its bounds when it leaves the reader, and a key that is not in its section's table is an error.

use std::time::Duration;

use understudy_text::duration;
use understudy_wire::MAXIMUM_HISTORY;

use crate::place::{ByteOrder, Registers};

/// The bounds of a cluster's period.
pub(crate) const SHORTEST_PERIOD: Duration = Duration::from_micros(200);
pub(crate) const LONGEST_PERIOD: Duration = Duration::from_secs(10);

/// A table of the file.
#[derive(Debug)]
pub(crate) struct Section {
    /// As it stands between the brackets.
    pub(crate) name: &'static str,
    /// Any number of it, `[[name]]`, or at most one, `[name]`.
    pub(crate) repeated: bool,
    pub(crate) meaning: &'static str,
    pub(crate) keys: &'static [Key],
}

#[derive(Debug)]
pub(crate) struct Key {
    pub(crate) name: &'static str,
    pub(crate) required: bool,
    pub(crate) kind: Kind,
    pub(crate) meaning: &'static str,
}

/// What may stand behind a key.
#[derive(Debug)]
pub(crate) enum Kind {
    /// The name of a member.
    Name,
    /// Any text.
    Text,
    /// `host:port` with a numeric host.
    Address,
    /// `host:port` with a numeric host, or `rtu:` and a terminal device.
    Connection,
    /// A whole number.
    Count { least: u32, most: u32, default: u32 },
    /// A whole number from 0, without a default.
    Digits { most: u32 },
    /// A number with or without a fraction; at most so large, with either sign.
    Number { most: f64, default: f64 },
    /// A number with its unit.
    Time { least: Duration, most: Duration, default: Duration },
    /// One of these; the first is the default where the key is not required and `default` is true.
    Word { words: &'static [&'static str], default: bool },
    /// A table from names to `true` or `false`.
    Values,
    /// A table from names to names.
    Names,
    /// A table whose keys depend on the model.
    Parameters,
    /// The table of a device.
    Device,
    /// The table of a twin.
    Twin,
    /// A table from signals to places in a device.
    Points,
    /// A table from inputs to their sources.
    Sources,
    /// A list of texts: a program and its arguments.
    Command,
    /// A value of a signal.
    Value,
    /// `true` or `false`; `false` where absent.
    Flag,
    /// `input:N` or `holding:N`.
    Register,
}

const fn key(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
    Key { name, required: false, kind, meaning }
}

const fn required(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
    Key { name, required: true, kind, meaning }
}

const fn count(least: u32, most: u32, default: u32) -> Kind {
    Kind::Count { least, most, default }
}

const fn time(least: Duration, most: Duration, default: Duration) -> Kind {
    Kind::Time { least, most, default }
}

const fn word(words: &'static [&'static str]) -> Kind {
    let default = true;
    Kind::Word { words, default }
}

/// Rows of a table: `required` or `key`, name, kind and meaning.
macro_rules! keys {
    ($($form:ident $name:ident: $kind:expr, $meaning:literal;)*) => {
        &[$($form(stringify!($name), $kind, $meaning)),*]
    };
}

// Behind the macro that they use.
mod plant_file;
mod signals;

pub(crate) use plant_file::{GROUP, MACHINE, SPARE};
pub(crate) use signals::{SIGNAL, SIGNALS};

/// Cycles in one number of the file, at most.
pub(crate) const MANY_CYCLES: u32 = 100_000;

/// Cycles after the switch of an online change in which a program fault takes it back, where the file does not say.
pub(crate) const TRIAL_CYCLES: u32 = 100;

pub(crate) const MODES: [&str; 2] = ["full", "paper"];
pub(crate) const SCHEDULES: [&str; 2] = ["token", "parallel"];
pub(crate) const LINKS: [&str; 2] = ["udp", "zenoh"];
pub(crate) const SECURITIES: [&str; 2] = ["keys", "off"];
/// Samples in which the readings of two modules may differ, unless configured otherwise: more than the bounce of a contact in a cycle of 10 ms.
const DISCREPANCY_CYCLES: u32 = 20;

/// How the two remote I/Os of a program are connected to the plant.
pub(crate) const WIRINGS: [&str; 2] = ["exclusive", "parallel"];
pub(crate) const RELEASES: [&str; 2] = ["automatic", "operator"];
pub(crate) const VALUE_FAULTS: [&str; 3] = ["hold", "alarm", "fail-safe"];
pub(crate) const STALE_STATES: [&str; 2] = ["operator", "cold"];
pub(crate) const RESTARTS: [&str; 3] = ["warm", "cold", "operator"];
pub(crate) const OPERATOR_INPUTS: [&str; 3] = ["level", "pulse", "setpoint"];
pub(crate) const ROLES: [&str; 2] = ["operator", "engineer"];
pub(crate) const PRIORITIES: [&str; 4] = ["low", "medium", "high", "critical"];
pub(crate) const PARITIES: [&str; 3] = ["even", "odd", "none"];
pub(crate) const MODELS: [&str; 2] = ["robot", "press"];

pub(crate) static CLUSTER: Section = Section {
    name: "cluster",
    repeated: false,
    meaning: "what holds for all",
    keys: keys! {
        required name: Kind::Name, "names the cluster; frames of other clusters on the same network are ignored";
        key period: time(SHORTEST_PERIOD, LONGEST_PERIOD, Duration::from_millis(10)), "T, from one cycle to the next; timers of the ladders count in it";
        key mode: word(&MODES), "masked failures: `full`, any number of controllers as long as one understudy lives; `paper`, one failure, and all outputs become fail-safe at the second";
        key schedule: word(&SCHEDULES), "whom a station waits for before it publishes: `token`, each controller for the one before it, so that a cycle's exchange grows with their number; `parallel`, controllers for no station and understudies for the controllers, so that it has four hops for any number; not with `mode = \"paper\"`";
        key copies: count(1, 4, 2), "number of times that each cyclic frame is sent, against loss";
        key history: count(1, MAXIMUM_HISTORY as u32, 8), "samples that a remote I/O keeps and sends along, so that lost cycles are replayed";
        key flag_after: count(1, MANY_CYCLES, 3), "cycles without a turn after which a station is flagged, and its slot is closed";
        key shadow_cycles: count(0, MANY_CYCLES, 3), "cycles for which a repaired station computes in shadow mode before it publishes";
        key listen_cycles: count(1, MANY_CYCLES, 4), "cycles for which a starting station listens before it founds an epoch of its own";
        key retain_every: time(SHORTEST_PERIOD, Duration::from_secs(3600), Duration::from_secs(1)), "how often a station writes the whole state of a program with retentive variables to its disk, and makes sure that it is there; each cycle in between is written too, and may be lost with the power";
        key spin: Kind::Flag, "whether stations and remote I/Os wait actively from the start of a cycle to its deadline, on a core that each claims for itself, isolated ones (`isolcpus`) first; a member without such a core waits as always and says so (U0511). It is for machines with a core to spare, see [performance](../evidence/performance.md)";
        key link: word(&LINKS), "the transport of the frames";
        key multicast: Kind::Text, "with `link = \"udp\"`: the first of 33 IPv4 multicast groups and their port, such as `239.192.0.0:7600`, in a network that delivers multicast between all members; each frame is then sent once for all its receivers. With two networks the second one has the same groups at the next port. Other clusters on the network need other groups or another port";
        key networks: count(1, 2, 1), "number of independent networks between the members; with `2` every member has a `second_address`, each frame is sent over both, and the loss of one of them is an alarm and costs no cycle, see [two networks](../how-to/two-networks.md)";
        key security: word(&SECURITIES), "whose frames are accepted: `keys`, those of members with keys of this cluster, see `understudy keys`; `off`, all frames on the network. The laboratory makes keys of its own for each run";
    },
};

pub(crate) static CONTROLLER: Section = Section {
    name: "controller",
    repeated: true,
    meaning: "a controller and its program; at least one, in the order of their turns",
    keys: keys! {
        required name: Kind::Name, "names the station";
        required ladder: Kind::Text, "the file with its program, relative to the cluster file";
        key renamed: Kind::Names, "variables that had another name in the program before: the old name as the key, the name in this program as the value, such as `{ speed = \"velocity\" }` for a `speed` that is `velocity` now; an [online change](../how-to/online-change.md#renamed-variables) and a restart take their values over";
        key address: Kind::Address, "where it listens, such as `192.168.1.11:7450`; the laboratory picks a free loopback port where it is absent";
        key second_address: Kind::Address, "with `networks = 2`: where it listens on the second network";
    },
};

pub(crate) static UNDERSTUDY: Section = Section {
    name: "understudy",
    repeated: true,
    meaning: "a generated parity controller, which knows every program; one named `understudy` where there is no such section, none with `understudy = []`",
    keys: keys! {
        required name: Kind::Name, "names the station";
        key address: Kind::Address, "as for a controller";
        key second_address: Kind::Address, "as for a controller";
        key spare: Kind::Flag, "whether this is the slot of a spare: it is empty until `understudy spare` wakes here, and its absence is no alarm";
    },
};

pub(crate) static REMOTE_IO: Section = Section {
    name: "remote_io",
    repeated: true,
    meaning: "the plant's side of a controller; each controller has one, with or without this section",
    keys: keys! {
        required controller: Kind::Text, "whose";
        key name: Kind::Name, "names it; `<controller>-io` where absent";
        key hold_cycles: count(0, MANY_CYCLES, 3), "cycles for which the last proven outputs are held when no output can be proved";
        key fail_safe: Kind::Values, "fail-safe values after that, by the name of the output, such as `{ grip = true, heating = 12.5 }`; `false` or 0 for all others, or the value nearest to 0 that the declaration of the output has";
        key ramp: Kind::Values, "change per second of a numeric output on its way to its fail-safe value, such as `{ heating = 5.0 }`; an output without one changes at once";
        key release: word(&RELEASES), "how the outputs are released after a cold start of the program";
        key value_fault: word(&VALUE_FAULTS), "the applied outputs while two stations publish different outputs of one history and there is no majority: `hold`, the last proven outputs and then the fail-safe ones, until the stations agree or the operator releases them; `alarm`, the outputs of the controller itself; `fail-safe`, the fail-safe outputs at once, until the operator releases them";
        key stale_state: word(&STALE_STATES), "reaction when living stations hold only states that are older than the newest applied output: `operator`, the outputs are held, then fail-safe, until the operator chooses the older state or a cold start; `cold`, the program starts from its initial state";
        key restart: word(&RESTARTS), "how a program with retentive variables starts after a power failure, where no station holds its state: `warm`, from its initial state with the values that a station has kept; `cold`, from its initial state; `operator`, the operator chooses";
        key trial_cycles: count(0, MANY_CYCLES, TRIAL_CYCLES), "cycles after the switch of an [online change](../how-to/online-change.md) in which a program fault takes the change back by itself; 0: never";
        key diagnosis: Kind::Text, "the file of a ladder that detects failed input channels, relative to the cluster file, see [reconfiguration](reconfiguration.md)";
        key inputs: Kind::Sources, "inputs that do not come from the field: operators write them, or another program computes them, see below";
        key field: Kind::Device, "real equipment behind it, see below; without it its plant is simulated";
        key twin: Kind::Twin, "a second remote I/O of the program, which takes over where this one fails, see below and [twin remote I/Os](../how-to/twin-remote-io.md)";
        key address: Kind::Address, "as for a controller";
        key second_address: Kind::Address, "as for a controller";
        key link_address: Kind::Address, "with a twin and its `direct_link = true`: where it listens on the direct link";
    },
};

pub(crate) static TWIN: Section = Section {
    name: "remote_io.twin",
    repeated: false,
    meaning: "a second remote I/O of the same program, on another machine, below its `[[remote_io]]`",
    keys: keys! {
        required name: Kind::Name, "names it";
        required wiring: Kind::Word { words: &WIRINGS, default: false }, "how the two are connected to the plant: `exclusive`, both reach one device that lets one of them write at a time, and only the author connects to it; `parallel`, each has modules of its own, which read the same sensors and drive the same actuators through diodes";
        key take_over_after: count(1, 100, 1), "cycles without the author after which the other one takes over";
        key owner_timeout: time(Duration::ZERO, Duration::from_secs(60), Duration::ZERO), "time for which the device keeps a connection that has failed and lets no other one write; it must be over when the other one takes over; of `exclusive`";
        key modbus: Kind::Connection, "the device with the modules of the twin, with the places of `[remote_io.field]`; of `parallel`";
        key discrepancy_cycles: count(2, MANY_CYCLES, DISCREPANCY_CYCLES), "samples in a row in which the two readings of an input may differ before an alarm is raised; of `parallel`";
        key tolerance: Kind::Values, "greatest difference of two readings of a number that agree, by the name of the input, such as `{ level = 0.5 }`; 0 for all others; of `parallel`";
        key share: Kind::Names, "numeric outputs that both drive together, such as `{ valve = \"half\" }`: what the two modules drive adds up, so each drives half, and the whole while the other one drives nothing; of `parallel`";
        key direct_link: Kind::Flag, "whether a cable joins the two remote I/Os, apart from the networks; what they send to each other goes over it too, see [the direct link](../how-to/twin-remote-io.md#join-the-two-by-a-direct-link)";
        key address: Kind::Address, "as for a controller";
        key second_address: Kind::Address, "as for a controller";
        key link_address: Kind::Address, "with `direct_link = true`: where it listens on the direct link";
    },
};

pub(crate) static FIELD: Section = Section {
    name: "remote_io.field",
    repeated: false,
    meaning: "a device that the remote I/O reads and drives by Modbus TCP or Modbus RTU, below its `[[remote_io]]`",
    keys: keys! {
        required modbus: Kind::Connection, "where the device listens, or the serial line that it is connected to";
        key baud: count(1200, 921_600, 19_200), "bits per second of a serial line: 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800 or 921600";
        key parity: word(&PARITIES), "parity bit of a serial line";
        key stop_bits: count(1, 2, 1), "stop bits of a serial line";
        key unit: count(0, 255, 1), "the unit behind that address, where it is a gateway; the device on a serial line";
        key timeout: time(Duration::from_millis(1), Duration::from_secs(10), Duration::from_millis(100)), "maximum time of one exchange with the device; then the connection is opened again";
        key stale_after: time(Duration::from_millis(1), Duration::from_secs(60), Duration::from_millis(200)), "the age at which its last answer is too old: the outputs are held, and then fail-safe";
        key inputs: Kind::Points, "sources of the inputs of the program; an input without one is 0";
        key outputs: Kind::Points, "targets of the outputs of the program; each named register belongs to the remote I/O completely";
    },
};

pub(crate) static POINT: Section = Section {
    name: "remote_io.field.inputs.NAME",
    repeated: false,
    meaning: "the place of a number, in the long form",
    keys: keys! {
        required at: Kind::Register, "the first register";
        required as: Kind::Word { words: &Registers::TYPE_WORDS, default: false }, "the type of the number in the registers";
        key order: word(&ByteOrder::WORDS), "order of the bytes, `a` is the most significant one: `abcd`, as Modbus prescribes; `cdab`, least significant register first; `badc`, bytes of each register exchanged; `dcba`, both";
        key scale: Kind::Number { most: 1e12, default: 1.0 }, "units of the signal for each unit of the number; not 0";
        key offset: Kind::Number { most: 1e12, default: 0.0 }, "value of the signal where the number is 0";
    },
};

pub(crate) static OPERATOR_INPUT: Section = Section {
    name: "remote_io.inputs.NAME",
    repeated: false,
    meaning: "an input that operators write",
    keys: keys! {
        required operator: Kind::Word { words: &OPERATOR_INPUTS, default: false }, "behaviour of the value: `level`, a BOOL that is kept until the next write; `pulse`, a BOOL that is TRUE for `duration`; `setpoint`, a number that is kept until the next write";
        key title: Kind::Text, "text on the page; the name of the input where absent";
        key role: word(&ROLES), "the lowest role that may write it";
        key confirm: Kind::Flag, "whether the page asks before it writes";
        key duration: time(Duration::from_micros(200), Duration::from_secs(60), Duration::from_millis(200)), "time for which a pulse is TRUE, rounded up to whole cycles";
        key low: Kind::Value, "lowest value of a setpoint; required there, but for an enumeration";
        key high: Kind::Value, "highest value of a setpoint; required there, but for an enumeration";
        key unit: Kind::Text, "unit of a setpoint, such as `mm/s`";
        key initial: Kind::Value, "value before the first write; `false`, or the lowest value of a setpoint where absent";
        key retain: Kind::Flag, "whether a level or a setpoint keeps its value over a power failure; the initial value otherwise";
    },
};

pub(crate) static SIGNAL_INPUT: Section = Section {
    name: "remote_io.inputs.NAME",
    repeated: false,
    meaning: "an input that is an output of another program, one cycle later",
    keys: keys! {
        required from: Kind::Text, "controller and output, such as `press.done`";
        required default: Kind::Value, "value while the signal is not valid";
        key stale_after: count(0, MANY_CYCLES, 3), "cycles for which the last value is held when no new one can be proved; then the default value is sampled";
    },
};

pub(crate) static PLANT: Section = Section {
    name: "plant",
    repeated: true,
    meaning: "a simulated plant behind a remote I/O, for the laboratory; at most one for each controller",
    keys: keys! {
        required controller: Kind::Text, "whose outputs move it";
        key name: Kind::Name, "names it; `<controller>-plant` where absent";
        key model: Kind::Word { words: &MODELS, default: false, }, "a built-in model; either this or `ladder`";
        key ladder: Kind::Text, "a program as the plant: its inputs have the names of the controller's outputs, its outputs those of the controller's inputs";
        key fed_by: Kind::Text, "the plant whose finished parts come to this one; a built-in model feeds itself where absent";
        key signals: Kind::Names, "a signal of the controller for a terminal of the model, where their names differ, such as `{ part_present = \"u10\" }`";
        key follows: Kind::Names, "a sensor of another plant for a terminal of this one that the controller does not drive, such as `{ pilot_flame = \"pilot-burner.flame\" }`";
        key parameters: Kind::Parameters, "of a built-in model, see below";
        key watchdog_cycles: count(2, MANY_CYCLES, 3), "periods without an actuation after which the fail-safe outputs are in force";
        key address: Kind::Address, "as for a controller";
        key second_address: Kind::Address, "as for a controller";
    },
};

pub(crate) static ALARM: Section = Section {
    name: "alarm",
    repeated: true,
    meaning: "an alarm on an input or output of a program",
    keys: keys! {
        required signal: Kind::Text, "controller and input or output, such as `tank.level`";
        key name: Kind::Name, "names the alarm; the signal where absent";
        key when: Kind::Value, "value of a BOOL or an enumeration at which the condition holds, such as `true` or `\"Fault\"`; an alarm has either `when`, `above` or `below`";
        key above: Kind::Value, "limit of a number or a TIME above which the condition holds";
        key below: Kind::Value, "limit of a number or a TIME below which the condition holds";
        key hysteresis: Kind::Value, "distance from the limit at which the condition is over; 0 where absent";
        key on_delay: time(Duration::ZERO, LONGEST_DELAY, Duration::ZERO), "time for which the condition must hold before the alarm is active, rounded up to whole cycles";
        key off_delay: time(Duration::ZERO, LONGEST_DELAY, Duration::ZERO), "time for which the condition must be over before the alarm is, rounded up to whole cycles";
        key priority: word(&PRIORITIES), "urgency of the response";
        required text: Kind::Text, "what is wrong";
        key action: Kind::Text, "what the operator should do";
    },
};

pub(crate) static NOTIFY: Section = Section {
    name: "notify",
    repeated: false,
    meaning: "the command that `understudy gateway notify` runs for alarms",
    keys: keys! {
        required command: Kind::Command, "program and arguments, without a shell; the alarm is its standard input";
        key timeout: time(Duration::from_millis(100), Duration::from_mins(10), Duration::from_secs(10)), "time after which the command is killed";
    },
};

/// The longest delay of an alarm.
const LONGEST_DELAY: Duration = Duration::from_hours(24);

/// In the order of the documentation.
pub(crate) static SECTIONS: [&Section; 7] =
    [&CLUSTER, &CONTROLLER, &UNDERSTUDY, &REMOTE_IO, &PLANT, &ALARM, &NOTIFY];

/// Sections of a plant file.
pub(crate) static PLANT_FILE_SECTIONS: [&Section; 3] = [&GROUP, &SPARE, &MACHINE];

/// Those that a plant file must have.
pub(crate) static PLANT_FILE_REQUIRED: [&Section; 2] = [&GROUP, &SPARE];

pub(crate) static ROBOT_PARAMETERS: Section = Section {
    name: "plant.parameters",
    repeated: false,
    meaning: "of the model `robot`",
    keys: keys! {
        key horizontal_cycles: count(1, MANY_CYCLES, 10), "cycles from left to right";
        key vertical_cycles: count(1, MANY_CYCLES, 5), "cycles from up to down";
        key feed_cycles: count(0, MANY_CYCLES, 5), "cycles between taking a part and the next one at the pick place";
    },
};

pub(crate) static PRESS_PARAMETERS: Section = Section {
    name: "plant.parameters",
    repeated: false,
    meaning: "of the model `press`",
    keys: keys! {
        key ram_cycles: count(1, MANY_CYCLES, 8), "cycles from up to down";
        key feed_cycles: count(0, MANY_CYCLES, 5), "cycles between a finished part and the next one";
    },
};

pub(crate) static LADDER_PARAMETERS: Section = Section {
    name: "plant.parameters",
    repeated: false,
    meaning: "of a plant that is a ladder: none",
    keys: &[],
};

impl Section {
    /// The key of a name.
    ///
    /// # Panics
    /// Where it is not in the table; the names in the reader are constants.
    pub(crate) fn key(&'static self, name: &str) -> &'static Key {
        let mut keys = self.keys.iter();
        keys.find(|key| key.name == name).expect("the reader asks for keys of the table only")
    }

    /// Whether it has a key.
    pub(crate) fn knows(&self, name: &str) -> bool {
        self.keys.iter().any(|key| key.name == name)
    }

    /// What holds where a count is absent; 0 for a key that is none.
    pub(crate) fn default_count(&'static self, name: &str) -> u32 {
        match self.key(name).kind {
            Kind::Count { default, .. } => default,
            _ => 0,
        }
    }

    /// `[name]` or `[[name]]`.
    pub(crate) fn header(&self) -> String {
        if self.repeated { format!("[[{}]]", self.name) } else { format!("[{}]", self.name) }
    }
}

impl Kind {
    /// What is expected, as a person says it.
    pub(crate) fn expected(&self) -> String {
        match self {
            Self::Name => "a name in quotes".into(),
            Self::Text => "a text in quotes".into(),
            Self::Address => "an address in quotes, such as \"192.168.1.11:7450\"".into(),
            Self::Connection => {
                "an address or a serial line in quotes, such as \"192.168.1.40:502\" or \"rtu:/dev/ttyUSB0\"".into()
            }
            Self::Count { least, most, .. } => format!("a whole number from {least} to {most}"),
            Self::Digits { most } => format!("a whole number from 0 to {most}"),
            Self::Number { most, .. } => format!("a number from -{most} to {most}"),
            Self::Time { least, most, .. } => format!(
                "a time with its unit in quotes, from \"{}\" to \"{}\"",
                duration::text(*least),
                duration::text(*most)
            ),
            Self::Word { words, .. } => {
                let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
                quoted.join(" or ")
            }
            Self::Values => {
                "a table from names to values, such as { grip = true, heating = 12.5 }".into()
            }
            Self::Names => "a table from names to names in quotes".into(),
            Self::Parameters => "a table, [plant.parameters]".into(),
            Self::Device => "a table, [remote_io.field]".into(),
            Self::Twin => "a table, [remote_io.twin]".into(),
            Self::Points => {
                "a table from signals to places, such as { start = \"discrete:0\", level = \"input:10 real\" }".into()
            }
            Self::Sources => {
                "a table from inputs to sources, such as { start = { operator = \"pulse\" }, ready = { from = \"press.done\", default = false } }".into()
            }
            Self::Command => {
                "a list of texts in quotes, such as [\"logger\", \"-t\", \"understudy\"]".into()
            }
            Self::Value => "a value of the signal, such as `true`, 12.5, \"1.5 s\" or \"Auto\"".into(),
            Self::Flag => "`true` or `false`".into(),
            Self::Register => "a register in quotes, such as \"holding:4\"".into(),
        }
    }

    /// As it would be written in the file.
    pub(crate) fn default(&self) -> Option<String> {
        match self {
            Self::Count { default, .. } => Some(default.to_string()),
            Self::Number { default, .. } => Some(format!("{default:?}")),
            Self::Time { default, .. } => Some(format!("\"{}\"", duration::text(*default))),
            Self::Word { words, default: true } => Some(format!("\"{}\"", words[0])),
            Self::Flag => Some("false".into()),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;
