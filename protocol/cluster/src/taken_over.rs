//! What a program takes over in an online change, for proofs about it.

use understudy_executable::Scratch;
use understudy_typed::Origin;

use crate::code::{Code, Way};

/// Where the values of a program come from when it takes the place of the one before it, as far as stations hold them.
pub fn origins(before: &Code, after: &Code) -> Vec<Origin> {
    let mut origins = after.successor(before, Way::There).origins();
    origins.retain(|origin| before.holds_address(origin.before));
    origins
}

/// The states of both programs, in the order of their variables, at a change in a state of the one before as stations hold it.
///
/// # Panics
/// If `state` is shorter than a state of `before`.
pub fn states_at_change(before: &Code, after: &Code, state: &[u64]) -> [Vec<u64>; 2] {
    let changed = after.changed(before, state, &after.successor(before, Way::There));
    [before.typed_state(state).into_owned(), after.typed_state(&changed).into_owned()]
}

/// A variable whose value becomes the nearest one that the circuit of the program after the change has; only circuits lack values.
pub fn nearest_of(before: &Code, after: &Code) -> Option<String> {
    after.nearest(before)
}

impl Code {
    /// The state after a scan, as stations hold it; of a state and inputs that are shorter, the rest is 0.
    pub fn after_scan(&self, state: &[u64], inputs: &[u64]) -> Vec<u64> {
        let executable = self.executable();
        let words = |bits: usize| bits.div_ceil(64);
        let mut after = state.to_vec();
        after.resize(words(executable.state_count()), 0);
        let mut given = inputs.to_vec();
        given.resize(words(executable.input_count()), 0);
        let mut outputs = vec![0; words(executable.output_count())];
        executable.step(&mut Scratch::default(), &mut after, &given, &mut outputs);
        after
    }
}
