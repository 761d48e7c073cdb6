//! Which tuples are known, and under which numbers.

use std::hash::{BuildHasher, Hash, Hasher};

use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use rustc_hash::FxBuildHasher;

/// Tuples in the order in which they were met. They are looked up by hash, until they fill a quarter of all that could be: then
/// a table with a place for each is smaller and faster.
pub(super) struct Numbers<const WORDS: usize> {
    tuples: Vec<[u64; WORDS]>,
    places: Places,
    /// Tuples at which the table is worth its place.
    dense_from: usize,
    bits: usize,
}

enum Places {
    Hashed(HashTable<u32>),
    /// The number + 1 for each tuple of one word; 0 is none.
    Dense(Vec<u32>),
}

/// A table of 2^30 places takes 4 GB.
const WIDEST_TABLE: usize = 30;

impl<const WORDS: usize> Numbers<WORDS> {
    /// `bits` of a tuple are in use, the lowest ones.
    pub(super) fn new(bits: usize) -> Self {
        let dense_from = if bits <= WIDEST_TABLE { (1 << bits) / 4 } else { usize::MAX };
        Self {
            tuples: Vec::new(),
            places: Places::Hashed(HashTable::new()),
            dense_from: dense_from.max(1024),
            bits,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.tuples.len()
    }

    pub(super) fn tuple(&self, number: usize) -> [u64; WORDS] {
        self.tuples[number]
    }

    pub(super) fn into_words(self) -> Vec<u64> {
        self.tuples.into_flattened()
    }

    /// The number of `tuple`, a new one where it is new.
    pub(super) fn number(&mut self, tuple: [u64; WORDS]) -> u32 {
        let new = self.tuples.len() as u32;
        match &mut self.places {
            Places::Dense(table) => {
                let place = &mut table[tuple[0] as usize];
                if *place != 0 {
                    return *place - 1;
                }
                *place = new + 1;
            }
            Places::Hashed(table) => {
                let tuples = &self.tuples;
                let known = table.entry(
                    hash(&tuple),
                    |&number| tuples[number as usize] == tuple,
                    |&number| hash(&tuples[number as usize]),
                );
                match known {
                    Entry::Occupied(known) => return *known.get(),
                    Entry::Vacant(vacant) => vacant.insert(new),
                };
            }
        }
        self.tuples.push(tuple);
        if self.tuples.len() == self.dense_from {
            self.make_dense();
        }
        new
    }

    fn make_dense(&mut self) {
        let mut table = vec![0; 1 << self.bits];
        for (number, tuple) in self.tuples.iter().enumerate() {
            table[tuple[0] as usize] = number as u32 + 1;
        }
        self.places = Places::Dense(table);
    }
}

fn hash<const WORDS: usize>(tuple: &[u64; WORDS]) -> u64 {
    FxBuildHasher.hash_one(Packed(tuple))
}

/// Hashed without a length before it.
struct Packed<'a, const WORDS: usize>(&'a [u64; WORDS]);

impl<const WORDS: usize> Hash for Packed<'_, WORDS> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        for &word in self.0 {
            state.write_u64(word);
        }
    }
}
