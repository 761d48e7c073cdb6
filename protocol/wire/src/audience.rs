//! Receivers of each kind of frame: whoever needs it, and no other member.
//!
//! | topic | frames | received by |
//! |---|---|---|
//! | cycle | Sync, Join, turns of understudies, turns that relay samples | all stations and remote I/Os |
//! | cycle | Transfer | the station that asked, where the link can choose |
//! | turn | other turns of controller i | all remote I/Os (equation (12) needs every other output), the understudies, the next two controllers |
//! | sample | samples of remote I/O i | controller i, the understudies, the next controller, the remote I/Os of programs that read a signal of i |
//! | field | sensors of plant i | remote I/O i, and the plants that it feeds or that follow it |
//! | actuation | outputs of remote I/O i | plant i |
//! | pair | what one of two remote I/Os of a program reports | the other one |
//!
//! A twin receives all that the remote I/O of its program receives, and what it sends goes to the same members; each of the two receives the
//! samples of the other one.
//!
//! So what a controller receives does not grow with the number of controllers. "Next" goes around: the first controller follows the last.
//!
//! * A controller waits for its predecessor's turn, and for the one before where the predecessor is flagged; where both are flagged it publishes
//!   in its own slot. Which other stations published it learns from the understudies' turns, and from those of its predecessors.
//! * With turns in parallel it does not wait while it receives an understudy, whose turn says who published.
//! * The next controller has a sample that the understudy and controller i both lack, and relays it to all.

use crate::frame::{Body, Frame};
use crate::identifier::{Member, StationId};
use crate::set::{ProgramSet, StationSet};

/// Distance from the port of a member's address to the TCP port of its frames over Zenoh, because operators use the TCP
/// port of the address.
pub const ZENOH_PORT_OFFSET: u16 = 8192;

/// Controllers after a controller that receive its turns.
const FOLLOWERS: usize = 2;

/// Topic of a frame: members that receive frames of one sender on one topic receive all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// What all members of the cycle need.
    Cycle,
    /// Turns of controllers.
    Turn,
    /// Samples of remote I/Os.
    Sample,
    /// Sensors of a plant.
    Field,
    /// Outputs that a remote I/O drives.
    Actuation,
    /// What one of two remote I/Os of a program reports to the other one.
    Pair,
}

impl Topic {
    /// All topics; the place of each is `topic as usize`.
    pub const ALL: [Self; 6] =
        [Self::Cycle, Self::Turn, Self::Sample, Self::Field, Self::Actuation, Self::Pair];
}

/// The receivers of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Audience {
    /// Stations.
    pub stations: StationSet,
    /// Remote I/Os, by their programs.
    pub remote_ios: ProgramSet,
    /// Plants, by their programs.
    pub plants: ProgramSet,
    /// Twins, by their programs.
    pub twins: ProgramSet,
}

impl Audience {
    /// Whether `member` is one of them.
    pub fn contains(&self, member: Member) -> bool {
        match member {
            Member::Station(station) => self.stations.contains(station),
            Member::RemoteIo(program) => self.remote_ios.contains(program),
            Member::Plant(program) => self.plants.contains(program),
            Member::Twin(program) => self.twins.contains(program),
        }
    }

    /// One member alone.
    pub fn only(member: Member) -> Self {
        let mut audience = Self::default();
        match member {
            Member::Station(station) => audience.stations.insert(station),
            Member::RemoteIo(program) => audience.remote_ios.insert(program),
            Member::Plant(program) => audience.plants.insert(program),
            Member::Twin(program) => audience.twins.insert(program),
        }
        audience
    }

    /// The receivers in either.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            stations: self.stations.or(other.stations),
            remote_ios: self.remote_ios.or(other.remote_ios),
            plants: self.plants.or(other.plants),
            twins: self.twins.or(other.twins),
        }
    }

    /// The receivers that are not in `other`.
    #[must_use]
    pub fn without(self, other: Self) -> Self {
        Self {
            stations: self.stations.without(other.stations),
            remote_ios: self.remote_ios.without(other.remote_ios),
            plants: self.plants.without(other.plants),
            twins: self.twins.without(other.twins),
        }
    }

    /// The receivers.
    pub fn members(self) -> impl Iterator<Item = Member> {
        let stations = self.stations.iter().map(Member::Station);
        let remote_ios = self.remote_ios.iter().map(Member::RemoteIo);
        let plants = self.plants.iter().map(Member::Plant);
        stations.chain(remote_ios).chain(plants).chain(self.twins.iter().map(Member::Twin))
    }

    /// Whether nobody receives it.
    pub fn is_empty(&self) -> bool {
        self.stations.is_empty()
            && self.remote_ios.is_empty()
            && self.plants.is_empty()
            && self.twins.is_empty()
    }
}

