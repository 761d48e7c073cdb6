//! The way of every frame from its sender to all who are concerned: lost, late, twice, changed, cut off, or said again.
//!
//! A frame that was changed on its way travels as its bytes, through [`encode`] and [`decode`], so that it is the very
//! checksum that refuses it. What flips before a checksum is made, or after it was read, arrives: that is a value fault.

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use smallvec::SmallVec;
use understudy_wire::{
    Audience, Body, Frame, Image, Member, ProgramSet, Roster, StationId, StationSet, Time, Via,
    decode, encode,
};

use crate::fault::Action;
use crate::network::{Disturbance, Network};
use crate::queue::{Delivery, Queue};
use crate::stranger::forged;

/// Frames of each member that can be said again, at most; older ones are forgotten. The last one is always remembered.
const REMEMBERED: usize = 1024;

/// All links of a cluster.
#[derive(Debug, Clone)]
pub(crate) struct Links {
    usual: Network,
    disturbance: Option<Disturbance>,
    /// What frames go over now.
    network: Network,
    random: Pcg64Mcg,
    queue: Queue,
    stations: StationSet,
    remote_ios: ProgramSet,
    roster: Roster,
    /// By place of the sender.
    senders: Vec<Sender>,
    /// By rank: what flips in the next samples that a station takes in.
    intakes: Vec<Flips>,
    /// By place: how much later a member hears.
    late: Vec<Duration>,
    anybody_late: bool,
    /// Over how many networks each frame is sent.
    networks: &'static [Via],
    /// Programs whose two remote I/Os a direct link joins.
    linked: ProgramSet,
    /// By place: the paths that a member is unplugged from.
    unplugged: Vec<[bool; Via::ALL.len()]>,
    remembers: bool,
    refused: u64,
    metered: Option<Metered>,
}

/// What is sent, counted for each receiver, whether it arrives or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Metered {
    /// Frames.
    pub frames: u64,
    /// Their encoded bytes.
    pub bytes: u64,
}

#[derive(Debug, Clone, Default)]
struct Sender {
    /// Who does not hear it.
    deaf: Audience,
    /// Who hears it later, by place, and by how much.
    delays: Vec<(usize, Duration)>,
    corrupt: u16,
    samples: Flips,
    words: Flips,
    /// Frames that it has sent.
    frames: u64,
    sent: VecDeque<Arc<Frame>>,
}

/// One bit, in so many frames more.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
struct Flips {
    bit: u16,
    frames: u16,
}

impl Flips {
    fn flip(&mut self, image: &mut Image) {
        if self.frames == 0 || image.width() == 0 {
            return;
        }
        self.frames -= 1;
        let bit = usize::from(self.bit) % image.width();
        image.set(bit, !image.get(bit));
    }
}

impl Links {
    /// Links of stations and remote I/Os, by their numbers, over two networks and over the direct links of these programs where they have them.
    pub(crate) fn new(
        (stations, remote_ios): (usize, usize),
        (roster, has_two_networks, linked): (Roster, bool, ProgramSet),
        network: Network,
        seed: u64,
    ) -> Self {
        Self {
            roster,
            usual: network,
            disturbance: None,
            network,
            random: Pcg64Mcg::seed_from_u64(seed),
            queue: Queue::default(),
            stations: StationSet::first(stations),
            remote_ios: ProgramSet::first(remote_ios),
            senders: vec![Sender::default(); stations + 2 * remote_ios],
            intakes: vec![Flips::default(); stations],
            late: vec![Duration::ZERO; stations + 2 * remote_ios],
            anybody_late: false,
            networks: if has_two_networks { &Via::NETWORKS } else { &[Via::First] },
            linked,
            unplugged: vec![[false; Via::ALL.len()]; stations + 2 * remote_ios],
            remembers: false,
            refused: 0,
            metered: None,
        }
    }

    /// Frames that a member has sent so far; none for one that is not of the cluster.
    pub(crate) fn sent(&self, member: Member) -> u64 {
        self.place(member).map_or(0, |place| self.senders[place].frames)
    }

