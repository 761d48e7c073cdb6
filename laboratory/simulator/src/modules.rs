//! Output modules of two remote I/Os that drive the actuators of one program through diodes, and input modules that fail.
//!
//! A module drives what it was driven with last until its own watchdog runs out. An actuator is on where one of the two modules drives it; shared numbers
//! add up.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use understudy_remote_io::{Settings, SharedOutputs, Wiring};
use understudy_wire::{Image, Member, Share, Time};

/// Periods that outputs may be under way from the author to its follower, at most.
const UNDER_WAY: u32 = 2;

/// What is wrong with the outputs of a remote I/O that is not the author.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrong {
    /// No author has decided them lately.
    NotOfAuthor,
    /// With those of the other one they are more than an author has decided.
    TooMuch,
}

/// The modules of a program; of no importance where its remote I/Os are not both wired to the plant.
#[derive(Debug, Clone, Hash)]
pub(crate) struct Modules {
    period: Duration,
    /// Periods until the watchdog of a module runs out; 0 where there is one module only.
    lasting: u32,
    shared: SharedOutputs,
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
            shared: settings.shared_outputs.clone(),
            driven: [None, None],
            of_author: VecDeque::new(),
            stepped: None,
            stuck: Vec::new(),
        }
    }

    fn are_two(&self) -> bool {
        self.lasting > 0
    }

    /// Takes what the modules of an author drive. What the actuators get.
    pub(crate) fn drive(&mut self, now: Time, member: Member, outputs: &Image) -> Image {
        if !self.are_two() {
            return outputs.clone();
        }
        self.driven[place(member)] = Some((now, outputs.clone()));
        self.stepped = Some(now);
        self.actuators(now, outputs.width())
    }

    /// Takes the outputs that an author has decided to drive. Whether the actuators get more of a shared number than an author has decided lately.
    pub(crate) fn decided(&mut self, now: Time, outputs: &Image) -> bool {
        if !self.are_two() {
            return false;
        }
        // A follower keeps what it has received, and its module keeps that.
        let times = if self.shared.places.is_empty() { 1 } else { 2 };
        let oldest = self.period * (times * self.lasting + UNDER_WAY + times - 1);
        while self.of_author.front().is_some_and(|(at, _)| now.since(*at) > oldest) {
            self.of_author.pop_front();
        }
        self.of_author.push_back((now, outputs.clone()));
        self.is_too_much(&self.actuators(now, outputs.width()))
    }

    fn is_too_much(&self, actuators: &Image) -> bool {
        !self.shared.is_within(actuators, self.of_author.iter().map(|(_, whole)| whole))
    }

    /// Takes outputs of a remote I/O that is not the author. What the actuators get, where no author drives them; and what is wrong with it.
    pub(crate) fn follow(
        &mut self,
        now: Time,
        member: Member,
        outputs: &Image,
    ) -> (Option<Image>, Option<Wrong>) {
        let oldest = self.period * (self.lasting + UNDER_WAY);
        let mut recent = self.of_author.iter().filter(|(at, _)| now.since(*at) <= oldest);
        let is_twin = matches!(member, Member::Twin(_));
        let is_part = |whole: &Image| {
            let mut parts = [Share::Nothing, Share::Half, Share::Whole].into_iter();
            parts.any(|share| self.shared.part(whole, share, is_twin) == *outputs)
        };
        let is_unknown = !outputs.is_zero() && !recent.any(|(_, whole)| is_part(whole));
        self.driven[place(member)] = Some((now, outputs.clone()));
        let actuators = self.actuators(now, outputs.width());
        let wrong = match (is_unknown, self.is_too_much(&actuators)) {
            (true, _) => Some(Wrong::NotOfAuthor),
            (false, true) => Some(Wrong::TooMuch),
            (false, false) => None,
        };
        let is_due = self.stepped.is_none_or(|at| now.since(at) * 4 > self.period * 3);
        if is_due {
            self.stepped = Some(now);
        }
        (is_due.then_some(actuators), wrong)
    }

    fn actuators(&self, now: Time, width: usize) -> Image {
        let lasts = self.period * self.lasting;
        let lasting = self.driven.iter().flatten().filter(|(at, _)| now.since(*at) <= lasts);
        self.shared.sum(width, lasting.map(|(_, outputs)| outputs))
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
