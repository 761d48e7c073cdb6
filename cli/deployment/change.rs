//! `understudy change`: an online change of programs and of settings of remote I/Os, while the cluster runs.

mod difference;
mod members;
mod plan;
mod rehearsal;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum, value_parser};
use serde_json::{Value, json};
use understudy_cluster::{ChangeTexts, Cluster, NeedsStop, Overrides, Way};
use understudy_journal::kept_overrides;
use understudy_text::duration::parse_positive;
use understudy_view::{Model, Run, ViewError};
use understudy_wire::{ChangeRequest, ConfigurationHash, Member, OrderRefusal, ProgramId};

use self::difference::{Differences, newest_states};
use self::members::{Members, gives};
use self::plan::Plan;
use crate::answer::{Answer, Status};
use crate::files;

/// Change the programs and fail-safe settings of a running cluster
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy change examples/online-change/cluster.toml examples/online-change/new/cluster.toml
  understudy change runs/latest new/cluster.toml rehearse
  understudy change runs/latest new/cluster.toml prepare
  understudy change runs/latest new/cluster.toml switch
  understudy change runs/latest new/cluster.toml accept
  understudy change cell/cluster.toml new/cluster.toml cancel --keys keys/members/engineer

Without a step, and with `plan`, it says what would change and which outputs can then differ, by proof, and touches nothing: from the newest state of
a run, or from every state of the old program. `rehearse` computes what the new programs would have done with
the samples of a run. `prepare` loads the new programs at all members next to the old ones;
`switch` changes the programs between two cycles; `accept` ends the change with the new programs and settings, `cancel` with the old ones. A step can be given again,
also from another machine: it continues where the members are.")]
pub(crate) struct Arguments {
    /// Cluster file that the members run, or directory of a running laboratory
    #[arg(value_name = "CLUSTER.toml|RUN")]
    before: PathBuf,
    /// Cluster file with the new programs and settings
    #[arg(value_name = "NEW.toml")]
    after: PathBuf,
    /// Step
    #[arg(value_enum, default_value = "plan")]
    step: Step,
    /// Folder of the engineer's keys, for members that run elsewhere
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    /// Members that are left out, because they are down
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// Continue although values are dropped
    #[arg(long)]
    drop: bool,
    /// Cycles of a rehearsal: the newest recorded ones
    #[arg(long, value_name = "CYCLES", default_value_t = 1000, value_parser = value_parser!(u64).range(1..=1_000_000))]
    cycles: u64,
    /// Rehearse with the next cycles of a running cluster, in place of the recorded ones
    #[arg(long)]
    live: bool,
    /// Scans after which a rehearsed program takes the state of the running one over anew
    #[arg(long, value_name = "SCANS", default_value_t = 100, value_parser = value_parser!(u32).range(1..))]
    renew: u32,
    /// Time limit of the proofs of `plan`; outputs that are not decided then are reported as undecided
    #[arg(long, value_name = "TIME", value_parser = parse_positive, default_value = "30s")]
    budget: Duration,
    /// Directory of runs
    #[arg(long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Step {
    /// Say what would change
    Plan,
    /// Compute what the new programs would have done in a run
    Rehearse,
    /// Load the new programs at all members, next to the old ones
    Prepare,
    /// Change the programs between two cycles
    Switch,
    /// End the change with the new programs and settings
    Accept,
    /// End the change with the old programs
    Cancel,
}

impl Step {
    /// Whether members are asked for it, which say themselves what they run.
    fn asks_members(self) -> bool {
        !matches!(self, Self::Plan | Self::Rehearse)
    }
}

const NO_PROGRAM: &str = "no program changes: the settings of the new file count from `accept` on";

/// Time limit for members that still need the other configuration: histories must leave the change behind.
const PATIENCE: Duration = Duration::from_secs(20);

/// Time limit for stations of which the remote I/O does not know yet what they have loaded: they say it in their next frame.
const LOADING_PATIENCE: Duration = Duration::from_secs(2);

