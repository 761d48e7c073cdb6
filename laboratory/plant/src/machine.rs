//! A plant as a member.
//!
//! ```text
//!            ┌── each period: send the field ─┐
//!   start ──►│ not driven yet                 │
//!            └──────────┬─────────────────────┘
//!             actuation │ step
//!                       ▼
//!            ┌ driven ◄── actuation of a new moment: step ──┐
//!            │   │ none for 1.5 periods                      │
//!            │   ▼                                           │
//!            │ alone: a step each period, last outputs ──────┤
//!            │   │ none for `watchdog_cycles` periods        │
//!            │   ▼                                           │
//!            └ watchdog: a step each period, fail-safe ──────┘
//! ```
//!
//! Invariant: an actuation steps the plant once, however often its frame arrives, and an older one never does, except
//! where the watchdog has run out or the epoch of the last one bound no member. At most one step for each wake-up: time
//! of a host stall is lost.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Endpoint, Input, Machine, OnlineChange, Output, SharedOutputs};
use understudy_wire::{
    Body, Configurations, Field, Frame, Header, Image, Member, Moment, ProgramId, Time,
};

use crate::event::{Event, Pace};
use crate::followed::{Followed, Hearing};
use crate::model::Plant;

/// Periods without an actuation after which the fail-safe outputs are in force, unless configured otherwise.
pub const WATCHDOG_CYCLES: u32 = 3;

/// Configuration of a plant.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Program whose plant it is.
    pub program: ProgramId,
    /// Configuration shared by all members.
    pub agreement: Arc<Agreement>,
    /// Plant in its initial state.
    pub plant: Plant,
    /// Program of the plant whose parts it receives.
    pub fed_by: Option<ProgramId>,
    /// Followed terminals, by number.
    pub follows: Vec<Followed>,
    /// y(i) after the watchdog has run out; its width is that of the outputs.
    pub fail_safe: Image,
    /// Periods without an actuation until the watchdog runs out: at least 2.
    pub watchdog_cycles: u32,
    /// Whether two remote I/Os drive it by modules of their own, through diodes: an actuator is on where one of the two modules drives it, and each has
    /// a watchdog.
    pub has_two_modules: bool,
    /// Numbers that these modules drive together: they add up.
    pub shared_outputs: SharedOutputs,
}

/// A plant between its remote I/O and its neighbours.
#[derive(Debug, Clone)]
pub struct PlantMachine {
    settings: Settings,
    /// The last actuation: time of arrival, moment and outputs.
    driven: Option<Driven>,
    /// The last one of each of two modules.
    modules: [Option<Driven>; 2],
    wakeup: Time,
    feed: Feed,
    /// State of each followed terminal, by number.
    hearings: Vec<Hearing>,
    endpoint: Endpoint<Event>,
}

#[derive(Debug, Clone)]
struct Driven {
    at: Time,
    moment: Moment,
    /// Whether that moment is of an epoch that only its founder knows.
    alone: bool,
    outputs: Image,
}

/// Parts on their way from the feeding plant. The counter falls only at a restart, so that lost frames are made up for.
#[derive(Debug, Clone, Default)]
struct Feed {
    moment: Moment,
    handed_over: u64,
    arrived: u64,
}

impl Feed {
    fn hear(&mut self, moment: Moment, handed_over: u64) {
        // The counter itself orders frames; moments do not, where an epoch was given up for an older one.
        if handed_over < self.handed_over {
            // A plant that was not driven yet has no moment: it has just started, and counts from 0.
            let restarted = moment == Moment::default() || moment > self.moment;
            if !restarted {
                return;
            }
            self.handed_over = 0;
        }
        self.arrived += handed_over - self.handed_over;
        self.handed_over = handed_over;
        self.moment = moment;
    }
}

impl PlantMachine {
    /// A plant that starts at `now` and sends its field at once.
    pub fn new(settings: Settings, now: Time) -> Self {
        Self {
            driven: None,
            modules: [None, None],
            wakeup: now,
            feed: Feed::default(),
            hearings: vec![Hearing::default(); settings.follows.len()],
            endpoint: Endpoint::new(Member::Plant(settings.program), &settings.agreement),
            settings,
        }
    }

    /// Its current sensors and counts.
    pub fn field(&self) -> Field {
        self.settings.plant.field()
    }

    fn period(&self) -> Duration {
        self.settings.agreement.schedule.period()
    }

    fn watchdog_has_run_out(&self, now: Time) -> bool {
        let limit = self.period() * self.settings.watchdog_cycles;
        let late = |driven: &Driven| now.since(driven.at) >= limit;
        self.driven.as_ref().is_none_or(late)
    }

    fn hear(&mut self, now: Time, frame: &Frame) {
        let header = &frame.header;
        if !self.endpoint.admits(now, header) {
            return;
        }
        match (&frame.body, header.sender) {
            (Body::Actuation(actuation), sender)
                if sender.sampled_program() == Some(self.settings.program) =>
            {
                self.drive(now, header, &actuation.outputs);
            }
            (Body::Field(field), Member::Plant(program)) => {
                if Some(program) == self.settings.fed_by {
                    self.feed.hear(header.moment, field.handed_over);
                }
                self.follow(program, header.moment, field);
            }
            _ => {}
        }
    }

