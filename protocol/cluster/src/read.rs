//! From a cluster file and the ladders that it names to a [`Cluster`], with everything that is wrong in one run.
//!
//! | code | what is wrong |
//! |---|---|
//! | U0201 | the text is no TOML |
//! | U0202 | a key that the section does not have |
//! | U0203 | a key or a section that is missing |
//! | U0204 | a value of another type than expected |
//! | U0205 | a number or a time out of its bounds |
//! | U0206 | a name that is none |
//! | U0207 | a word that is none of those allowed |
//! | U0208 | a name, or the place of a remote I/O or of a plant, that is taken |
//! | U0209 | a name that nothing has |
//! | U0210 | an address that is none, at which nothing can be reached, that is taken, or that the link cannot use |
//! | U0211 | a ladder that cannot be read |
//! | U0212 | a program that does not become a circuit |
//! | U0213 | more stations, or wider images, than there may be |
//! | U0214 | a plant with both a model and a ladder, or with neither |
//! | U0215 | a plant that feeds or follows itself |
//! | U0216 | two sensors of a plant on one input |
//! | U0217 | a terminal of a plant that two things drive |
//! | U0221 | a remote I/O with both a device and a simulated plant |
//! | U0222 | a place that no device has, or that an output cannot go to |
//! | U0223 | a diagnosing ladder that does not fit its program |
//! | U0224 | an input with two sources |
//! | U0225 | a source of an input that does not fit its type |
//! | U0226 | an alarm whose condition does not fit its signal |
//! | U0227 | a sender and a receiver of different types or ranges |
//! | U0228 | a schedule that the mode does not have |
//! | U0229 | a twin that takes over before its device lets it, or a twin of a device on a serial line |
//! | U0240 | addresses that are not of two networks, or of one network only |
//! | U0251 | warning: an input that no sensor drives |
//! | U0252 | warning: an output that moves nothing |
//! | U0253 | warning: not one understudy where the mode wants one |
//! | U0254 | warning: parts that never come |
//! | U0255 | warning: a mark of what is to be filled in |
//! | U0256 | warning: inputs that nothing drives |
//! | U0258 | warning: a watchdog of a simulated plant that runs out before the twin has taken over |
//! | U0262 | warning: a twin on the machine of its remote I/O |
//! | U0263 | a direct link that does not join the two remote I/Os of a program, or that is a network |
//! | U0264 | a card that does not fit its signal |

mod alarms;
mod cards;
mod devices;
mod diagnosis;
mod fail_safe;
mod follows;
mod inputs;
mod ladders;
mod limits;
mod marks;
mod names;
mod plants;
mod renamed;
mod twins;
mod undriven;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::Program;
use understudy_cycle::{Agreement, Mode, Schedule, Turns};
use understudy_executable::Interface;
use understudy_logic::Circuit;
use understudy_remote_io::{Fallback, Release, Restart, StaleState, ValueFault};
use understudy_text::{Diagnostic, Report};
use understudy_wire::{ClusterHash, ConfigurationHash, MAXIMUM_PROGRAMS, StationId, StationSet};

use self::ladders::Ladders;
pub(crate) use self::marks::MARK;
use self::names::Names;
use crate::address::Addresses;
use crate::cluster::{Cluster, Controller, Link, RemoteIo, Security, Understudy};
use crate::code::Code;
use crate::configuration::{FALLBACK, PROGRAM, configuration_text, fallback_text};
use crate::file::{self, ClusterFile, ControllerSection};
use crate::source::InputSource;

/// The longest cluster file in bytes.
pub const MAXIMUM_TEXT_BYTES: usize = 1 << 20;

/// What reading answers.
#[derive(Debug)]
pub struct Loaded {
    /// Nothing where one of the reports has errors.
    pub cluster: Option<Cluster>,
    /// Of the cluster file, then of each ladder in the order in which they were read.
    pub reports: Vec<Report>,
}

