//! The catalogue that comes with the program, and what is added to one: all of it, or nothing.

use understudy_text::Report;

use crate::controller::Catalogue;
use crate::file;

const FILES: [(&str, &str); 2] = [
    ("controllers.csv", include_str!("../data/controllers.csv")),
    ("families.csv", include_str!("../data/families.csv")),
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
        for controller in part.controllers() {
            self.put(controller.clone());
        }
        for (name, family) in &part.families {
            self.put_family(name, family.clone());
        }
    }

    /// Adds `part`.
    ///
    /// # Errors
    /// Everything of `part` that is there already, under [`Mode::New`], or that disagrees with what is there. Then nothing is added.
    pub fn add(&mut self, part: &Self, mode: Mode) -> Result<Added, Vec<AdditionError>> {
        let errors = self.refused(part, mode);
        if !errors.is_empty() {
            return Err(errors);
        }
        let mut added = Added::default();
        for controller in part.controllers() {
            match self.get(&controller.vendor, &controller.model) {
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
        self.merge(part);
        Ok(added)
    }

    fn refused(&self, part: &Self, mode: Mode) -> Vec<AdditionError> {
        let mut errors = Vec::new();
        for controller in part.controllers() {
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
    /// Models that were not there.
    pub models: usize,
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
}

impl AdditionError {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Present(_) => "U1125",
            Self::Disagrees { .. } => "U1129",
        }
    }
}
