//! When the steps of a scenario are due, by the cycles that the remote I/Os report.
//!
//! A step at cycle t is meant to be felt first by cycle t. It is armed when cycle t-1 was decided, which its remote I/Os do at the
//! deadline, and done at once, or later by its phase. Where no cycle is reported any more (nobody is there to pace, or no
//! remote I/O to report), the period counts on.
//!
//! Invariant: no step is done before one of an earlier cycle. A laboratory that is late learns of several cycles at once, and phases would order their steps
//! otherwise: a station that continues before it is stopped stays stopped.
//!
//! Besides the steps, an operator may answer the questions of remote I/Os, some time after each.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use understudy_journal::{Happening, Record};
use understudy_remote_io::Event;
use understudy_scenarios::Scenario;
use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, StateChoice};

use super::Conductor;

/// Periods without a report after which the clock counts.
const SILENT_PERIODS: u32 = 20;

/// Multiple of the time to an answer after which a question that is still open is answered by a cold start: no station holds a state.
const COLD_AFTER: u32 = 4;

/// Share of the period between a deadline and the next cycle.
const DEADLINE_TO_NEXT_CYCLE: f64 = 0.35;

#[derive(Debug)]
pub(super) struct Steps {
    period: Duration,
    waiting: VecDeque<Fault>,
    /// In the order of their times.
    armed: Vec<(Instant, Fault)>,
    /// The newest cycle with a step that was armed, and when all steps of earlier cycles are done.
    last: Option<(u64, Instant)>,
    /// When the last step that was armed is done.
    done: Option<Instant>,
    newest: Option<(u64, Instant)>,
    /// Time from a question of a remote I/O to its answer; nothing where none is given.
    answers_after: Option<Duration>,
    /// Answers that are due, in the order of their times.
    answers: Vec<(Instant, Fault)>,
}

impl Steps {
    pub(super) fn new(
        scenario: &Scenario,
        period: Duration,
        answers_after: Option<Duration>,
    ) -> Self {
        Self {
            period,
            waiting: scenario.steps.iter().copied().collect(),
            armed: Vec::new(),
            last: None,
            done: None,
            newest: None,
            answers_after,
            answers: Vec::new(),
        }
    }

    /// A remote I/O asks which state its program continues from. An answer that it does not need any more is refused.
    fn asked(&mut self, member: Member, now: Instant) {
        let Some(after) = self.answers_after else {
            return;
        };
        let choices = [(1, StateChoice::Newest { cycle: None }), (COLD_AFTER, StateChoice::Cold)];
        self.answers.retain(|(_, answer)| answer.member != member);
        self.answers.extend(choices.map(|(times, choice)| {
            let action = Action::Choose { choice };
            (now + after * times, Fault { at_cycle: 0, phase: 0.0, member, action })
        }));
        self.answers.sort_by_key(|(due, _)| *due);
    }
}

impl Conductor for Steps {
    fn hear(&mut self, record: &Record, now: Instant) {
        if let (Happening::RemoteIo(Event::StateLost { asks: true, .. }), Some(member)) =
            (&record.event, record.member)
        {
            self.asked(member, now);
        }
    }

    fn follow(&mut self, cycle: Option<u64>, now: Instant) {
        let Some(cycle) = cycle else {
            return;
        };
        if self.newest.is_none_or(|(newest, _)| newest < cycle) {
            self.newest = Some((cycle, now));
        }
        let Some((newest, since)) = self.newest else {
            return;
        };
        let silent = now.duration_since(since);
        let counted = if silent > self.period * SILENT_PERIODS {
            newest + (silent.as_nanos() / self.period.as_nanos()) as u64
        } else {
            newest
        };
        while let Some(step) = self.waiting.front()
            && step.at_cycle <= counted + 1
        {
            let after = if step.phase > 0.0 {
                self.period.mul_f64(DEADLINE_TO_NEXT_CYCLE + step.phase)
            } else {
                Duration::ZERO
            };
            let earlier = match self.last {
                Some((cycle, earlier)) if cycle == step.at_cycle => earlier,
                _ => self.done.unwrap_or(now),
            };
            self.last = Some((step.at_cycle, earlier));
            let due = earlier.max(now + after);
            self.done = self.done.max(Some(due));
            self.armed.push((due, *step));
            self.waiting.pop_front();
        }
        self.armed.sort_by(|(due, one), (later, other)| {
            let cycles = one.at_cycle.cmp(&other.at_cycle);
            due.cmp(later).then(cycles).then(one.phase.total_cmp(&other.phase))
        });
    }

    fn next_due(&self) -> Option<Instant> {
        let first = |due: &[(Instant, Fault)]| due.first().map(|(due, _)| *due);
        [first(&self.armed), first(&self.answers)].into_iter().flatten().min()
    }

