//! The reference run of one program, and whether what its remote I/O drove was true to it.
//!
//! The referee sees only what a remote I/O reports: its samples, its cold starts, and what it drove. From the samples it runs
//! the program by itself, and knows so the one true h(x(t), u(t)) of every cycle. Invariant checked (*No guess*): what is driven is
//! that, or the last true output for at most the configured cycles, or the configured fail-safe; never anything else. And
//! (*The plant decides history*): a program goes on only from a state that its own samples led to.

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};

use serde::{Deserialize, Serialize};
use understudy_logic::{Scan, Scratch};
use understudy_remote_io::{Event, Settings};
use understudy_wire::{Image, Lineage, Moment, ProgramHash, Source};

/// States that it can go back to, at most; older ones are forgotten.
const REMEMBERED: usize = 1024;

/// Different images of a plant that are remembered.
const SEEN: usize = 16;

/// Samples in a row of which a killed remote I/O has left no record, at most, and the states that they may follow.
const UNRECORDED_SAMPLES: usize = 2;
const RECENT_STATES: usize = 16;

/// Checks one remote I/O.
#[derive(Debug, Clone)]
pub struct Referee {
    scan: Scan,
    hash: ProgramHash,
    fail_safe: Image,
    hold_cycles: u32,
    scratch: Scratch,
    /// The states that the samples led to, newest last; void ones and those before a cold start too, for a station may still
    /// hold one, and then the program goes on from it.
    states: VecDeque<(Lineage, Image)>,
    /// x(t).
    state: Option<(Lineage, Image)>,
    /// h(x(t), u(t)) of the newest sample, with its cycle.
    truth: Option<(Moment, Image)>,
    last_true: Option<Image>,
    held: u32,
    /// Records are missing, and no state after them is known yet.
    blind: bool,
    /// What the plant showed last: any of these may have been sampled.
    seen: VecDeque<Image>,
}

/// Something that must never happen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "violation", rename_all = "kebab-case")]
pub enum Violation {
    /// An output was driven as true and is not.
    #[error("{source_:?} output {driven} in cycle {moment}, where the reference run has {}", text(.truth))]
    Wrong {
        /// In this cycle.
        moment: Moment,
        /// As what it was driven.
        #[serde(rename = "source")]
        source_: Source,
        /// What was driven.
        driven: Image,
        /// What was true, where that is known.
        truth: Option<Image>,
    },
    /// An output was held that was not the last true one, or for longer than configured.
    #[error("held output {driven} in cycle {moment}, for {cycles} cycles, where the last true one was {}", text(.last_true))]
    WronglyHeld {
        /// In this cycle.
        moment: Moment,
        /// What was driven.
        driven: Image,
        /// Cycles held in a row.
        cycles: u32,
        /// The last output that was true.
        last_true: Option<Image>,
    },
    /// Something else than the configured values was driven as fail-safe.
    #[error("fail-safe output {driven} in cycle {moment}, where {configured} is configured")]
    NotTheFailSafe {
        /// In this cycle.
        moment: Moment,
        /// What was driven.
        driven: Image,
        /// What is configured.
        configured: Image,
    },
    /// The program goes on from a state that none of its samples led to.
    #[error(
        "in cycle {moment} the program went on from lineage {lineage}, which its plant has never seen"
    )]
    UnknownHistory {
        /// In this cycle.
        moment: Moment,
        /// The lineage.
        lineage: Lineage,
    },
}

/// By its reference run; settings and program are given.
impl Hash for Referee {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.states, &self.state, &self.truth).hash(hasher);
        (&self.last_true, self.held, self.blind).hash(hasher);
    }
}

fn text(image: &Option<Image>) -> String {
    image
        .as_ref()
        .map_or_else(|| "none".to_owned(), Image::to_string)
}

impl Referee {
    /// For the remote I/O of these settings, whose program is `scan`.
    pub fn new(settings: &Settings, scan: Scan) -> Self {
        Self {
            scan,
            hash: settings.hash,
            fail_safe: settings.fail_safe.clone(),
            hold_cycles: settings.hold_cycles,
            scratch: Scratch::default(),
            states: VecDeque::new(),
            state: None,
            truth: None,
            last_true: None,
            held: 0,
            blind: false,
            seen: VecDeque::new(),
        }
    }

    /// What the plant shows, as it says itself.
    ///
    /// A remote I/O that is killed may take the record of its last samples with it. The lineage that a station then has proves
    /// which inputs they were, if only they are among those that the plant has shown.
    pub fn saw(&mut self, sensors: &Image) {
        if self.seen.contains(sensors) {
            return;
        }
        if self.seen.len() == SEEN {
            self.seen.pop_front();
        }
        self.seen.push_back(sensors.clone());
    }

    /// Records of the remote I/O are missing here: nothing that it drives is judged until its program starts, or goes on from a state that is
    /// known. What is not known is not a violation, and must be said by whoever reads the records.
    pub fn misses_records(&mut self) {
        self.state = None;
        self.truth = None;
        self.last_true = None;
        self.held = 0;
        self.blind = true;
    }

    /// Where the reference run stands: its lineage and x(t), as of the samples so far; nothing before a start that it has seen.
    pub fn standing(&self) -> Option<(Lineage, &Image)> {
        self.state
            .as_ref()
            .map(|(lineage, state)| (*lineage, state))
    }

