//! `understudy operate`: operator commands, by the socket of a laboratory or by mutual TLS.

mod alarms;
mod status;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use clap::{Args, ValueEnum};
use serde_json::json;
use understudy_bus::{BusError, Call, DONE, Peer, RefusedOrder, Request, Told};
use understudy_cluster::{Addresses, Cluster, Overrides};
use understudy_executable::Interface;
use understudy_journal::{
    Command, Done, OperatorAction, Refusal, RequestedValue, WriteRequest, attempt_until_decided,
    force_value, new_write, repeated,
};
use understudy_keys::{Date, OperatorKeys};
use understudy_member::tls_keys;
use understudy_text::visible_json;
use understudy_typed::Declared;
use understudy_view::{Run, find_running_of};
use understudy_wire::{
    Cycle, Force, Member, PointsHash, Role, SignalPlace, StateChoice, Unforce, Write, WriteAnswer,
};

use crate::answer::{Answer, Failure, Status};
use crate::files;

/// Command or query a member
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy operate runs/latest --name robot kill
  understudy operate runs/latest --name robot restart
  understudy operate cell/cluster.toml --keys keys/members/engineer --name robot-io status
  understudy operate cell/cluster.toml --keys keys/members/engineer --name robot-io release
  understudy operate cell/cluster.toml --keys keys/members/engineer --name robot-io accept-state --cycle 4711
  understudy operate cell/cluster.toml --keys keys/members/engineer --name robot journal --lines 100
  understudy operate runs/latest --name tank-io force inflow=12.5 --seconds 60 --reason \"valve test\"
  understudy operate runs/latest --name tank-io unforce inflow
  understudy operate runs/latest --name tank-io write setpoint=42.5 --reason \"new batch\"
  understudy operate runs/latest --name level-high acknowledge-alarm
  understudy operate runs/latest --name level-high shelve-alarm --seconds 600 --reason \"sensor is exchanged\"

Without --keys the member belongs to a laboratory on this machine: that of the given run, or the running one of the cluster below --out.")]
pub(crate) struct Arguments {
    /// Cluster file, or directory of a running laboratory
    #[arg(value_name = "CLUSTER.toml|RUN")]
    target: PathBuf,
    /// Folder of the operator's keys, for a remote member
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// Member; for acknowledge-alarm, shelve-alarm and unshelve-alarm: alarm
    #[arg(long, value_name = "NAME")]
    name: String,
    /// Command or query
    #[arg(value_enum)]
    what: What,
    /// For force and write: signal and value, such as inflow=12.5 or lamp=true; for unforce: signal
    #[arg(value_name = "SIGNAL[=VALUE]", required_if_eq_any([("what", "force"), ("what", "unforce"), ("what", "write")]))]
    signal: Option<String>,
    /// For force and shelve-alarm: duration
    #[arg(long, value_name = "N", default_value_t = 60)]
    seconds: u32,
    /// For accept-state: cycle of the state as in the event `state-lost`; the command is refused if the newest state is of another cycle
    #[arg(long, value_name = "CYCLE", required_if_eq("what", "accept-state"))]
    cycle: Option<u64>,
    /// Number of journal lines to print
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    lines: u64,
    /// Reason, recorded in the journal of the laboratory
    #[arg(long, value_name = "TEXT", default_value = "from the command line")]
    reason: String,
    /// Directory of runs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
}

impl What {
    /// Whether it is for an alarm, and not for a member.
    fn is_of_alarm(self) -> bool {
        matches!(self, Self::AcknowledgeAlarm | Self::ShelveAlarm | Self::UnshelveAlarm)
    }

    /// Whether it changes something, and does not only ask.
    fn is_order(self) -> bool {
        !matches!(self, Self::Status | Self::Configuration | Self::Journal)
    }
}

