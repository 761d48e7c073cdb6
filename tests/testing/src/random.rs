//! Random programs of all element kinds, from a seed.

use std::time::Duration;

use understudy_ladder::{
    Address, Area, Block, BlockKind, Coil, CoilKind, Comparison, Contact, ContactKind, Element,
    Feed, Program, Relation, Rung, Series, Signal,
};

/// Random numbers, the same for the same seed: SplitMix64.
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    /// The numbers of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A random number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number from 0 to `bound` - 1.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.number() % bound as u64) as usize
    }

    /// One of the values.
    pub fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())].clone()
    }

    /// True once in `out_of` times.
    pub fn rarely(&mut self, out_of: usize) -> bool {
        self.below(out_of) == 0
    }

    /// Random bits.
    pub fn bits(&mut self, width: usize) -> Vec<bool> {
        (0..width).map(|_| self.rarely(2)).collect()
    }
}

/// A sound program with up to `rungs` rungs, of which some read below and some above what writes them.
pub fn random_program(seed: u64, rungs: usize) -> Program {
    let mut dice = Dice::new(seed);
    let mut program = Program {
        name: "random".into(),
        inputs: signals(&mut dice, "in", Area::Input, 4),
        outputs: signals(&mut dice, "out", Area::Output, 3),
        memory: signals(&mut dice, "bit", Area::Memory, 4),
        ..Program::default()
    };
    decorate(&mut dice, &mut program);
    // The skeleton first: which blocks there are decides what contacts can read.
    let mut blocks = 0;
    for _ in 0..=dice.below(rungs) {
        let network = skeleton(&mut dice, &mut blocks, 3);
        let targets: Vec<_> = program.writable().map(|signal| signal.name.clone()).collect();
        let coils = (0..1 + dice.below(2)).map(|_| Coil {
            kind: CoilKind::ALL[dice.below(6)],
            target: targets[dice.below(targets.len())].clone(),
        });
        let coils = coils.collect();
        program.rungs.push(Rung {
            title: dice
                .rarely(2)
                .then(|| dice.pick(&["a \"title\"", "back\\slash", ""]).to_owned()),
            comments: vec!["why".to_owned(); dice.below(3)],
            network,
            coils,
        });
    }
    let mut readable: Vec<String> = Vec::new();
    let signals = program.inputs.iter().chain(program.writable());
    readable.extend(signals.map(|signal| signal.name.to_string()));
    let mut counters = Vec::new();
    for block in program.blocks() {
        for pin in block.kind.outputs() {
            readable.push(format!("{}.{pin}", block.name));
        }
        if block.kind.preset_value().is_some() {
            counters.push(block.name.to_string());
        }
    }
    for rung in &mut program.rungs {
        fill(&mut dice, &mut rung.network, &readable, &counters);
    }
    // Numbers of its own: what is retentive does not change the rest.
    let mut dice = Dice::new(!seed);
    let signals = program.writable().map(|signal| signal.name.clone());
    let blocks = program.blocks().into_iter().map(|block| block.name.clone());
    let retained = signals.chain(blocks).filter(|_| dice.rarely(3)).collect();
    program.retained = retained;
    program
}

fn signals(dice: &mut Dice, name: &str, area: Area, most: usize) -> Vec<Signal> {
    (0..=dice.below(most))
        .map(|index| Signal {
            address: dice.rarely(2).then(|| Address { area, path: vec![0, index as u32] }),
            initial: (area != Area::Input && dice.rarely(2)).then(|| dice.rarely(2)),
            description: dice.rarely(3).then(|| "what it is".to_owned()),
            comments: vec!["above".to_owned(); dice.below(2)],
            ..Signal::new(format!("{name}{index}"))
        })
        .collect()
}

fn decorate(dice: &mut Dice, program: &mut Program) {
    program.comments = vec![String::new(); dice.below(2)];
    program.description = dice.rarely(2).then(|| "for a test".to_owned());
    program.footer = vec!["the end".to_owned(); dice.below(2)];
}

fn skeleton(dice: &mut Dice, blocks: &mut usize, depth: usize) -> Series {
    let least = usize::from(depth < 3);
    (0..least + dice.below(3))
        .map(|_| match dice.below(8) {
            0 | 1 if depth > 0 => Element::Branches(
                (0..2 + dice.below(2)).map(|_| skeleton(dice, blocks, depth - 1)).collect(),
            ),
            2 if depth > 0 => Element::Block(block(dice, blocks, depth)),
            3 => Element::Comparison(Comparison {
                counter: "".into(),
                relation: Relation::ALL[dice.below(6)],
                value: dice.below(7) as u16,
            }),
            _ => Element::Contact(Contact {
                kind: ContactKind::ALL[dice.below(4)],
                operand: "".into(),
            }),
        })
        .collect()
}

fn block(dice: &mut Dice, blocks: &mut usize, depth: usize) -> Block {
    *blocks += 1;
    let name = format!("block{blocks}");
    let time = Duration::from_millis(50 * dice.below(9) as u64);
    let value = dice.below(6) as u16;
    let kind = match dice.below(10) {
        0 => BlockKind::Ton(time),
        1 => BlockKind::Tof(time),
        2 => BlockKind::Tp(time),
        3 => BlockKind::Ctu(value),
        4 => BlockKind::Ctd(value),
        5 => BlockKind::Ctud(value),
        6 => BlockKind::Sr,
        7 => BlockKind::Rs,
        8 => BlockKind::RTrig,
        _ => BlockKind::FTrig,
    };
    let mut pins = Vec::new();
    for (pin, required) in kind.side_inputs() {
        if *required || dice.rarely(2) {
            pins.push(Feed { pin: (*pin).into(), network: skeleton(dice, blocks, depth - 1) });
        }
    }
    Block { name: name.into(), kind, pins }
}

/// Gives every contact and comparison something to read; a comparison without a counter becomes a contact.
fn fill(dice: &mut Dice, series: &mut Series, readable: &[String], counters: &[String]) {
    for element in series {
        match element {
            Element::Contact(contact) => contact.operand = dice.pick(readable).into(),
            Element::Comparison(comparison) if !counters.is_empty() => {
                comparison.counter = dice.pick(counters).into();
            }
            Element::Comparison(_) => {
                *element = Element::Contact(Contact {
                    kind: ContactKind::NormallyOpen,
                    operand: dice.pick(readable).into(),
                });
            }
            Element::Branches(branches) => {
                for branch in branches {
                    fill(dice, branch, readable, counters);
                }
            }
            Element::Block(block) => {
                for feed in &mut block.pins {
                    fill(dice, &mut feed.network, readable, counters);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use understudy_ladder::visit;

    #[test]
    fn random_programs_have_every_kind_of_element() {
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..200 {
            let program = random_program(seed, 6);
            for rung in &program.rungs {
                visit(&rung.network, &mut |element| {
                    seen.insert(match element {
                        Element::Contact(contact) => format!("contact {:?}", contact.kind),
                        Element::Comparison(comparison) => format!("{:?}", comparison.relation),
                        Element::Branches(_) => "branches".to_owned(),
                        Element::Block(block) => block.kind.word().to_owned(),
                    });
                });
                for coil in &rung.coils {
                    seen.insert(format!("coil {:?}", coil.kind));
                }
            }
        }
        assert_eq!(seen.len(), 4 + 6 + 1 + 10 + 6, "{seen:?}");
    }
}
