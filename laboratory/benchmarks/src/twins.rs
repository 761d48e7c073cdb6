//! `understudy-bench twins`: a cell of two networks, an understudy and twins on Modbus devices that record each write. Processes are killed and
//! suspended, and networks cut, at random phases of the cycle, one or two at once. With `--hosts netns` each machine has a namespace and each network a
//! bridge, and cables are pulled, also that of a direct link; the plants are simulated then, since a namespace does not reach the devices of this process.

mod device;
mod judge;
mod row;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use understudy::{Answer, ClusterRun, Console, RunArguments, Status};
use understudy_cluster::Cluster;
use understudy_journal::{Happening, Members, RunEvent, records_of};
use understudy_remote_io::{Event, SWITCHOVER};
use understudy_scenarios::{Action, Fault, Scenario};
use understudy_wire::{Image, Member, ProgramId, SignalPlace, Source, StationId, Via};

use device::{Device, Recorded, TIMEOUT};
use judge::{Found, Outputs, Rule, Write, judge, longest_gap};
use row::{Row, answer};

/// Kill and suspend members of a cell with twins and cut its networks, in front of devices that record who writes them
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Faults in all; a fifth of them come two at once
    #[arg(long, default_value_t = 500)]
    count: u32,
    /// `take_over_after` of the twins
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=100))]
    take_over_after: u32,
    /// How the two remote I/Os of a program are connected to the plant
    #[arg(long, value_enum, default_value = "exclusive")]
    wiring: Wiring,
    /// Join the two remote I/Os of each program by a direct link, which fails as a network does
    #[arg(long)]
    direct_link: bool,
    /// Folder for the files of the cell
    #[arg(long, value_name = "DIR", default_value = "twins-bench")]
    folder: PathBuf,
    /// Seed of the faults and their phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    run: RunArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Wiring {
    /// Both reach one device, and the author writes to it
    Exclusive,
    /// Each writes to a device of its own
    Parallel,
}

/// Outputs of a program, in the order of their coils.
const OUTPUTS: [&str; 5] = ["move_right", "move_left", "move_down", "move_up", "grip"];

/// Periods for which outputs may be under way, and be recorded later than driven.
const UNDER_WAY: u32 = 2;

/// Periods before the end of a process whose records may be missing.
const UNRECORDED: u32 = 20;

/// Cycles from the end of one fault to the next: enough for a new connection to the device and a synchronised station.
const RECOVERY_CYCLES: f64 = 80.0;

/// Periods from a question of a remote I/O to the answer of the operator: before the next fault.
const ANSWER_CYCLES: u32 = 30;

/// Cycles from a kill to the restart, and of a cut.
const DOWN_CYCLES: f64 = 20.0;

const ROBOT: &str = include_str!("../../../examples/press-cell/robot.ladder");

/// What fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    Stations,
    RemoteIos,
    Networks,
    /// Two of all at one time.
    Two,
}

impl Target {
    const ALL: [Self; 4] = [Self::Stations, Self::RemoteIos, Self::Networks, Self::Two];

    fn words(self) -> &'static str {
        match self {
            Self::Stations => "one station",
            Self::RemoteIos => "one remote I/O",
            Self::Networks => "one network",
            Self::Two => "two at once",
        }
    }

    /// Faults of this kind, of `count` in all.
    fn share(self, count: u32) -> u32 {
        let two = count / 5;
        match self {
            Self::Two => two,
            Self::RemoteIos => (count - two).div_ceil(2),
            Self::Stations | Self::Networks => (count - two) / 4,
        }
    }
}

/// One fault: its steps from a cycle on, and the last one.
fn fault(cluster: &Cluster, of: Target, begin: f64, random: &mut Pcg64Mcg) -> (Vec<Fault>, f64) {
    let begin = begin + random.random::<f64>();
    let step = |at: f64, member: Member, action: Action| Fault {
        at_cycle: at as u64,
        phase: at.fract(),
        member,
        action,
    };
    if of == Target::Networks {
        let paths = if cluster.direct_links().is_empty() { 2 } else { 3 };
        let network = Via::ALL[random.random_range(0..paths)];
        let end = begin + DOWN_CYCLES;
        let on = cluster.members().filter(|it| cluster.paths(*it).any(|via| via == network));
        let all = on.flat_map(|member| {
            let cut = step(begin, member, Action::Unplug { network });
            [cut, step(end, member, Action::Plug { network })]
        });
        return (all.collect(), end);
    }
    let member = match of {
        Target::RemoteIos => {
            let program = ProgramId(random.random_range(0..2));
            if random.random() { Member::RemoteIo(program) } else { Member::Twin(program) }
        }
        _ => Member::Station(StationId(random.random_range(0..3))),
    };
    let (lasts, begins, ends) = if random.random() {
        (DOWN_CYCLES, Action::Crash, Action::Restart)
    } else {
        (random.random_range(0.5..DOWN_CYCLES), Action::Stop, Action::Continue)
    };
    let steps = vec![step(begin, member, begins), step(begin + lasts, member, ends)];
    (steps, begin + lasts)
}

