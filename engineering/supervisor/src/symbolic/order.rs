//! Assignment of components to levels.

use crate::alphabet::Label;
use crate::automaton::Automaton;

/// An order of the components in which those that share events stand near each other: F. Aloul, I. Markov, K. Sakallah, *FORCE*
/// (2003). Each event pulls its components to their centre of gravity; the order with the smallest sum of spans is kept.
pub(super) fn force(parts: &[&Automaton]) -> Vec<usize> {
    let mut labels: Vec<Label> = parts.iter().flat_map(|part| part.alphabet().labels()).collect();
    labels.sort_unstable();
    labels.dedup();
    let knowing = |label: &Label| -> Vec<usize> {
        (0..parts.len()).filter(|&part| parts[part].alphabet().contains(*label)).collect()
    };
    let events: Vec<Vec<usize>> = labels.iter().map(knowing).collect();
    let mut order: Vec<usize> = (0..parts.len()).collect();
    let mut best = (span(&events, &order), order.clone());
    // The sum of spans falls for a few rounds that grow with the logarithm of the size.
    for _ in 0..10 * (1 + parts.len().checked_ilog2().unwrap_or(0)) {
        let place = places(&order);
        let mut pull = vec![(0.0, 0_u32); parts.len()];
        for event in &events {
            let sum: usize = event.iter().map(|&part| place[part]).sum();
            let centre = sum as f64 / event.len() as f64;
            for &part in event {
                pull[part].0 += centre;
                pull[part].1 += 1;
            }
        }
        let wish = |part: usize| match pull[part] {
            (_, 0) => place[part] as f64,
            (sum, count) => sum / f64::from(count),
        };
        order.sort_by(|&left, &right| wish(left).total_cmp(&wish(right)));
        let sum = span(&events, &order);
        if sum < best.0 {
            best = (sum, order.clone());
        }
    }
    best.1
}

fn places(order: &[usize]) -> Vec<usize> {
    let mut places = vec![0; order.len()];
    for (place, &part) in order.iter().enumerate() {
        places[part] = place;
    }
    places
}

fn span(events: &[Vec<usize>], order: &[usize]) -> usize {
    let place = places(order);
    let spans = events.iter().map(|event| {
        let at = |part: &usize| place[*part];
        event.iter().map(at).max().unwrap_or(0) - event.iter().map(at).min().unwrap_or(0)
    });
    spans.sum()
}
