//! A spare as the process that this is.

use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use understudy_bus::{BusError, Peer, TlsKeys};
use understudy_cluster::{Cluster, PlantSpare};
use understudy_cycle::spare::{Attention, Order, Rule, WITNESSES};
use understudy_wire::{Member, StationId};

use crate::post::Post;
use crate::unfinished;
use crate::watch::{Seen, Watch, Whereabouts};

/// How often the end of the process is looked for when nothing happens.
const TICK: Duration = Duration::from_millis(500);

/// After the station of a slot has ended unexpectedly, the spare wakes again after this time.
const START_AGAIN_AFTER: Duration = Duration::from_secs(10);

/// What a spare does in one group.
#[derive(Debug, Clone)]
pub struct Duty {
    /// Name of the group.
    pub group: String,
    /// Its cluster.
    pub cluster: Cluster,
    /// Its cluster file.
    pub cluster_file: PathBuf,
    /// The station of the slot.
    pub slot: StationId,
    /// Its name.
    pub slot_name: String,
    /// Whether the group fits the capacity of the spare.
    pub fits: bool,
    /// The folder of the keys of the slot.
    pub slot_keys: PathBuf,
    /// The keys that it watches with.
    pub viewer_keys: TlsKeys,
    /// The members of the group with their addresses.
    pub peers: Vec<Peer>,
    /// The file of the journal of the station; it is discarded where absent.
    pub journal: Option<PathBuf>,
    /// The folder of what the station keeps for the time after a power failure.
    pub retain: Option<PathBuf>,
}

/// What a spare needs to run.
#[derive(Debug)]
pub struct SpareSettings {
    /// The spare, from the plant file.
    pub spare: PlantSpare,
    /// Its groups, in the order of their preference.
    pub duties: Vec<Duty>,
    /// The program whose command `node` runs a station.
    pub program: PathBuf,
    /// Whether stations ask for real-time rights.
    pub real_time: bool,
}

/// What a spare reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Report {
    /// A group is seen: its journals are followed.
    Watches {
        /// The group.
        group: String,
    },
    /// Too few remote I/Os of a group are followed.
    Unseen {
        /// The group.
        group: String,
        /// Why the last one is not followed.
        reason: String,
    },
    /// The spare wakes in a group.
    Wakes {
        /// The group.
        group: String,
        /// The slot that it takes.
        slot: String,
        /// The flagged stations, and the cycles for which each has been.
        failed: Vec<(String, u32)>,
    },
    /// The spare wakes in the group in which it was awake when it ended: what its station has kept may be the newest state.
    WakesAgain {
        /// The group.
        group: String,
        /// The slot that it takes.
        slot: String,
    },
    /// Its station publishes.
    Awake {
        /// The group.
        group: String,
        /// Cycles since the spare woke, and since the last turn of the station that failed first; nothing where it has woken again, because it had
        /// not followed the group before.
        cycles: Option<(u32, u32)>,
    },
    /// The group is complete: the spare retires.
    Retires {
        /// The group.
        group: String,
        /// Cycles for which it has been complete.
        cycles: u32,
    },
    /// The station of the slot has not started, or has ended unexpectedly.
    Ended {
        /// The group.
        group: String,
        /// How.
        how: String,
    },
}

impl fmt::Display for Report {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Watches { group } => write!(formatter, "{group}: watches it"),
            Self::Unseen { group, reason } => {
                write!(formatter, "{group}: cannot watch it, retrying: {reason}")
            }
            Self::Wakes { group, slot, failed } => {
                let failed: Vec<String> = failed
                    .iter()
                    .map(|(name, cycles)| format!("{name} (flagged for {cycles} cycles)"))
                    .collect();
                write!(formatter, "{group}: wakes as {slot}; failed: {}", failed.join(", "))
            }
            Self::WakesAgain { group, slot } => {
                write!(formatter, "{group}: wakes as {slot}, as it was when it ended")
            }
            Self::Awake { group, cycles: Some((cycles, since_failure)) } => write!(
                formatter,
                "{group}: publishes {cycles} cycles after it woke, {since_failure} after the failure"
            ),
            Self::Awake { group, cycles: None } => write!(formatter, "{group}: publishes"),
            Self::Retires { group, cycles } => {
                write!(formatter, "{group}: retires, the group is complete for {cycles} cycles")
            }
            Self::Ended { group, how } => {
                write!(formatter, "{group}: its station has ended unexpectedly: {how}")
            }
        }
    }
}

