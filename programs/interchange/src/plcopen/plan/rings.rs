//! Objects that feed each other in a ring.

use super::links::Source;

/// The number of each object's ring: two objects have the same one if each feeds the other, directly or through others.
pub(super) fn rings(sources: &[Vec<Vec<Source>>]) -> Vec<usize> {
    let feeding: Vec<Vec<usize>> = sources
        .iter()
        .map(|inputs| {
            let sources = inputs.iter().flatten();
            let places = sources.filter_map(|source| match source {
                Source::Output(from, _) => Some(*from),
                Source::Rail => None,
            });
            places.collect()
        })
        .collect();
    let mut fed = vec![Vec::new(); sources.len()];
    for (place, feeding) in feeding.iter().enumerate() {
        for from in feeding {
            fed[*from].push(place);
        }
    }
    // Kosaraju: what finishes last is in a ring with what reaches it.
    let mut finished = Vec::with_capacity(sources.len());
    let mut is_seen = vec![false; sources.len()];
    for start in 0..sources.len() {
        let mut open = vec![(start, 0)];
        if std::mem::replace(&mut is_seen[start], true) {
            continue;
        }
        while let Some((place, next)) = open.last_mut() {
            match feeding[*place].get(*next) {
                Some(&from) => {
                    *next += 1;
                    if !std::mem::replace(&mut is_seen[from], true) {
                        open.push((from, 0));
                    }
                }
                None => {
                    finished.push(*place);
                    open.pop();
                }
            }
        }
    }
    let mut ring = vec![usize::MAX; sources.len()];
    for &start in finished.iter().rev() {
        let mut open = vec![start];
        while let Some(place) = open.pop() {
            if ring[place] == usize::MAX {
                ring[place] = start;
                open.extend(&fed[place]);
            }
        }
    }
    ring
}