const AGAIN: Duration = Duration::from_millis(200);

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let run = arguments.before.is_dir().then(|| Run::open(&arguments.before)).transpose()?;
    let before = match &run {
        Some(run) => run.cluster().as_ref().clone(),
        None => files::cluster(&arguments.before, Overrides::default())?.0,
    };
    // What the command line of a run said in place of its file, it says in place of the new one too.
    let said = run.as_ref().map(|run| kept_overrides(run.path())).transpose();
    let said = said.map_err(ViewError::from)?.unwrap_or_default();
    let (after, used) = files::cluster(&arguments.after, said)?;
    let texts = ChangeTexts::between(&before, &after).map_err(|reasons| needs_stop(&reasons))?;
    let plan = Plan::of(&before, &after, &texts, Way::There);
    let live = run.as_ref().and_then(newest_states);
    if let Some(live) = live.as_ref().filter(|_| !arguments.step.asks_members()) {
        check_running(live, [&before, &after])?;
    }
    if arguments.step == Step::Plan {
        let budget = arguments.budget;
        let differences = Differences::of((&before, &after), &texts, live.as_ref(), budget);
        return Ok(plan.answer(&differences).with_used(used));
    }
    if texts.touched().is_empty() {
        return Err(Answer::failed(Status::BadInput, "U0630", plan.nothing()));
    }
    if texts.programs.is_empty() && matches!(arguments.step, Step::Rehearse | Step::Switch) {
        return Ok(Answer::done(NO_PROGRAM, json!({ "rehearsed": [], "members": [], "plan": [] })));
    }
    if arguments.step == Step::Rehearse {
        return rehearsal::rehearse(arguments, run.as_ref(), (&before, &after), &texts);
    }
    let members = Members::of(arguments, &before)?;
    match arguments.step {
        Step::Plan | Step::Rehearse | Step::Prepare => {
            plan.permit(
                arguments.drop,
                "values are dropped, so the new program begins with their initial values",
            )?;
            let asked = members.prepare(&texts)?;
            Ok(asked.answer("loaded the change", plan.json()))
        }
        Step::Switch => {
            let asked = switch(&members, &texts, true);
            Ok(asked.answer("changes its program with its next sample", plan.json()))
        }
        Step::Accept => {
            // Where the change is over already, as on a second run of this step, all members say so.
            let request =
                ChangeRequest::Forget { change: texts.name(), configuration: texts.after };
            let [first, others] = members.deciding(&texts);
            let mut ended = members.ask_all(first, &request);
            if ended.is_done() {
                ended.0.append(&mut members.ask_all(others, &request).0);
            }
            let is_taken_back = |why: &String| gives(why, OrderRefusal::TakenBack);
            let is_taken_back =
                ended.0.iter().any(|(.., said)| said.as_ref().is_err_and(is_taken_back));
            if ended.is_done() || is_taken_back {
                return Ok(ended.answer("runs the new configuration", plan.json()));
            }
            let asked = switch(&members, &texts, true);
            let finish = Finish {
                configuration: texts.after,
                trial: longest_trial(&before, &texts),
                done: "runs the new configuration",
            };
            Ok(finish.ask(&members, &texts, asked).answer(finish.done, plan.json()))
        }
        Step::Cancel => {
            let back = Plan::back(&before, &after, &texts);
            back.permit(
                arguments.drop,
                "the old program does not have all values that the new one can have, so these begin with their initial values",
            )?;
            let asked = switch(&members, &texts, false);
            let finish = Finish {
                configuration: texts.before,
                trial: Duration::ZERO,
                done: "runs the old configuration",
            };
            Ok(finish.ask(&members, &texts, asked).answer(finish.done, plan.json()))
        }
    }
}

/// A run keeps the cluster file with which it began: what differs from that is no plan for members that run the programs of another one.
fn check_running(live: &Model, files: [&Cluster; 2]) -> Result<(), Answer> {
    for (program, old) in (0..).map(ProgramId).zip(files[0].controllers()) {
        let runs = live.controller_at(program, None).map(|controller| controller.hash);
        let of_files = files.map(|file| file.controllers().get(program.index()).map(|it| it.hash));
        if runs.is_some() && !of_files.contains(&runs) {
            let message = format!(
                "`{}` runs the program of an earlier change, which is in neither file: give the cluster file that the members run in the place of the run",
                old.name
            );
            return Err(Answer::failed(Status::BadInput, "U0631", message));
        }
    }
    Ok(())
}

/// Asks the remote I/Os of the programs for the new ones, or for the old ones.
fn switch(members: &Members<'_>, texts: &ChangeTexts, is_forward: bool) -> Asked {
    let mut asked = Asked::default();
    for changed in &texts.programs {
        let to = if is_forward { changed.after.hash } else { changed.before.hash };
        // Of two remote I/Os the author makes the change mark.
        let pair = [Member::RemoteIo(changed.program), Member::Twin(changed.program)];
        let mut of_pair = Asked::default();
        let begun = Instant::now();
        loop {
            for member in pair.into_iter().filter(|member| members.all().contains(member)) {
                members.ask(
                    member,
                    &ChangeRequest::Switch { change: texts.name(), to },
                    &mut of_pair,
                );
            }
            of_pair.keep_done();
            if of_pair.of_code("U0636").is_empty() || begun.elapsed() >= LOADING_PATIENCE {
                break;
            }
            of_pair.0.clear();
            pause();
        }
        let configuration = if is_forward { texts.after } else { texts.before };
        members.find_done(texts, configuration, &mut of_pair);
        of_pair.keep_done();
        asked.0.append(&mut of_pair.0);
    }
    asked
}

/// How a change ends.
struct Finish {
    /// The configuration of all members from then on.
    configuration: ConfigurationHash,
    /// Time for which a program may still be on trial.
    trial: Duration,
    /// What a member that has done it does.
    done: &'static str,
}

