//! Digest of the outputs of a program over many scans with pseudo-random inputs. A program has one digest, on every processor and in
//! every build: replicas on different machines agree bit for bit, or their digests differ.

use understudy_logic::Random;
use understudy_typed::{Elementary, Point, Program};

use crate::{Executable, Interface, Scratch};

/// Scans from one warm start to the next, of a program with retentive variables.
const RESTART: u64 = 97;

/// Outputs of many scans as one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest {
    /// FNV-1a over the words of all outputs, scan by scan.
    pub outputs: u64,
    /// Program faults, each of which was reset in the scan after it.
    pub faults: u64,
}

/// Executes a program from its initial state. An input keeps its value in three of four scans, so that timers and integrals move; one with
/// retentive variables is restarted warm now and then.
pub fn digest(executable: &Executable, interface: &Interface, scans: u64) -> Digest {
    let Interface { inputs, outputs } = interface;
    let mut scratch = Scratch::default();
    let mut state = executable.initial().to_vec();
    let mut read = vec![0; inputs.width().div_ceil(64)];
    let mut driven = vec![0; outputs.width().div_ceil(64)];
    let (reset, fault) = (inputs.find(Program::RESET), outputs.find(Program::FAULT));
    let mut random = Random(0);
    let mut digest = Digest { outputs: 0xcbf2_9ce4_8422_2325, faults: 0 };
    for scan in 0..scans {
        if executable.is_retentive() && scan % RESTART == RESTART - 1 {
            state = executable.restarted(&state);
        }
        let stopped = fault.is_some_and(|fault| fault.get(&driven) == 1);
        for point in inputs.iter() {
            if Some(point) == reset {
                point.set(&mut read, u64::from(stopped));
            } else if random.is_one_of(4) {
                point.set(&mut read, value(&mut random, point));
            }
        }
        executable.step(&mut scratch, &mut state, &read, &mut driven);
        digest.faults += u64::from(!stopped && fault.is_some_and(|fault| fault.get(&driven) == 1));
        for word in &driven {
            digest.outputs = (digest.outputs ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    digest
}

/// A value as it is stored: reals from -1000 to 1000 in thousandths, times up to 10 s, everything else in the subrange
/// or the range of its type.
fn value(random: &mut Random, point: &Point) -> u64 {
    let number = random.number();
    let real = (number % 2_000_001) as f64 / 1000.0 - 1000.0;
    match point.of {
        Elementary::Real => u64::from((real as f32).to_bits()),
        Elementary::Lreal => real.to_bits(),
        of if of.is_time() => number % 10_000_000_000,
        of => match point.range {
            Some((low, high)) => {
                let count = high.abs_diff(low).saturating_add(1);
                low.wrapping_add_unsigned(u128::from(number) % count) as u64 & of.mask()
            }
            None => number & of.mask(),
        },
    }
}
