//! What a box must have, for what it is to do.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::controller::Family;
use crate::figures::{FamilyQuantity, Figure};
use crate::requirement::{Requirement, Role};
use crate::resources::Resources;

/// Largest part of a capacity that may be kept free, in percent.
pub const MOST_RESERVE_PERCENT: u8 = 90;

/// Needs of one box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Need {
    /// Purpose of the position.
    pub role: Role,
    /// Digital inputs that are wired to it.
    pub inputs: u64,
    /// Digital outputs that are wired to it.
    pub outputs: u64,
    /// Analog inputs that are wired to it.
    pub analog_inputs: u64,
    /// Analog outputs that are wired to it.
    pub analog_outputs: u64,
    /// The program that it runs; a remote I/O runs none.
    pub program: Option<Resources>,
    /// Maximum scan time, if limited.
    pub scan_within: Option<Duration>,
    /// Whether it needs an Ethernet port.
    pub ethernet: bool,
}

impl Need {
    /// A controller without terminals, program and network.
    pub fn nothing() -> Self {
        Self {
            role: Role::Controller,
            inputs: 0,
            outputs: 0,
            analog_inputs: 0,
            analog_outputs: 0,
            program: None,
            scan_within: None,
            ethernet: false,
        }
    }
}

/// Rules for the comparison of needs with figures.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Terms {
    /// Part of each capacity that stays free, in percent; at most [`MOST_RESERVE_PERCENT`].
    pub reserve_percent: u8,
    /// Whether expansion modules are added where a controller alone is not sufficient.
    pub expansion: bool,
    /// Additional requirements.
    pub requirements: Vec<Requirement>,
    /// Assumed storage figures for families without figures in the catalogue.
    pub assumptions: BTreeMap<FamilyQuantity, u64>,
}

impl Terms {
    /// Usable part of a capacity.
    pub(crate) fn usable(&self, capacity: u64) -> u64 {
        let percent = 100 - u64::from(self.reserve_percent.min(MOST_RESERVE_PERCENT));
        // Capacities are below 2^41, so the product fits.
        capacity * percent / 100
    }

    /// The smallest capacity of which `need` is usable.
    pub(crate) fn capacity_for(&self, need: u64) -> u64 {
        let percent = 100 - u64::from(self.reserve_percent.min(MOST_RESERVE_PERCENT));
        need.saturating_mul(100).div_ceil(percent)
    }

    /// A figure of a family, or what is assumed in its place.
    pub(crate) fn of_family(
        &self,
        family: Option<&Family>,
        quantity: FamilyQuantity,
    ) -> Option<Figure<u64>> {
        let known = family.and_then(|family| family.numbers.get(&quantity));
        let assumed = self.assumptions.get(&quantity);
        known.cloned().or_else(|| {
            assumed.map(|&value| Figure { value, source: format!("assumed: {quantity} = {value}") })
        })
    }
}
