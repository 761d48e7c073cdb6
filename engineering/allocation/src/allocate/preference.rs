//! What is best among what fits.

use std::cmp::Ordering;

use serde::Serialize;

use super::offers::{Offer, best_of_each};
use super::{AllocationError, Candidate};
use crate::figures::{Quantity, Statement};
use crate::fit::{Fit, Verdict};

/// What is preferred.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preference {
    /// The least price; where prices are not known, the smallest that suffices.
    #[default]
    Cost,
    /// The smallest program memory that suffices.
    Memory,
    /// The shortest time of an instruction.
    Speed,
    /// The largest smallest margin.
    Reserve,
}

/// A smaller number of controllers is preferred to better controllers.
const BOX: f64 = 10_000.0;

/// The controllers in the order of a preference.
pub(super) struct Order {
    preference: Preference,
    /// Whether costs are prices.
    priced: bool,
    /// Of each type, by number: its place in the order, and its price.
    places: Vec<(usize, Option<u64>)>,
}

pub(super) fn order(
    offers: &[Offer],
    controllers: usize,
    preference: Preference,
    remarks: &mut Vec<String>,
) -> Result<Order, AllocationError> {
    let prices: Vec<Option<u64>> =
        offers.iter().map(|offer| offer.controller.number(Quantity::Price)).collect();
    let known = prices[..controllers].iter().flatten().count();
    let priced = preference == Preference::Cost && known > 0;
    if priced {
        let mut currencies: Vec<String> = offers
            .iter()
            .map(|offer| &offer.controller)
            .filter(|controller| controller.number(Quantity::Price).is_some())
            .filter_map(|controller| controller.text(Statement::Currency))
            .map(str::to_owned)
            .collect();
        currencies.sort();
        currencies.dedup();
        if currencies.len() > 1 {
            return Err(AllocationError::Currencies(currencies));
        }
    }
    if preference == Preference::Cost && known < controllers {
        remarks.push(if known == 0 {
            "no price is known: sufficient models are ranked by memory size, and the smallest number of controllers is \
             taken (`understudy catalogue import FILE --update` brings prices)"
                .to_owned()
        } else {
            format!(
                "{} of {} prices are unknown: models without a price are ranked after those with one, by memory size",
                controllers - known,
                controllers
            )
        });
    }
    let mut order: Vec<usize> = (0..offers.len()).collect();
    order.sort_by_key(|&place| {
        let controller = &offers[place].controller;
        let number = |quantity| controller.number(quantity).unwrap_or(u64::MAX);
        let memory = number(Quantity::ProgramMemoryBytes);
        let points = number(Quantity::DigitalInputs);
        let first = match preference {
            Preference::Cost => number(Quantity::Price),
            Preference::Memory | Preference::Reserve => memory,
            Preference::Speed => number(Quantity::BoolInstructionNs),
        };
        (first, offers[place].parts(), memory, points, place)
    });
    let mut places = vec![(0, None); offers.len()];
    for (rank, &place) in order.iter().enumerate() {
        places[place] = (rank, prices[place]);
    }
    Ok(Order { preference, priced, places })
}

impl Order {
    /// Cost of a controller type: its price; without prices, an additional controller costs more than any choice of type.
    pub(super) fn cost<'a>(&self, place: usize, fits: impl Iterator<Item = &'a Fit>) -> f64 {
        let (rank, price) = self.places[place];
        if self.priced {
            // What has no price is dearer than what has one.
            let dearest = self.places.iter().filter_map(|(_, price)| *price).max();
            let dearest = dearest.unwrap_or(0) as f64;
            return match price {
                Some(price) => price as f64,
                None => 10.0 * dearest + rank as f64 + 1.0,
            };
        }
        if self.preference == Preference::Reserve {
            let margins = fits.filter(|fit| fit.verdict == Verdict::Fits);
            let smallest = margins.filter_map(Fit::smallest_margin).fold(1.0_f64, f64::min);
            return BOX + 100.0 * (1.0 - smallest) + rank as f64 / 1000.0;
        }
        BOX + rank as f64
    }

    /// The controllers for one box, the best first.
    pub(super) fn rank(&self, offers: &[Offer], fits: &[Fit]) -> Vec<Candidate> {
        let mut order = best_of_each(offers, fits);
        let missing = |fit: &Fit| fit.with(Verdict::Unknown).count();
        order.sort_by(|&left, &right| {
            let (one, other) = (&fits[left], &fits[right]);
            let verdicts = one.verdict.cmp(&other.verdict);
            let verdicts = verdicts.then(missing(one).cmp(&missing(other)));
            let preferred = if self.preference == Preference::Reserve {
                let margin = |fit: &Fit| fit.smallest_margin().unwrap_or(0.0);
                margin(other).total_cmp(&margin(one))
            } else {
                Ordering::Equal
            };
            verdicts.then(preferred).then(self.places[left].0.cmp(&self.places[right].0))
        });
        let candidate = |place: usize| Candidate {
            vendor: offers[place].controller.vendor.clone(),
            model: offers[place].controller.model.clone(),
            modules: offers[place].modules.clone(),
            fit: fits[place].clone(),
            notes: offers[place].controller.notes.clone(),
        };
        order.into_iter().map(candidate).collect()
    }
}
