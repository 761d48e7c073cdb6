//! The cycles of one program, recomputed from the samples of its remote I/O.
//!
//! The [`Referee`] of the simulator runs the program from the samples, each of which names the state that it extends. A step keeps
//! x(t), u(t) and the lineages before and after, so that a scan can be looked at as its station evaluated it.

mod order;
mod resets;
mod step;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use understudy_cluster::Cluster;
use understudy_cycle::OnlineChange;
use understudy_remote_io::Event;
use understudy_simulator::{Referee, Violation};
use understudy_typed::{Fault, Program as TypedProgram};
use understudy_wire::{
    Image, Lineage, Member, Moment, ProgramHash, ProgramId, Source, Step as Taken, Time, Write,
};

use order::Order;
use resets::Resets;
pub use step::{Driven, Sampled, Step};

/// The last cycles of one program.
#[derive(Debug, Clone)]
pub struct History {
    program: ProgramId,
    /// The remote I/O that has reported last.
    by: Member,
    /// The program with which the run began.
    first: ProgramHash,
    /// The program that runs, as far as it is known.
    running: ProgramHash,
    /// Whether the state has a program fault of another program.
    has_other_fault: bool,
    referee: Referee,
    steps: VecDeque<Step>,
    most: usize,
    /// The version of the program whose points count.
    points: ProgramHash,
    /// Whether these points are known; nothing is judged while they are not.
    are_points_known: bool,
    resets: Resets,
    /// Whether steps have gone, or were never seen.
    cut: bool,
    /// The newest samples, while it is not known which state they belong to.
    unplaced: VecDeque<(Time, Event)>,
    /// The state after a sample that is still to come.
    awaited: Option<(Moment, (Option<ProgramHash>, Lineage), Image)>,
    /// The first sample with a change mark, from which on its program is that of an online change.
    replaced: Option<Moment>,
    end: End,
    order: Order,
}

/// Whether the oldest state that is known was not enough for an answer.
#[derive(Debug, Default)]
pub(crate) struct End(AtomicBool);