/// The members of a cluster, as far as they decide who receives what.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Roster {
    controllers: usize,
    stations: usize,
    neighbours: Vec<(Member, Member)>,
    twins: ProgramSet,
}

impl Roster {
    /// A cluster of `controllers`, each with a remote I/O and a plant, among `stations`. A pair (i, j) in `neighbours` means that plant or
    /// remote I/O j also receives from plant or remote I/O i.
    pub fn new(controllers: usize, stations: usize, neighbours: Vec<(Member, Member)>) -> Self {
        Self { controllers, stations, neighbours, twins: ProgramSet::EMPTY }
    }

    /// The same with a second remote I/O for each of these programs.
    #[must_use]
    pub fn with_twins(self, twins: ProgramSet) -> Self {
        Self { twins, ..self }
    }

    /// Whether a member is an understudy.
    pub fn is_understudy(&self, member: Member) -> bool {
        matches!(member, Member::Station(station) if (self.controllers..self.stations).contains(&station.index()))
    }

    /// Topic of a frame.
    pub fn topic(&self, frame: &Frame) -> Topic {
        match (&frame.body, frame.header.sender) {
            (Body::Turn(turn), Member::Station(station)) => {
                let is_understudy = self.is_understudy(Member::Station(station));
                if !is_understudy && turn.relayed.is_empty() { Topic::Turn } else { Topic::Cycle }
            }
            (Body::Sync | Body::Turn(_) | Body::Join(_) | Body::Transfer(_), _) => Topic::Cycle,
            (Body::Sample(_), _) => Topic::Sample,
            (Body::Field(_), _) => Topic::Field,
            (Body::Actuation(_), _) => Topic::Actuation,
            (Body::Pair(_), _) => Topic::Pair,
        }
    }

    /// Members that receive what `sender` sends on `topic`.
    pub fn audience(&self, topic: Topic, sender: Member) -> Audience {
        let programs = ProgramSet::first(self.controllers);
        let stations = StationSet::first(self.stations);
        let understudies = stations.without(StationSet::first(self.controllers));
        let pair = sender.sampled_program();
        // What both remote I/Os of a program send goes to the same members.
        let role = pair.map_or(sender, Member::RemoteIo);
        let mut audience = match (topic, role) {
            (Topic::Cycle, Member::Station(_)) => {
                Audience { stations, remote_ios: programs, ..Audience::default() }
            }
            (Topic::Turn, Member::Station(station)) if station.index() < self.controllers => {
                Audience {
                    stations: understudies.or(self.following(station.index(), FOLLOWERS)),
                    remote_ios: programs,
                    ..Audience::default()
                }
            }
            (Topic::Sample, Member::RemoteIo(program)) => Audience {
                stations: understudies
                    .or(StationSet::only(program.controller()))
                    .or(self.following(program.index(), 1)),
                remote_ios: self.neighbours_of(role),
                ..Audience::default()
            },
            (Topic::Field, Member::Plant(program)) => Audience {
                remote_ios: ProgramSet::only(program),
                plants: self.neighbours_of(sender),
                ..Audience::default()
            },
            (Topic::Actuation, Member::RemoteIo(program)) => {
                Audience { plants: ProgramSet::only(program), ..Audience::default() }
            }
            _ => Audience::default(),
        };
        audience.twins = audience.remote_ios.and(self.twins);
        if let (Some(program), Topic::Sample | Topic::Pair) = (pair, topic)
            && self.twins.contains(program)
        {
            audience.remote_ios.insert(program);
            audience.twins.insert(program);
        }
        match sender {
            Member::Station(station) => audience.stations.remove(station),
            Member::RemoteIo(program) => audience.remote_ios.remove(program),
            Member::Plant(program) => audience.plants.remove(program),
            Member::Twin(program) => audience.twins.remove(program),
        }
        audience
    }

    /// Whether `receiver` receives anything from `sender`.
    pub fn is_received(&self, sender: Member, receiver: Member) -> bool {
        let mut topics = Topic::ALL.into_iter();
        topics.any(|topic| self.audience(topic, sender).contains(receiver))
    }

    fn following(&self, controller: usize, count: usize) -> StationSet {
        let next = (1..=count).map(|by| (controller + by) % self.controllers.max(1));
        next.map(|place| StationId(place as u8)).collect()
    }

