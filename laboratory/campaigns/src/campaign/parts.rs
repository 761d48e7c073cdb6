//! Remote I/Os and networks of a campaign: each fails after an exponential time of being up, and its repair starts at the failure.
//!
//! A remote I/O without a twin fails the system with its failure, and so does a single network. Of a pair the other one continues: a switchover has
//! succeeded where the twin is the author before the outputs have been held for `hold_cycles`. An author that drives nothing more by itself, as
//! where no station computes its program, has not failed: the stations have. What was drawn for stations is not changed by these
//! parts, since they have a stream of chance of their own.

use rand_distr::{Distribution, Exp1};
use rand_pcg::Pcg64;
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_simulator::Action;
use understudy_wire::{Member, Part, ProgramId, Time, Via};

use super::CampaignPlan;
use super::lives::Order;
use super::seen::Seen;

/// Stream of chance of these parts, apart from that of the stations.
const STREAM: u128 = 1 << 64;

/// Cycles after a switchover or the failure of a network whose missed deadlines are not those of a station.
const UNSETTLED_CYCLES: u64 = 30;

/// Mean cycles between failures of a part, and to repair it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PartTimes {
    /// From being up to the failure.
    pub mtbf_cycles: f64,
    /// From the failure to the restart.
    pub mttr_cycles: f64,
}

/// What became of remote I/Os and networks.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct PartsFound {
    /// Failures of remote I/Os.
    pub remote_ios: u64,
    /// Failures of networks.
    pub networks: u64,
    /// Authors that failed while their twin was up.
    pub switchovers: u64,
    /// Those of them whose twin did not become the author in time.
    pub unmasked: u64,
    /// Longest time from the failure of an author to the first part of its twin as one, in nanoseconds.
    pub longest_ns: u64,
}

impl PartsFound {
    pub(super) fn add(&mut self, other: &Self) {
        self.remote_ios += other.remote_ios;
        self.networks += other.networks;
        self.switchovers += other.switchovers;
        self.unmasked += other.unmasked;
        self.longest_ns = self.longest_ns.max(other.longest_ns);
    }
}

/// The remote I/Os of one program.
#[derive(Debug, Clone)]
struct Place {
    /// The remote I/O and its twin, with whether they are up.
    members: Vec<(Member, bool)>,
    author: Option<Member>,
    /// Since when no one is the author, where one was up then.
    vacant: Option<Vacant>,
    /// For how long outputs may be held.
    patience_ns: u64,
}

/// The time without an author.
#[derive(Debug, Clone, Copy)]
struct Vacant {
    since: Time,
    /// Whether the author has failed; it drives nothing more by itself otherwise.
    by_failure: bool,
}

/// A failure of the system: when, and by what; without a cause its stations have failed.
pub(super) type SystemFailed = (Time, Option<String>);

pub(super) struct Parts<'a> {
    cluster: &'a Cluster,
    plan: &'a CampaignPlan,
    random: Pcg64,
    places: Vec<Place>,
    networks: Vec<bool>,
    unsettled: Option<Time>,
    period_ns: u64,
    orders: Vec<Order>,
    found: PartsFound,
}

impl<'a> Parts<'a> {
    /// All up.
    pub(super) fn new(cluster: &'a Cluster, plan: &'a CampaignPlan, number: u64) -> Self {
        let period_ns = cluster.agreement().schedule.period().as_nanos() as u64;
        let places = (0..).map(ProgramId).zip(cluster.remote_ios()).map(|(program, place)| {
            let twin = place.twin.as_ref().map(|_| Member::Twin(program));
            let members = [Member::RemoteIo(program)].into_iter().chain(twin);
            Place {
                members: members.map(|member| (member, true)).collect(),
                author: Some(Member::RemoteIo(program)),
                vacant: None,
                patience_ns: u64::from(place.fallback.hold_cycles) * period_ns,
            }
        });
        Self {
            cluster,
            plan,
            random: Pcg64::new(u128::from(plan.seed), STREAM | u128::from(number)),
            places: places.collect(),
            networks: vec![true; if cluster.has_two_networks() { 2 } else { 1 }],
            unsettled: None,
            period_ns,
            orders: Vec::new(),
            found: PartsFound::default(),
        }
    }

    /// Everybody is synchronised: from now on they fail. `author` is the remote I/O of a program that drives.
    pub(super) fn begin(&mut self, author: impl Fn(ProgramId) -> Option<Member>) {
        for (program, place) in (0..).map(ProgramId).zip(&mut self.places) {
            place.author = author(program);
        }
        let members: Vec<Member> = self
            .places
            .iter()
            .flat_map(|place| &place.members)
            .map(|(member, _)| *member)
            .collect();
        for member in members {
            self.order(&[member], Action::Crash, self.plan.remote_io, |times| times.mtbf_cycles);
        }
        for network in [Via::First, Via::Second].into_iter().take(self.networks.len()) {
            self.order_network(network, false);
        }
    }

    pub(super) fn take_orders(&mut self) -> Vec<Order> {
        std::mem::take(&mut self.orders)
    }

    pub(super) fn into_found(self) -> PartsFound {
        self.found
    }