    /// Whether frames of one member reach another one, and on time.
    pub(crate) fn reaches(&self, from: Member, to: Member) -> bool {
        let (Some(sender), Some(receiver)) = (self.place(from), self.place(to)) else {
            return false;
        };
        let delays = &self.senders[sender].delays;
        let late = delays.iter().any(|(place, _)| *place == receiver);
        let slow = |place: usize| !self.late[place].is_zero();
        let is_joined =
            self.joins((from, sender), (to, receiver)).any(|via| via == Via::Link || !late);
        is_joined && !slow(sender) && !slow(receiver)
    }

    /// The paths that carry frames from one member to another one, each with its place.
    fn joins(
        &self,
        (from, sender): (Member, usize),
        (to, receiver): (Member, usize),
    ) -> impl Iterator<Item = Via> + use<> {
        let is_deaf = self.senders[sender].deaf.contains(to);
        let networks = self.networks.iter().copied().filter(move |_| !is_deaf);
        let link = self.is_linked(from, to).then_some(Via::Link);
        let (sender, receiver) = (self.unplugged[sender], self.unplugged[receiver]);
        networks.chain(link).filter(move |via| !sender[via.index()] && !receiver[via.index()])
    }

    /// Whether a direct link joins two members.
    fn is_linked(&self, from: Member, to: Member) -> bool {
        let is_linked = from.sampled_program().is_some_and(|program| self.linked.contains(program));
        is_linked && from.partner() == Some(to)
    }

    /// Counts what is sent, from here on.
    pub(crate) fn meter(&mut self) {
        self.metered = Some(Metered::default());
    }

    pub(crate) fn metered(&self) -> Metered {
        self.metered.unwrap_or_default()
    }

    /// Frames that were changed on their way or forged, and refused for it.
    pub(crate) fn refused(&self) -> u64 {
        self.refused
    }

    pub(crate) fn next_at(&self) -> Option<Time> {
        self.queue.next_at()
    }

    pub(crate) fn pop(&mut self) -> Option<Delivery> {
        self.queue.pop()
    }

    /// A fault of this kind is to come: frames have to be remembered for it from now on.
    pub(crate) fn expect(&mut self, action: Action) {
        self.remembers |= matches!(action, Action::Replay { age } if age > 1);
    }

    /// From here on all chance comes from `seed`.
    pub(crate) fn reseed(&mut self, seed: u64) {
        self.random = Pcg64Mcg::seed_from_u64(seed);
    }

    /// The network is another one while `disturbance` lasts.
    pub(crate) fn alter(&mut self, disturbance: Disturbance) {
        self.disturbance = Some(disturbance);
    }

    /// Does what concerns the links of `member`.
    pub(crate) fn disturb(&mut self, now: Time, member: Member, action: Action) {
        let Some(place) = self.place(member) else {
            return;
        };
        match action {
            Action::Cut { to } | Action::Heal { to } => {
                let sender = &mut self.senders[place];
                match action {
                    Action::Cut { .. } => sender.deaf = sender.deaf.or(Audience::only(to)),
                    _ => sender.deaf = sender.deaf.without(Audience::only(to)),
                }
            }
            Action::Unplug { network } => self.unplugged[place][network.index()] = true,
            Action::Plug { network } => self.unplugged[place][network.index()] = false,
            Action::Delay { to, by } => {
                let Some(to) = self.place(to) else {
                    return;
                };
                let delays = &mut self.senders[place].delays;
                delays.retain(|&(receiver, _)| receiver != to);
                if !by.is_zero() {
                    delays.push((to, by));
                    delays.sort_unstable();
                }
            }
            Action::Corrupt { frames } => self.senders[place].corrupt = frames,
            Action::FlipSample { bit, frames } => {
                let flips = Flips { bit, frames };
                match member {
                    Member::Station(station) => self.intakes[station.index()] = flips,
                    _ => self.senders[place].samples = flips,
                }
            }
            Action::FlipWord { bit, frames } => self.senders[place].words = Flips { bit, frames },
            Action::Slow { by } => {
                self.late[place] = by;
                self.anybody_late = self.late.iter().any(|late| !late.is_zero());
            }
            Action::Forge => {
                let Some(last) = self.senders[place].sent.back() else {
                    return;
                };
                match forged(last) {
                    Some(frame) => self.carry(now, place, frame),
                    None => self.refused += 1,
                }
            }
            Action::Replay { age } => {
                let sent = &self.senders[place].sent;
                let nth = sent.len().checked_sub(usize::from(age.max(1)));
                if let Some(frame) = nth.and_then(|nth| sent.get(nth)).cloned() {
                    self.carry(now, place, frame);
                }
            }
            _ => {}
        }
    }

