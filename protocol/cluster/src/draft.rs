//! A cluster drafted from programs that exist: the cluster file, a stand-in for each plant, and a scenario.
//!
//! Invariant: what is drafted runs as it is. What only the engineer of the plant knows stands below a line with [`MARK`].

mod signals;
mod statements;
mod stub;

use std::fmt::Write as _;
use std::time::Duration;

use understudy_interchange::Source;
use understudy_text::duration;
use understudy_text::tables::key_text;
use understudy_wire::MAXIMUM_STATE_BITS;

use crate::address::MAXIMUM_NAME_LENGTH;
use crate::format::{LONGEST_PERIOD, SHORTEST_PERIOD};
use crate::read::MARK;
use signals::{Signal, Signals};
use stub::Stub;
use understudy_executable::value_text;

/// The name of the drafted understudy.
const UNDERSTUDY: &str = "understudy";

/// The longest suffix that a drafted member adds to the name of its controller.
const LONGEST_SUFFIX: &str = "-plant";

/// The most characters of a comment behind a signal.
const MAXIMUM_COMMENT: usize = 70;

/// Bits of inputs or of outputs with which frames are far from full.
const ORDINARY_BITS: usize = 2048;

/// Parts of an interval that are tried as the period of a cluster.
const MAXIMUM_PARTS: usize = 100_000;

/// The longest name of a program that leaves room for the names of its remote I/O and its plant.
pub const MAXIMUM_PROGRAM_NAME: usize = MAXIMUM_NAME_LENGTH - LONGEST_SUFFIX.len();

/// A cluster that is not written yet.
#[derive(Debug, Clone)]
pub struct Draft {
    name: String,
    period: Duration,
    programs: Vec<DraftProgram>,
}

/// A program of a [`Draft`].
#[derive(Debug, Clone)]
pub struct DraftProgram {
    name: String,
    file: String,
    origin: String,
    signals: Signals,
}

impl DraftProgram {
    /// A program that names its controller, the file that the cluster file names, where it comes from, for people, and what it is.
    pub fn new(name: String, file: String, origin: String, source: &Source) -> Self {
        Self { name, file, origin, signals: Signals::of(source) }
    }

    /// Whether a program is so far from every bound that its draft has no error, if its names and its outputs are those that a draft needs:
    /// less than what is drafted, and known without reading the draft.
    pub fn is_ordinary(source: &Source, interval: Option<Duration>) -> bool {
        let Source::Program(program) = source else {
            return false;
        };
        let state = program.state as usize * 64;
        let Signals { inputs, outputs } = Signals::of(source);
        let fits = |signals: &[Signal]| {
            let bits = signals.iter().map(|signal| signal.declared.of.bits() as usize);
            bits.sum::<usize>() <= ORDINARY_BITS
        };
        let is_plain = |signal: &Signal| {
            let name = signal.name.as_str();
            let mut letters = name.chars();
            letters.all(|letter| letter.is_ascii_alphanumeric() || "._".contains(letter))
                && name.len() <= MAXIMUM_NAME_LENGTH
        };
        interval.is_none_or(|interval| possible(interval) == interval)
            && state <= MAXIMUM_STATE_BITS / 2
            && fits(&inputs)
            && fits(&outputs)
            && inputs.iter().chain(&outputs).all(is_plain)
    }

    /// The name of its controller.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it has an output that can be protected.
    pub fn has_outputs(&self) -> bool {
        !self.signals.outputs.is_empty()
    }

    /// Names of all members that the draft makes for it.
    pub fn members(&self) -> [String; 3] {
        let name = &self.name;
        [name.clone(), format!("{name}-io"), self.plant()]
    }

    fn plant(&self) -> String {
        format!("{}{LONGEST_SUFFIX}", self.name)
    }
}

impl Draft {
    /// A cluster of one controller for each program, in the order of their turns, with the longest possible period of which `interval`
    /// is a multiple.
    pub fn new(name: String, interval: Duration, programs: Vec<DraftProgram>) -> Self {
        Self { name, period: possible(interval), programs }
    }

    /// Members that belong to no program.
    pub fn other_members() -> [&'static str; 1] {
        [UNDERSTUDY]
    }

    /// The files of the draft and their texts, the cluster file first; the programs are not among them.
    pub fn files(&self) -> Vec<(String, String)> {
        let stubs: Vec<Stub<'_>> = self.programs.iter().map(Stub::new).collect();
        let mut files = vec![
            ("cluster.toml".to_owned(), self.cluster_file(&stubs)),
            ("kill.toml".to_owned(), self.scenario()),
        ];
        let plants = stubs.iter().map(|stub| (stub.file(), stub.text(self.period)));
        files.extend(plants);
        files
    }