impl Arguments {
    /// The command as it is typed.
    fn word(&self) -> String {
        let word = self.what.to_possible_value();
        word.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The record of an order that this answer refuses.
    fn refused(&self, answer: &Answer, owner: &str) -> RefusedOrder {
        let why = answer.failures.first().map_or_else(String::new, |failure| {
            let Failure { code, message } = failure;
            // Some messages begin with their code.
            let words = message.strip_prefix(&format!("{code}: ")).unwrap_or(message);
            format!("{code}: {words}")
        });
        let signal = self.signal.as_deref().unwrap_or_default();
        RefusedOrder::new(&self.word(), &self.name, owner, why).with(signal, &self.reason)
    }

    /// Reply to `cold-start` or `accept-state`.
    fn choice(&self) -> StateChoice {
        match self.what {
            What::AcceptState => StateChoice::Newest { cycle: self.cycle.map(Cycle) },
            _ => StateChoice::Cold,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// Print the state of the member: the records that are in effect, and its newest turn or deadline
    Status,
    /// Print the canonical configuration of the member
    Configuration,
    /// Release the outputs of a cold-started program
    Release,
    /// Restart a program with lost state from its initial state
    ColdStart,
    /// Continue a program with lost state from the newest available state, of cycle --cycle
    AcceptState,
    /// Replace a signal of the program by a value, for a limited time
    Force,
    /// End a force
    Unforce,
    /// Write a value to an operator input, and wait until it is in effect
    Write,
    /// Stop the member
    Stop,
    /// Print new journal records
    Journal,
    /// Kill its process (kill -9); laboratory only
    Kill,
    /// Restart its process; laboratory only
    Restart,
    /// Acknowledge an alarm of a signal, or the alarms of a member; run only
    AcknowledgeAlarm,
    /// Take an alarm of a signal off the list of open alarms for a limited time; run only
    ShelveAlarm,
    /// End the shelving of an alarm; run only
    UnshelveAlarm,
}

/// Timeout; a member sends in every cycle.
const SILENCE: Duration = Duration::from_secs(60);

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    match &arguments.keys {
        _ if arguments.what.is_of_alarm() => alarms::run(arguments),
        Some(keys) => elsewhere(arguments, keys),
        None => in_laboratory(arguments),
    }
}

/// Sends the command to the laboratory that writes the run. The laboratory records one that is refused here, too.
fn in_laboratory(arguments: &Arguments) -> Result<Answer, Answer> {
    let word = arguments.word();
    let owner = crate::inspect::top::owner();
    let ordered = command(arguments, &owner).and_then(|command| {
        let run = written(arguments)?;
        let member = crate::member::find(run.cluster(), &arguments.name)?;
        Ok((run, member, command))
    });
    let (run, member, command) = ordered.inspect_err(|answer| {
        if arguments.what.is_order()
            && let Ok(run) = written(arguments)
        {
            run.commander().refused_and_wait(arguments.refused(answer, &owner));
        }
    })?;
    let done = match command {
        Command::Write(write) => run.commander().write_and_wait(member, &write),
        command => run.commander().act_and_wait(&OperatorAction::Command {
            member,
            command,
            owner,
            reason: arguments.reason.clone(),
        }),
    };
    let done = done.map_err(|refusal| refused(&refusal))?;
    let mut text = format!("{word} {}: done", arguments.name);
    let mut result = json!({ "run": run.path(), "name": arguments.name, "done": word });
    if let Some(cycle) = done.cycle {
        text = format!("{word} {}: in effect since cycle {cycle} of the cluster", arguments.name);
        result["cycle"] = json!(cycle);
    }
    Ok(Answer::done(text, result).and_next(&[&"top", &run.path()]))
}

/// The command to a member of a laboratory.
fn command(arguments: &Arguments, owner: &str) -> Result<Command, Answer> {
    let word = arguments.word();
    Ok(match arguments.what {
        // By the points that count: an online change may have replaced those of the cluster file.
        What::Force => {
            Command::Force(force(arguments, written(arguments)?.points().cluster(), owner)?)
        }
        What::Unforce => {
            Command::Unforce(unforce(arguments, written(arguments)?.points().cluster())?)
        }
        What::Write => {
            let points = written(arguments)?.points();
            Command::Write(write(arguments, points.cluster(), (owner, Role::Engineer))?)
        }
        What::Kill => Command::Kill,
        What::Restart => Command::Restart,
        What::Release => Command::Release,
        What::ColdStart | What::AcceptState => Command::Choose { choice: arguments.choice() },
        What::Status
        | What::Configuration
        | What::Stop
        | What::Journal
        | What::AcknowledgeAlarm
        | What::ShelveAlarm
        | What::UnshelveAlarm => {
            named(arguments)?;
            let message = format!(
                "`{word}` requires a remote member: give the folder of the operator's keys by --keys; a laboratory accepts kill, restart, release, cold-start, accept-state, force, unforce, write, acknowledge-alarm, shelve-alarm and unshelve-alarm"
            );
            return Err(Answer::failed(Status::BadInput, "U0621", message));
        }
    })
}

/// Whether the cluster of the run, or of the cluster file, has the member.
fn named(arguments: &Arguments) -> Result<Member, Answer> {
    let target = &arguments.target;
    if target.is_dir() {
        return crate::member::find(Run::open(target)?.cluster(), &arguments.name);
    }
    let (cluster, _) = files::cluster(target, Overrides::default())?;
    crate::member::find(&cluster, &arguments.name)
}

/// The signal of a force, as the cluster file has it.
struct Named<'a> {
    signal: SignalPlace,
    declared: Declared,
    points: Option<PointsHash>,
    /// The text of its value.
    value: &'a str,
}

/// The signal that is forced, or whose force ends.
fn named_signal<'a>(arguments: &'a Arguments, cluster: &Cluster) -> Result<Named<'a>, Answer> {
    let text = arguments.signal.as_deref().unwrap_or_default();
    let (name, value) = text.split_once('=').unwrap_or((text, ""));
    let bad = |message: String| Answer::failed(Status::BadInput, "U0556", message);
    let member = crate::member::find(cluster, &arguments.name)?;
    let Some(program) = member.sampled_program() else {
        let message = format!("`{}` is not a remote I/O: signals are forced there", arguments.name);
        return Err(bad(message));
    };
    let Interface { inputs, outputs } = &cluster.controllers()[program.index()].interface;
    let name = name.trim();
    let input = inputs.find(name).map(|point| (SignalPlace::Input(point.bit as u16), point));
    let output = outputs.find(name).map(|point| (SignalPlace::Output(point.bit as u16), point));
    let (signal, point) = input.or(output).ok_or_else(|| {
        let names: Vec<&str> = inputs.names().chain(outputs.names()).collect();
        let names = names.join(", ");
        bad(format!(
            "the program of `{}` has no signal `{name}`; its signals are {names}",
            arguments.name
        ))
    })?;
    let points = cluster.points_hash(program);
    Ok(Named { signal, declared: point.declared(), points, value: value.trim() })
}

