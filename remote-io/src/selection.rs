//! Which output a remote I/O may apply in one cycle.
//!
//! Invariant *No guess*: a value is applied only if it is provably h(x(t), u(t)) of the one true history of this
//! program, the history that this remote I/O itself has sampled. Proof is by lineage: a lineage identifies the initial
//! state and every input since, so equal lineages mean equal states. (Fujimoto and Sekiguchi, Theorem 2; they assume a
//! perfect failure flag, which lineage replaces.)
//!
//! ```text
//!   own frame, own lineage ──────────────────────────► a vote ─┐
//!   word over a mask with me, my lineage,                      ├─► they agree: Direct, or Reconstructed if it is missing
//!   and every other member's frame agrees with it ───► a vote ─┘   they differ: see `trust`
//!   neither ─────────────────────────────────────────► Missing (the caller holds, then falls safe)
//! ```

use std::sync::Arc;

use understudy_cycle::{Mode, ValueFault};
use understudy_wire::{
    Body, Frame, Holding, Image, Lineage, ProgramId, ProgramSet, StationId, StationSet, Turn, Word,
};

use crate::event::Missing;
use crate::trust::{Accusation, Judgement, Trust};
use crate::votes::{Vote, Votes};

/// Source of an applied output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Selection {
    Direct(Image),
    Reconstructed(Image, StationId),
    Missing(Missing),
}

/// Turns that were received in this cycle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Received<'a> {
    /// Frame of each station's turn, by rank.
    pub(crate) turns: &'a [Option<Arc<Frame>>],
    /// Number of controllers, N.
    pub(crate) controllers: usize,
    /// Number of failures that are masked.
    pub(crate) mode: Mode,
}

impl<'a> Received<'a> {
    /// Selects the `width` outputs of program `me`, whose true lineage after the sample of this cycle is `truth`; also
    /// returns the stations of a new value fault. The paper's mode compares no votes: its theorems are about erasures.
    ///
    /// At most (received words) × N steps, each over the holdings of one turn.
    pub(crate) fn select(
        &self,
        me: ProgramId,
        truth: Lineage,
        width: usize,
        trust: &mut Trust,
        answer: ValueFault,
    ) -> (Selection, Option<Accusation>) {
        if self.mode == Mode::Paper && self.silent().len() > 1 {
            return (Selection::Missing(Missing::SecondFailure), None);
        }
        let (mut votes, missing) = self.votes(me, truth, width, trust.excluded());
        let (judgement, accusation) = match self.mode {
            Mode::Paper if votes.is_empty() => (Judgement::Silence, None),
            Mode::Paper => (Judgement::Believed(0), None),
            Mode::Full => trust.judge(&votes),
        };
        let place = match judgement {
            Judgement::Silence => return (Selection::Missing(missing), accusation),
            Judgement::Believed(place) => place,
            Judgement::Doubted if answer == ValueFault::Alarm => 0,
            Judgement::Doubted => {
                return (Selection::Missing(Missing::ValueFault), accusation);
            }
        };
        let vote = votes.swap_remove(place);
        let selection = if vote.station == me.controller() {
            Selection::Direct(vote.outputs)
        } else {
            Selection::Reconstructed(vote.outputs, vote.station)
        };
        (selection, accusation)
    }

    /// Votes of the stations that are not `excluded` for the outputs of `me`, and the reason where there is none.
    fn votes(
        &self,
        me: ProgramId,
        truth: Lineage,
        width: usize,
        excluded: StationSet,
    ) -> (Votes, Missing) {
        let mut votes = Votes::new();
        let mut missing = Missing::NotSynchronised;
        if let Some((word, holding)) = self.own_word(me)
            && holding.lineage == truth
            && word.sum.width() == width
            && !excluded.contains(me.controller())
        {
            votes.push(Vote {
                station: me.controller(),
                digest: holding.digest,
                outputs: word.sum.clone(),
                independent: true,
            });
        }
        for station in self.understudies() {
            let turn = self.turn_of(station).filter(|_| !excluded.contains(station));
            let Some((turn, holding)) =
                turn.and_then(|turn| Some((turn, Holding::of(&turn.holdings, me)?)))
            else {
                continue;
            };
            if holding.lineage != truth {
                continue;
            }
            for word in turn.words.iter().filter(|word| word.mask.contains(me)) {
                let addend = |other| self.addend(other, turn);
                let Ok(outputs) = understudy_parity::reconstruct(word, me, width, addend) else {
                    missing = Missing::TwoErasures;
                    continue;
                };
                votes.push(Vote {
                    station,
                    digest: holding.digest,
                    outputs,
                    independent: word.mask.len() == 1,
                });
                break;
            }
        }
        (votes, missing)
    }

