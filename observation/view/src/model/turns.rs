//! Turns of the stations, compared with the outputs that the samples yield.

use std::collections::{BTreeSet, HashMap, VecDeque};

use smallvec::SmallVec;
use understudy_wire::{Image, Member, Moment, StationId, Word};

use super::Model;
use crate::event::{Event, Level};

/// Turn of a station in a cycle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SentTurn {
    /// The station.
    pub station: StationId,
    /// Its parity words.
    pub words: SmallVec<[Word; 2]>,
    checked: bool,
}

/// The turns of the newest cycles.
#[derive(Debug, Clone)]
pub(super) struct Turns {
    by_moment: HashMap<Moment, Vec<SentTurn>>,
    order: VecDeque<Moment>,
    most: usize,
    /// Stations whose parity words differ from what the samples yield, and have not agreed since.
    differing: BTreeSet<StationId>,
}

impl Turns {
    pub(super) fn new(most: usize) -> Self {
        Self {
            by_moment: HashMap::new(),
            order: VecDeque::new(),
            most: most.max(2),
            differing: BTreeSet::new(),
        }
    }

    pub(super) fn published(&mut self, moment: Moment, station: StationId, words: &[Word]) {
        if !self.by_moment.contains_key(&moment) {
            if self.order.len() == self.most
                && let Some(oldest) = self.order.pop_front()
            {
                self.by_moment.remove(&oldest);
            }
            self.order.push_back(moment);
        }
        let turns = self.by_moment.entry(moment).or_default();
        if turns.iter().all(|turn| turn.station != station) {
            turns.push(SentTurn {
                station,
                words: words.iter().cloned().collect(),
                checked: false,
            });
        }
    }

    pub(super) fn of(&self, moment: Moment) -> &[SentTurn] {
        self.by_moment.get(&moment).map_or(&[], Vec::as_slice)
    }
}

impl Model {
    /// Compares the parity words of a cycle with what the samples yield, as soon as both are there.
    pub(super) fn check_words(&mut self, moment: Moment) {
        let Some(mut turns) = self.turns.by_moment.remove(&moment) else {
            return;
        };
        for turn in turns.iter_mut().filter(|turn| !turn.checked) {
            let compared: Option<Vec<(&Word, Image)>> =
                turn.words.iter().map(|word| Some((word, self.sum_of(word, moment)?))).collect();
            let Some(compared) = compared else {
                continue;
            };
            let wrong = compared.into_iter().find(|(word, sum)| word.sum != *sum);
            let text = wrong
                .map(|(word, sum)| format!("publishes {}, but the samples yield {sum}", word.sum));
            turn.checked = true;
            self.compared(turn.station, moment, text);
        }
        self.turns.by_moment.insert(moment, turns);
    }

    /// Sum (9) that the samples yield for the mask of a word, if the outputs of all its programs are known.
    fn sum_of(&self, word: &Word, moment: Moment) -> Option<Image> {
        let truth_of = |program| self.history(program)?.truth_of(moment);
        Some(understudy_parity::sum(word.mask, truth_of)?.sum)
    }

    fn compared(&mut self, station: StationId, moment: Moment, wrong: Option<String>) {
        let name = self.members().name(Member::Station(station)).to_owned();
        let cycle = self.cycles.of(Some(moment));
        let subject = (name.clone(), "word-differs");
        match wrong {
            None => {
                if self.turns.differing.remove(&station) {
                    self.alarms.over(&subject, cycle);
                }
            }
            Some(text) => {
                if self.turns.differing.insert(station) {
                    self.tell(Event {
                        number: 0,
                        at: None,
                        cycle,
                        at_ns: self.at_ns,
                        name,
                        event: "word-differs",
                        level: Level::Alarm,
                        text: text.clone(),
                        cause: None,
                    });
                    self.alarms.raise(subject, cycle, text);
                }
            }
        }
    }
}