impl End {
    pub(crate) fn reach(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_reached(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Clone for End {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl History {
    /// Of a program of a cluster; nothing where it has no such program.
    pub(crate) fn new(cluster: &Cluster, program: ProgramId, most: usize) -> Option<Self> {
        let settings = cluster.remote_io_settings(program)?;
        let executable = cluster.programs().get(program.index())?.executable.clone();
        Some(Self {
            program,
            by: Member::RemoteIo(program),
            first: settings.hash,
            running: settings.hash,
            has_other_fault: false,
            referee: Referee::new(&settings, executable),
            steps: VecDeque::new(),
            most: most.max(2),
            points: settings.hash,
            are_points_known: true,
            resets: Resets::new(settings.hash, &settings.layout),
            cut: false,
            unplaced: VecDeque::new(),
            awaited: None,
            replaced: None,
            end: End::default(),
            order: Order::default(),
        })
    }

    /// The program.
    pub fn program(&self) -> ProgramId {
        self.program
    }

    /// Oldest first.
    pub fn steps(&self) -> &VecDeque<Step> {
        &self.steps
    }

    /// Whether there were older cycles.
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// The step of a cycle; the last one where several records tell of it.
    pub fn at(&self, cycle: i64) -> Option<&Step> {
        self.place_of(cycle).map(|place| &self.steps[place])
    }

    pub(crate) fn place_of(&self, cycle: i64) -> Option<usize> {
        // Nearly in order: only an epoch that is given up can count back.
        self.steps.iter().rposition(|step| step.cycle == cycle)
    }

    /// The program that took the newest sample up to the step at `place`.
    pub(crate) fn program_at(&self, place: usize) -> ProgramHash {
        let steps = self.steps.iter().take(place.saturating_add(1)).rev();
        let sampled = steps.filter(|step| !step.void).find_map(|step| step.sampled.as_ref());
        sampled.map_or(self.running, |sampled| sampled.program)
    }

    /// The place of the newest step up to that at `place` whose scan ended in a program fault.
    pub(crate) fn fault_before(&self, place: usize) -> Option<usize> {
        let is_new = |at: &usize| self.sampled_at(*at).is_some_and(|it| it.fault_is_new);
        let found = (0..=place).rev().find(is_new);
        if found.is_none() {
            self.end.reach();
        }
        found
    }

    /// The program that runs.
    pub(crate) fn running(&self) -> ProgramHash {
        self.running
    }

    /// As [`Self::before`], where the same program has led there: no variable of another one is followed further.
    pub(crate) fn scan_before(&self, place: usize) -> Option<usize> {
        if self.is_taken_over_at(place) { None } else { self.before(place) }
    }

    /// Whether the scan of the step at `place` began in a state of another program, converted by an online change.
    pub(crate) fn is_taken_over_at(&self, place: usize) -> bool {
        self.sampled_at(place).is_some_and(|own| own.is_taken_over)
    }

    fn sampled_at(&self, place: usize) -> Option<&Sampled> {
        self.steps.get(place).and_then(|step| step.sampled.as_ref())
    }

    /// The place of the step that led to the state in which the step at `place` began.
    pub(crate) fn before(&self, place: usize) -> Option<usize> {
        let own = self.sampled_at(place);
        let found = own.and_then(|own| {
            (0..place).rev().find(|&earlier| {
                self.steps[earlier]
                    .sampled
                    .as_ref()
                    .is_some_and(|sampled| sampled.after == own.before)
            })
        });
        if found.is_none() {
            self.end.reach();
        }
        found
    }

    /// Whether the scan of the step at `place` began in the initial state of the program.
    pub(crate) fn begins_at(&self, place: usize) -> bool {
        self.sampled_at(place).is_some_and(|own| own.is_initial)
    }

    /// Whether somebody has looked for what is before the oldest state that is known.
    pub(crate) fn end(&self) -> &End {
        &self.end
    }

    /// h(x(t), u(t)) of a moment, where it is among the newest.
    pub(crate) fn truth_of(&self, moment: Moment) -> Option<&Image> {
        let newest = self.steps.iter().rev().take(NEWEST);
        let mut of_moment = newest.filter(|step| step.moment == moment && !step.void);
        Some(&of_moment.find_map(|step| step.sampled.as_ref())?.outputs)
    }

    /// The inputs that were sampled last before the newest deadline.
    pub(crate) fn sampled_last(&mut self, inputs: Option<&Image>) {
        let driven = self.steps.back_mut().and_then(|step| step.driven.as_mut());
        if let Some(driven) = driven {
            driven.inputs = inputs.cloned();
        }
    }

    /// What its plant shows.
    pub(crate) fn saw(&mut self, sensors: &Image) {
        self.referee.saw(sensors);
    }

    /// An operator asks to write a value.
    pub(crate) fn asked(&mut self, write: &Write) {
        self.referee.asked(write.input, write.value);
    }

    /// Its program may change by this from now on.
    pub(crate) fn learn(&mut self, change: &Arc<OnlineChange>) {
        self.referee.learn(change);
        self.resets.learn(change, self.program);
    }

    /// The points of a version of the program count from now on, which may not be known here.
    pub(crate) fn lay_out(&mut self, version: ProgramHash, is_known: bool) {
        self.points = version;
        // What was sampled by points that are not known belongs to no state that is.
        if self.are_points_known != is_known {
            self.misses_records();
        }
        self.are_points_known = is_known;
    }

    /// Whether an online change has replaced the program before a cycle.
    pub(crate) fn is_replaced(&self, moment: Moment) -> bool {
        self.replaced.is_some_and(|since| since <= moment)
    }

    /// Its remote I/O starts again.
    pub(crate) fn starts_again(&mut self) {
        self.referee.starts_again();
        self.order.starts_again();
    }

    /// Records of its remote I/O are missing; its state is known again when a station reports the state that it holds.
    pub(crate) fn misses_records(&mut self) {
        self.referee.misses_records();
        self.order.cut();
        self.cut = true;
        self.unplaced.clear();
        self.awaited = None;
    }

    /// A station holds this state after the sample of `moment`: where a journal begins in the middle of a run, it is known from here on.
    pub(crate) fn holds(
        &mut self,
        moment: Moment,
        (of, lineage): (Option<ProgramHash>, Lineage),
        state: &Image,
    ) {
        if self.referee.standing().is_some() {
            return;
        }
        let place = self.unplaced.iter().position(|(_, it)| is_of(it, moment));
        let Some(place) = place else {
            self.awaited = Some((moment, (of, lineage), state.clone()));
            return;
        };
        // Which program a fault of this state is of is not known.
        self.has_other_fault = of.is_some_and(|of| of != self.first);
        self.referee.goes_on_from((of, lineage), state.clone());
        let later: Vec<(Time, Event)> = self.unplaced.drain(..).skip(place + 1).collect();
        self.awaited = None;
        for (at, event) in later {
            let (sampled, _) = self.sample(self.by, at, &event);
            let mut steps = self.steps.iter_mut().rev();
            if let Some(step) = steps.find(|step| is_of(&event, step.moment)) {
                step.sampled = sampled;
            }
        }
    }

    /// Takes a sample; what it did, where the state before it is known, and what is wrong with it.
    fn sample(
        &mut self,
        member: Member,
        at: Time,
        event: &Event,
    ) -> (Option<Sampled>, Option<Violation>) {
        if let Event::Sampled { moment, change: Some(_), .. } = event {
            self.replaced.get_or_insert(*moment);
        }
        if !self.are_points_known
            && let Event::Sampled { .. } | Event::Applied { .. } = event
        {
            return (None, None);
        }
        let violation = self.referee.observe_from(member, at, event).err();
        let Event::Sampled { moment, inputs, before, change, .. } = event else {
            return (None, violation);
        };
        let truth = self.referee.truth().filter(|(of, _)| of == moment);
        let sampled = truth.and_then(|(_, outputs)| {
            let step = Taken { change: *change, inputs: inputs.clone() };
            let (program, state) = self.referee.taken(*before, &step)?;
            let after = before.after_step(&step);
            let was_stopped = self.fault_in(program, &state).is_some();
            let reset = self.resets.of(program);
            let is_reset = reset.is_some_and(|reset| inputs.get(reset));
            let is_taken_over = self.referee.program_of(*before) != Some(program);
            let keeps_other = was_stopped && !is_reset && (self.has_other_fault || is_taken_over);
            let fault = self.fault_after(program, after).filter(|_| !keeps_other);
            let sampled = Sampled {
                program,
                is_taken_over,
                is_initial: self.referee.is_initial(program, &state),
                inputs: inputs.clone(),
                before: *before,
                state,
                after,
                outputs: outputs.clone(),
                fault,
                fault_is_new: fault.is_some() && (is_reset || !was_stopped),
            };
            Some((sampled, keeps_other))
        });
        let Some((sampled, keeps_other)) = sampled else {
            return (None, violation);
        };
        self.running = sampled.program;
        self.has_other_fault = keeps_other;
        (Some(sampled), violation)
    }

    /// The program fault that a state of a program holds.
    fn fault_in(&self, program: ProgramHash, state: &Image) -> Option<Fault> {
        let has_header = state.words().len() >= TypedProgram::HEADER as usize;
        self.resets.of(program).filter(|_| has_header)?;
        Fault::read(state.words())
    }

    fn fault_after(&self, program: ProgramHash, after: Lineage) -> Option<Fault> {
        self.fault_in(program, self.referee.state_of(after)?)
    }

    /// Keeps a sample until it is known which state it belongs to.
    fn place_later(&mut self, moment: Moment, at: Time, event: &Event) {
        if self.referee.standing().is_some() {
            self.unplaced.clear();
            return;
        }
        match self.awaited.take_if(|(of, ..)| *of == moment) {
            Some((_, of, state)) => {
                self.unplaced.clear();
                self.referee.goes_on_from(of, state);
            }
            None => {
                if self.unplaced.len() == NEWEST {
                    self.unplaced.pop_front();
                }
                self.unplaced.push_back((at, event.clone()));
            }
        }
    }

    /// Whatever its remote I/O reports: which program runs.
    pub(crate) fn learn_running(&mut self, event: &Event) {
        if let Event::ProgramChanged { to, .. } = event {
            self.running = *to;
        }
    }

    /// A report of its remote I/O, of a cycle; the wrong thing that it is, if it is one.
    pub(crate) fn note(
        &mut self,
        cycle: i64,
        member: Member,
        at: Time,
        event: &Event,
    ) -> Option<Violation> {
        if let Event::StateLost { asks: true, .. } = event {
            // Nothing but an order of a person leads from here to an older state.
            self.referee.operator_chooses();
        }
        if let Event::Voided { samples, .. } = event {
            let sampled = self.steps.iter_mut().rev();
            let sampled = sampled.filter(|step| step.sampled.is_some() && !step.void);
            sampled.take(*samples).for_each(|step| step.void = true);
        }
        self.learn_running(event);
        self.order.note(event);
        self.by = member;
        let (sampled, violation) = self.sample(member, at, event);
        let violation = self.judged(event, violation);
        match event {
            Event::Sampled { moment, .. } => {
                self.place_later(*moment, at, event);
                self.push(Step { cycle, moment: *moment, sampled, driven: None, void: false });
            }
            Event::Applied { moment, outputs, source, word_of, missing, heard, .. } => {
                let driven = Driven {
                    by: member,
                    points: self.points,
                    outputs: event.driven().unwrap_or(outputs).clone(),
                    unforced: outputs.clone(),
                    source: *source,
                    word_of: *word_of,
                    missing: *missing,
                    heard: *heard,
                    inputs: None,
                    fail_safe: (*source == Source::FailSafe)
                        .then(|| self.referee.fail_safe())
                        .flatten()
                        .filter(|values| values.width() == outputs.width()),
                };
                match self.steps.back_mut() {
                    Some(last) if last.moment == *moment && last.driven.is_none() => {
                        last.cycle = cycle;
                        last.driven = Some(driven);
                    }
                    _ => self.push(Step {
                        cycle,
                        moment: *moment,
                        sampled: None,
                        driven: Some(driven),
                        void: false,
                    }),
                }
            }
            _ => {}
        }
        violation.filter(|violation| !self.is_of_a_cut_journal(violation))
    }

    /// A violation, unless a record that is missing may be the reason.
    fn judged(&mut self, event: &Event, violation: Option<Violation>) -> Option<Violation> {
        match &violation {
            None => {
                let truth = self.referee.truth();
                if let Event::Applied { moment, missing: None, .. } = event
                    && truth.is_some_and(|(of, _)| of == *moment)
                {
                    self.order.begins();
                }
            }
            // What the state after this sample is, is not known.
            Some(Violation::UnknownHistory { .. } | Violation::Wrong { truth: None, .. })
                if self.order.is_cut() =>
            {
                self.misses_records();
                return None;
            }
            Some(Violation::WronglyHeld { .. }) if self.order.is_cut() => return None,
            Some(Violation::NotTheFailSafe { .. })
                if self.order.is_cut() && self.referee.has_ramps() =>
            {
                return None;
            }
            // Of a state and a sample that are known; a state before the floor is none that follows it, whatever is missing.
            Some(_) => {}
        }
        violation
    }

    /// What went before the first record of a journal is no violation of what comes after.
    fn is_of_a_cut_journal(&mut self, violation: &Violation) -> bool {
        let known = self.steps.iter().any(|step| step.sampled.is_some());
        let unknown = matches!(
            violation,
            Violation::UnknownHistory { .. }
                | Violation::Wrong { truth: None, .. }
                | Violation::WronglyHeld { .. }
        );
        self.cut |= !known && unknown;
        !known && unknown
    }

    fn push(&mut self, step: Step) {
        if self.steps.len() == self.most {
            self.steps.pop_front();
            self.cut = true;
        }
        self.steps.push_back(step);
    }

    pub(crate) fn shift(&mut self, by: i64) {
        self.steps.iter_mut().for_each(|step| step.cycle = step.cycle.saturating_add(by));
    }
}

fn is_of(sample: &Event, cycle: Moment) -> bool {
    matches!(sample, Event::Sampled { moment, .. } if *moment == cycle)
}

/// Lines of different members are so many cycles apart, at most.
const NEWEST: usize = 64;