    /// Remote I/Os for a remote I/O, plants for a plant.
    fn neighbours_of(&self, sender: Member) -> ProgramSet {
        let pairs = self.neighbours.iter();
        let receivers = pairs.filter(|(from, _)| *from == sender);
        receivers
            .filter_map(|(_, to)| match (sender, *to) {
                (Member::RemoteIo(_), Member::RemoteIo(program))
                | (Member::Plant(_), Member::Plant(program)) => Some(program),
                _ => None,
            })
            .collect::<ProgramSet>()
            .and(ProgramSet::first(self.controllers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identifier::ProgramId;

    fn received(roster: &Roster, receiver: Member) -> usize {
        let stations = (0..roster.stations).map(|rank| Member::Station(StationId(rank as u8)));
        let programs = (0..roster.controllers).map(|place| ProgramId(place as u8));
        let senders = stations.chain(programs.map(Member::RemoteIo));
        let topics = [Topic::Turn, Topic::Sample];
        let heard = |sender| {
            let audience = |topic| roster.audience(topic, sender).contains(receiver);
            topics.into_iter().filter(|topic| audience(*topic)).count()
        };
        senders.map(heard).sum()
    }

    /// Turns and samples that a controller receives do not grow with N; a remote I/O receives N turns, an understudy N of each.
    #[test]
    fn what_a_controller_receives_does_not_grow() {
        for controllers in 3..=63 {
            let roster = Roster::new(controllers, controllers + 1, Vec::new());
            for place in 0..controllers as u8 {
                assert_eq!(received(&roster, Member::Station(StationId(place))), 4);
                let remote_io = Member::RemoteIo(ProgramId(place));
                assert_eq!(received(&roster, remote_io), controllers);
            }
            let understudy = Member::Station(StationId(controllers as u8));
            assert_eq!(received(&roster, understudy), 2 * controllers);
        }
    }

    /// No member receives its own frames; each controller and each understudy receives the samples that it steps with.
    #[test]
    fn those_who_step_a_program_receive_its_samples() {
        for controllers in 1..=8_u8 {
            for understudies in 0..=2 {
                let stations = controllers + understudies;
                let roster = Roster::new(controllers.into(), stations.into(), Vec::new());
                for program in 0..controllers {
                    let sender = Member::RemoteIo(ProgramId(program));
                    let audience = roster.audience(Topic::Sample, sender);
                    let understudies = controllers..stations;
                    let mut stepping = understudies.chain([program]);
                    assert!(stepping.all(|rank| audience.stations.contains(StationId(rank))));
                    assert!(audience.remote_ios.is_empty());
                    let witness = StationId((program + 1) % controllers);
                    assert!(audience.stations.contains(witness));
                }
                for rank in 0..stations {
                    let own = Member::Station(StationId(rank));
                    assert!(!roster.is_received(own, own));
                }
            }
        }
    }

    /// A twin receives what the remote I/O of its program receives, and the two receive each other.
    #[test]
    fn a_twin_receives_what_its_remote_io_receives() {
        let [first, second] = [ProgramId(0), ProgramId(1)];
        let pairs = vec![(Member::RemoteIo(second), Member::RemoteIo(first))];
        let roster = Roster::new(2, 3, pairs).with_twins(ProgramSet::only(first));
        let (own, twin) = (Member::RemoteIo(first), Member::Twin(first));
        let senders = [
            Member::Station(StationId(0)),
            Member::Station(StationId(1)),
            Member::Station(StationId(2)),
            Member::RemoteIo(second),
            Member::Plant(first),
        ];
        for (sender, topic) in
            senders.into_iter().flat_map(|it| Topic::ALL.map(|topic| (it, topic)))
        {
            let audience = roster.audience(topic, sender);
            assert_eq!(audience.contains(own), audience.contains(twin), "{sender:?} {topic:?}");
            assert!(audience.twins.without(ProgramSet::only(first)).is_empty());
        }
        for topic in Topic::ALL {
            let (ours, theirs) = (roster.audience(topic, own), roster.audience(topic, twin));
            let receive_each_other = matches!(topic, Topic::Sample | Topic::Pair);
            assert_eq!(ours.contains(twin), receive_each_other, "{topic:?}");
            assert_eq!(theirs.contains(own), receive_each_other, "{topic:?}");
            assert_eq!((ours.stations, ours.plants), (theirs.stations, theirs.plants), "{topic:?}");
            assert!(!ours.contains(own) && !theirs.contains(twin));
        }
        assert!(!roster.is_received(Member::RemoteIo(second), Member::Twin(second)));
    }

    #[test]
    fn neighbours_receive_what_they_read() {
        let [first, second] = [ProgramId(0), ProgramId(1)];
        let pairs = vec![
            (Member::Plant(first), Member::Plant(second)),
            (Member::RemoteIo(second), Member::RemoteIo(first)),
        ];
        let roster = Roster::new(2, 3, pairs);
        let field = roster.audience(Topic::Field, Member::Plant(first));
        assert_eq!(field.remote_ios, ProgramSet::only(first));
        assert_eq!(field.plants, ProgramSet::only(second));
        let sample = roster.audience(Topic::Sample, Member::RemoteIo(second));
        assert_eq!(sample.remote_ios, ProgramSet::only(first));
        let drives = roster.audience(Topic::Actuation, Member::RemoteIo(first));
        assert_eq!(drives.plants, ProgramSet::only(first));
        assert!(drives.stations.is_empty() && drives.remote_ios.is_empty());
    }
}
