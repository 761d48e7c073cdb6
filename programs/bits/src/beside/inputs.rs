//! Values of inputs: one after the other the ends of types and subranges, the values of enumerations, and what is next to a constant of the program;
//! any value in between.

use std::collections::HashSet;

use understudy_logic::Random;
use understudy_typed::Elementary;

use crate::System;
use crate::circuit::boundaries::position;
use crate::system::Input;

/// A restart comes in one of so many scans.
const RESTARTS: u64 = 16;
/// A BOOL changes in one of so many scans, so that timers run.
const CHANGES: u64 = 3;

/// The inputs of a system, scan by scan.
pub(super) struct Inputs<'s> {
    inputs: &'s [Input],
    /// Values that matter, for each input, which has one after the other.
    corners: Vec<Vec<u64>>,
    turns: Vec<usize>,
    restarts: Vec<bool>,
    random: Random,
    given: Vec<u64>,
}

impl<'s> Inputs<'s> {
    pub(super) fn new(system: &'s System, seed: u64) -> Self {
        let restarts = (0..system.inputs.len() as u32).map(|it| system.restarting.contains(&it));
        Self {
            corners: system.inputs.iter().map(|input| corners(system, input)).collect(),
            turns: vec![0; system.inputs.len()],
            restarts: restarts.collect(),
            given: system.inputs.iter().map(|input| inside(input, 0)).collect(),
            inputs: &system.inputs,
            random: Random(seed),
        }
    }

    /// Those of the next scan, as they are stored.
    pub(super) fn next(&mut self) -> &[u64] {
        let Self { inputs, corners, turns, restarts, random, given } = self;
        for (number, given) in given.iter_mut().enumerate() {
            let input = &inputs[number];
            if restarts[number] {
                *given = u64::from(random.is_one_of(RESTARTS));
            } else if input.of == Elementary::Bool {
                *given ^= u64::from(random.is_one_of(CHANGES));
            } else if random.is_one_of(2) {
                *given = match random.below(4) {
                    0 => inside(input, random.number()),
                    _ => {
                        let turn = turns[number];
                        turns[number] = (turn + 1) % corners[number].len();
                        corners[number][turn]
                    }
                };
            }
        }
        given
    }
}

/// Whether an input takes a stored value.
fn takes(input: &Input, stored: u64) -> bool {
    let (least, most) = input.limits;
    position(input.of, stored).is_some_and(|at| least <= at && at <= most)
}

/// A value of an input by any number.
fn inside(input: &Input, number: u64) -> u64 {
    let stored = number & input.of.mask();
    if takes(input, stored) {
        return stored;
    }
    if input.of.is_real() {
        return 0;
    }
    let (least, most) = input.limits;
    let count = (most - least).unsigned_abs() + 1;
    least.wrapping_add_unsigned(u128::from(number) % count) as u64 & input.of.mask()
}

fn corners(system: &System, input: &Input) -> Vec<u64> {
    let of = input.of;
    let constants = system.terms.constants(of);
    let mut corners: Vec<u64> = match of {
        Elementary::Real => {
            let constants = constants.iter().map(|&stored| f32::from_bits(stored as u32));
            let near = constants.flat_map(|it| [it, it.next_up(), it.next_down()]);
            let usual = [0.0, -0.0, 1.0, -1.0, 0.5, f32::MIN, f32::MAX, f32::MIN_POSITIVE];
            usual.into_iter().chain(near).map(|real| real.to_bits().into()).collect()
        }
        Elementary::Lreal => {
            let constants = constants.iter().map(|&stored| f64::from_bits(stored));
            let near = constants.flat_map(|it| [it, it.next_up(), it.next_down()]);
            let usual = [0.0, -0.0, 1.0, -1.0, 0.5, f64::MIN, f64::MAX, f64::MIN_POSITIVE];
            usual.into_iter().chain(near).map(f64::to_bits).collect()
        }
        _ => {
            let (least, most) = of.limits();
            let known = system.enumerated.get(&input.name);
            let named = known.and_then(|known| known.values.as_ref()).into_iter();
            let named = named.flat_map(|known| &known.values);
            let named = named.map(|(_, value)| i128::from(*value));
            let subrange = system.subranges.get(&input.name).copied().unwrap_or(input.limits);
            let ends = [input.limits.0, input.limits.1, subrange.0, subrange.1, least, most];
            let constants = constants.iter().map(|&stored| of.signed(stored));
            let near = ends.into_iter().chain(named).chain(constants);
            let near = near.flat_map(|number| [number, number - 1, number + 1]);
            let usual = [0, 1, -1].into_iter().chain(near);
            let usual = usual.filter(|number| least <= *number && *number <= most);
            usual.map(|number| number as u64 & of.mask()).collect()
        }
    };
    let mut known = HashSet::new();
    corners.retain(|&stored| takes(input, stored) && known.insert(stored));
    if corners.is_empty() {
        corners.push(inside(input, 0));
    }
    corners
}