    fn take_due(&mut self, now: Instant) -> Option<Fault> {
        let due = self.next_due()?;
        if due > now {
            return None;
        }
        let is_answer = self.answers.first().is_some_and(|(answer, _)| *answer == due);
        let list = if is_answer { &mut self.answers } else { &mut self.armed };
        Some(list.remove(0).1)
    }

    fn wait_for_time(&self) -> bool {
        !(self.waiting.is_empty() && self.armed.is_empty() && self.answers.is_empty())
    }

    fn is_over(&self, _: Instant) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use understudy_remote_io::AskReason;
    use understudy_wire::{Moment, ProgramId, StationId};

    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);

    fn steps(steps: &[(u64, f64)]) -> Steps {
        let scenario = Scenario {
            title: String::new(),
            cycles: 1000,
            steps: steps
                .iter()
                .map(|&(at_cycle, phase)| Fault {
                    at_cycle,
                    phase,
                    member: Member::Station(StationId(0)),
                    action: Action::Crash,
                })
                .collect(),
            ..Scenario::default()
        };
        Steps::new(&scenario, PERIOD, None)
    }

    /// The remote I/O that asks is answered; a question that is asked again puts the cold start off, and one that is not asked gets no answer.
    #[test]
    fn questions_are_answered_once_each() {
        let (now, after) = (Instant::now(), PERIOD * 10);
        let twin = Member::Twin(ProgramId(0));
        let asked = |asks| Record {
            at_ns: 0,
            name: "twin".to_owned(),
            member: Some(twin),
            event: Happening::RemoteIo(Event::StateLost {
                moment: Moment::default(),
                applied: None,
                newest: None,
                holder: None,
                asks,
                reason: AskReason::Doubt,
                inputs: None,
            }),
        };
        let mut unanswered = steps(&[]);
        unanswered.hear(&asked(true), now);
        assert_eq!(unanswered.next_due(), None);
        let mut steps = Steps { answers_after: Some(after), ..steps(&[]) };
        steps.hear(&asked(false), now);
        assert_eq!(steps.next_due(), None);
        steps.hear(&asked(true), now);
        assert_eq!(steps.take_due(now + PERIOD), None);
        let choice =
            |steps: &mut Steps, at: Instant| steps.take_due(at).map(|it| (it.member, it.action));
        let newest = Action::Choose { choice: StateChoice::Newest { cycle: None } };
        assert_eq!(choice(&mut steps, now + after), Some((twin, newest)));
        steps.hear(&asked(true), now + after);
        assert_eq!(choice(&mut steps, now + after * 2), Some((twin, newest)));
        assert_eq!(steps.take_due(now + after * 4), None);
        let cold = Action::Choose { choice: StateChoice::Cold };
        assert_eq!(choice(&mut steps, now + after * 5), Some((twin, cold)));
        assert!(!steps.wait_for_time());
    }

    #[test]
    fn a_step_is_due_when_the_cycle_before_it_was_decided() {
        let now = Instant::now();
        let mut steps = steps(&[(5, 0.0), (7, 0.5)]);
        steps.follow(None, now);
        steps.follow(Some(3), now);
        assert_eq!(steps.take_due(now), None);
        steps.follow(Some(4), now);
        assert_eq!(steps.take_due(now).map(|step| step.at_cycle), Some(5));
        steps.follow(Some(6), now);
        assert_eq!(steps.take_due(now), None, "by its phase it is later");
        let later = now + PERIOD.mul_f64(0.86);
        assert_eq!(steps.take_due(later).map(|step| step.at_cycle), Some(7));
        assert!(!steps.wait_for_time());
    }

    /// Steps of cycles that are reported at once: their order is that of the cycles, and within one that of the phases.
    #[test]
    fn a_laboratory_that_is_late_keeps_the_order_of_the_cycles() {
        let now = Instant::now();
        let mut steps = steps(&[(5, 0.9), (5, 0.2), (7, 0.1), (7, 0.0), (8, 0.0)]);
        steps.follow(Some(20), now);
        let later = now + PERIOD * 2;
        let taken = std::iter::from_fn(|| steps.take_due(later));
        let taken: Vec<(u64, f64)> = taken.map(|step| (step.at_cycle, step.phase)).collect();
        assert_eq!(taken, [(5, 0.2), (5, 0.9), (7, 0.0), (7, 0.1), (8, 0.0)]);
    }

    #[test]
    fn the_period_counts_on_where_nobody_reports() {
        let now = Instant::now();
        let mut steps = steps(&[(100, 0.0)]);
        steps.follow(Some(50), now);
        steps.follow(Some(50), now + PERIOD * 10);
        assert_eq!(steps.take_due(now + PERIOD * 10), None);
        steps.follow(Some(50), now + PERIOD * 49);
        assert!(steps.take_due(now + PERIOD * 49).is_some());
    }
}