    /// Sends a frame to all whom its kind concerns; `cycle` is the scenario's.
    pub(crate) fn send(&mut self, now: Time, cycle: Option<u64>, frame: Arc<Frame>) {
        self.network = match &self.disturbance {
            Some(disturbance) if disturbance.holds(cycle) => disturbance.network,
            _ => self.usual,
        };
        let Some(place) = self.place(frame.header.sender) else {
            return;
        };
        let Some(frame) = self.leave(place, frame) else {
            return;
        };
        let sender = &mut self.senders[place];
        sender.frames += 1;
        if sender.sent.len() == if self.remembers { REMEMBERED } else { 1 } {
            sender.sent.pop_front();
        }
        sender.sent.push_back(Arc::clone(&frame));
        self.carry(now, place, frame);
    }

    /// What a station takes in where this frame comes to it, if that is another one.
    pub(crate) fn take_in(&mut self, station: StationId, frame: &Frame) -> Option<Arc<Frame>> {
        let flips = &mut self.intakes[station.index()];
        let flips_it = flips.frames > 0 && matches!(frame.body, Body::Sample(_));
        flips_it.then(|| flipped(frame, flips))
    }

    fn place(&self, member: Member) -> Option<usize> {
        match member {
            Member::Station(station) => {
                let is_there = self.stations.contains(station);
                is_there.then_some(station.index())
            }
            Member::RemoteIo(program) => {
                let is_there = self.remote_ios.contains(program);
                is_there.then(|| self.stations.len() + program.index())
            }
            Member::Twin(program) => {
                let is_there = self.remote_ios.contains(program);
                let before = self.stations.len() + self.remote_ios.len();
                is_there.then(|| before + program.index())
            }
            Member::Plant(_) => None,
        }
    }

    /// The frame as it leaves its sender; nothing where every receiver refuses it.
    fn leave(&mut self, place: usize, frame: Arc<Frame>) -> Option<Arc<Frame>> {
        let sender = &mut self.senders[place];
        let frame = match &frame.body {
            Body::Sample(_) if sender.samples.frames > 0 => flipped(&frame, &mut sender.samples),
            Body::Turn(_) if sender.words.frames > 0 => flipped(&frame, &mut sender.words),
            _ => frame,
        };
        if sender.corrupt > 0 {
            sender.corrupt -= 1;
            return self.corrupted(&frame);
        }
        Some(frame)
    }

    /// Up to four flipped bits of its bytes. Nothing where the receiver's checksum refuses them.
    fn corrupted(&mut self, frame: &Frame) -> Option<Arc<Frame>> {
        let mut bytes = Vec::new();
        if encode(frame, &mut bytes).is_ok() {
            for _ in 0..self.random.random_range(1..=4) {
                let place = self.random.random_range(0..bytes.len());
                bytes[place] ^= 1 << self.random.random_range(0..8);
            }
        }
        let arrived = decode(&bytes).ok().map(Arc::new);
        self.refused += u64::from(arrived.is_none());
        arrived
    }