/// `count` faults of one kind, one after the other.
fn scenario(cluster: &Cluster, of: Target, count: u32, random: &mut Pcg64Mcg) -> Scenario {
    let every = DOWN_CYCLES + RECOVERY_CYCLES;
    let mut steps = Vec::new();
    for number in 0..count {
        let begin = RECOVERY_CYCLES + every * f64::from(number);
        let single = [Target::Stations, Target::RemoteIos, Target::Networks];
        let kinds = match of {
            Target::Two => {
                vec![single[random.random_range(0..3)], single[random.random_range(0..3)]]
            }
            one => vec![one],
        };
        let mut members: Vec<(Member, Action)> = Vec::new();
        for kind in kinds {
            // Two of one member are one.
            loop {
                let (found, _) = fault(cluster, kind, begin, random);
                let is_new = |step: &Fault| {
                    !members.iter().any(|(member, action)| {
                        let is_cut = |it: &Action| matches!(it, Action::Unplug { .. });
                        *member == step.member
                            && is_cut(action) == is_cut(&step.action)
                            && (!is_cut(action) || *action == step.action)
                    })
                };
                if found.first().is_some_and(is_new) {
                    members.extend(found.first().map(|step| (step.member, step.action)));
                    steps.extend(found);
                    break;
                }
            }
        }
    }
    steps.sort_by(|a, b| (a.at_cycle as f64 + a.phase).total_cmp(&(b.at_cycle as f64 + b.phase)));
    Scenario {
        title: format!("{count} faults, {}", of.words()),
        cycles: (RECOVERY_CYCLES * 2.0 + every * f64::from(count)) as u64,
        steps,
        ..Scenario::default()
    }
}

/// Devices of each program: of its remote I/O, and of the twin, which uses it with `parallel` only.
type Devices = [[Device; 2]; 2];

/// The cluster file, with the devices of its programs, or with simulated plants.
fn files(arguments: &Arguments, devices: Option<&Devices>) -> std::io::Result<PathBuf> {
    let Arguments { folder, take_over_after, wiring, direct_link, .. } = arguments;
    let mut text = "[cluster]\nname = \"twins\"\nperiod = \"10ms\"\nnetworks = 2\n".to_owned();
    for name in ["left", "right"] {
        let _ = writeln!(text, "[[controller]]\nname = \"{name}\"\nladder = \"robot.ladder\"");
    }
    text.push_str("[[understudy]]\nname = \"understudy\"\n");
    let coils = OUTPUTS.iter().enumerate().map(|(coil, name)| format!("{name} = \"coil:{coil}\""));
    let coils = coils.collect::<Vec<_>>().join(", ");
    for (place, name) in ["left", "right"].into_iter().enumerate() {
        let pair = devices.map(|all| &all[place]);
        let (kind, modbus) = match (wiring, pair) {
            (Wiring::Exclusive, _) => ("exclusive", String::new()),
            (Wiring::Parallel, None) => ("parallel", String::new()),
            (Wiring::Parallel, Some([_, of_twin])) => {
                ("parallel", format!(", modbus = \"{}\"", of_twin.address))
            }
        };
        let _ = writeln!(
            text,
            "[[remote_io]]\nname = \"{name}-io\"\ncontroller = \"{name}\"\n\
             twin = {{ name = \"{name}-io-2\", wiring = \"{kind}\"{modbus}, take_over_after = {take_over_after}, direct_link = {direct_link} }}"
        );
        let Some([device, _]) = pair else {
            let watchdog = take_over_after + SWITCHOVER + 1;
            let _ = writeln!(
                text,
                "[[plant]]\nname = \"{name}-arm\"\ncontroller = \"{name}\"\nmodel = \"robot\"\nwatchdog_cycles = {watchdog}"
            );
            continue;
        };
        let _ = write!(
            text,
            "[remote_io.field]\nmodbus = \"{}\"\n\
             inputs = {{ part_present = \"discrete:0\", arm_left = \"discrete:1\", arm_right = \"discrete:2\", arm_up = \"discrete:3\", arm_down = \"discrete:4\", stop = \"discrete:5\" }}\n\
             outputs = {{ {coils} }}\n",
            device.address
        );
    }
    fs::create_dir_all(folder)?;
    fs::write(folder.join("robot.ladder"), ROBOT)?;
    let file = folder.join("cluster.toml");
    fs::write(&file, text)?;
    Ok(file)
}

