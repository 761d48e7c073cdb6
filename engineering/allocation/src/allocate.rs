//! The plan: ranked suitable controllers for every controller position of a plant, and the selection.
//!
//! Two rules come from the redundancy itself. An understudy never shares a box with a program of its own group, nor with another
//! understudy of it: when that box fails, what is to be restored and what restores it are gone together. And programs of one group share no
//! box unless the user says so: a box that fails would take two of them, and then one understudy of the paper's kind cannot restore either.
//! A remote I/O is located at the plant and is never shared.

mod offers;
mod preference;
mod stock;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::bill::{BillRow, bill};
use crate::controller::{Catalogue, Controller};
use crate::fit::{Dimension, Fit, Verdict};
use crate::modules::Modules;
use crate::need::{Need, Terms};
use crate::packing::{BoxType, PackingError, pack};
use crate::requirement::Role;
use crate::resources::Resources;

pub use preference::Preference;
pub use stock::Stock;

/// Verification result of the program of a position.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "verdict", content = "message")]
pub enum Verification {
    /// Everything that is asked of it, in these words.
    Passed(String),
    /// Something does not hold, or was not decided.
    NotPassed(String),
    /// Nobody asked.
    NotAsked,
}

impl Verification {
    /// Whether it may be recommended.
    pub fn has_passed(&self) -> bool {
        matches!(self, Self::Passed(_))
    }

    /// Note for the reader.
    pub fn message(&self) -> &str {
        match self {
            Self::Passed(message) | Self::NotPassed(message) => message,
            Self::NotAsked => "not verified",
        }
    }
}

/// A box that is wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Name of the position in the plant.
    pub name: String,
    /// Programs with one understudy; programs without one have no group.
    pub group: Option<usize>,
    /// Requirements of the position.
    pub need: Need,
    /// Verification result of its program.
    pub verification: Verification,
    /// The remote I/O whose twin it is.
    pub twin_of: Option<String>,
}

/// Rules of the choice.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Rules for the comparison of needs.
    pub terms: Terms,
    /// Preference among fitting controllers.
    pub preference: Preference,
    /// Whether programs of one group may share a box.
    pub share_members: bool,
    /// Whether programs are placed that did not pass verification.
    pub unverified: bool,
    /// Available controllers; empty: every model of the catalogue.
    pub stock: Vec<Stock>,
    /// Networks of all groups together, each with a switch.
    pub networks: usize,
}

/// Assessment of a controller for one position.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The vendor.
    pub vendor: String,
    /// The model.
    pub model: String,
    /// Modules that it needs.
    pub modules: Vec<Modules>,
    /// Every criterion.
    #[serde(flatten)]
    pub fit: Fit,
    /// Note on its figures.
    pub notes: String,
}

/// A box that is wanted, with the controllers that could be it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Placed {
    /// Name of the position in the plant.
    pub name: String,
    /// Purpose of the position.
    pub role: Role,
    /// Counts of its program.
    pub program: Option<Resources>,
    /// Terminals that are wired to it.
    pub inputs: u64,
    /// Terminals that are wired to it.
    pub outputs: u64,
    /// Verification result.
    pub verification: Verification,
    /// The best first; none where its program has not passed verification.
    pub candidates: Vec<Candidate>,
    /// The remote I/O whose twin it is.
    pub twin_of: Option<String>,
    /// Why it is on no box.
    pub left_over: Option<String>,
}

impl Placed {
    /// Number of candidates with this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        let candidates = self.candidates.iter();
        candidates.filter(|found| found.fit.verdict == verdict).count()
    }
}

/// A part of a box that is taken.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Taken {
    /// The shared resource.
    pub dimension: Dimension,
    /// Amount that all programs of the controller take.
    pub takes: u64,
    /// Usable amount.
    pub usable: u64,
}

/// A box to take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxOnPlan {
    /// The model; with modules its figures are the sums.
    pub controller: Controller,
    /// Modules that it needs.
    pub modules: Vec<Modules>,
    /// Names of what is on it.
    pub items: Vec<String>,
    /// Shared resources with their loads.
    pub taken: Vec<Taken>,
}

/// The plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Allocation {
    /// The controllers of the plan.
    pub items: Vec<Placed>,
    /// Selected controllers.
    pub boxes: Vec<BoxOnPlan>,
    /// All boxes of the cell with their price, next to other ways to build it; empty for programs whose terminals are on their own controllers.
    pub bill: Vec<BillRow>,
    /// Whether no better packing exists by what is preferred.
    pub best: bool,
    /// Notes on the plan.
    pub remarks: Vec<String>,
}

impl Allocation {
    /// Whether every box that is wanted has its controller.
    pub fn is_complete(&self) -> bool {
        self.items.iter().all(|item| item.left_over.is_none())
    }
}

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AllocationError {
    /// A model of the stock is not in the catalogue.
    #[error("U1131: the catalogue has no `{name}`{}", if like.is_empty() { String::new() } else { format!("; there is {}", like.join(", ")) })]
    NoModel {
        /// The name as it was written.
        name: String,
        /// Available number.
        like: Vec<String>,
    },
    /// Several vendors have such a model.
    #[error("U1132: `{name}` is made by several: {}", vendors.join(", "))]
    Ambiguous {
        /// The name as it was written.
        name: String,
        /// The vendor.
        vendors: Vec<String>,
    },
    /// Prices of several currencies cannot be compared.
    #[error("U1133: prices are in {}: one currency is needed to prefer by cost", .0.join(", "))]
    Currencies(Vec<String>),
    /// A module in a list of controllers.
    #[error(
        "U1145: {0} is a module: --stock has controllers, and --expansion adds the modules that they need"
    )]
    Module(String),
    /// No packing.
    #[error(transparent)]
    Packing(#[from] PackingError),
}