impl Finish {
    /// Makes the configuration that of all members, and ends the change; `asked` is what the remote I/Os of its programs said to the switch.
    fn ask(&self, members: &Members<'_>, texts: &ChangeTexts, mut asked: Asked) -> Asked {
        let Self { configuration, trial, .. } = *self;
        if !asked.is_done() {
            return asked;
        }
        let [first, others] = members.deciding(texts);
        asked.0.clear();
        // No member leaves the old program behind before the trials of the new ones are over.
        let run = ChangeRequest::Run { change: texts.name(), configuration };
        members.ask_until(first, &run, PATIENCE + trial, &mut asked);
        if asked.is_done() {
            asked.0.append(&mut members.ask_all(others, &run).0);
        }
        if asked.is_done() {
            let forget = ChangeRequest::Forget { change: texts.name(), configuration };
            members.ask_until(members.all(), &forget, PATIENCE, &mut asked);
        }
        asked
    }
}

/// The longest trial of the programs of a change.
fn longest_trial(before: &Cluster, texts: &ChangeTexts) -> Duration {
    let remote_ios = texts
        .programs
        .iter()
        .filter_map(|changed| before.remote_ios().get(changed.program.index()));
    let cycles = remote_ios.map(|remote_io| remote_io.fallback.trial_cycles).max().unwrap_or(0);
    before.agreement().schedule.period() * cycles
}

/// Before members or a run are asked again.
#[allow(clippy::disallowed_methods, reason = "a person waits, and members continue meanwhile")]
fn pause() {
    std::thread::sleep(AGAIN);
}

fn needs_stop(reasons: &[NeedsStop]) -> Answer {
    let of = |code: &'static str| reasons.iter().filter(move |reason| reason.code() == code);
    let groups = [
        (
            "U0630",
            "the change needs a stop, since an online change replaces programs with their inputs and outputs, and what remote I/Os do where nothing is proved, only: make these settings equal in both files, or stop the cluster and start all members with the new file",
        ),
        ("U0637", "variables cannot be renamed so: correct `renamed` of the new file"),
    ];
    let groups = groups.into_iter().filter(|(code, _)| of(code).next().is_some());
    let messages = groups.flat_map(|(code, words)| {
        let own = of(code).map(move |reason| (code, reason.to_string()));
        std::iter::once((code, words.to_owned())).chain(own)
    });
    let answer = messages.fold(None, |answer: Option<Answer>, (code, message)| {
        Some(match answer {
            Some(answer) => answer.and_failure(Status::BadInput, code, message),
            None => Answer::failed(Status::BadInput, code, message),
        })
    });
    answer.expect("a reason")
}

/// What members said, by name.
#[derive(Default)]
struct Asked(Vec<(Member, String, Result<(), String>)>);

impl Asked {
    /// Leaves out what was refused where another one has done it.
    fn keep_done(&mut self) {
        if self.0.iter().any(|(.., said)| said.is_ok()) {
            self.0.retain(|(.., said)| said.is_ok());
        }
    }

    fn is_done(&self) -> bool {
        self.0.iter().all(|(.., said)| said.is_ok())
    }

    /// The members that refused with a code.
    fn of_code(&self, code: &str) -> Vec<Member> {
        let refused = self
            .0
            .iter()
            .filter(|(.., said)| said.as_ref().is_err_and(|why| why.starts_with(code)));
        refused.map(|(member, ..)| *member).collect()
    }

    /// Takes what was refused later, but for members that are asked again.
    fn take(&mut self, later: Self, waits: &[Member]) {
        for (member, name, said) in later.0 {
            if !waits.contains(&member) {
                self.0.retain(|(known, ..)| *known != member);
                self.0.push((member, name, said));
            }
        }
    }

    fn waits_for(&mut self, members: &Members<'_>, waits: &[Member]) {
        for member in waits {
            let name = members.name(*member);
            self.0.retain(|(known, ..)| known != member);
            let why =
                "U0634: it still needs the other configuration; give this step again".to_owned();
            self.0.push((*member, name, Err(why)));
        }
    }

    fn answer(&self, done: &str, plan: Value) -> Answer {
        let mut text = String::new();
        let mut rows = Vec::new();
        let width = self.0.iter().map(|(_, name, _)| name.chars().count()).max().unwrap_or(0);
        for (_, name, said) in &self.0 {
            let words = said.as_ref().map_or_else(String::as_str, |()| done);
            // Writing to memory does not fail.
            let _ = writeln!(text, "{name:<width$}  {words}");
            rows.push(
                json!({ "member": name, "done": said.is_ok(), "refused": said.as_ref().err() }),
            );
        }
        let mut answer = Answer::done(text.trim_end(), json!({ "members": rows, "plan": plan }));
        for (_, name, said) in &self.0 {
            if let Err(why) = said {
                let (code, words) = why.split_once(": ").unwrap_or(("U0632", why));
                let code = if code.starts_with('U') { code } else { "U0632" };
                answer = answer.and_failure(Status::Failed, code, format!("{name}: {words}"));
            }
        }
        answer
    }
}