/// Where the spare is awake.
struct Awake {
    group: usize,
    post: Post,
    /// Cycles for which a station had been flagged when it woke; nothing where it woke before it followed the group.
    silent: Option<u32>,
    publishes: bool,
}

/// Runs a spare until `ends` is set; answers with the number of times that it woke.
///
/// # Errors
/// [`BusError::System`].
pub fn run(
    settings: &SpareSettings,
    ends: &AtomicBool,
    say: &mut dyn FnMut(&Report),
) -> Result<u64, BusError> {
    let SpareSettings { spare, duties, .. } = settings;
    let (sender, seen) = channel();
    let whereabouts = Whereabouts::default();
    for (group, duty) in duties.iter().enumerate() {
        let agreement = duty.cluster.agreement();
        let is_remote_io = |peer: &&Peer| matches!(peer.member, Member::RemoteIo(_));
        let remote_ios: Vec<&Peer> = duty.peers.iter().filter(is_remote_io).collect();
        for witness in 0..remote_ios.len().min(WITNESSES) {
            let watch = Watch {
                spare: spare.name.clone(),
                whereabouts: whereabouts.clone(),
                cluster: agreement.cluster,
                configuration: agreement.configuration,
                period: agreement.schedule.period(),
                keys: duty.viewer_keys.clone(),
                peers: remote_ios
                    .iter()
                    .skip(witness)
                    .step_by(WITNESSES)
                    .copied()
                    .cloned()
                    .collect(),
            };
            let sender = sender.clone();
            std::thread::Builder::new()
                .name("watch".to_owned())
                .spawn(move || watch.run(group, witness, &sender))
                .map_err(|source| BusError::System { what: "a thread for a remote I/O", source })?;
        }
    }
    let attention =
        |duty: &Duty| Attention::new(duty.cluster.agreement(), duty.slot, spare.spare_after);
    let retire_after = |duty: &Duty| {
        let period = duty.cluster.agreement().schedule.period().as_nanos().max(1);
        u32::try_from(spare.retire_after.as_nanos().div_ceil(period)).unwrap_or(u32::MAX)
    };
    let mut keeper = Keeper {
        settings,
        groups: duties.iter().map(attention).collect(),
        seen: vec![None; duties.len()],
        rule: Rule {
            fits: duties.iter().map(|duty| duty.fits).collect(),
            retire_after: duties.iter().map(retire_after).collect(),
        },
        awake: None,
        whereabouts,
        not_before: Instant::now(),
        woke: 0,
    };
    if let Some(group) = unfinished::of(duties).filter(|&group| duties[group].fits) {
        let duty = &duties[group];
        say(&Report::WakesAgain { group: duty.group.clone(), slot: duty.slot_name.clone() });
        keeper.start(group, say);
    }
    while !ends.load(Ordering::Relaxed) {
        match seen.recv_timeout(TICK) {
            Ok((group, witness, what)) => keeper.saw(group, witness, what, say),
            Err(RecvTimeoutError::Timeout) => {}
            // Each group has a remote I/O, and its thread ends after this.
            Err(RecvTimeoutError::Disconnected) => break,
        }
        keeper.look(say);
    }
    Ok(keeper.woke)
}

struct Keeper<'a> {
    settings: &'a SpareSettings,
    groups: Vec<Attention>,
    /// Whether each group was seen when that was last reported.
    seen: Vec<Option<bool>>,
    rule: Rule,
    awake: Option<Awake>,
    whereabouts: Whereabouts,
    /// No station is started earlier.
    not_before: Instant,
    woke: u64,
}

