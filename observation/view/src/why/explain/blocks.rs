//! Why a block is as it is: a timer, a counter, a latch or an edge, and the earlier scan in which that began.

use understudy_ladder::{BlockKind, Element, ElementFlow, Reading, visit};
use understudy_text::duration;

use super::super::Reason;
use super::super::power::{AtBlock, Node, at_block, nodes};
use super::{DEEPEST, Explainer, FARTHEST, MOST};

impl Explainer<'_> {
    /// A block as an element of the rung `below` sees it: of this scan where the block is in front of the element, of the one before otherwise.
    pub(super) fn block(
        &mut self,
        name: &str,
        (below, element): (usize, &Element),
        place: usize,
        depth: usize,
    ) -> Option<Reason> {
        let rung = self.rung_of(name)?;
        let is_before = rung < below || rung == below && self.is_before(rung, name, element);
        let place = if is_before { place } else { self.history.scan_before(place)? };
        self.block_at(name, rung, place, depth)
    }

    /// The rung with the block of this name.
    pub(super) fn rung_of(&self, name: &str) -> Option<usize> {
        self.program.rungs.iter().position(|rung| {
            let mut found = false;
            visit(&rung.network, &mut |element| {
                found |= matches!(element, Element::Block(block) if block.name.as_str() == name);
            });
            found
        })
    }

    /// Whether a block of a rung is called before an element of it is looked at.
    fn is_before(&self, rung: usize, name: &str, element: &Element) -> bool {
        let (mut is_called, mut found) = (false, false);
        visit(&self.program.rungs[rung].network, &mut |seen| {
            if std::ptr::eq(seen, element) {
                found = is_called;
            }
            is_called |= matches!(seen, Element::Block(block) if block.name.as_str() == name);
        });
        found
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
        reason.because = self.inputs_at(name, rung, at.unwrap_or(place), depth);
        Some(reason)
    }

    /// Why an input of a block has power in a scan, or has none; nothing for an output, which the block explains.
    pub(super) fn fed(
        &mut self,
        name: &str,
        pin: &str,
        rung: usize,
        place: usize,
    ) -> Option<Vec<Reason>> {
        let evaluation = self.evaluation(place)?;
        let flows = &evaluation.rungs[rung].elements;
        let network = nodes(&self.program.rungs[rung].network, &mut flows.iter());
        let found = at_block(&network, name)?;
        let input = found.block.kind.inputs().position(|input| input == pin)?;
        let elements = if input == 0 { found.wire.clone() } else { found.feed(pin).1 };
        Some(self.elements(&elements, rung, place, 1))
    }

    /// Why a block did what it did in an earlier scan: the input that decided.
    fn inputs_at(&mut self, name: &str, rung: usize, place: usize, depth: usize) -> Vec<Reason> {
        let Some(evaluation) = self.evaluation(place) else {
            return Vec::new();
        };
        let flows = &evaluation.rungs[rung].elements;
        let network = nodes(&self.program.rungs[rung].network, &mut flows.iter());
        let was = self.count_before(name, rung, place);
        match at_block(&network, name) {
            Some(found) => self.elements(&deciding(&found, was), rung, place, depth + 1),
            None => Vec::new(),
        }
    }

    /// CV of a counter after the scan before that of a step.
    fn count_before(&mut self, name: &str, rung: usize, place: usize) -> Option<u16> {
        let element = self.place_of_block(name, rung)?;
        let before = self.history.scan_before(place)?;
        let evaluation = self.evaluation(before)?;
        match evaluation.rungs[rung].elements.get(element)?.reading {
            Reading::Number(count) => Some(count),
            _ => None,
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
            Reading::Time(elapsed) => duration::text(elapsed),
            Reading::Number(number) => number.to_string(),
            _ => String::new(),
        };
        let kind = found.block.kind;
        let preset = kind.preset_time().map(duration::text).unwrap_or_default();
        match (kind.runs_while(), kind.preset_time(), kind.preset_value()) {
            (Some(on), ..) => {
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
                    format!("its {preset} are over")
                } else {
                    format!("{elapsed} of {preset}")
                };
                (format!("{what} {since}, {over}"), None)
            }
            (None, Some(_), _) => {
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
                        "its pulse began in cycle {}, {elapsed} of {preset}",
                        self.cycle(since)
                    ),
                    Some(since),
                )
            }
            (None, None, Some(preset)) => {
                let (since, known) = self.unchanged(name, rung, place, |flow| flow.reading);
                let since_text = if known {
                    format!(" since cycle {}", self.cycle(since))
                } else {
                    String::new()
                };
                (format!("CV is {elapsed}, PV {preset}{since_text}"), Some(since))
            }
            _ if matches!(kind, BlockKind::Sr | BlockKind::Rs) => {
                if leaves && !enters {
                    let (since, _) = self.unchanged(name, rung, place, |flow| flow.enters);
                    let set = self.history.scan_before(since).unwrap_or(since);
                    return (
                        format!("set in cycle {}, and unchanged since", self.cycle(set)),
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
            _ => {
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
            let Some(before) = self.history.scan_before(at) else {
                return (at, self.history.begins_at(at));
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

/// Why the input of a block that decided in a scan has power, or has none; `was` is CV of a counter before it.
fn deciding<'n, 'e>(found: &'n AtBlock<'n, 'e>, was: Option<u16>) -> Vec<&'n Node<'e>> {
    let is_off = !found.node.flow.leaves;
    let fallen = match (found.node.flow.reading, was) {
        (Reading::Number(count), Some(was)) => count < was,
        _ => false,
    };
    let pins: &[(&str, bool)] = match found.block.kind {
        BlockKind::Sr => &[("R", is_off)],
        BlockKind::Rs => &[("R1", is_off)],
        BlockKind::Ctu(_) => &[("R", true)],
        BlockKind::Ctd(_) => &[("LD", true)],
        BlockKind::Ctud(_) => &[("R", true), ("LD", true), ("CD", fallen)],
        _ => &[],
    };
    let mut pins = pins.iter().filter(|(_, decides)| *decides).map(|(pin, _)| found.feed(pin));
    pins.find(|(power, _)| *power).map_or_else(|| found.wire.clone(), |(_, elements)| elements)
}
