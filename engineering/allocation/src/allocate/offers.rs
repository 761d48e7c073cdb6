//! What can be bought for a position: each controller alone, and with the modules that a position needs.

use super::Options;
use super::preference::Preference;
use crate::controller::{Catalogue, Controller};
use crate::fit::{Fit, fit};
use crate::modules::{Modules, assess};
use crate::need::Need;

/// A controller with its modules.
pub(super) struct Offer {
    /// Number of the controller; offers with one number draw on one stock.
    pub(super) model: usize,
    /// With modules its figures are the sums.
    pub(super) controller: Controller,
    /// None for the controller alone.
    pub(super) modules: Vec<Modules>,
    /// Available number; unlimited if none.
    pub(super) stock: Option<usize>,
}

/// The controllers alone, by number, then those with modules; and for each need how each offer meets it. Without a need there is no answer.
pub(super) fn of(
    catalogue: &Catalogue,
    types: &[(&Controller, Option<usize>)],
    needs: &[Option<&Need>],
    options: &Options,
) -> (Vec<Offer>, Vec<Vec<Fit>>) {
    let by_price = options.preference == Preference::Cost;
    let alone = types.iter().enumerate().map(|(model, (controller, stock))| Offer {
        model,
        controller: (*controller).clone(),
        modules: Vec::new(),
        stock: *stock,
    });
    let mut offers: Vec<Offer> = alone.collect();
    let mut fits: Vec<Vec<Fit>> = vec![Vec::new(); needs.len()];
    for (need, fits) in needs.iter().zip(&mut fits) {
        let Some(need) = need else { continue };
        for (model, (controller, stock)) in types.iter().enumerate() {
            let assessed = assess(catalogue, controller, need, &options.terms, by_price);
            fits.push(assessed.alone);
            let Some((controller, modules)) = assessed.extended else { continue };
            if !offers.iter().any(|offer| offer.model == model && offer.modules == modules) {
                offers.push(Offer { model, controller, modules, stock: *stock });
            }
        }
    }
    for (need, fits) in needs.iter().zip(&mut fits) {
        let Some(need) = need else { continue };
        for offer in &offers[types.len()..] {
            let family = catalogue.families.get(&offer.controller.family);
            fits.push(fit(&offer.controller, family, need, &options.terms));
        }
    }
    (offers, fits)
}

/// For one position the best offer of each controller: the best verdict, then the fewest modules.
pub(super) fn best_of_each(offers: &[Offer], fits: &[Fit]) -> Vec<usize> {
    let key = |place: usize| (fits[place].verdict, offers[place].parts());
    let mut best: Vec<usize> = Vec::new();
    for (place, offer) in offers.iter().enumerate().take(fits.len()) {
        // The controllers alone come first, by number.
        match best.get_mut(offer.model) {
            None => best.push(place),
            Some(known) if key(place) < key(*known) => *known = place,
            Some(_) => {}
        }
    }
    best
}

impl Offer {
    /// Number of its modules.
    pub(super) fn parts(&self) -> u64 {
        self.modules.iter().map(|of| of.count).sum()
    }
}