/// The end of a force of a signal.
fn unforce(arguments: &Arguments, cluster: &Cluster) -> Result<Unforce, Answer> {
    let Named { signal, points, .. } = named_signal(arguments, cluster)?;
    Ok(Unforce { signal, points })
}

/// A force of a signal as a whole.
fn force(arguments: &Arguments, cluster: &Cluster, owner: &str) -> Result<Force, Answer> {
    let Named { signal, declared, points, value } = named_signal(arguments, cluster)?;
    let value = force_value(value, &declared)
        .map_err(|message| Answer::failed(Status::BadInput, "U0556", message))?;
    let force = Force {
        signal,
        value,
        seconds: arguments.seconds,
        owner: owner.to_owned(),
        reason: arguments.reason.clone(),
        points,
    };
    force.check().map_err(|error| Answer::failed(Status::BadInput, "U0556", error.to_string()))?;
    Ok(force)
}

/// A write of an operator input, by a person with this role.
fn write(
    arguments: &Arguments,
    cluster: &Cluster,
    (owner, role): (&str, Role),
) -> Result<Write, Answer> {
    let text = arguments.signal.as_deref().unwrap_or_default();
    let (input, value) = text.split_once('=').unwrap_or((text, ""));
    let member = crate::member::find(cluster, &arguments.name)?;
    let request = WriteRequest {
        input: input.trim(),
        value: RequestedValue::Text(value),
        role,
        owner,
        reason: &arguments.reason,
    };
    new_write(cluster, member, &request)
        .map_err(|problem| Answer::failed(Status::BadInput, problem.code(), problem.to_string()))
}

/// The named run, or the newest running one of the cluster.
fn written(arguments: &Arguments) -> Result<Run, Answer> {
    let target = &arguments.target;
    if target.is_dir() {
        return Ok(Run::open(target)?);
    }
    let (cluster, _) = files::cluster(target, Overrides::default())?;
    find_running_of(&arguments.out, &cluster).ok_or_else(|| {
        let message = format!(
            "no laboratory of `{}` runs below {}; remote members require the keys of an operator (--keys DIR)",
            cluster.name(),
            arguments.out.display()
        );
        Answer::failed(Status::BadInput, "U0614", message)
    })
}

fn refused(refusal: &Refusal) -> Answer {
    Answer::failed(Status::Failed, &refusal.code(), refusal.to_string())
}

/// Writes to a remote I/O, and asks again over a new call where the answer is lost.
fn write_elsewhere(
    arguments: &Arguments,
    request: &Request,
    call: impl Fn() -> Result<Call, BusError>,
) -> Result<Answer, Answer> {
    let said = |error: BusError| Refusal::Said(error.to_string());
    let ask = || call()?.ask(request);
    let done = attempt_until_decided(|| {
        // A connection that is lost and restored at once looks like a refusal: it is one where the next call has it too.
        let answer = match ask() {
            Err(BusError::Unanswered { .. }) => ask(),
            answer => answer,
        };
        let text = match answer {
            Err(BusError::AnswerLost { .. }) => return Err(Refusal::Undecided),
            answer => answer.map_err(said)?,
        };
        let answer: WriteAnswer =
            serde_json::from_str(&text).map_err(|_| Refusal::of_answer(format!("{text:.200}")))?;
        Done::of_write(answer.outcome)
    });
    let cycle = done.map_err(|refusal| refused(&refusal))?.cycle.unwrap_or_default();
    let text = format!("write {}: in effect since cycle {cycle} of the cluster", arguments.name);
    let result = json!({ "name": arguments.name, "done": "write", "cycle": cycle });
    Ok(Answer::done(text, result))
}

