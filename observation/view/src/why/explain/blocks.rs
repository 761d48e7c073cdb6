//! Why a block is as it is: a timer, a counter, a latch or an edge, and the earlier scan in which that began.

use understudy_ladder::{BlockKind, Element, ElementFlow, Reading, visit};

use super::super::Reason;
use super::super::power::{AtBlock, at_block, nodes};
use super::{DEEPEST, Explainer, FARTHEST, MOST};

impl Explainer<'_> {
    /// A block as the rung `below` sees it: of this scan where it is above, of the one before otherwise.
    pub(super) fn block(
        &mut self,
        name: &str,
        below: usize,
        place: usize,
        depth: usize,
    ) -> Option<Reason> {
        let rung = self.program.rungs.iter().position(|rung| {
            let mut found = false;
            visit(&rung.network, &mut |element| {
                found |= matches!(element, Element::Block(block) if block.name.as_str() == name);
            });
            found
        })?;
        let place = if rung <= below { place } else { self.history.before(place)? };
        self.block_at(name, rung, place, depth)
    }

    pub(super) fn block_at(
        &mut self,
        name: &str,
        rung: usize,
        place: usize,
        depth: usize,
    ) -> Option<Reason> {
        self.count += 1;
        let evaluation = self.evaluation(place)?;
        let flows = &evaluation.rungs[rung].elements;
        let network = nodes(&self.program.rungs[rung].network, &mut flows.iter());
        let found = at_block(&network, name)?;
        let kind = found.block.kind;
        let mut reason = self.leaf(name, found.node.flow.leaves, place, "");
        reason.rung = Some(rung + 1);
        reason.title = self.program.rungs[rung].title.clone().filter(|title| !title.is_empty());
        if depth > DEEPEST || self.count > MOST {
            reason.text = "and so on".to_owned();
            return Some(reason);
        }
        if !self.told.insert((name.to_owned(), place, usize::MAX)) {
            reason.text = "explained above".to_owned();
            return Some(reason);
        }
        let word = kind.word();
        let (text, at) = self.block_text(&found, rung, place);
        reason.text = format!("{word}: {text}");
        reason.because = match at {
            Some(at) if at != place => self.wire_at(name, rung, at, depth),
            _ => {
                let reset = match kind {
                    BlockKind::Sr => found.feed("R"),
                    BlockKind::Rs => found.feed("R1"),
                    _ => (false, Vec::new()),
                };
                let elements =
                    if reset.0 && !found.node.flow.leaves { reset.1 } else { found.wire.clone() };
                self.elements(&elements, rung, place, depth + 1)
            }
        };
        Some(reason)
    }

    /// Why there was power at the wire of a block in an earlier scan, or why not.
    fn wire_at(&mut self, name: &str, rung: usize, place: usize, depth: usize) -> Vec<Reason> {
        let Some(evaluation) = self.evaluation(place) else {
            return Vec::new();
        };
        let flows = &evaluation.rungs[rung].elements;
        let network = nodes(&self.program.rungs[rung].network, &mut flows.iter());
        match at_block(&network, name) {
            Some(found) => self.elements(&found.wire, rung, place, depth + 1),
            None => Vec::new(),
        }
    }

    /// What a block does, and the step that explains it where that is an earlier one.
    fn block_text(
        &mut self,
        found: &AtBlock<'_, '_>,
        rung: usize,
        place: usize,
    ) -> (String, Option<usize>) {
        let name = found.block.name.as_str();
        let flow = found.node.flow;
        let (enters, leaves) = (flow.enters, flow.leaves);
        let elapsed = match flow.reading {
            Reading::Time(elapsed) => format!("{elapsed:?}"),
            Reading::Number(number) => number.to_string(),
            _ => String::new(),
        };
        let preset = found.block.kind.preset_time().unwrap_or_default();
        match found.block.kind {
            BlockKind::Ton(_) | BlockKind::Tof(_) => {
                let on = matches!(found.block.kind, BlockKind::Ton(_));
                if enters != on {
                    let power =
                        if enters { "its input has power" } else { "its input has no power" };
                    return (power.to_owned(), None);
                }
                let (since, known) = self.unchanged(name, rung, place, |flow| flow.enters);
                let since = if known {
                    format!("since cycle {}", self.cycle(since))
                } else {
                    "for long".to_owned()
                };
                let what = if on { "its input has power" } else { "its input has no power" };
                let over = if leaves == on {
                    format!("its {preset:?} are over")
                } else {
                    format!("{elapsed} of {preset:?}")
                };
                (format!("{what} {since}, {over}"), None)
            }
            BlockKind::Tp(_) => {
                if !leaves {
                    let what = if enters {
                        "its pulse is over, and its input still has power"
                    } else {
                        "its input has no power"
                    };
                    return (what.to_owned(), None);
                }
                let (since, _) = self.unchanged(name, rung, place, |flow| flow.leaves);
                (
                    format!(
                        "its pulse began in cycle {}, {elapsed} of {preset:?}",
                        self.cycle(since)
                    ),
                    Some(since),
                )
            }
            BlockKind::Ctu(preset) | BlockKind::Ctd(preset) | BlockKind::Ctud(preset) => {
                let (since, known) = self.unchanged(name, rung, place, |flow| flow.reading);
                let since_text = if known {
                    format!(" since cycle {}", self.cycle(since))
                } else {
                    String::new()
                };
                (format!("CV is {elapsed}, PV {preset}{since_text}"), Some(since))
            }
            BlockKind::Sr | BlockKind::Rs => {
                if leaves && !enters {
                    let (since, _) = self.unchanged(name, rung, place, |flow| flow.enters);
                    let set = self.history.before(since).unwrap_or(since);
                    return (
                        format!("set in cycle {}, and kept since", self.cycle(set)),
                        Some(set),
                    );
                }
                let what = match (leaves, enters) {
                    (true, _) => "it is set",
                    (false, true) => "it is reset, and that wins",
                    (false, false) => "nothing sets it",
                };
                (what.to_owned(), None)
            }
            BlockKind::RTrig | BlockKind::FTrig => {
                let what = if leaves {
                    "its input has just changed"
                } else {
                    "its input has not just changed"
                };
                (what.to_owned(), None)
            }
        }
    }

    /// The first of the steps up to `place` in which something of a block was as it is, and whether the one before is known.
    fn unchanged<T: PartialEq>(
        &mut self,
        name: &str,
        rung: usize,
        place: usize,
        what: impl Fn(&ElementFlow) -> T,
    ) -> (usize, bool) {
        let Some(element) = self.place_of_block(name, rung) else {
            return (place, false);
        };
        let mut at = place;
        let Some(now) = self
            .evaluation(place)
            .and_then(|evaluation| Some(what(evaluation.rungs[rung].elements.get(element)?)))
        else {
            return (place, false);
        };
        for _ in 0..FARTHEST {
            let Some(before) = self.history.before(at) else {
                return (at, self.end_of_history(at) == "its initial value");
            };
            // Not kept: there may be thousands.
            let evaluation = self.model.evaluation_at(self.history, before).ok();
            let was = evaluation
                .as_ref()
                .and_then(|evaluation| evaluation.rungs[rung].elements.get(element));
            match was {
                Some(was) if what(was) == now => at = before,
                Some(_) => return (at, true),
                None => return (at, false),
            }
        }
        (at, false)
    }

    fn place_of_block(&self, name: &str, rung: usize) -> Option<usize> {
        let (mut place, mut found) = (0, None);
        visit(&self.program.rungs[rung].network, &mut |element| {
            if matches!(element, Element::Block(block) if block.name.as_str() == name) {
                found = Some(place);
            }
            place += 1;
        });
        found
    }
}