    fn order(
        &mut self,
        members: &[Member],
        action: Action,
        times: Option<PartTimes>,
        mean: impl Fn(&PartTimes) -> f64,
    ) {
        let Some(times) = times else {
            return;
        };
        let drawn: f64 = Exp1.sample(&mut self.random);
        let after_cycles = mean(&times) * drawn;
        let orders = members.iter().map(|&member| Order::Do { member, action, after_cycles });
        self.orders.extend(orders);
    }

    /// A network fails for all members at one time, or is repaired for all.
    fn order_network(&mut self, network: Via, is_repaired: bool) {
        let all: Vec<Member> = self.cluster.members().collect();
        if is_repaired {
            self.order(&all, Action::Plug { network }, self.plan.network, |it| it.mttr_cycles);
        } else {
            self.order(&all, Action::Unplug { network }, self.plan.network, |it| it.mtbf_cycles);
        }
    }

    /// Whether a missed deadline now follows from a remote I/O or a network, and not from the failure of a station.
    pub(super) fn explains(&self, now: Time) -> bool {
        let near = UNSETTLED_CYCLES * self.period_ns;
        self.unsettled.is_some_and(|then| now.0.saturating_sub(then.0) <= near)
    }

    /// Answers what was seen at `now`: the failure of the system, if it has failed by these parts.
    pub(super) fn see(&mut self, now: Time, seen: &Seen) -> Option<SystemFailed> {
        if let Some(failed) = self.overdue(now) {
            return Some(failed);
        }
        match *seen {
            Seen::Gone(member) => self.gone(now, member),
            Seen::Back(member) => {
                self.set(member, true);
                self.order(&[member], Action::Crash, self.plan.remote_io, |it| it.mtbf_cycles);
                None
            }
            Seen::Part(member, part) => {
                self.part_changed(now, member, part);
                None
            }
            Seen::Network(via, is_up) => self.network(now, via, is_up),
            _ => None,
        }
    }

    fn place_of(&mut self, member: Member) -> Option<&mut Place> {
        match member {
            Member::RemoteIo(program) | Member::Twin(program) => {
                self.places.get_mut(program.index())
            }
            _ => None,
        }
    }

    fn set(&mut self, member: Member, is_up: bool) {
        let place = self.place_of(member);
        let found = place.and_then(|place| place.members.iter_mut().find(|it| it.0 == member));
        if let Some((_, up)) = found {
            *up = is_up;
        }
    }

    fn gone(&mut self, now: Time, member: Member) -> Option<SystemFailed> {
        self.set(member, false);
        self.found.remote_ios += 1;
        self.unsettled = Some(now);
        let name = self.cluster.member_name(member).unwrap_or_default().to_owned();
        let place = self.place_of(member)?;
        let Some((other, _)) = place.members.iter().find(|(_, is_up)| *is_up).copied() else {
            let is_pair = place.members.len() > 1;
            let cause =
                if is_pair { format!("{name} after its twin") } else { format!("{name} alone") };
            let since = place.vacant.map_or(now, |vacant| vacant.since);
            return Some((since, Some(cause)));
        };
        debug_assert_ne!(other, member);
        if place.author == Some(member) {
            place.author = None;
            place.vacant = Some(Vacant { since: now, by_failure: true });
            self.found.switchovers += 1;
        }
        self.order(&[member], Action::Restart, self.plan.remote_io, |it| it.mttr_cycles);
        None
    }

    fn part_changed(&mut self, now: Time, member: Member, part: Part) {
        let Some(place) = self.place_of(member) else {
            return;
        };
        if part == Part::Author {
            place.author = Some(member);
            let vacant = place.vacant.take();
            let took = vacant.map_or(0, |vacant| now.0.saturating_sub(vacant.since.0));
            self.found.longest_ns = self.found.longest_ns.max(took);
            self.unsettled = Some(now);
        } else if place.author == Some(member) {
            place.author = None;
            place.vacant = Some(Vacant { since: now, by_failure: false });
        }
    }

    /// Outputs that nobody has driven in time.
    fn overdue(&mut self, now: Time) -> Option<SystemFailed> {
        let is_late = |place: &Place, vacant: Vacant| {
            now.0.saturating_sub(vacant.since.0) > place.patience_ns
        };
        let late = (self.places.iter())
            .position(|place| place.vacant.is_some_and(|vacant| is_late(place, vacant)))?;
        let Vacant { since, by_failure } = self.places[late].vacant?;
        self.found.unmasked += u64::from(by_failure);
        let name = &self.cluster.remote_ios()[late].name;
        Some((since, by_failure.then(|| format!("no author of {name}"))))
    }

    fn network(&mut self, now: Time, via: Via, is_up: bool) -> Option<SystemFailed> {
        let state = self.networks.get_mut(via.index())?;
        if *state == is_up {
            // It was said of the first member.
            return None;
        }
        *state = is_up;
        self.unsettled = Some(now);
        if !is_up {
            self.found.networks += 1;
            if !self.networks.contains(&true) {
                let is_pair = self.networks.len() > 1;
                let cause = if is_pair { "both networks" } else { "the network" };
                return Some((now, Some(cause.to_owned())));
            }
        }
        self.order_network(via, !is_up);
        None
    }
}