/// Sends the command to a remote member. The member records one that is refused here, or to which this certificate is not admitted, too.
fn elsewhere(arguments: &Arguments, keys: &Path) -> Result<Answer, Answer> {
    let (cluster, _) = files::cluster(&arguments.target, Overrides::default())?;
    let keys = OperatorKeys::load(keys, &cluster, Date::of(SystemTime::now()));
    let keys = keys.map_err(|errors| crate::deployment::keys::failed(&errors))?;
    let member = crate::member::find(&cluster, &arguments.name)?;
    let Addresses { first, second, .. } = cluster.addresses(member);
    let address = first.ok_or_else(|| {
        let message = format!("no address for {}", arguments.name);
        Answer::failed(Status::BadInput, "U0608", message)
    })?;
    let peer = Peer { member, name: arguments.name.clone(), address, second, link: None };
    let hash = cluster.agreement().cluster;
    let tls = tls_keys(&keys.tls);
    let configuration = cluster.agreement().configuration;
    let call = || {
        let call = Call::to(peer.call_address(), hash, &arguments.name, &tls)?;
        Ok(call.with_configuration(configuration))
    };
    let record = |answer: &Answer| {
        if arguments.what.is_order()
            && let Ok(call) = call()
        {
            // A member of another version does not know the question.
            let _ = call.ask(&Request::Refused(arguments.refused(answer, &keys.name)));
        }
    };
    let request = request(arguments, &cluster, (&keys.name, keys.role)).inspect_err(record)?;
    ask_elsewhere(arguments, &cluster, request, &call).inspect_err(|answer| {
        // What the member decides itself has a record already.
        let code = answer.failures.first().map(|failure| failure.code.as_str());
        if matches!(code, Some("U0510" | "U0556")) {
            record(answer);
        }
    })
}

/// What a remote member is asked by the person of the keys; nothing for its journal, which is followed.
fn request(
    arguments: &Arguments,
    cluster: &Cluster,
    person: (&str, Role),
) -> Result<Option<Request>, Answer> {
    Ok(match arguments.what {
        What::Status => Some(Request::Status),
        What::Configuration => Some(Request::Configuration),
        What::Release => Some(Request::Release),
        What::ColdStart | What::AcceptState => Some(Request::Choose(arguments.choice())),
        What::Force => Some(Request::Force(force(arguments, cluster, person.0)?)),
        What::Unforce => Some(Request::Unforce(unforce(arguments, cluster)?)),
        What::Write => Some(Request::Write(write(arguments, cluster, person)?)),
        What::Stop => Some(Request::Stop),
        What::Journal => None,
        What::Kill
        | What::Restart
        | What::AcknowledgeAlarm
        | What::ShelveAlarm
        | What::UnshelveAlarm => {
            return Err(refused(&Refusal::Elsewhere {
                name: arguments.name.clone(),
                reason: "its process runs on another machine: stop or start it there".to_owned(),
            }));
        }
    })
}

fn ask_elsewhere(
    arguments: &Arguments,
    cluster: &Cluster,
    request: Option<Request>,
    call: &impl Fn() -> Result<Call, BusError>,
) -> Result<Answer, Answer> {
    if let Some(request @ Request::Write(_)) = &request {
        return write_elsewhere(arguments, request, call);
    }
    let call = call()?;
    let Some(request) = request else {
        let mut left = arguments.lines;
        let take = |told: Told<'_>| {
            let line = match told {
                Told::Line(line) => line,
                Told::By(_) | Told::Silent => return true,
                // Standard output has records alone.
                Told::Lost(lines) => {
                    return writeln!(std::io::stderr(), "{lines} lines were lost on their way")
                        .is_ok();
                }
            };
            if repeated(line).is_ok() {
                return true;
            }
            left = left.saturating_sub(1);
            // The reader closed the pipe.
            writeln!(std::io::stdout(), "{}", visible_json(line)).is_ok() && left > 0
        };
        call.follow(SILENCE, take)?;
        return Ok(Answer::done("", json!(null)));
    };
    if request == Request::Status {
        return Ok(status::ask(&call, cluster, &arguments.name)?);
    }
    let text = call.ask(&request)?;
    if request.is_command() && text != DONE {
        return Err(refused(&Refusal::of_answer(text)));
    }
    let result = serde_json::from_str(&text).unwrap_or_else(|_| json!({ "text": text }));
    Ok(Answer::done(text, result))
}