/// What the members of a run have recorded of the outputs of one program.
#[derive(Debug, Default)]
struct OfProgram {
    /// What its authors have driven.
    driven: Vec<Outputs>,
    input_alarms: u64,
    questions: u64,
    /// Whether a question was the last that was heard of the program.
    is_asking: bool,
}

/// Whether outputs of the program were applied, and not those of a remote I/O without it.
fn is_proved(event: &Event) -> bool {
    matches!(event, Event::Applied { source: Source::Direct | Source::Reconstructed, .. })
}

/// What the members of a run have recorded: of each program, and when processes have ended.
fn recorded(directory: &Path, cluster: &Cluster) -> Result<(Vec<OfProgram>, Vec<u64>), Answer> {
    let failed = |error: String| Answer::failed(Status::Failed, "U0602", error);
    let members = Members::of(cluster);
    let coils = |program: ProgramId, image: &Image| -> u64 {
        let on = members.outputs(program).filter(|signal| {
            matches!(signal.place, SignalPlace::Output(place) if image.get(usize::from(place)))
        });
        on.filter_map(|signal| OUTPUTS.iter().position(|name| *name == signal.name))
            .map(|coil| 1 << coil)
            .sum()
    };
    let mut programs: Vec<OfProgram> =
        cluster.controllers().iter().map(|_| OfProgram::default()).collect();
    let mut ends = Vec::new();
    let journal = records_of(&directory.join("journal.jsonl"));
    for record in journal.map_err(|error| failed(error.to_string()))? {
        let record = record.map_err(|error| failed(error.to_string()))?;
        let program = record.member.and_then(Member::sampled_program);
        match (&record.event, program) {
            (Happening::Run(RunEvent::Fault { action: Action::Crash, .. }), _) => {
                ends.push(record.at_ns);
            }
            (Happening::RemoteIo(event), Some(program)) => {
                let of_program = &mut programs[program.index()];
                if let Some(image) = event.driven() {
                    let coils = coils(program, image);
                    of_program.driven.push(Outputs { at_ns: record.at_ns, coils });
                    of_program.is_asking &= !is_proved(event);
                }
                let is_alarm =
                    matches!(event, Event::InputsDiffer { .. } | Event::InputExcluded { .. });
                of_program.input_alarms += u64::from(is_alarm);
                let is_question = matches!(event, Event::StateLost { asks: true, .. });
                of_program.questions += u64::from(is_question);
                of_program.is_asking |= is_question;
            }
            _ => {}
        }
    }
    for program in &mut programs {
        program.driven.sort_by_key(|outputs| outputs.at_ns);
    }
    Ok((programs, ends))
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let failed = |error: std::io::Error| Answer::failed(Status::Failed, "U0602", error);
    let pair = || -> std::io::Result<[Device; 2]> {
        let first = Device::start()?;
        let twin = first.beside()?;
        Ok([first, twin])
    };
    let devices = match arguments.run.network.has_namespaces() {
        true => None,
        false => Some([pair().map_err(failed)?, pair().map_err(failed)?]),
    };
    let file = files(arguments, devices.as_ref()).map_err(failed)?;
    let mut random = Pcg64Mcg::seed_from_u64(arguments.seed);
    let mut rows = Vec::new();
    for of in Target::ALL {
        let count = of.share(arguments.count);
        if count > 0 {
            let found = row(of, count, &file, devices.as_ref(), arguments, &mut random, console)?;
            rows.push(found);
        }
    }
    Ok(answer(&rows))
}

/// Keeps what the devices have received with the run, so that each finding can be looked up: the time as in the journal, and the coils.
fn keep_writes(directory: &Path, taken: &[[Recorded; 2]]) -> std::io::Result<()> {
    for (side, pair) in ["left", "right"].into_iter().zip(taken) {
        for (name, recorded) in [format!("{side}-io"), format!("{side}-io-2")].iter().zip(pair) {
            let mut text = "at_ns,since_ns,coils,two_writers\n".to_owned();
            for Write { at_ns, since_ns, coils } in &recorded.writes {
                let by_two = recorded.by_two.binary_search(at_ns).is_ok();
                let _ = writeln!(text, "{at_ns},{since_ns},{coils},{}", u8::from(by_two));
            }
            fs::write(directory.join(format!("writes-{name}.csv")), text)?;
        }
    }
    Ok(())
}