    fn follow(&mut self, program: ProgramId, moment: Moment, field: &Field) {
        let follows = self.settings.follows.iter().zip(&mut self.hearings);
        for (number, (followed, hearing)) in follows.enumerate() {
            if followed.from == program
                && let Some(shown) = hearing.hear(*followed, moment, field)
            {
                self.settings.plant.see(number, &shown);
            }
        }
    }

    fn drive(&mut self, now: Time, header: &Header, outputs: &Image) {
        let moment = header.moment;
        let newer = |driven: &Driven| {
            moment > driven.moment || (driven.alone && moment.epoch != driven.moment.epoch)
        };
        let is_new = self.driven.as_ref().is_none_or(newer) || self.watchdog_has_run_out(now);
        let driven = Driven { at: now, moment, alone: header.alone, outputs: outputs.clone() };
        if self.settings.has_two_modules {
            self.drive_module(header.sender, &driven);
        }
        if is_new {
            self.driven = Some(driven);
            self.wakeup = now + self.period() * 3 / 2;
            let outputs = self.outputs(now);
            self.step(moment, outputs, Pace::Driven);
        }
    }

    /// One module drives other outputs, unless they are older than those that it drives; in one cycle the later frame counts.
    fn drive_module(&mut self, sender: Member, driven: &Driven) {
        let limit = self.period() * self.settings.watchdog_cycles;
        let module = &mut self.modules[usize::from(matches!(sender, Member::Twin(_)))];
        let is_older = module.as_ref().is_some_and(|before| {
            let lasts = driven.at.since(before.at) < limit;
            lasts && before.moment.epoch == driven.moment.epoch && driven.moment < before.moment
        });
        if !is_older {
            *module = Some(driven.clone());
        }
    }

    /// y(i) as the actuators have it.
    fn outputs(&self, now: Time) -> Image {
        let Some(driven) = &self.driven else {
            return self.settings.fail_safe.clone();
        };
        if !self.settings.has_two_modules {
            return driven.outputs.clone();
        }
        let limit = self.period() * self.settings.watchdog_cycles;
        let lasting = self.modules.iter().flatten().filter(|it| now.since(it.at) < limit);
        let width = self.settings.fail_safe.width();
        self.settings.shared_outputs.sum(width, lasting.map(|module| &module.outputs))
    }

    fn wake(&mut self, now: Time) {
        if now < self.wakeup {
            return;
        }
        self.wakeup = now + self.period();
        let watchdog = self.watchdog_has_run_out(now);
        let Some(driven) = &self.driven else {
            self.send_field(Moment::default(), self.field());
            return;
        };
        let moment = driven.moment;
        if watchdog {
            self.step(moment, self.settings.fail_safe.clone(), Pace::Watchdog);
        } else {
            let outputs = self.outputs(now);
            self.step(moment, outputs, Pace::Alone);
        }
    }

    fn step(&mut self, moment: Moment, outputs: Image, pace: Pace) {
        let arrived = std::mem::take(&mut self.feed.arrived);
        let field = self.settings.plant.step(&outputs, arrived);
        self.send_field(moment, field.clone());
        self.endpoint.report(Event::Stepped { moment, pace, outputs, field });
    }

    /// It had loaded a change before it was started, with these configurations; without effect where neither is its own.
    #[must_use]
    pub fn changed(mut self, change: &Arc<OnlineChange>, configurations: Configurations) -> Self {
        // One that is refused is of another cluster file, and its members say so.
        if self.endpoint.restore_change(Arc::clone(change), configurations).is_ok() {
            self.take_fail_safe(change);
        }
        self
    }

    /// The values of its watchdog are those of its own configuration. Modules of two remote I/Os are released in every one.
    fn take_fail_safe(&mut self, change: &OnlineChange) {
        let own = self.endpoint.configurations().own;
        let fallback = change.fallback_in(own, self.settings.program);
        if let Some(fallback) = fallback.filter(|_| !self.settings.has_two_modules) {
            self.settings.fail_safe.clone_from(&fallback.fail_safe);
        }
    }

    fn send_field(&mut self, moment: Moment, field: Field) {
        self.endpoint.send(moment, false, Body::Field(field));
    }
}

impl Machine for PlantMachine {
    type Event = Event;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        self.endpoint.end_refusals(now);
        match input {
            Input::Wakeup => self.wake(now),
            Input::Frame(frame) => self.hear(now, frame),
            Input::Change(order) => {
                self.endpoint.take_change(now, order, true);
                if let Some(change) = self.endpoint.changing().change().cloned() {
                    self.take_fail_safe(&change);
                }
            }
            Input::RemoteIo(_) => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output<Event>> {
        self.endpoint.poll_output()
    }

    fn wakeup(&self) -> Time {
        self.wakeup
    }

    fn configurations(&self) -> Option<Configurations> {
        Some(self.endpoint.configurations())
    }
}
