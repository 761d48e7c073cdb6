//! Output modules of two remote I/Os that drive the actuators of one program through diodes, and input modules that fail.
//!
//! A module drives what it was driven with last until its own watchdog runs out. An actuator is on where one of the two modules drives it.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use understudy_remote_io::{Settings, Wiring};
use understudy_wire::{Image, Member, Time};

/// Periods that outputs may be under way from the author to its follower, at most.
const UNDER_WAY: u32 = 2;

/// The modules of a program; of no importance where its remote I/Os are not both wired to the plant.
#[derive(Debug, Clone, Hash)]
pub(crate) struct Modules {
    period: Duration,
    /// Periods until the watchdog of a module runs out; 0 where there is one module only.
    lasting: u32,
    /// What the modules of each of the two were driven with last.
    driven: [Option<(Time, Image)>; 2],
    /// What an author has driven lately.
    of_author: VecDeque<(Time, Image)>,
    stepped: Option<Time>,
    /// Inputs that show a fixed value at one of the two.
    stuck: Vec<(Member, usize, bool)>,
}

impl Modules {
    /// Of the program of a remote I/O.
    pub(crate) fn of(settings: &Settings) -> Self {
        let period = settings.agreement.schedule.period();
        let parallel = settings.pair.filter(|pair| matches!(pair.wiring, Wiring::Parallel { .. }));
        Self {
            period,
            lasting: parallel.map_or(0, |pair| pair.lasting()),
            driven: [None, None],
            of_author: VecDeque::new(),
            stepped: None,
            stuck: Vec::new(),
        }
    }

    fn are_two(&self) -> bool {
        self.lasting > 0
    }

    /// Takes outputs of an author. What the actuators get.
    pub(crate) fn drive(&mut self, now: Time, member: Member, outputs: &Image) -> Image {
        if !self.are_two() {
            return outputs.clone();
        }
        let oldest = self.period * (self.lasting + UNDER_WAY);
        while self.of_author.front().is_some_and(|(at, _)| now.since(*at) > oldest) {
            self.of_author.pop_front();
        }
        self.of_author.push_back((now, outputs.clone()));
        self.driven[place(member)] = Some((now, outputs.clone()));
        self.stepped = Some(now);
        self.actuators(now, outputs.width())
    }

    /// Takes outputs of a remote I/O that is not the author. What the actuators get, where no author drives them; and whether no author
    /// has driven these outputs lately.
    pub(crate) fn follow(
        &mut self,
        now: Time,
        member: Member,
        outputs: &Image,
    ) -> (Option<Image>, bool) {
        let oldest = self.period * (self.lasting + UNDER_WAY);
        let mut recent = self.of_author.iter().filter(|(at, _)| now.since(*at) <= oldest);
        let is_wrong = !outputs.is_zero() && !recent.any(|(_, driven)| driven == outputs);
        self.driven[place(member)] = Some((now, outputs.clone()));
        let is_due = self.stepped.is_none_or(|at| now.since(at) * 4 > self.period * 3);
        if is_due {
            self.stepped = Some(now);
        }
        (is_due.then(|| self.actuators(now, outputs.width())), is_wrong)
    }

    fn actuators(&self, now: Time, width: usize) -> Image {
        let lasts = self.period * self.lasting;
        let lasting = self.driven.iter().flatten().filter(|(at, _)| now.since(*at) <= lasts);
        let mut actuators = Image::zero(width);
        lasting.for_each(|(_, outputs)| actuators.unite(outputs));
        actuators
    }

    /// An input of the modules of one remote I/O shows this value from now on; the true one again with `None`.
    pub(crate) fn stick(&mut self, member: Member, input: usize, value: Option<bool>) {
        self.stuck.retain(|(of, place, _)| (*of, *place) != (member, input));
        self.stuck.extend(value.map(|value| (member, input, value)));
    }

    /// What the modules of a remote I/O show.
    pub(crate) fn shown<'a>(&self, member: Member, sensors: &'a Image) -> Cow<'a, Image> {
        let mut shown = Cow::Borrowed(sensors);
        for (_, place, value) in self.stuck.iter().filter(|(of, ..)| *of == member) {
            shown.to_mut().set(*place, *value);
        }
        shown
    }
}

fn place(member: Member) -> usize {
    usize::from(matches!(member, Member::Twin(_)))
}