    fn cluster_file(&self, stubs: &[Stub<'_>]) -> String {
        let period = duration::text(self.period);
        let mut text = format!(
            "\
# Drafted by `understudy init --from`. It runs as it is, with stand-ins for the plants.
# Each line marked \"{MARK}\" asks for something that only the engineer of the plant knows. `understudy check` lists
# the marks that are left; remove a mark when its section is done.
# Every key is described in docs/reference/cluster-file.md of Understudy.

[cluster]
name = \"{}\"
# The longest that divides the intervals of all programs, or 10ms. The timers of all programs count in it.
period = \"{period}\"

# One controller for each program, in the order of their turns. A controller or understudy on a machine of its own also
# needs its `address`, such as address = \"192.168.1.11:7450\"; so does each remote I/O.
",
            self.name
        );
        for program in &self.programs {
            let DraftProgram { name, file, origin, .. } = program;
            let origin = comment(origin);
            let _ = write!(
                text,
                "\n# From {origin}\n[[controller]]\nname = \"{name}\"\nladder = {file:?}\n"
            );
        }
        let _ = write!(
            text,
            "\n# Generated from all programs above; it masks the failure of any number of controllers.\n\
             [[understudy]]\nname = \"{UNDERSTUDY}\"\n"
        );
        for program in &self.programs {
            push_remote_io(&mut text, program);
        }
        for stub in stubs {
            push_plant(&mut text, stub);
        }
        text
    }

    /// Each station is killed once, and started again before the next.
    fn scenario(&self) -> String {
        let cycles = |time: Duration, least: u128| {
            let count = time.as_nanos().div_ceil(self.period.as_nanos().max(1)).max(least);
            u64::try_from(count).unwrap_or(u64::MAX)
        };
        // Long enough for a process to start, and for a station to be synchronised again.
        let down = cycles(Duration::from_millis(500), 20);
        let up = cycles(Duration::from_secs(1), 30);
        let programs = self.programs.iter().map(|program| Some(program.name.as_str()));
        let mut steps = String::new();
        let mut during = String::new();
        let mut at = up;
        for program in programs.chain([None]) {
            let station = program.unwrap_or(UNDERSTUDY);
            let restart = at + down;
            let _ = write!(
                steps,
                "\n[[step]]\nat = {at}\naction = \"crash\"\nstation = \"{station}\"\n\
                 \n[[step]]\nat = {restart}\naction = \"restart\"\nstation = \"{station}\"\n"
            );
            if program.is_some() {
                let from = at + down / 4;
                let _ = write!(
                    during,
                    "\n[[expect.during]]\nfrom = {from}\nto = {restart}\nremote_io = \"{station}-io\"\n\
                     source = [\"reconstructed\", \"held\"]\n"
                );
            }
            at = restart + up;
        }
        let plants = self.programs.iter().map(|program| format!("{:?}", program.plant()));
        let plants = plants.collect::<Vec<_>>().join(", ");
        format!(
            "\
# Each station is killed once and started again, and no plant notices.
title = \"Each station is killed once\"
cycles = {at}
{steps}
# `functional` plants see only true outputs. While a controller is down its outputs are reconstructed, and none is held.
[expect]
wrong = 0
held = 0
plant_faults = 0
functional = [{plants}]
{during}"
        )
    }
}

/// The longest period of a cluster, in whole microseconds, of which the interval is a multiple; where there is none, the nearest one.
fn possible(interval: Duration) -> Duration {
    let microseconds = |time: Duration| u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
    let (whole, longest) = (microseconds(interval), microseconds(LONGEST_PERIOD));
    let least = microseconds(SHORTEST_PERIOD);
    let parts = whole.div_ceil(longest).max(1)..=whole / least;
    let divides = |parts: &u64| whole.is_multiple_of(*parts);
    let found = parts.take(MAXIMUM_PARTS).find(divides).map(|parts| whole / parts);
    Duration::from_micros(found.unwrap_or(whole.clamp(least, longest)))
}

fn push_remote_io(text: &mut String, program: &DraftProgram) {
    let name = &program.name;
    let outputs = &program.signals.outputs;
    let now = match outputs.iter().all(Signal::is_bit) {
        true => "All are off now.",
        false => "Each is off or nearest to 0 now.",
    };
    let _ = write!(
        text,
        "
[[remote_io]]
controller = \"{name}\"

# {MARK} the outputs of `{name}` in a safe plant. They are driven when no station can prove an output. {now}
[remote_io.fail_safe]
"
    );
    for output in outputs {
        let declared = &output.declared;
        let safe = value_text(declared, output.nearest(0) as u64 & declared.of.mask());
        let line = format!("{} = {safe}", key_text(&output.name));
        let _ = match &output.note {
            Some(note) => writeln!(text, "{line}  # {note}"),
            None => writeln!(text, "{line}"),
        };
    }
}

fn push_plant(text: &mut String, stub: &Stub<'_>) {
    let name = &stub.program.name;
    let file = stub.file();
    let _ = write!(
        text,
        "
# {MARK} a model of the plant of `{name}`, or its device.
# {file} only moves the inputs of the program, one after the other: write a model of the plant in it.
# For real equipment, replace this section by [remote_io.field] below the [[remote_io]] of `{name}`.
[[plant]]
controller = \"{name}\"
name = \"{}\"
ladder = {file:?}
",
        stub.program.plant()
    );
    let renamed: Vec<String> = stub
        .renamed()
        .map(|(terminal, signal)| format!("{} = {signal:?}\n", key_text(terminal)))
        .collect();
    if !renamed.is_empty() {
        let _ = write!(text, "\n[plant.signals]\n{}", renamed.concat());
    }
}

/// One line that a comment can have.
fn comment(text: &str) -> String {
    let legal = |letter: char| if letter.is_control() { ' ' } else { letter };
    let line: String = text.chars().map(legal).take(MAXIMUM_COMMENT).collect();
    line.trim().to_owned()
}