    /// Output of a program that may be added to a word of `turn`: its controller published it in this cycle, with the
    /// lineage and the state digest that the understudy has for it.
    fn addend(&self, program: ProgramId, turn: &Turn) -> Option<&'a Image> {
        let (outputs, theirs) = self.own_word(program)?;
        let ours = Holding::of(&turn.holdings, program)?;
        let equal = ours.lineage == theirs.lineage && ours.digest == theirs.digest;
        equal.then_some(&outputs.sum)
    }

    /// Syndromes (10) that are not 0, of every word of which all outputs are received, with the stations that can be
    /// wrong.
    pub(crate) fn syndromes(self) -> impl Iterator<Item = (Image, StationSet)> {
        let words = self.understudies().filter_map(move |understudy| {
            let turn = self.turn_of(understudy)?;
            Some(turn.words.iter().map(move |word| (understudy, turn, word)))
        });
        words.flatten().filter_map(move |(understudy, turn, word)| {
            let addend = |program| self.addend(program, turn);
            let syndrome = understudy_parity::syndrome(word, addend)?;
            let accused = word.mask.iter().map(|program| program.controller());
            let accused = accused.chain([understudy]).collect();
            (!syndrome.is_zero()).then_some((syndrome, accused))
        })
    }

    /// Equal lineages and unequal digests: a state was corrupted in one of the stations.
    pub(crate) fn digest_differences(&self) -> Vec<(ProgramId, StationSet)> {
        let mut differences = Vec::new();
        let mut first = vec![None; self.controllers];
        for station in (0..self.turns.len() as u8).map(StationId) {
            let mut compared = ProgramSet::EMPTY;
            let holdings = self.turn_of(station).into_iter();
            for holding in holdings.flat_map(|turn| &turn.holdings) {
                let program = holding.program;
                let Some(first) = first.get_mut(program.index()) else {
                    continue;
                };
                if compared.contains(program) {
                    continue;
                }
                compared.insert(program);
                let (other, theirs) = *first.get_or_insert((station, holding));
                if theirs.lineage == holding.lineage && theirs.digest != holding.digest {
                    differences.push((program, [other, station].into_iter().collect()));
                }
            }
        }
        differences.sort_by_key(|(program, _)| *program);
        differences
    }

    fn turn_of(&self, station: StationId) -> Option<&'a Turn> {
        match &self.turns.get(station.index())?.as_ref()?.body {
            Body::Turn(turn) => Some(turn),
            _ => None,
        }
    }

    /// Stations that published no output in this cycle.
    fn silent(&self) -> StationSet {
        let all = (0..self.turns.len() as u8).map(StationId);
        all.filter(|&station| self.turn_of(station).is_none_or(|turn| turn.words.is_empty()))
            .collect()
    }

    fn understudies(&self) -> impl Iterator<Item = StationId> + use<'a> {
        (self.controllers as u8..self.turns.len() as u8).map(StationId)
    }

    /// The output that a controller publishes of its own program, with the state that it is computed from.
    fn own_word(&self, program: ProgramId) -> Option<(&'a Word, &'a Holding)> {
        let turn = self.turn_of(program.controller())?;
        let own = ProgramSet::only(program);
        let word = turn.words.iter().find(|word| word.mask == own)?;
        Some((word, Holding::of(&turn.holdings, program)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use understudy_wire::{ClusterHash, ConfigurationHash, Digest, Header, Member, Moment};

    const WIDTHS: [usize; 3] = [3, 2, 3];
    const OUTPUTS: [u64; 3] = [0b101, 0b11, 0b110];
    const TRUE: Lineage = Lineage(7);

    /// Behaviour of one controller in the cycle.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Controller {
        Silent,
        True,
        /// It publishes from another history, and so another output.
        Stale,
        /// Its lineage is the true one, and its state was corrupted.
        Corrupted,
    }

    const CASES: [Controller; 4] =
        [Controller::Silent, Controller::True, Controller::Stale, Controller::Corrupted];

    fn image(program: usize, flipped: bool) -> Image {
        let word = OUTPUTS[program] ^ u64::from(flipped);
        Image::from_words(WIDTHS[program], &[word]).expect("it fits")
    }

    fn holding(program: usize, lineage: Lineage, digest: u64) -> Holding {
        Holding {
            program: ProgramId(program as u8),
            born: Moment::default(),
            lineage,
            stepped: Moment::default(),
            digest: Digest(digest),
            version: None,
        }
    }

    fn frame(rank: usize, holdings: &[Holding], words: &[Word]) -> Arc<Frame> {
        Arc::new(Frame {
            header: Header {
                cluster: ClusterHash(1),
                configuration: ConfigurationHash(1),
                prepared: None,
                moment: Moment::default(),
                sender: Member::Station(StationId(rank as u8)),
                alone: false,
            },
            body: Body::Turn(Turn {
                heard: StationSet::EMPTY,
                holdings: holdings.iter().copied().collect(),
                words: words.iter().cloned().collect(),
                recalled: Vec::new(),
                lacks: ProgramSet::EMPTY,
                relayed: Vec::new(),
            }),
        })
    }

    fn controller(program: usize, case: Controller) -> Option<Arc<Frame>> {
        let (lineage, digest) = match case {
            Controller::Silent => return None,
            Controller::True => (TRUE, 1),
            Controller::Stale => (Lineage(6), 1),
            Controller::Corrupted => (TRUE, 2),
        };
        let word = Word {
            mask: ProgramSet::only(ProgramId(program as u8)),
            sum: image(program, case != Controller::True),
        };
        Some(frame(program, &[holding(program, lineage, digest)], &[word]))
    }

    /// An understudy without a fault, with one word over `mask` and one for each other program of `alone`.
    fn understudy(mask: u128, alone: u128) -> Arc<Frame> {
        let holdings: Vec<Holding> = (0..3).map(|program| holding(program, TRUE, 1)).collect();
        let word = |mask: ProgramSet| {
            let mut sum = Image::default();
            for program in mask.iter() {
                sum.add(&image(program.index(), false));
            }
            Word { mask, sum }
        };
        let together = ProgramSet::from_bits(mask);
        let words: Vec<Word> = [together]
            .into_iter()
            .chain(ProgramSet::from_bits(alone).without(together).iter().map(ProgramSet::only))
            .filter(|mask| !mask.is_empty())
            .map(word)
            .collect();
        frame(3, &holdings, &words)
    }

    /// Every controller in every case, with every word of one understudy, and without it: a true output is found where
    /// one can be proved, and nothing else is applied but what the controller itself publishes of the true history.
    #[test]
    fn what_is_applied_is_proved() {
        for cases in (0..64).map(|case| [case % 4, case / 4 % 4, case / 16]) {
            let cases = cases.map(|case| CASES[case]);
            for (mask, alone) in (0..8).flat_map(|mask| (0..8).map(move |alone| (mask, alone))) {
                for with_understudy in [false, true] {
                    check(cases, mask, alone, with_understudy);
                }
            }
        }
    }

    fn check(cases: [Controller; 3], mask: u128, alone: u128, with_understudy: bool) {
        let mut turns: Vec<Option<Arc<Frame>>> =
            (0..3).map(|program| controller(program, cases[program])).collect();
        turns.push(with_understudy.then(|| understudy(mask, alone)));
        let received = Received { turns: &turns, controllers: 3, mode: Mode::Full };
        for me in 0..3 {
            let (selection, accusation) = select(received, me, ValueFault::Alarm);
            let others = (0..3).filter(|&other| other != me && mask >> other & 1 == 1);
            let provable = with_understudy
                && if mask >> me & 1 == 1 {
                    others.clone().all(|other| cases[other] == Controller::True)
                } else {
                    alone >> me & 1 == 1
                };
            match cases[me] {
                // A value fault of a controller cannot be detected from its own frame alone.
                Controller::Corrupted => {
                    assert_eq!(selection, Selection::Direct(image(me, true)));
                    let (held, _) = select(received, me, ValueFault::Hold);
                    let accused = [StationId(me as u8), StationId(3)].into_iter().collect();
                    let located = false;
                    if provable {
                        assert_eq!(held, Selection::Missing(Missing::ValueFault));
                        assert_eq!(accusation, Some(Accusation { accused, located }));
                    } else {
                        assert_eq!((held, accusation), (selection, None));
                    }
                }
                Controller::True => assert_eq!(selection, Selection::Direct(image(me, false))),
                _ if provable => {
                    let restored = Selection::Reconstructed(image(me, false), StationId(3));
                    assert_eq!(selection, restored, "{cases:?} {mask:03b} {alone:03b}");
                }
                _ => assert!(matches!(selection, Selection::Missing(_))),
            }
        }
        let corrupted = cases.iter().filter(|&&case| case == Controller::Corrupted).count();
        let differences = received.digest_differences().len();
        assert_eq!(differences, if with_understudy { corrupted } else { 0 });
        assert_eq!(received.syndromes().count(), 0);
    }

    /// Selection of a remote I/O that suspects no station.
    fn select(
        received: Received<'_>,
        me: usize,
        answer: ValueFault,
    ) -> (Selection, Option<Accusation>) {
        let program = ProgramId(me as u8);
        received.select(program, TRUE, WIDTHS[me], &mut Trust::default(), answer)
    }

    /// An output that is corrupted after it was computed leaves a syndrome, (10), and all stations that can be wrong
    /// are reported.
    #[test]
    fn a_corrupted_output_leaves_a_syndrome() {
        for program in 0..3 {
            let mut turns: Vec<Option<Arc<Frame>>> =
                (0..3).map(|program| controller(program, Controller::True)).collect();
            let word = Word {
                mask: ProgramSet::only(ProgramId(program as u8)),
                sum: image(program, true),
            };
            turns[program] = Some(frame(program, &[holding(program, TRUE, 1)], &[word]));
            turns.push(Some(understudy(0b111, 0)));
            let received = Received { turns: &turns, controllers: 3, mode: Mode::Full };
            let syndromes: Vec<_> = received.syndromes().collect();
            assert_eq!(syndromes.len(), 1);
            assert_eq!(syndromes[0].0.words(), [1]);
            assert_eq!(syndromes[0].1, StationSet::first(4));
        }
    }

    /// The paper's S2: with two stations not received no output is applied, not even a received one.
    #[test]
    fn the_paper_fails_with_the_second_station() {
        for silent in (0..16_u128).map(StationSet::from_bits) {
            let turns: Vec<Option<Arc<Frame>>> = (0..4)
                .map(|rank| match rank {
                    _ if silent.contains(StationId(rank as u8)) => None,
                    3 => Some(understudy(0b111, 0)),
                    _ => controller(rank, Controller::True),
                })
                .collect();
            let received = Received { turns: &turns, controllers: 3, mode: Mode::Paper };
            for (me, width) in (0..).zip(WIDTHS) {
                let (selection, _) = received.select(
                    ProgramId(me),
                    TRUE,
                    width,
                    &mut Trust::default(),
                    ValueFault::Hold,
                );
                let missing = matches!(selection, Selection::Missing(_));
                assert_eq!(missing, silent.len() > 1, "{silent:?}");
            }
        }
    }
}