/// The first findings of each device, with the times of the files that [`keep_writes`] writes.
fn of_devices(taken: &[[Recorded; 2]], found: &[Found]) -> Vec<String> {
    let names = ["left-io", "left-io-2", "right-io", "right-io-2"];
    let all = names.iter().zip(taken.as_flattened()).zip(found);
    let findings = all.flat_map(|((name, recorded), found)| {
        let both = [("two writers", &recorded.by_two), ("unproved", &found.unproved)];
        both.into_iter().flat_map(move |(what, times)| {
            let times = times.iter().take(5);
            times.map(move |at_ns| format!("{what}: a write to the device of {name} at {at_ns} ns"))
        })
    });
    findings.collect()
}

fn row(
    of: Target,
    count: u32,
    file: &Path,
    devices: Option<&Devices>,
    arguments: &Arguments,
    random: &mut Pcg64Mcg,
    console: &mut Console,
) -> Result<Row, Answer> {
    let cell = ClusterRun::of_file(file.to_owned(), &arguments.run)?;
    let period = cell.cluster.agreement().schedule.period();
    let answer_after = arguments.run.answer_after.or(Some(period * ANSWER_CYCLES));
    let run = RunArguments { answer_after, ..arguments.run.clone() };
    let scenario = scenario(&cell.cluster, of, count, random).shortened(run.cycles);
    console.note(&scenario.title);
    let failed = |error: std::io::Error| Answer::failed(Status::Failed, "U0602", error);
    for device in devices.into_iter().flatten().flatten() {
        device.take().map_err(failed)?;
    }
    let (summary, judged) = cell.judged(&scenario, &run, console)?;
    if let Some(failure) = judged.failure {
        return Err(Answer::failed(Status::Failed, failure.code(), &failure));
    }
    let mut taken: Vec<[Recorded; 2]> = Vec::new();
    for [first, twin] in devices.into_iter().flatten() {
        taken.push([first.take().map_err(failed)?, twin.take().map_err(failed)?]);
    }
    keep_writes(cell.path(), &taken).map_err(failed)?;
    let sum = |of: fn(&Recorded) -> u64| taken.as_flattened().iter().map(of).sum();
    let ns = |periods: u32| u64::try_from((period * periods).as_nanos()).unwrap_or(u64::MAX);
    let rule = Rule {
        oldest: ns(arguments.take_over_after + SWITCHOVER + 1 + UNDER_WAY),
        unread: TIMEOUT.as_nanos() as u64,
        recorded_after: ns(UNDER_WAY),
        unrecorded: ns(UNRECORDED),
    };
    let (programs, ends) = recorded(cell.path(), &cell.cluster)?;
    let pairs = programs.iter().zip(&taken);
    let devices = pairs.flat_map(|(program, pair)| pair.iter().map(move |it| (program, it)));
    let found = devices.map(|(program, it)| judge(&it.writes, &program.driven, &ends, rule));
    let found: Vec<Found> = found.collect();
    let gaps = taken.iter().map(|[first, twin]| longest_gap(&[&first.writes, &twin.writes]));
    let longest = gaps.max().unwrap_or(0);
    let slowest = taken.as_flattened().iter().map(|it| it.slowest_ns).max().unwrap_or(0);
    let total = summary.total();
    Ok(Row {
        fault: of.words(),
        count,
        directory: cell.path().display().to_string(),
        wrong: summary.violation_count,
        violations: {
            let wrong = summary.violations.iter().take(5);
            let wrong = wrong.map(|it| format!("cycle {}, {}: {}", it.cycle, it.name, it.what));
            wrong.chain(of_devices(&taken, &found)).collect()
        },
        held: total.held,
        fail_safe: total.fail_safe,
        by_stall: total.held_by_stall + total.fail_safe_by_stall,
        writes: sum(|it| it.writes.len() as u64),
        writers: sum(|it| it.writers),
        by_two: sum(|it| it.by_two.len() as u64),
        unproved: found.iter().map(|it| it.unproved.len() as u64).sum(),
        unrecorded: found.iter().map(|it| it.unrecorded).sum(),
        input_alarms: programs.iter().map(|it| it.input_alarms).sum(),
        questions: programs.iter().map(|it| it.questions).sum(),
        unanswered: programs.iter().map(|it| u64::from(it.is_asking)).sum(),
        longest_gap_cycles: longest as f64 / period.as_nanos() as f64,
        slowest_answer_cycles: slowest as f64 / period.as_nanos() as f64,
    })
}
