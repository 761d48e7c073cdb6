//! The catalogue that comes with the program, and what is added to one: all of it, or nothing.

use understudy_text::Report;

use crate::controller::{Catalogue, Controller, Kind};
use crate::file;
use crate::modules::ModuleFault;

const FILES: [(&str, &str); 3] = [
    ("controllers.csv", include_str!("../data/controllers.csv")),
    ("families.csv", include_str!("../data/families.csv")),
    ("modules.csv", include_str!("../data/modules.csv")),
];

impl Catalogue {
    /// The one that comes with the program: facts from data sheets, manuals and pages, each with its source.
    ///
    /// # Errors
    /// The files that it is made from have errors.
    pub fn built_in() -> Result<Self, Vec<Report>> {
        let mut catalogue = Self::default();
        let mut reports = Vec::new();
        for (name, text) in FILES {
            let loaded = file::read(name, text);
            match loaded.catalogue {
                Some(part) => catalogue.merge(&part),
                None => reports.push(loaded.report),
            }
        }
        if reports.is_empty() { Ok(catalogue) } else { Err(reports) }
    }

    fn merge(&mut self, part: &Self) {
        for row in part.rows() {
            self.put(row.clone());
        }
        for (name, family) in &part.families {
            self.put_family(name, family.clone());
        }
    }

    /// Adds `part`.
    ///
    /// # Errors
    /// Everything of `part` that is there already, under [`Mode::New`], or that disagrees with what is there, and modules that extend nothing
    /// after the addition. Then nothing is added.
    pub fn add(&mut self, part: &Self, mode: Mode) -> Result<Added, Vec<AdditionError>> {
        let mut errors = self.refused(part, mode);
        let mut sum = self.clone();
        sum.merge(part);
        errors.extend(sum.module_faults().into_iter().map(AdditionError::Module));
        if !errors.is_empty() {
            return Err(errors);
        }
        let mut added = Added::default();
        for controller in part.rows() {
            match self.get(&controller.vendor, &controller.model) {
                None if controller.kind == Kind::Module => added.modules += 1,
                None => added.models += 1,
                Some(known) => {
                    added.updated += 1;
                    let changed = known.clone().update(controller.clone()).into_iter();
                    let changed = changed.map(|figure| format!("{controller}: {figure}"));
                    added.changed.extend(changed);
                }
            }
        }
        let figures = part.families.values().map(|family| family.numbers.len());
        added.family_figures = figures.sum();
        *self = sum;
        Ok(added)
    }

    /// Takes out the row of this vendor and model.
    ///
    /// # Errors
    /// Modules of the catalogue extend no other controller. Then nothing is taken out.
    pub fn remove(&mut self, vendor: &str, model: &str) -> Result<Option<Controller>, InUse> {
        let mut rest = self.clone();
        let Some(row) = rest.take(vendor, model) else { return Ok(None) };
        let of_family = |other: &&Controller| other.family == row.family;
        let is_last = row.kind != Kind::Module && !rest.controllers().any(|one| of_family(&one));
        let modules: Vec<String> = rest
            .modules()
            .filter(|one| is_last && of_family(one))
            .map(|one| one.to_string())
            .collect();
        if !modules.is_empty() {
            return Err(InUse { row: row.to_string(), family: row.family, modules });
        }
        *self = rest;
        Ok(Some(row))
    }

    fn refused(&self, part: &Self, mode: Mode) -> Vec<AdditionError> {
        let mut errors = Vec::new();
        for controller in part.rows() {
            let Some(known) = self.get(&controller.vendor, &controller.model) else {
                continue;
            };
            if mode == Mode::New {
                errors.push(AdditionError::Present(controller.to_string()));
                continue;
            }
            let compared = [
                ("family", &known.family[..], &controller.family[..]),
                ("kind", known.kind.name(), controller.kind.name()),
            ];
            let differ = compared.into_iter().filter(|(_, known, new)| known != new);
            errors.extend(differ.map(|(what, known, new)| AdditionError::Disagrees {
                model: controller.to_string(),
                what,
                known: known.to_owned(),
                new: new.to_owned(),
            }));
        }
        if mode == Mode::New {
            for (name, family) in &part.families {
                let known = self.families.get(name);
                let figures = family
                    .numbers
                    .keys()
                    .filter(|figure| known.is_some_and(|known| known.number(**figure).is_some()));
                errors.extend(figures.map(|figure| {
                    AdditionError::Present(format!("{figure} of the family {name}"))
                }));
            }
        }
        errors
    }
}

/// A controller that modules of the catalogue need.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "U1144: {row} is the last controller of the family `{family}`, which {} extend{}; remove the modules first",
    modules.join(", "),
    if modules.len() == 1 { "s" } else { "" }
)]
pub struct InUse {
    /// Vendor and model.
    pub row: String,
    /// Its family.
    pub family: String,
    /// The modules that would extend nothing.
    pub modules: Vec<String>,
}

/// Permission to change known models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing: they must not be there.
    New,
    /// They get the figures that are given, and keep all others.
    Update,
}

/// Result of an addition.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Added {
    /// Controllers that were not there.
    pub models: usize,
    /// Modules that were not there.
    pub modules: usize,
    /// Models that were there.
    pub updated: usize,
    /// Figures of families.
    pub family_figures: usize,
    /// Figures that had another value before, each with its model.
    pub changed: Vec<String>,
}

/// Why something cannot be added.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AdditionError {
    /// A model, or a figure of a family, that is there already.
    #[error("U1125: the catalogue has {0} already; --update takes over new figures for it")]
    Present(String),
    /// An update that says something else of a model than the catalogue.
    #[error(
        "U1129: {model} is of the {what} `{known}` in the catalogue, and `{new}` in what is added"
    )]
    Disagrees {
        /// Vendor and model.
        model: String,
        /// `family` or `kind`.
        what: &'static str,
        /// The family or kind that the catalogue has for the model.
        known: String,
        /// The family or kind that is to be added for it.
        new: String,
    },
    /// A module that extends nothing.
    #[error(transparent)]
    Module(#[from] ModuleFault),
}

impl AdditionError {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Present(_) => "U1125",
            Self::Disagrees { .. } => "U1129",
            Self::Module(fault) => fault.code(),
        }
    }
}
