//! The reachable product of several automata.

use super::numbers::Numbers;
use super::{Bounds, TooLarge};
use crate::alphabet::Alphabet;
use crate::automaton::{Automaton, Edge, State};

/// How events that a component does not know are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Joint {
    /// They pass it by: TCT's sync.
    Synchronous,
    /// They are forbidden: TCT's meet.
    Meet,
}

/// States and transitions of a product, in breadth-first order.
pub(crate) struct Product {
    pub(crate) alphabet: Alphabet,
    pub(crate) marked: Vec<bool>,
    pub(crate) first: Vec<u32>,
    pub(crate) edges: Vec<Edge>,
    /// States where a specification forbids what the plant does uncontrollably; nothing leaves them.
    pub(crate) violated: Vec<State>,
    fields: Vec<Field>,
    words: usize,
    tuples: Vec<u64>,
}

impl Product {
    /// The product of `plants` and `specifications`; the search goes no further where a specification forbids an
    /// uncontrollable event that the plants enable. Without specifications it is the plain product.
    pub(crate) fn explore(
        plants: &[&Automaton],
        specifications: &[&Automaton],
        joint: Joint,
        bounds: Bounds,
    ) -> Result<Self, TooLarge> {
        let parts: Vec<&Automaton> = plants.iter().chain(specifications).copied().collect();
        let alphabet = Alphabet::new([]).union(parts.iter().map(|part| part.alphabet()));
        let (fields, bits) = fields(&parts);
        let search = Search {
            components: parts.iter().map(|part| Component::new(part, &alphabet, joint)).collect(),
            plants: plants.len(),
            participants: participants(&parts, &alphabet),
            uncontrollable: uncontrollable(&alphabet),
            alphabet,
            fields,
            bits,
            bounds,
        };
        match bits {
            0..=64 => search.run::<1>(),
            65..=128 => search.run::<2>(),
            129..=256 => search.run::<4>(),
            257..=512 => search.run::<8>(),
            513..=WIDEST => search.run::<16>(),
            _ => Err(TooLarge::Tuple { bits, limit: WIDEST }),
        }
    }

    pub(crate) fn state_count(&self) -> usize {
        self.marked.len()
    }

    pub(crate) fn edges(&self, state: usize) -> &[Edge] {
        &self.edges[self.first[state] as usize..self.first[state + 1] as usize]
    }

    /// The state of component `component` in product state `state`.
    pub(crate) fn component_state(&self, state: usize, component: usize) -> State {
        let tuple = &self.tuples[state * self.words..(state + 1) * self.words];
        State::new(self.fields[component].get(tuple))
    }

    /// All of it as an automaton.
    pub(crate) fn into_automaton(self, name: String) -> Automaton {
        Automaton::from_parts(name, self.alphabet, self.marked, self.first, self.edges)
    }
}

const WIDEST: usize = 16 * 64;

/// Where a component's state lies in a tuple.
#[derive(Debug, Clone, Copy)]
struct Field {
    word: usize,
    shift: u32,
    mask: u64,
}

impl Field {
    fn get(self, tuple: &[u64]) -> u32 {
        ((tuple[self.word] >> self.shift) & self.mask) as u32
    }

    fn set(self, tuple: &mut [u64], state: u32) {
        let word = &mut tuple[self.word];
        *word = (*word & !(self.mask << self.shift)) | (u64::from(state) << self.shift);
    }
}

/// A field for each component, none across a border of words; and the bits up to the end of the last one.
fn fields(parts: &[&Automaton]) -> (Vec<Field>, usize) {
    let mut next = 0;
    let fields = parts.iter().map(|part| {
        let last = part.state_count().saturating_sub(1) as u64;
        let width = 64 - last.leading_zeros();
        if next % 64 + width as usize > 64 {
            next = next.next_multiple_of(64);
        }
        let field = Field {
            // A component of one state takes no bit; its word must exist nevertheless.
            word: if width == 0 { 0 } else { next / 64 },
            shift: (next % 64) as u32,
            mask: (1_u64 << width) - 1,
        };
        next += width as usize;
        field
    });
    (fields.collect(), next)
}

fn participants(parts: &[&Automaton], alphabet: &Alphabet) -> Vec<Vec<u32>> {
    let of = |label| {
        let numbered = parts.iter().enumerate();
        let knowing = numbered.filter(move |(_, part)| part.alphabet().contains(label));
        knowing.map(|(number, _)| number as u32).collect()
    };
    alphabet.labels().map(of).collect()
}

fn uncontrollable(alphabet: &Alphabet) -> Vec<u64> {
    let mut set = vec![0; alphabet.len().div_ceil(64)];
    for (place, label) in alphabet.labels().enumerate() {
        set[place / 64] |= u64::from(!label.is_controllable()) << (place % 64);
    }
    set
}

/// A component, with its alphabet as bit sets over the product's.
struct Component<'a> {
    automaton: &'a Automaton,
    /// Events of its own alphabet.
    own: Vec<u64>,
    /// For each state, the events that it does not forbid.
    allowed: Vec<u64>,
}