/// What the command line says instead of the cluster file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Overrides {
    /// In place of `period`; the same bounds hold.
    pub period: Option<Duration>,
    /// In place of `link`.
    pub link: Option<Link>,
    /// In place of `security`.
    pub security: Option<Security>,
    /// In place of `mode`.
    pub mode: Option<Mode>,
    /// In place of `schedule`.
    pub turns: Option<Turns>,
}

/// Reads a cluster file; `open` gives the text of a ladder by the name that stands in the file, or says why it cannot.
pub fn read(
    name: &str,
    text: &str,
    open: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Loaded {
    read_with(name, text, Overrides::default(), open)
}

/// As [`read`], with some values of the file replaced. All members of a cluster have to replace the same.
pub fn read_with(
    name: &str,
    text: &str,
    overrides: Overrides,
    open: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Loaded {
    let mut diagnostics = Vec::new();
    let mut ladders = Ladders::new(open);
    let file = if text.len() > MAXIMUM_TEXT_BYTES {
        let bytes = text.len();
        let message = format!("the file has {bytes} bytes; it may have {MAXIMUM_TEXT_BYTES}");
        diagnostics.push(Diagnostic::error("U0213", message, 0..0));
        None
    } else {
        marks::remind(text, &mut diagnostics);
        file::read(text, &mut diagnostics)
    };
    let cluster = file.and_then(|file| build(file, overrides, &mut ladders, &mut diagnostics));
    let cluster = cluster.map(|cluster| with_sections(cluster, text));
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
    let mut reports = vec![Report { name: name.to_owned(), text: text.to_owned(), diagnostics }];
    reports.extend(ladders.into_reports());
    Loaded { cluster: cluster.filter(|_| !reports.iter().any(Report::has_errors)), reports }
}

/// A cluster with the sections of its remote I/Os, from the text of its file.
fn with_sections(mut cluster: Cluster, text: &str) -> Cluster {
    let document: toml::Table = text.parse().unwrap_or_default();
    let sections = document.get("remote_io").and_then(toml::Value::as_array);
    for (controller, remote_io) in cluster.controllers.iter().zip(&mut cluster.remote_ios) {
        let name = toml::Value::from(controller.name.as_str());
        let is_its = |section: &&toml::Value| section.get("controller") == Some(&name);
        let section = sections.and_then(|sections| sections.iter().find(is_its)).cloned();
        let section = section.unwrap_or_else(|| {
            let of = ("controller".to_owned(), name.clone());
            toml::Value::Table([of].into_iter().collect())
        });
        remote_io.section = section_text(section, &remote_io.inputs);
    }
    cluster
}

/// A section as text. Its inputs stand in the order of the file, which counts in the configuration; a table is written in the order of its keys.
fn section_text(mut section: toml::Value, inputs: &[InputSource]) -> String {
    let of = |key: &str, value: toml::Value| -> toml::Table {
        [(key.to_owned(), value)].into_iter().collect()
    };
    let mut declared = match section.as_table_mut().and_then(|section| section.remove("inputs")) {
        Some(toml::Value::Table(declared)) => declared,
        _ => toml::Table::new(),
    };
    let mut text = of("remote_io", toml::Value::Array(vec![section])).to_string();
    let first = inputs.iter().map(|input| &input.name);
    let others: Vec<String> = declared.keys().cloned().collect();
    for name in first.chain(&others) {
        if let Some(input) = declared.remove(name) {
            let inputs = toml::Value::Table(of(name, input));
            text += &format!("\n{}", of("remote_io", of("inputs", inputs).into()));
        }
    }
    text
}

/// A controller that was read as far as possible.
pub(crate) struct Member {
    pub(crate) section: ControllerSection,
    /// The station's name, empty where it has none.
    pub(crate) name: String,
    /// What it runs, with its signals. Nothing where its program has errors or was not found; no error about its signals follows then.
    pub(crate) code: Option<(Code, Interface)>,
}

fn build(
    mut file: ClusterFile,
    overrides: Overrides,
    ladders: &mut Ladders<'_>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Cluster> {
    let period = overrides.period.unwrap_or(file.cluster.period);
    let cluster = &file.cluster;
    let understudy_count = file.understudies.as_ref().map_or(1, Vec::len);
    let schedule = Schedule::new(period, file.controllers.len(), understudy_count, cluster.copies);
    // Where there is no controller at all, that was said already.
    if let Err(error) = &schedule
        && !file.controllers.is_empty()
    {
        let span = cluster.span.clone();
        diagnostics.push(Diagnostic::error("U0213", error.to_string(), span));
    }
    file.controllers.truncate(MAXIMUM_PROGRAMS);
    let link = overrides.link.unwrap_or([Link::Udp, Link::Zenoh][cluster.link]);
    let has_two_networks = cluster.networks == Some(2);
    let mut names = Names::new(link, cluster.multicast.is_some(), cluster.networks);
    let members = members(file.controllers, period, ladders, &mut names, diagnostics);
    let understudies = understudies(file.understudies, &mut names, diagnostics);
    let mut remote_ios =
        remote_ios(file.remote_ios, period, &members, ladders, &mut names, diagnostics);
    let simulated: Vec<_> =
        file.plants.iter().filter_map(|plant| plant.controller.clone()).collect();
    devices::check_simulated(&simulated, &members, &remote_ios, diagnostics);
    let plants =
        plants::place(file.plants, period, &members, &remote_ios, ladders, &mut names, diagnostics);
    twins::check_watchdogs(&remote_ios, &plants.places, &cluster.span, diagnostics);
    // What an error left out could be the source of an input.
    if !diagnostics.iter().any(is_error) {
        undriven::check(&members, &remote_ios, &simulated, diagnostics);
    }
    let alarms = alarms::resolve(file.alarms, &members, period, diagnostics);
    let cards = cards::resolve(file.signals, &members, &remote_ios, diagnostics);
    limits::check(&members, &remote_ios, cluster.history, diagnostics);
    let mode = overrides.mode.unwrap_or([Mode::Full, Mode::Paper][cluster.mode]);
    check_understudies(&understudies, mode, &cluster.span, diagnostics);
    let turns = overrides.turns.unwrap_or([Turns::Token, Turns::Parallel][cluster.schedule]);
    if (mode, turns) == (Mode::Paper, Turns::Parallel) {
        let message = "the paper's mode passes the token: `schedule = \"parallel\"` is not for it";
        let help = "use `schedule = \"token\"`, or `mode = \"full\"`";
        let found = Diagnostic::error("U0228", message, cluster.span.clone());
        diagnostics.push(found.with_help(help));
    }

    let controllers: Option<Vec<Controller>> = members.into_iter().map(controller).collect();
    let (controllers, name) = (controllers?, cluster.name.as_ref()?.value.clone());
    let circuits: Option<Vec<&Circuit>> = controllers.iter().map(Controller::circuit).collect();
    let parity = circuits.map(|circuits| understudy_parity::generate(&circuits));
    let parity = match parity.transpose() {
        Ok(parity) => parity,
        // Names of stations are unique here unless that was reported; only dots in names of signals could still collide.
        Err(error) => {
            // A diagnostic has its code beside its words.
            let (code, words) = (error.code(), error.to_string());
            let words = words.strip_prefix(&format!("{code}: ")).unwrap_or(&words);
            diagnostics.push(Diagnostic::error(code, words, cluster.span.clone()));
            return None;
        }
    };
    let programs: Arc<[Program]> = controllers
        .iter()
        .map(|controller| Program {
            hash: controller.hash,
            executable: controller.code.executable(),
        })
        .collect();
    for (remote_io, program) in remote_ios.iter_mut().zip(programs.iter()) {
        let restart = &mut remote_io.fallback.restart;
        *restart = restart.filter(|_| program.executable.is_retentive());
    }
    let agreement = Agreement {
        cluster: ClusterHash::of(name.as_bytes()),
        configuration: ConfigurationHash::default(),
        schedule: schedule
            .ok()?
            .with_turns(turns)
            .with_spare_slots(spare_slots(controllers.len(), &understudies)),
        mode,
        history: cluster.history as usize,
        flag_after: cluster.flag_after,
        shadow_cycles: cluster.shadow_cycles,
        listen_cycles: cluster.listen_cycles,
    };
    let mut cluster = Cluster {
        name,
        link,
        retain_every: cluster.retain_every,
        spins: cluster.spin,
        multicast: cluster.multicast,
        has_two_networks,
        security: overrides.security.unwrap_or([Security::Keys, Security::Off][cluster.security]),
        agreement: Arc::new(agreement.clone()),
        canonical_text: String::new(),
        frame_text: String::new(),
        controllers,
        understudies,
        remote_ios,
        plants: plants.places,
        alarms: alarms.into(),
        notify: file.notify,
        cards: Arc::new(cards),
        programs,
        parity,
    };
    cluster.canonical_text = configuration_text(&cluster, &plants.texts, Code::text, fallback_text);
    let program = |_: &Code| PROGRAM.to_owned();
    cluster.frame_text =
        configuration_text(&cluster, &plants.texts, program, |_| FALLBACK.to_owned() + "\n");
    let configuration = ConfigurationHash::of(cluster.canonical_text.as_bytes());
    cluster.agreement = Arc::new(Agreement { configuration, ..agreement });
    Some(cluster)
}

fn members(
    sections: Vec<ControllerSection>,
    period: Duration,
    ladders: &mut Ladders<'_>,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Member> {
    let mut members = Vec::new();
    for section in sections {
        let name = match &section.name {
            Some(name) => {
                names.declare(&name.value, name.span.clone(), diagnostics);
                name.value.clone()
            }
            None => String::new(),
        };
        names.listen(&section.addresses, diagnostics);
        let code =
            section.ladder.as_ref().and_then(|file| ladders.code(file, &name, period, diagnostics));
        let code = code.map(|code| {
            let pairs = renamed::pairs(&section.renamed, &code, diagnostics);
            code.with_renamed(pairs)
        });
        members.push(Member {
            section,
            name,
            code: code.map(|code| {
                let interface = code.interface();
                (code, interface)
            }),
        });
    }
    members
}

fn controller(member: Member) -> Option<Controller> {
    let (code, interface) = member.code?;
    Some(Controller {
        name: member.name,
        file: member.section.ladder?.value,
        hash: code.hash(),
        interface,
        code,
        addresses: member.section.addresses.map(|address| address.value),
    })
}

fn understudies(
    sections: Option<Vec<file::UnderstudySection>>,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Understudy> {
    let Some(sections) = sections else {
        let name = "understudy".to_owned();
        names.declare(&name, 0..0, diagnostics);
        return vec![Understudy { name, addresses: Addresses::default(), spare: false }];
    };
    let mut understudies = Vec::new();
    for section in sections {
        names.listen(&section.addresses, diagnostics);
        let name = section.name.map(|name| {
            names.declare(&name.value, name.span, diagnostics);
            name.value
        });
        understudies.push(Understudy {
            name: name.unwrap_or_default(),
            addresses: section.addresses.map(|address| address.value),
            spare: section.spare,
        });
    }
    understudies
}

fn spare_slots(controllers: usize, understudies: &[Understudy]) -> StationSet {
    let slots = (controllers..).zip(understudies).filter(|(_, understudy)| understudy.spare);
    slots.map(|(rank, _)| StationId(rank as u8)).collect()
}

fn remote_ios(
    sections: Vec<file::RemoteIoSection>,
    period: Duration,
    members: &[Member],
    ladders: &mut Ladders<'_>,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<RemoteIo> {
    let read = inputs::outputs_read(&sections);
    let mut places: BTreeMap<usize, RemoteIo> = BTreeMap::new();
    let mut taken = BTreeMap::new();
    for section in sections {
        names.listen(&section.addresses, diagnostics);
        twins::check_link(&section.addresses, section.twin.as_ref(), diagnostics);
        if let Some(name) = &section.name {
            names.declare(&name.value, name.span.clone(), diagnostics);
        }
        let Some(controller) = &section.controller else {
            continue;
        };
        let Some(index) =
            names::find_controller(members, controller, "a remote I/O", &mut taken, diagnostics)
        else {
            continue;
        };
        let member = &members[index];
        let fail_safe = fail_safe::values(member, &section.fail_safe, diagnostics);
        let ramps = fail_safe::ramps(member, &section.ramp, period, diagnostics);
        let name = section.name.map(|name| name.value);
        let mut remote_io = RemoteIo {
            name: name.unwrap_or_else(|| {
                let name = default_remote_io_name(member);
                names.declare(&name, controller.span.clone(), diagnostics);
                name
            }),
            fallback: Fallback {
                hold_cycles: section.hold_cycles,
                trial_cycles: section.trial_cycles,
                fail_safe,
                ramps,
                release: [Release::Automatic, Release::Operator][section.release],
                value_fault: [ValueFault::Hold, ValueFault::Alarm, ValueFault::FailSafe]
                    [section.value_fault],
                stale_state: [StaleState::Operator, StaleState::Cold][section.stale_state],
                restart: Some([Restart::Warm, Restart::Cold, Restart::Operator][section.restart]),
            },
            section: String::new(),
            inputs: inputs::resolve(
                &section.inputs,
                index,
                members,
                section.field.as_ref(),
                period,
                diagnostics,
            ),
            field: section.field.as_ref().and_then(|field| {
                devices::device(field, &section.inputs, &read, member, diagnostics)
            }),
            diagnosis: section
                .diagnosis
                .as_ref()
                .and_then(|file| diagnosis::read(file, period, member, ladders, diagnostics)),
            twin: None,
            addresses: section.addresses.map(|address| address.value),
        };
        if let Some(twin) = section.twin {
            let of = (&remote_io, member);
            remote_io.twin =
                twins::read(twin, of, section.field.as_ref(), period, names, diagnostics);
        }
        places.insert(index, remote_io);
    }
    let place = |(index, member): (usize, &Member)| {
        places.remove(&index).unwrap_or_else(|| {
            let name = default_remote_io_name(member);
            // Two controllers of one name were reported; their remote I/Os would only repeat it.
            let first = members.iter().position(|other| other.name == member.name);
            if let Some(station) = &member.section.name
                && first == Some(index)
            {
                names.declare(&name, station.span.clone(), diagnostics);
            }
            RemoteIo {
                name,
                fallback: Fallback {
                    hold_cycles: crate::format::REMOTE_IO.default_count("hold_cycles"),
                    trial_cycles: crate::format::REMOTE_IO.default_count("trial_cycles"),
                    fail_safe: fail_safe::values(member, &[], diagnostics),
                    ramps: Vec::new(),
                    release: Release::default(),
                    value_fault: ValueFault::default(),
                    stale_state: StaleState::default(),
                    restart: Some(Restart::default()),
                },
                section: String::new(),
                inputs: Vec::new(),
                field: None,
                diagnosis: None,
                twin: None,
                addresses: Addresses::default(),
            }
        })
    };
    members.iter().enumerate().map(place).collect()
}

fn is_error(diagnostic: &Diagnostic) -> bool {
    diagnostic.severity == understudy_text::Severity::Error
}

fn default_remote_io_name(member: &Member) -> String {
    format!("{}-io", member.name)
}

fn check_understudies(
    understudies: &[Understudy],
    mode: Mode,
    span: &std::ops::Range<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let slots = understudies.iter().filter(|understudy| understudy.spare).count();
    let (message, help) = match (understudies.len() - slots, mode) {
        (0, _) if slots > 0 => (
            "there is no understudy: no failure is masked until a spare is awake".to_owned(),
            "add an `[[understudy]]` without `spare = true`",
        ),
        (_, Mode::Paper) if slots > 0 => (
            "the paper's mode has one understudy, and a spare is one more".to_owned(),
            "use `mode = \"full\"` with spares",
        ),
        (0, _) => (
            "there is no understudy: no failure is masked".to_owned(),
            "leave `understudy = []` out",
        ),
        (count @ 2.., Mode::Paper) => (
            format!("the paper's mode has one understudy, and there are {count}"),
            "use `mode = \"full\"` for more than one",
        ),
        _ => return,
    };
    diagnostics.push(Diagnostic::warning("U0253", message, span.clone()).with_help(help));
}
