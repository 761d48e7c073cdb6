//! Formulas as sets of listed states.

use std::ops::Range;

use super::lanes::{LANES, Lanes, first_of};
use super::{Explicit, Set};
use crate::program::words;
use crate::property::{Formula, Path};
use crate::symbolic::{Core, Resolved, Signal};

impl Explicit {
    /// Whether each of `properties` holds from every first scan, and the inputs of a run that shows it: for `AG p` that fails, or `EF p` that holds.
    pub fn check(&self, properties: &[Resolved]) -> Vec<(bool, Option<Vec<Vec<bool>>>)> {
        let mut signals: Vec<Signal> = properties
            .iter()
            .flat_map(|property| property.signals().into_iter().copied())
            .collect();
        signals.sort_unstable();
        signals.dedup();
        let values = self.values(&signals);
        let model = Model { listed: self, ways_back: WaysBack::of(self), signals, values };
        properties.iter().map(|property| model.check(property)).collect()
    }

    /// For each formula of one scan the shortest run to where it is broken, as far as states are listed.
    pub(crate) fn broken(&self, kept: &[Resolved]) -> Vec<Option<Vec<Vec<bool>>>> {
        let mut broken = vec![None; kept.len()];
        let mut lanes = Lanes::default();
        for states in batches(self.ended() * self.ways) {
            lanes.scan(self, states.clone());
            for (formula, broken) in kept.iter().zip(&mut broken) {
                if broken.is_none() {
                    let lost = words(formula, &lanes.outputs, &lanes.inputs).map(|word| !word);
                    *broken = first_of(&lost, &states).map(|state| self.run_to(state));
                }
            }
        }
        broken
    }

    /// Of how many x every scan was listed.
    pub(crate) fn ended(&self) -> usize {
        self.next.len() / self.ways
    }

    fn empty(&self) -> Set {
        Set(vec![0; self.states().div_ceil(64)])
    }

    /// For each signal the states in which it is 1.
    fn values(&self, signals: &[Signal]) -> Vec<Set> {
        let mut values = vec![self.empty(); signals.len()];
        let mut lanes = Lanes::default();
        for states in batches(self.states()) {
            lanes.scan(self, states.clone());
            for (signal, value) in signals.iter().zip(&mut values) {
                let words = match signal {
                    Signal::Output(output) => lanes.outputs[*output],
                    Signal::Input(input) => lanes.inputs[*input],
                };
                // What is past the last state is in the list of none.
                let places = value.0[states.start / 64..].iter_mut();
                places.zip(words).for_each(|(place, word)| *place = word);
            }
        }
        values
    }
}

/// The states below `end`, as many at once as are scanned.
fn batches(end: usize) -> impl Iterator<Item = Range<usize>> {
    let starts = (0..end).step_by(LANES);
    starts.map(move |start| start..end.min(start + LANES))
}

/// For each x the x from which some scan leads to it, each once.
struct WaysBack {
    /// Where those of each x begin.
    starts: Vec<u32>,
    from: Vec<u32>,
}

impl WaysBack {
    fn of(listed: &Explicit) -> Self {
        let count = listed.origins.len();
        let mut edges: Vec<(u32, u32)> = Vec::new();
        let mut row = Vec::with_capacity(listed.ways);
        for (from, ways) in listed.next.chunks(listed.ways).enumerate() {
            row.clear();
            row.extend_from_slice(ways);
            row.sort_unstable();
            row.dedup();
            edges.extend(row.iter().map(|&to| (to, from as u32)));
        }
        let mut starts = vec![0_u32; count + 1];
        for &(to, _) in &edges {
            starts[to as usize + 1] += 1;
        }
        for place in 0..count {
            starts[place + 1] += starts[place];
        }
        let mut places = starts.clone();
        let mut from = vec![0; edges.len()];
        for (to, source) in edges {
            let place = &mut places[to as usize];
            from[*place as usize] = source;
            *place += 1;
        }
        Self { starts, from }
    }

    fn to(&self, to: usize) -> &[u32] {
        &self.from[self.starts[to] as usize..self.starts[to + 1] as usize]
    }
}

/// The states with the signals that are asked for.
struct Model<'e> {
    listed: &'e Explicit,
    ways_back: WaysBack,
    signals: Vec<Signal>,
    values: Vec<Set>,
}