impl<'a> Component<'a> {
    fn new(automaton: &'a Automaton, alphabet: &Alphabet, joint: Joint) -> Self {
        let words = alphabet.len().div_ceil(64);
        let mut own = vec![0; words];
        let mut places = Vec::with_capacity(automaton.alphabet().len());
        for label in automaton.alphabet().labels() {
            // The union holds every label of its parts.
            let place = alphabet.place(label).unwrap_or_default() as usize;
            own[place / 64] |= 1 << (place % 64);
            places.push(place);
        }
        let passing = own.iter().map(|own: &u64| match joint {
            Joint::Synchronous => !own,
            Joint::Meet => 0,
        });
        let passing: Vec<u64> = passing.collect();
        let mut allowed = Vec::with_capacity(automaton.state_count() * words);
        for state in automaton.states() {
            let start = allowed.len();
            allowed.extend_from_slice(&passing);
            for edge in automaton.edges(state) {
                let place = places[edge.event as usize];
                allowed[start + place / 64] |= 1 << (place % 64);
            }
        }
        Self { automaton, own, allowed }
    }

    /// Where `event`, which is enabled and its own, leads: its edges are in the order of the product's alphabet, so the place among
    /// them is the number of its enabled events before.
    fn target(&self, state: u32, event: usize) -> u32 {
        let words = self.own.len();
        let allowed = &self.allowed[state as usize * words..];
        let word = event / 64;
        let before = (0..word).map(|word| (allowed[word] & self.own[word]).count_ones());
        let rank = before.sum::<u32>()
            + (allowed[word] & self.own[word] & ((1 << (event % 64)) - 1)).count_ones();
        self.automaton.edges(State::new(state))[rank as usize].target.number()
    }
}

struct Search<'a> {
    components: Vec<Component<'a>>,
    plants: usize,
    participants: Vec<Vec<u32>>,
    uncontrollable: Vec<u64>,
    alphabet: Alphabet,
    fields: Vec<Field>,
    bits: usize,
    bounds: Bounds,
}

impl Search<'_> {
    fn run<const WORDS: usize>(self) -> Result<Product, TooLarge> {
        let mut numbers = Numbers::<WORDS>::new(self.bits);
        let mut edges: Vec<Edge> = Vec::new();
        let mut first = vec![0];
        let mut marked = Vec::new();
        let mut violated = Vec::new();
        let mut local = vec![0; self.components.len()];
        let mut enabled = vec![0; self.uncontrollable.len()];
        if self.components.iter().all(|component| !component.automaton.is_empty()) {
            numbers.number([0; WORDS]);
        }
        let mut state = 0;
        while state < numbers.len() {
            let tuple = numbers.tuple(state);
            for (local, field) in local.iter_mut().zip(&self.fields) {
                *local = field.get(&tuple);
            }
            marked.push(self.is_marked(&local));
            if self.enable(&local, &mut enabled) {
                for (word, &set) in enabled.iter().enumerate() {
                    let mut set = set;
                    while set != 0 {
                        let event = word * 64 + set.trailing_zeros() as usize;
                        set &= set - 1;
                        let next = self.next(tuple, &local, event);
                        let number = numbers.number(next);
                        edges.push(Edge { event: event as u32, target: State::new(number) });
                    }
                }
            } else {
                violated.push(State::new(state as u32));
            }
            first.push(edges.len() as u32);
            state += 1;
            // Each state looks once; what one state adds is bounded by the alphabet.
            if self.is_full::<WORDS>(numbers.len(), edges.len()) {
                return Err(TooLarge::Memory {
                    states: numbers.len(),
                    transitions: edges.len(),
                    memory_bytes: self.bounds.memory_bytes,
                });
            }
        }
        // What a growing list keeps in reserve would count twice beside the predecessors.
        edges.shrink_to_fit();
        Ok(Product {
            alphabet: self.alphabet,
            marked,
            first,
            edges,
            violated,
            fields: self.fields,
            words: WORDS,
            tuples: numbers.into_words(),
        })
    }

    fn is_marked(&self, local: &[u32]) -> bool {
        let mut components = self.components.iter().zip(local);
        components.all(|(component, &state)| component.automaton.is_marked(State::new(state)))
    }

    /// Puts what all components allow into `enabled`; false where a specification forbids an uncontrollable event of the plants.
    fn enable(&self, local: &[u32], enabled: &mut [u64]) -> bool {
        let words = enabled.len();
        let mut violated = 0;
        for (word, enabled) in enabled.iter_mut().enumerate() {
            let allowed = |component: usize| {
                self.components[component].allowed[local[component] as usize * words + word]
            };
            let plant = (0..self.plants).map(allowed).fold(!0, |all, set| all & set);
            let all = (self.plants..local.len()).map(allowed).fold(plant, |all, set| all & set);
            violated |= plant & !all & self.uncontrollable[word];
            *enabled = all;
        }
        // Bits past the alphabet's end pass every component.
        if let Some(last) = enabled.last_mut() {
            *last &= !0 >> (words * 64 - self.alphabet.len());
        }
        violated == 0
    }

    fn next<const WORDS: usize>(
        &self,
        mut tuple: [u64; WORDS],
        local: &[u32],
        event: usize,
    ) -> [u64; WORDS] {
        for &component in &self.participants[event] {
            let component = component as usize;
            let target = self.components[component].target(local[component], event);
            self.fields[component].set(&mut tuple, target);
        }
        tuple
    }

    fn is_full<const WORDS: usize>(&self, states: usize, transitions: usize) -> bool {
        // Tuple, place in the table, first transition, mark; and the state in the sets of the fixed point.
        let state = WORDS * 8 + 24;
        let bytes = states.saturating_mul(state) + transitions.saturating_mul(12);
        bytes > self.bounds.memory_bytes || states >= 1 << 31 || transitions >= u32::MAX as usize
    }
}
