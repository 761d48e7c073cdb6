//! Controllers in stock.

use super::AllocationError;
use crate::controller::{Catalogue, Controller, Kind};

/// A number of controllers of one model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stock {
    /// A model, or vendor and model with a blank between.
    pub name: String,
    /// How many.
    pub count: usize,
}

/// Permitted controllers, with their limited numbers; otherwise all errors of the stock.
pub(super) fn types<'a>(
    catalogue: &'a Catalogue,
    stock: &[Stock],
) -> Result<Vec<(&'a Controller, Option<usize>)>, Vec<AllocationError>> {
    if stock.is_empty() {
        let controllers = catalogue.controllers();
        return Ok(controllers.map(|controller| (controller, None)).collect());
    }
    let mut types: Vec<(&Controller, Option<usize>)> = Vec::new();
    let mut errors = Vec::new();
    for Stock { name, count } in stock {
        match catalogue.named(name).as_slice() {
            [] => errors
                .push(AllocationError::NoModel { name: name.clone(), like: catalogue.like(name) }),
            [module] if module.kind == Kind::Module => {
                errors.push(AllocationError::Module(module.to_string()));
            }
            [controller] => match types.iter_mut().find(|(known, _)| known == controller) {
                Some((_, known)) => *known = known.map(|known| known.saturating_add(*count)),
                None => types.push((controller, Some(*count))),
            },
            several => errors.push(AllocationError::Ambiguous {
                name: name.clone(),
                vendors: several.iter().map(|found| found.vendor.clone()).collect(),
            }),
        }
    }
    if errors.is_empty() { Ok(types) } else { Err(errors) }
}