impl AllocationError {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoModel { .. } => "U1131",
            Self::Ambiguous { .. } => "U1132",
            Self::Currencies(_) => "U1133",
            Self::Module(_) => "U1145",
            Self::Packing(_) => "U1140",
        }
    }
}

/// Ranks the controllers of the catalogue for every item, and packs the items.
///
/// # Errors
/// Every model of the stock that the catalogue does not have; prices of several currencies; the solver failed.
pub fn allocate(
    catalogue: &Catalogue,
    items: &[Item],
    options: &Options,
) -> Result<Allocation, Vec<AllocationError>> {
    let types = stock::types(catalogue, &options.stock)?;
    let mut remarks = Vec::new();
    let may_be_placed = |item: &Item| {
        options.unverified || item.verification.has_passed() || item.need.program.is_none()
    };
    let placeable: Vec<Option<&Need>> =
        items.iter().map(|item| may_be_placed(item).then_some(&item.need)).collect();
    let (offers, fits) = offers::of(catalogue, &types, &placeable, options);
    let order = preference::order(&offers, types.len(), options.preference, &mut remarks)
        .map_err(|error| vec![error])?;
    let box_types: Vec<BoxType> = (0..offers.len())
        .map(|place| {
            let on_it = fits.iter().map(|of_item| of_item.get(place));
            let loads = on_it.map(|fit| {
                let fit = fit.filter(|fit| fit.verdict == Verdict::Fits)?;
                Some(fit.loads.clone())
            });
            let loads: Vec<_> = loads.collect();
            BoxType {
                cost: order.cost(place, fits.iter().filter_map(|of_item| of_item.get(place))),
                model: offers[place].model,
                stock: offers[place].stock,
                loads,
            }
        })
        .collect();
    let packing = pack(items.len(), &box_types, &|left, right| {
        apart(&items[left], &items[right], options.share_members)
    })
    .map_err(|error| vec![error.into()])?;
    let mut packed = packing.boxes;
    packed.sort_by_key(|packed| packed.items.first().copied());
    let boxes = packed.iter().map(|packed| {
        let box_type = &box_types[packed.box_type];
        let loads = packed.items.iter();
        let loads = loads.filter_map(|&item| box_type.loads[item].as_ref());
        BoxOnPlan {
            controller: offers[packed.box_type].controller.clone(),
            modules: offers[packed.box_type].modules.clone(),
            items: packed.items.iter().map(|&item| items[item].name.clone()).collect(),
            taken: taken(loads),
        }
    });
    let boxes: Vec<BoxOnPlan> = boxes.collect();
    let placed = items.iter().zip(&fits).enumerate();
    let placed = placed.map(|(place, (item, of_item))| {
        let candidates = order.rank(&offers, of_item);
        let left_over = packing.left_over.contains(&place);
        Placed {
            name: item.name.clone(),
            role: item.need.role,
            program: item.need.program,
            inputs: item.need.inputs,
            outputs: item.need.outputs,
            verification: item.verification.clone(),
            twin_of: item.twin_of.clone(),
            left_over: left_over.then(|| why(item, &candidates, may_be_placed(item))),
            candidates,
        }
    });
    let placed: Vec<Placed> = placed.collect();
    // Modules are chosen for one item at a time, and items that share a controller may need fewer.
    let may_share =
        |left: usize, right: usize| !apart(&items[left], &items[right], options.share_members);
    let shared = (0..items.len()).any(|one| (0..one).any(|other| may_share(one, other)));
    let extended = offers.len() > types.len();
    let bill = bill(&placed, &boxes, options.networks);
    let best = packing.best && !(shared && extended);
    Ok(Allocation { items: placed, boxes, bill, best, remarks })
}

/// Whether one failure must not take both.
fn apart(left: &Item, right: &Item, share_members: bool) -> bool {
    let roles = [left.need.role, right.need.role];
    if roles.contains(&Role::RemoteIo) {
        return true;
    }
    let same_group = left.group.is_some() && left.group == right.group;
    same_group && (roles.contains(&Role::Understudy) || !share_members)
}

fn taken<'a>(loads: impl Iterator<Item = &'a BTreeMap<Dimension, crate::fit::Load>>) -> Vec<Taken> {
    let mut sums: BTreeMap<Dimension, Taken> = BTreeMap::new();
    for (&dimension, load) in loads.flatten() {
        let entry =
            sums.entry(dimension).or_insert(Taken { dimension, takes: 0, usable: load.usable });
        entry.takes += load.takes;
    }
    sums.into_values().collect()
}

/// Why an item is on no box.
fn why(item: &Item, candidates: &[Candidate], may_be_placed: bool) -> String {
    if !may_be_placed {
        return format!("not recommended: {}", item.verification.message());
    }
    let count = |verdict| {
        let of_it = candidates.iter().filter(|found| found.fit.verdict == verdict);
        of_it.count()
    };
    match (count(Verdict::Fits), count(Verdict::Unknown)) {
        (0, 0) => format!("none of {} controllers fits", candidates.len()),
        (0, unknown) => format!(
            "no controller is known to be suitable: {unknown} of {} lack a figure, the others are unsuitable",
            candidates.len()
        ),
        (fitting, _) => {
            format!("insufficient stock: of {fitting} suitable controllers, all are in use")
        }
    }
}