    /// h(x(t), u(t)) of the newest sample, with its cycle.
    pub fn truth(&self) -> Option<(Moment, &Image)> {
        self.truth
            .as_ref()
            .map(|(moment, outputs)| (*moment, outputs))
    }

    /// Takes one report of the remote I/O, in the order in which they were made.
    ///
    /// # Errors
    /// The violation that it is, if it is one; the referee goes on with what was driven.
    pub fn observe(&mut self, event: &Event) -> Result<(), Violation> {
        match event {
            Event::StartedCold { born, .. } => {
                let initial = Image::from_words(self.scan.register_count(), self.scan.initial());
                self.truth = None;
                self.last_true = None;
                self.remember(
                    Lineage::genesis(self.hash, *born),
                    initial.expect("a circuit packs its initial state"),
                );
                Ok(())
            }
            Event::AdoptedLineage {
                moment, lineage, ..
            }
            | Event::Voided {
                moment, lineage, ..
            } => self.go_to(*moment, *lineage),
            Event::Sampled { moment, inputs } => {
                self.step(*moment, inputs);
                Ok(())
            }
            Event::Applied {
                moment,
                outputs,
                source,
                ..
            } => self.judge(*moment, outputs, *source),
            _ => Ok(()),
        }
    }

    /// The reference run goes on from a state that is known from elsewhere, for want of a start that was seen.
    pub fn goes_on_from(&mut self, lineage: Lineage, state: Image) {
        self.truth = None;
        self.remember(lineage, state);
    }

    fn remember(&mut self, lineage: Lineage, state: Image) {
        if self.states.len() == REMEMBERED {
            self.states.pop_front();
        }
        self.states.push_back((lineage, state.clone()));
        self.state = Some((lineage, state));
        self.blind = false;
    }

    fn go_to(&mut self, moment: Moment, lineage: Lineage) -> Result<(), Violation> {
        self.truth = None;
        let known = self
            .states
            .iter()
            .rev()
            .find(|(known, _)| *known == lineage);
        self.state = known.cloned();
        if self.state.is_some() || self.recover(lineage) {
            self.blind = false;
            Ok(())
        } else if self.blind {
            Ok(())
        } else {
            Err(Violation::UnknownHistory { moment, lineage })
        }
    }

    /// Finds the samples without a record that lead to a lineage, and goes there.
    fn recover(&mut self, lineage: Lineage) -> bool {
        let newest = self.states.iter().rev().take(RECENT_STATES);
        let begun: Vec<(Lineage, Image)> = newest.cloned().collect();
        let mut ways: Vec<(usize, Lineage, Vec<usize>)> = begun
            .iter()
            .enumerate()
            .map(|(from, (known, _))| (from, *known, Vec::new()))
            .collect();
        for _ in 0..UNRECORDED_SAMPLES {
            let mut longer = Vec::new();
            for (from, known, samples) in &ways {
                for (place, sensors) in self.seen.iter().enumerate() {
                    let samples: Vec<usize> = samples.iter().copied().chain([place]).collect();
                    longer.push((*from, known.after(sensors), samples));
                }
            }
            if let Some((from, _, samples)) = longer.iter().find(|(_, found, _)| *found == lineage)
            {
                self.state = Some(begun[*from].clone());
                for &place in samples {
                    let sensors = self.seen[place].clone();
                    self.step(Moment::default(), &sensors);
                }
                self.truth = None;
                return true;
            }
            ways = longer;
        }
        false
    }

    fn step(&mut self, moment: Moment, inputs: &Image) {
        let Some((lineage, mut state)) = self.state.take() else {
            return;
        };
        let mut outputs = Image::zero(self.scan.output_count());
        self.scan.step(
            &mut self.scratch,
            state.words_mut(),
            inputs.words(),
            outputs.words_mut(),
        );
        self.remember(lineage.after(inputs), state);
        self.truth = Some((moment, outputs));
    }

    fn judge(&mut self, moment: Moment, driven: &Image, source: Source) -> Result<(), Violation> {
        match source {
            Source::Direct | Source::Reconstructed | Source::Held if self.blind => Ok(()),
            Source::Direct | Source::Reconstructed => {
                self.held = 0;
                self.last_true = Some(driven.clone());
                let truth = self.truth.as_ref().filter(|(of, _)| *of == moment);
                let truth = truth.map(|(_, outputs)| outputs);
                if truth == Some(driven) {
                    return Ok(());
                }
                Err(Violation::Wrong {
                    moment,
                    source_: source,
                    driven: driven.clone(),
                    truth: truth.cloned(),
                })
            }
            Source::Held => {
                self.held += 1;
                if self.held <= self.hold_cycles && self.last_true.as_ref() == Some(driven) {
                    return Ok(());
                }
                Err(Violation::WronglyHeld {
                    moment,
                    driven: driven.clone(),
                    cycles: self.held,
                    last_true: self.last_true.clone(),
                })
            }
            Source::FailSafe => {
                self.held = 0;
                self.last_true = None;
                if *driven == self.fail_safe {
                    return Ok(());
                }
                Err(Violation::NotTheFailSafe {
                    moment,
                    driven: driven.clone(),
                    configured: self.fail_safe.clone(),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests;
