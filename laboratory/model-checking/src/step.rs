//! What may be done between two slots, how often, and the faults of the simulator that it is.

use std::time::Duration;

use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, Via};

/// Where slots begin, as shares of T. A frame that is sent in a slot arrives in the next one.
pub(crate) const SLOTS: [f64; 8] = [0.025, 0.075, 0.125, 0.175, 0.225, 0.675, 0.725, 0.975];

/// How late a frame may be, as shares of T: others overtake it; its cycle is over.
pub(crate) const LATE_PER_MILLE: [u32; 2] = [150, 1000];

/// How much may be done in one run, at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Budget {
    /// Links, or senders towards everybody, that lose all frames of one slot.
    pub losses: u8,
    /// Links that are late with all frames of one slot.
    pub delays: u8,
    /// Senders of which the last frame of a slot arrives once more, at everybody.
    pub duplicates: u8,
    /// Members that crash; each may start again at any later slot.
    pub crashes: u8,
    /// Members that stand still; each may go on at any later slot.
    pub stops: u8,
    /// Cuts of the network into two parts; each may be healed at any later slot.
    pub cuts: u8,
    /// Direct links that are pulled; each may be plugged in again at any later slot.
    pub links: u8,
    /// All of them together.
    pub total: u8,
    /// Cycles in which anything may be done.
    pub cycles: u64,
}

/// One step of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Step {
    /// What a member sends in this slot does not reach one other.
    Lose {
        /// Who sends.
        from: Member,
        /// Who does not hear it.
        to: Member,
    },
    /// What a member sends in this slot reaches nobody.
    Mute {
        /// Who sends.
        from: Member,
    },
    /// What a member sends in this slot reaches one other late.
    Late {
        /// Who sends.
        from: Member,
        /// Who hears it late.
        to: Member,
        /// By so many thousandths of T.
        per_mille: u32,
    },
    /// The last frame of a member comes once more, to everybody.
    Twice {
        /// Whose.
        from: Member,
    },
    /// A member is gone, with all that it knew.
    Crash(Member),
    /// It starts again.
    Restart(Member),
    /// A member stands still.
    Stop(Member),
    /// It goes on.
    Continue(Member),
    /// The network is cut into two parts, which do not receive each other.
    Cut {
        /// The members of one part, as bits in the order of the model.
        side: u32,
    },
    /// The network is one again.
    Heal {
        /// The part that was cut off.
        side: u32,
    },
    /// The direct link of a remote I/O is pulled.
    Pull(Member),
    /// It is plugged in again.
    Plug(Member),
    /// The next slot begins.
    Wait,
}

/// A place between two slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Place {
    pub(crate) cycle: u64,
    pub(crate) slot: usize,
}

impl Place {
    pub(crate) fn phase(self) -> f64 {
        SLOTS[self.slot]
    }

    /// Number of slots since the first slot of cycle 0.
    pub(crate) fn number(self) -> u64 {
        self.cycle * SLOTS.len() as u64 + self.slot as u64
    }

    pub(crate) fn next(self) -> Self {
        let slot = (self.slot + 1) % SLOTS.len();
        let cycle = self.cycle + u64::from(slot == 0);
        Self { cycle, slot }
    }
}

/// The pairs of members that are on different sides of a cut, in each direction.
fn separated(side: u32, members: &[Member]) -> impl Iterator<Item = (Member, Member)> + '_ {
    let is_in = move |place: usize| side >> place & 1 == 1;
    let pairs = members
        .iter()
        .enumerate()
        .flat_map(move |from| members.iter().enumerate().map(move |to| (from, to)));
    let apart = pairs.filter(move |((from, _), (to, _))| is_in(*from) != is_in(*to));
    apart.map(|((_, from), (_, to))| (*from, *to))
}

/// What has failed and has not come back.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Failed {
    /// Who is down, and whether it has crashed.
    pub(crate) down: Vec<(Member, bool)>,
    /// One part of the network, where it is cut.
    pub(crate) cut: Option<u32>,
    /// Remote I/Os whose direct link is pulled.
    pub(crate) pulled: Vec<Member>,
}

impl Failed {
    pub(crate) fn new(down: Vec<(Member, bool)>) -> Self {
        Self { down, cut: None, pulled: Vec::new() }
    }

    pub(crate) fn note(&mut self, step: Step) {
        match step {
            Step::Crash(member) | Step::Stop(member) => {
                self.down.push((member, matches!(step, Step::Crash(_))));
            }
            Step::Restart(member) | Step::Continue(member) => {
                self.down.retain(|&(other, _)| other != member);
            }
            Step::Cut { side } => self.cut = Some(side),
            Step::Heal { .. } => self.cut = None,
            Step::Pull(member) => self.pulled.push(member),
            Step::Plug(member) => self.pulled.retain(|&other| other != member),
            _ => {}
        }
    }

    /// The steps that bring each of them back, of those that pass `is_wanted`.
    pub(crate) fn revivals(
        &self,
        is_wanted: impl Fn(Member) -> bool,
    ) -> impl Iterator<Item = Step> {
        let down = self.down.iter().filter(move |(member, _)| is_wanted(*member));
        let back = down.map(|&(member, crashed)| match crashed {
            true => Step::Restart(member),
            false => Step::Continue(member),
        });
        let healed = self.cut.map(|side| Step::Heal { side });
        back.chain(healed).chain(self.pulled.iter().copied().map(Step::Plug))
    }
}

/// The faults that a step at `place` is; nothing for waiting. `members` are all of the cluster.
pub(crate) fn faults(step: Step, place: Place, members: &[Member], period: Duration) -> Vec<Fault> {
    let fault = |place: Place, member, action| Fault {
        at_cycle: place.cycle,
        phase: place.phase(),
        member,
        action,
    };
    let for_a_slot = |member, during, after| {
        vec![fault(place, member, during), fault(place.next(), member, after)]
    };
    match step {
        Step::Lose { from, to } => for_a_slot(from, Action::Cut { to }, Action::Heal { to }),
        Step::Mute { from } => {
            let others = members.iter().filter(|&&other| other != from);
            others
                .flat_map(|&to| for_a_slot(from, Action::Cut { to }, Action::Heal { to }))
                .collect()
        }
        Step::Late { from, to, per_mille } => {
            let by = period * per_mille / 1000;
            let on_time = Duration::ZERO;
            let late = Action::Delay { to, by };
            for_a_slot(from, late, Action::Delay { to, by: on_time })
        }
        Step::Twice { from } => vec![fault(place, from, Action::Replay { age: 1 })],
        Step::Crash(member) => vec![fault(place, member, Action::Crash)],
        Step::Restart(member) => vec![fault(place, member, Action::Restart)],
        Step::Stop(member) => vec![fault(place, member, Action::Stop)],
        Step::Continue(member) => vec![fault(place, member, Action::Continue)],
        Step::Cut { side } | Step::Heal { side } => {
            let is_cut = matches!(step, Step::Cut { .. });
            separated(side, members)
                .map(|(from, to)| {
                    let action = if is_cut { Action::Cut { to } } else { Action::Heal { to } };
                    fault(place, from, action)
                })
                .collect()
        }
        Step::Pull(member) => vec![fault(place, member, Action::Unplug { network: Via::Link })],
        Step::Plug(member) => vec![fault(place, member, Action::Plug { network: Via::Link })],
        Step::Wait => Vec::new(),
    }
}