impl Model<'_> {
    fn check(&self, property: &Resolved) -> (bool, Option<Vec<Vec<bool>>>) {
        let ways = self.listed.ways;
        let first_in = |set: &Set, wanted| set.first(wanted, self.listed.states());
        match property {
            // All states that are listed can be reached, so this needs no fixed point.
            Formula::Always(Path::All, inner) => {
                let lost = first_in(&self.set(&Core::of(inner)), false);
                (lost.is_none(), lost.map(|state| self.listed.run_to(state)))
            }
            Formula::Eventually(Path::Some, inner) => {
                let holds = self.set(&Core::of(property));
                let holds = (0..ways).all(|state| holds.contains(state));
                let shown = first_in(&self.set(&Core::of(inner)), true);
                let run = shown.filter(|_| holds);
                (holds, run.map(|state| self.listed.run_to(state)))
            }
            _ => {
                let set = self.set(&Core::of(property));
                ((0..ways).all(|state| set.contains(state)), None)
            }
        }
    }

    fn set(&self, formula: &Core) -> Set {
        match formula {
            Core::Constant(value) => {
                Set(vec![u64::from(*value).wrapping_neg(); self.listed.states().div_ceil(64)])
            }
            Core::Signal(signal) => {
                let place = self.signals.binary_search(signal);
                self.values[place.expect("signals were collected")].clone()
            }
            Core::Not(inner) => {
                let mut set = self.set(inner);
                for word in &mut set.0 {
                    *word = !*word;
                }
                set
            }
            Core::And(left, right) => {
                let mut set = self.set(left);
                for (word, other) in set.0.iter_mut().zip(&self.set(right).0) {
                    *word &= other;
                }
                set
            }
            Core::Next(inner) => self.before(&self.set(inner)),
            Core::Until(hold, end) if **hold == Core::Constant(true) => self.reaches(self.set(end)),
            Core::Until(hold, end) => self.until(&self.set(hold), self.set(end)),
            Core::Always(inner) => self.always(self.set(inner)),
            Core::Reaches(scans, inner) => {
                let end = self.set(inner);
                self.rounds(*scans, &end, |end, before| end | before)
            }
            Core::Stays(scans, inner) => {
                let kept = self.set(inner);
                self.rounds(*scans, &kept, |kept, before| kept & before)
            }
        }
    }

    /// For each x whether some inputs lead into the set.
    fn some(&self, set: &Set) -> Vec<bool> {
        let ways = self.listed.ways;
        let registers = 0..self.listed.origins.len();
        if ways < 64 {
            let all = (1 << ways) - 1;
            return registers
                .map(|from| set.0[from * ways / 64] >> (from * ways % 64) & all != 0)
                .collect();
        }
        let words = set.0.chunks(ways / 64);
        let some = words.map(|words| words.iter().any(|&word| word != 0));
        some.collect()
    }

    /// EX
    fn before(&self, set: &Set) -> Set {
        let some = self.some(set);
        let mut before = self.listed.empty();
        for (state, &next) in self.listed.next.iter().enumerate() {
            if some[next as usize] {
                before.insert(state);
            }
        }
        before
    }

    /// EF: backwards from x to x, whatever the inputs.
    fn reaches(&self, end: Set) -> Set {
        let mut some = self.some(&end);
        let known = some.iter().enumerate().filter(|&(_, &known)| known);
        let mut pending: Vec<usize> = known.map(|(to, _)| to).collect();
        while let Some(to) = pending.pop() {
            for &from in self.ways_back.to(to) {
                if !std::mem::replace(&mut some[from as usize], true) {
                    pending.push(from as usize);
                }
            }
        }
        let mut set = end;
        if some.iter().all(|&some| some) {
            set.0.fill(u64::MAX);
            return set;
        }
        for (state, &next) in self.listed.next.iter().enumerate() {
            if some[next as usize] {
                set.insert(state);
            }
        }
        set
    }

    /// E[hold U end]. States lead to later numbers and back; so the states are gone through in both directions, until nothing is added.
    fn until(&self, hold: &Set, end: Set) -> Set {
        let mut set = end;
        let mut some = self.some(&set);
        let mut added = true;
        let mut add = |state: usize, set: &mut Set| {
            let adds = !set.contains(state)
                && hold.contains(state)
                && some[self.listed.next[state] as usize];
            if adds {
                set.insert(state);
                some[state / self.listed.ways] = true;
            }
            adds
        };
        while added {
            added = false;
            for state in (0..self.listed.states()).rev() {
                added |= add(state, &mut set);
            }
            for state in 0..self.listed.states() {
                added |= add(state, &mut set);
            }
        }
        set
    }

    /// EG
    fn always(&self, inside: Set) -> Set {
        let mut set = inside;
        loop {
            let some = self.some(&set);
            let mut lost = false;
            for (state, &next) in self.listed.next.iter().enumerate() {
                if set.contains(state) && !some[next as usize] {
                    set.remove(state);
                    lost = true;
                }
            }
            if !lost {
                return set;
            }
        }
    }

    fn rounds(&self, scans: u32, start: &Set, join: impl Fn(u64, u64) -> u64) -> Set {
        let mut set = start.clone();
        for _ in 0..scans {
            let before = self.before(&set);
            let words = start.0.iter().zip(&before.0);
            let next = Set(words.map(|(&start, &before)| join(start, before)).collect());
            if next == set {
                break;
            }
            set = next;
        }
        set
    }
}
