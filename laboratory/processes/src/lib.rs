//! A scenario on real processes: one for each member, over a real network, on real clocks.
//!
//! The laboratory starts them, reads what they report, does the steps of the scenario when the cycles come that they are meant
//! for, and ends everything that it started, whatever happens. It decides nothing about the cycle, and no frame passes through it
//! unless it shapes the links. The unexpected end of a member is a fault like any other: it is recorded, and the run goes on.

mod afterwards;
mod conductor;
mod error;
mod keys;
mod operator;
mod patience;
mod process;
mod processes;
mod proxy;
mod recovery;
mod site;
mod steps;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use understudy_bus::{Cuts, LinkKind, RefusedOrders, WRITES_PER_SECOND, WriteLimiter};
use understudy_cluster::Cluster;
use understudy_journal::{
    Commands, Journal, JournalState, KEYS, PendingOrders, RETAINED, Record, RunDirectory, RunEvent,
    RunSocket, commands as queue_of_commands, keep_cluster, monotonic_ns,
};
use understudy_simulator::{Action, Fault};
use understudy_wire::{ConfigurationHash, Member, PointsHash, ProgramId};

use understudy_scenarios::{Account, OriginRule, Scenario, Terms};

pub use afterwards::Afterwards;
pub use conductor::Conductor;
pub use error::LaboratoryError;
pub use site::{HostKind, NetworkSettings};

use keys::RunKeys;
use patience::Waits;
use process::{Process, Said};
use recovery::Recovery;
use site::Site;
use steps::Steps;

/// What the members say and nobody has read yet, at most; then they wait, and lose records rather than cycles.
const UNREAD_LINES: usize = 16_384;

/// How often the clock is looked at when nobody says anything.
const TICK: Duration = Duration::from_millis(50);

/// What a laboratory is told besides its cluster and its scenario.
#[derive(Debug, Clone)]
pub struct LaboratorySettings {
    /// The program whose commands `node`, `remote-io` and `plant` run a member.
    pub program: PathBuf,
    /// The cluster file that they read.
    pub cluster_file: PathBuf,
    /// What they are told besides, such as `--period 5ms`: all the same.
    pub arguments: Vec<String>,
    /// What carries their frames.
    pub link: LinkKind,
    /// What lies between them.
    pub network: NetworkSettings,
    /// What the journal may take of the disk.
    pub journal_limit_bytes: u64,
    /// What follows when a member ends unexpectedly.
    pub deaths: Deaths,
    /// How long after a question of a remote I/O an operator answers it: with the newest state that a station holds, and with a cold start where none
    /// holds one. Nothing where it is not answered.
    pub answers_after: Option<Duration>,
}

/// What the laboratory does when a member ends unexpectedly after it was ready.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deaths {
    /// The run goes on without the member, which an operator can start again.
    Survived,
    /// The run goes on, and the member is started again after a while.
    Restarted,
    /// The run ends: a measurement in which a failure that was not drawn counted as one would be wrong.
    EndTheRun,
}

/// How far a run is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Progress {
    /// Processes come up.
    Starting {
        /// So many are ready.
        ready: usize,
        /// Of so many.
        members: usize,
    },
    /// The processes are there, and the cluster is not synchronised yet.
    ComingIntoStep {
        /// Who is not.
        names: Vec<String>,
    },
    /// Cycles are run.
    Cycle {
        /// The newest one.
        cycle: u64,
        /// Of so many.
        cycles: u64,
    },
    /// A step of the scenario was done.
    Step {
        /// The cycle in which it was done.
        cycle: u64,
        /// What and to whom.
        what: String,
    },
    /// A failure of the system was waited for, and has come.
    Failure {
        /// So many.
        done: u64,
        /// Of so many.
        of: u64,
    },
    /// What was started is stopped.
    Ending,
}

/// What a run left.
#[derive(Debug)]
pub struct LaboratoryRun {
    /// What came of it, up to a failure.
    pub account: Account,
    /// How the journal fared.
    pub journal: JournalState,
    /// Rights that the processes lack, and similar things that a reader should know.
    pub machine: Vec<String>,
    /// Why it ended early, where nobody asked it to.
    pub failure: Option<LaboratoryError>,
}

/// Runs `scenario` on processes of its own; the journal and the list of addresses go to `directory`. With `commands` an operator may act on
/// the members; the run then waits for cycles as long as that takes. With `afterwards` the cluster stays up.
///
/// To be called from the main thread: its processes end when the thread ends that started them. SIGINT and SIGTERM end the
/// run in order.
///
/// # Errors
/// [`LaboratoryError`] where nothing could be started; later failures are in [`LaboratoryRun::failure`].
pub fn run_commanded(
    cluster: &Cluster,
    scenario: &Scenario,
    settings: LaboratorySettings,
    directory: &RunDirectory,
    commands: Option<Commands>,
    afterwards: Option<Afterwards<'_>>,
    watch: &mut dyn FnMut(Progress),
) -> Result<LaboratoryRun, LaboratoryError> {
    let period = cluster.agreement().schedule.period();
    let mut steps = Steps::new(scenario, period, settings.answers_after);
    let conductor = &mut steps;
    run(cluster, scenario, settings, directory, commands, afterwards, conductor, watch)
}

