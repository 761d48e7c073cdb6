//! Controllers by their own figures, without a program.

use serde::Serialize;

use crate::controller::{Catalogue, Controller, Kind};
use crate::fit::{Verdict, fit};
use crate::need::{Need, Terms};
use crate::requirement::{Asked, Requirement, RequirementError};

/// Result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found<'a> {
    /// Controllers that meet every requirement.
    pub controllers: Vec<&'a Controller>,
    /// Controllers that may meet them, and lack a figure.
    pub unknown: Vec<Lacking>,
}

/// A controller that a search cannot decide.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Lacking {
    /// Vendor and model.
    pub controller: String,
    /// Messages that name the figures.
    pub messages: Vec<String>,
}

/// The controllers of `catalogue` that meet all `requirements`; under `kind=module` its modules.
///
/// # Errors
/// Requirements that are about a role or a program: a search has none.
pub fn search<'a>(
    catalogue: &'a Catalogue,
    requirements: &[Requirement],
) -> Result<Found<'a>, Vec<RequirementError>> {
    let refused = requirements.iter().filter_map(|requirement| {
        let reason = match (&requirement.asked, requirement.role) {
            (_, Some(role)) => format!("a search has no {role}; leave out `{role}:`"),
            (Asked::ScanTime(_), _) => {
                "a search has no program to scan; `understudy allocate` compares scan times".into()
            }
            _ => return None,
        };
        Some(RequirementError { text: requirement.text.clone(), reason })
    });
    let refused: Vec<RequirementError> = refused.collect();
    if !refused.is_empty() {
        return Err(refused);
    }
    let need = Need::nothing();
    let terms = Terms { requirements: requirements.to_vec(), ..Terms::default() };
    let mut found = Found { controllers: Vec::new(), unknown: Vec::new() };
    let module = Asked::Kind(Kind::Module);
    let of_modules = requirements.iter().any(|requirement| requirement.asked == module);
    let rows = catalogue.rows().filter(|row| (row.kind == Kind::Module) == of_modules);
    for controller in rows {
        let family = catalogue.families.get(&controller.family);
        let fit = fit(controller, family, &need, &terms);
        match fit.verdict {
            Verdict::Fits => found.controllers.push(controller),
            Verdict::Unknown => found.unknown.push(Lacking {
                controller: controller.to_string(),
                messages: fit.with(Verdict::Unknown).map(|of| of.message.clone()).collect(),
            }),
            Verdict::DoesNotFit => {}
        }
    }
    Ok(found)
}