    fn carry(&mut self, now: Time, place: usize, frame: Arc<Frame>) {
        let sender = &self.senders[place];
        let topic = self.roster.topic(&frame);
        let audience = self.roster.audience(topic, frame.header.sender);
        let mut to = audience.without(sender.deaf);
        let linked = frame.header.sender.partner().filter(|partner| {
            audience.contains(*partner) && self.is_linked(frame.header.sender, *partner)
        });
        if let Some(partner) = linked {
            // The direct link is no part of the networks.
            to = to.or(Audience::only(partner));
        }
        // Plants are not on the network.
        to.plants = ProgramSet::EMPTY;
        if let Body::Transfer(transfer) = &frame.body {
            let only = to.stations.and(StationSet::only(transfer.to));
            to = Audience { stations: only, ..Audience::default() };
        }
        if let Some(metered) = &mut self.metered {
            let mut bytes = Vec::new();
            // What cannot be encoded is no frame of a member.
            let _ = encode(&frame, &mut bytes);
            let receivers = to.members().count() as u64;
            metered.frames += receivers;
            metered.bytes += receivers * bytes.len() as u64;
        }
        let all_plugged = self.unplugged.iter().all(|unplugged| !unplugged.contains(&true));
        // A late network brings a frame later than a direct link.
        let is_as_fast = linked.is_none() || self.network.latency == Network::default().latency;
        let is_even = self.network.is_even() && self.network.over.is_none() && is_as_fast;
        if is_even && !self.anybody_late && sender.delays.is_empty() && all_plugged {
            let at = now + self.network.latency;
            self.queue.push(at, frame, to);
            return;
        }
        for member in to.members() {
            if let Some(receiver) = self.place(member) {
                self.carry_to(now, (place, receiver), &frame, member);
            }
        }
    }

    fn carry_to(
        &mut self,
        now: Time,
        (sender, receiver): (usize, usize),
        frame: &Arc<Frame>,
        to: Member,
    ) {
        let from = frame.header.sender;
        let delays = self.senders[sender].delays.iter();
        let late = delays.filter(|(to, _)| *to == receiver).map(|(_, by)| *by);
        let late_network = late.sum::<Duration>();
        let mut copies = SmallVec::<[(Time, Arc<Frame>); 4]>::new();
        for via in self.joins((from, sender), (to, receiver)) {
            let network = self.network.at(via);
            let late_network = if via == Via::Link { Duration::ZERO } else { late_network };
            let late = self.late[receiver] + late_network;
            for delay in network.arrivals(&mut self.random) {
                let share = network.corruption;
                let frame = if share > 0.0 && self.random.random::<f64>() < share {
                    self.corrupted(frame)
                } else {
                    Some(Arc::clone(frame))
                };
                copies.extend(frame.map(|frame| (now + delay + late, frame)));
            }
        }
        if self.networks.len() > 1 || self.is_linked(from, to) {
            // The receiver takes the first copy.
            copies.sort_by_key(|(at, _)| *at);
            copies.truncate(1);
        }
        for (at, frame) in copies {
            self.queue.push(at, frame, Audience::only(to));
        }
    }
}

/// Links that hash alike go on alike, as long as the network leaves nothing to chance.
impl Hash for Links {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            usual: _,
            disturbance: _,
            network: _,
            random: _,
            queue,
            stations: _,
            remote_ios: _,
            roster: _,
            senders,
            intakes,
            late,
            anybody_late: _,
            networks: _,
            linked: _,
            unplugged,
            remembers: _,
            refused: _,
            metered: _,
        } = self;
        (queue, intakes, late, unplugged).hash(hasher);
        for sender in senders {
            sender.deaf.hash(hasher);
            (&sender.delays, sender.corrupt, sender.samples, sender.words).hash(hasher);
            sender.sent.hash(hasher);
        }
    }
}

/// The newest sample, or the first word, with a bit flipped.
fn flipped(frame: &Frame, flips: &mut Flips) -> Arc<Frame> {
    let mut changed = frame.clone();
    let image = match &mut changed.body {
        Body::Sample(sample) => sample.history.last_mut().map(|step| &mut step.inputs),
        Body::Turn(turn) => turn.words.first_mut().map(|word| &mut word.sum),
        _ => None,
    };
    if let Some(image) = image {
        flips.flip(image);
    }
    Arc::new(changed)
}