/// The same with a conductor in place of the scenario's steps.
///
/// # Errors
/// As [`run_commanded`].
pub fn run_conducted(
    cluster: &Cluster,
    scenario: &Scenario,
    settings: LaboratorySettings,
    directory: &RunDirectory,
    conductor: &mut dyn Conductor,
    watch: &mut dyn FnMut(Progress),
) -> Result<LaboratoryRun, LaboratoryError> {
    run(cluster, scenario, settings, directory, None, None, conductor, watch)
}

#[allow(clippy::too_many_arguments, reason = "the three ways to call it differ in these")]
fn run(
    cluster: &Cluster,
    scenario: &Scenario,
    settings: LaboratorySettings,
    directory: &RunDirectory,
    commands: Option<Commands>,
    afterwards: Option<Afterwards<'_>>,
    conductor: &mut dyn Conductor,
    watch: &mut dyn FnMut(Progress),
) -> Result<LaboratoryRun, LaboratoryError> {
    let words = simulated_only(scenario);
    if !words.is_empty() {
        return Err(LaboratoryError::OnlySimulated { words });
    }
    let system = |what| move |source| LaboratoryError::System { what, source };
    let site = Site::prepare(cluster, scenario, &settings, directory)?;
    keep_cluster(directory.path(), &settings.cluster_file, cluster)
        .map_err(|error| system("to keep the cluster file")(std::io::Error::other(error)))?;
    let journal = Journal::create(&directory.file("journal.jsonl"), settings.journal_limit_bytes)
        .map_err(system("to write journal.jsonl"))?;
    let keys = RunKeys::make(cluster, directory.file(KEYS))
        .map_err(|errors| LaboratoryError::Keys { errors })?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(system("a runtime"))?;
    let (sender, receiver) = channel(UNREAD_LINES);
    let laboratory = Laboratory {
        settings,
        retained: directory.file(RETAINED),
        keys,
        site,
        account: Account::new(Terms::of(cluster), scenario, OriginRule::Found),
        journal: Some(journal),
        processes: BTreeMap::new(),
        lives: BTreeMap::new(),
        newest_ns: 0,
        ready: BTreeSet::new(),
        machine: BTreeSet::new(),
        cuts: BTreeMap::new(),
        recovery: Recovery::default(),
        conductor,
        afterwards,
        judged: None,
        commanded: commands.is_some(),
        points: (0..).map_while(|program| cluster.points_hash(ProgramId(program))).collect(),
        orders: PendingOrders::default(),
        // Less than a member takes, so that each caller gets an answer.
        write_limiter: WriteLimiter::new(WRITES_PER_SECOND / 2),
        change: None,
        refused_orders: RefusedOrders::default(),
        directory: directory.path().to_owned(),
        sender,
        watch,
    };
    let commands = commands.unwrap_or_else(|| queue_of_commands().1);
    Ok(runtime.block_on(laboratory.run(receiver, commands)))
}

/// What of a scenario a process has no way to do, and a simulation has.
pub fn simulated_only(scenario: &Scenario) -> Vec<&'static str> {
    let real = |action| {
        matches!(
            action,
            Action::Crash
                | Action::Restart
                | Action::Stop
                | Action::Continue
                | Action::Release
                | Action::Choose { .. }
                | Action::Set { .. }
                | Action::Unset { .. }
                | Action::Write { .. }
                | Action::Cut { .. }
                | Action::Heal { .. }
                | Action::Unplug { .. }
                | Action::Plug { .. }
        )
    };
    let simulated = scenario.steps.iter().filter(|step| !real(step.action));
    let mut words: BTreeSet<&'static str> = simulated.map(|step| step.action.word()).collect();
    if scenario.network_cycles.is_some() {
        words.insert("a network that is disturbed for some of its cycles");
    }
    if scenario.spare_after.is_some() {
        words.insert(
            "spares that wake by their rule (`understudy spare` does that beside processes)",
        );
    }
    words.into_iter().collect()
}

struct Laboratory<'w> {
    settings: LaboratorySettings,
    /// The folder of what the members keep for the time after a power failure.
    retained: PathBuf,
    keys: RunKeys,
    site: Site,
    account: Account,
    journal: Option<Journal>,
    processes: BTreeMap<Member, Process>,
    lives: BTreeMap<Member, u32>,
    /// Time of the newest record that was read, as [`monotonic_ns`] counts.
    newest_ns: u64,
    /// Members that have said that they listen.
    ready: BTreeSet<Member>,
    machine: BTreeSet<String>,
    /// By receiver: of whom it drops the frames.
    cuts: BTreeMap<Member, Cuts>,
    recovery: Recovery,
    conductor: &'w mut dyn Conductor,
    afterwards: Option<Afterwards<'w>>,
    /// The account of the scenario, where the cluster stays up after it.
    judged: Option<Account>,
    /// Whether somebody gives commands, or said that he might.
    commanded: bool,
    /// By program: identifies the points that steps of the scenario mean.
    points: Vec<PointsHash>,
    orders: PendingOrders,
    write_limiter: WriteLimiter,
    /// The configuration of the online change that the journal knows.
    change: Option<ConfigurationHash>,
    refused_orders: RefusedOrders,
    directory: PathBuf,
    sender: Sender<Said>,
    watch: &'w mut dyn FnMut(Progress),
}