impl Keeper<'_> {
    fn saw(&mut self, group: usize, witness: usize, what: Seen, say: &mut dyn FnMut(&Report)) {
        let name = &self.settings.duties[group].group;
        match what {
            Seen::Report(report) => {
                self.groups[group].told(witness, &report);
                let seen = self.groups[group].standing().seen;
                if seen && self.seen[group].replace(true) != Some(true) {
                    say(&Report::Watches { group: name.clone() });
                }
            }
            Seen::Lost(reason) => {
                self.groups[group].lost(witness);
                let seen = self.groups[group].standing().seen;
                if !seen && self.seen[group].replace(false) != Some(false) {
                    say(&Report::Unseen { group: name.clone(), reason });
                }
            }
        }
    }

    /// Follows the rule.
    fn look(&mut self, say: &mut dyn FnMut(&Report)) {
        let standings: Vec<_> = self.groups.iter().map(Attention::standing).collect();
        if let Some(awake) = &mut self.awake {
            let duty = &self.settings.duties[awake.group];
            if let Some(status) = awake.post.ended() {
                say(&Report::Ended { group: duty.group.clone(), how: status.to_string() });
                self.not_before = Instant::now() + START_AGAIN_AFTER;
                self.sleeps();
                return;
            }
            if !awake.publishes && standings[awake.group].publishes {
                awake.publishes = true;
                let since_failure = silent(&self.groups[awake.group]);
                let cycles = awake
                    .silent
                    .map(|silent| (since_failure.saturating_sub(silent), since_failure));
                say(&Report::Awake { group: duty.group.clone(), cycles });
            }
        }
        let post = self.awake.as_ref().map(|awake| awake.group);
        match self.rule.order(post, &standings) {
            Order::Stay => {}
            Order::Wake(_) if Instant::now() < self.not_before => {}
            Order::Wake(group) => self.wake(group, say),
            Order::Retire(group) => {
                let group_name = self.settings.duties[group].group.clone();
                let cycles = standings[group].complete;
                say(&Report::Retires { group: group_name, cycles });
                self.sleeps();
                unfinished::ends(&self.settings.duties[group]);
            }
        }
    }

    /// The station of its slot ends, if it has not.
    fn sleeps(&mut self) {
        self.awake = None;
        self.whereabouts.set(None);
    }

    fn wake(&mut self, group: usize, say: &mut dyn FnMut(&Report)) {
        let duty = &self.settings.duties[group];
        let attention = &self.groups[group];
        let name = |station| {
            let name = duty.cluster.member_name(Member::Station(station));
            (name.unwrap_or_default().to_owned(), attention.silent(station))
        };
        say(&Report::Wakes {
            group: duty.group.clone(),
            slot: duty.slot_name.clone(),
            failed: attention.failed().map(name).collect(),
        });
        self.start(group, say);
    }

    /// Starts the station of the slot of a group.
    fn start(&mut self, group: usize, say: &mut dyn FnMut(&Report)) {
        let duty = &self.settings.duties[group];
        // Without the file the spare sleeps after a power failure; its station reports what it does not keep.
        let _ = unfinished::begins(duty);
        match Post::start(&self.settings.program, duty, self.settings.real_time) {
            Ok(post) => {
                self.woke += 1;
                self.whereabouts.set(Some(duty.group.clone()));
                let attention = &self.groups[group];
                let silent = attention.standing().seen.then(|| silent(attention));
                self.awake = Some(Awake { group, post, silent, publishes: false });
            }
            Err(error) => {
                say(&Report::Ended { group: duty.group.clone(), how: error.to_string() });
                self.not_before = Instant::now() + START_AGAIN_AFTER;
            }
        }
    }
}

/// Cycles since the last turn of the station that failed first.
fn silent(attention: &Attention) -> u32 {
    attention.failed().map(|station| attention.silent(station)).max().unwrap_or(0)
}