impl Laboratory<'_> {
    async fn run(mut self, mut receiver: Receiver<Said>, mut commands: Commands) -> LaboratoryRun {
        // Without it nobody can act from another process; the run is none the worse.
        let socket = RunSocket::open(&self.directory, commands.commander());
        let failure = self.work(&mut receiver, &mut commands).await.err();
        (self.watch)(Progress::Ending);
        self.end(&mut receiver).await;
        drop(socket);
        self.note(RunEvent::Finished);
        self.machine.extend(self.site.end());
        LaboratoryRun {
            account: self.judged.unwrap_or(self.account),
            journal: self.journal.take().map(Journal::finish).unwrap_or_default(),
            machine: self.machine.into_iter().collect(),
            failure,
        }
    }

    async fn work(
        &mut self,
        receiver: &mut Receiver<Said>,
        commands: &mut Commands,
    ) -> Result<(), LaboratoryError> {
        let system = |what| move |source| LaboratoryError::System { what, source };
        let mut interrupt = signal(SignalKind::interrupt()).map_err(system("to hear SIGINT"))?;
        let mut terminate = signal(SignalKind::terminate()).map_err(system("to hear SIGTERM"))?;
        let members: Vec<Member> =
            self.account.terms.members.iter().map(|(member, _)| member).collect();
        let slots = self.account.terms.agreement.schedule.spare_slots();
        let is_slot = |member: Member| matches!(member, Member::Station(it) if slots.contains(it));
        // The slot of a spare is empty until a step or an operator starts it.
        for member in members.into_iter().filter(|member| !is_slot(*member)) {
            self.start(member).await?;
        }
        let mut waits = Waits::new();
        let mut tick = tokio::time::interval(TICK);
        loop {
            let due = [self.conductor.next_due(), self.recovery.next_due()];
            let due = due.into_iter().flatten().min();
            let sleep =
                tokio::time::sleep_until(due.unwrap_or_else(|| Instant::now() + TICK).into());
            tokio::select! {
                biased;
                _ = interrupt.recv() => return self.interrupted(),
                _ = terminate.recv() => return self.interrupted(),
                () = sleep, if due.is_some() => {}
                commanded = commands.next() => self.obey(commanded).await,
                said = receiver.recv() => {
                    if let Some(said) = said {
                        self.hear(said).await?;
                    }
                }
                _ = tick.tick() => self.show_journal(),
            }
            let now = Instant::now();
            self.conductor.follow(self.account.cycle(), now);
            let due = std::iter::from_fn(|| self.conductor.take_due(now));
            let due: Vec<Fault> = due.collect();
            self.do_steps(&due).await?;
            while let Some(member) = self.recovery.take_due(now) {
                self.restart(member).await;
            }
            self.show_progress(&mut waits);
            if self.judged.is_none() && self.is_over(now) && !self.stays() {
                return Ok(());
            }
            self.check_patience(&mut waits, now)?;
        }
    }

    fn interrupted(&mut self) -> Result<(), LaboratoryError> {
        if self.judged.is_none() {
            self.note(RunEvent::Interrupted);
        }
        Ok(())
    }

    fn name(&self, member: Member) -> String {
        self.account.terms.members.name(member).to_owned()
    }

    fn names(&self, members: impl IntoIterator<Item = Member>) -> Vec<String> {
        members.into_iter().map(|member| self.name(member)).collect()
    }

    /// A record of the laboratory's own.
    fn note(&mut self, event: RunEvent) {
        let record = Record::of_run(monotonic_ns(), event);
        self.take(&record);
    }

    fn take(&mut self, record: &Record) {
        self.newest_ns = self.newest_ns.max(record.at_ns);
        let had_origin = self.account.origin().is_some();
        if let Some(journal) = &mut self.journal {
            journal.write(record);
        }
        self.account.observe(record);
        for decided in self.orders.observe(record) {
            if let Some(event) = decided.record() {
                self.note(event);
                self.show_journal();
            }
            if let Some(request) = decided.change() {
                self.note_change(&request.clone());
            }
            decided.answer();
        }
        self.conductor.hear(record, Instant::now());
        if let Some(moment) = self.account.origin().filter(|_| !had_origin) {
            self.note(RunEvent::Origin { moment, cycle: 0 });
        }
    }

    /// Who follows the journal is to see it while it is written.
    fn show_journal(&mut self) {
        if let Some(journal) = &mut self.journal {
            journal.flush();
        }
    }
}
