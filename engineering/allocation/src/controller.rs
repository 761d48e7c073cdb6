//! Controllers that can be bought, as the catalogue knows them.

use std::collections::BTreeMap;
use std::fmt;
use understudy_text::spelling;

use serde::Serialize;
use understudy_text::words;

use crate::figures::{FamilyQuantity, Figure, Quantity, Statement};

words! {
    /// Kind of a device.
    pub enum Kind by name {
        /// A programmable logic controller.
        Plc = "plc",
        /// An embedded controller or a board.
        Embedded = "embedded",
        /// An expansion module of the controllers of its family.
        Module = "module",
    }
}

/// One model of a controller, or of a module that extends controllers: then its numbers are what it adds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Controller {
    /// The vendor.
    pub vendor: String,
    /// Unique for its vendor.
    pub model: String,
    /// Models that store programs in the same way.
    pub family: String,
    /// PLC, embedded controller or module.
    pub kind: Kind,
    /// Known numbers.
    pub numbers: BTreeMap<Quantity, Figure<u64>>,
    /// Known texts.
    pub texts: BTreeMap<Statement, Figure<String>>,
    /// Note on its figures, such as conflicting sources.
    pub notes: String,
}

impl Kind {
    /// The words of all kinds, for messages.
    pub const WORDS: &'static str = "`plc`, `embedded` or `module`";
}

impl Controller {
    /// A controller without figures.
    pub fn new(vendor: &str, model: &str, family: &str, kind: Kind) -> Self {
        Self {
            vendor: vendor.to_owned(),
            model: model.to_owned(),
            family: family.to_owned(),
            kind,
            numbers: BTreeMap::new(),
            texts: BTreeMap::new(),
            notes: String::new(),
        }
    }

    /// A number, if it is known.
    pub fn number(&self, quantity: Quantity) -> Option<u64> {
        self.numbers.get(&quantity).map(|figure| figure.value)
    }

    /// A text, if it is known.
    pub fn text(&self, statement: Statement) -> Option<&str> {
        let figure = self.texts.get(&statement)?;
        Some(&figure.value)
    }

    /// Names of what is not known.
    pub fn unknown(&self) -> Vec<&'static str> {
        let is_module = self.kind == Kind::Module;
        let of_module = |quantity: &Quantity| {
            Quantity::EXTENDABLE.contains(quantity) || *quantity == Quantity::Price
        };
        let numbers = Quantity::ALL.into_iter();
        let numbers = numbers
            .filter(|quantity| !self.numbers.contains_key(quantity))
            .filter(|quantity| !is_module || of_module(quantity));
        let texts = Statement::ALL.into_iter();
        let texts = texts.filter(|statement| !self.texts.contains_key(statement));
        let texts = texts.map(Statement::name);
        numbers.map(Quantity::name).chain(texts).collect()
    }

    /// Takes over figures of `other`, which is the same model; answers with the names of those that were there already and differ.
    pub fn update(&mut self, other: Self) -> Vec<&'static str> {
        let mut changed = Vec::new();
        for (quantity, figure) in other.numbers {
            if let Some(old) = self.numbers.insert(quantity, figure.clone())
                && old.value != figure.value
            {
                changed.push(quantity.name());
            }
        }
        for (statement, figure) in other.texts {
            if let Some(old) = self.texts.insert(statement, figure.clone())
                && old.value != figure.value
            {
                changed.push(statement.name());
            }
        }
        if !other.notes.is_empty() {
            self.notes = other.notes;
        }
        changed
    }
}

impl fmt::Display for Controller {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {}", self.vendor, self.model)
    }
}

/// Storage figures of a family, as far as they are known.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Family {
    /// Known numbers with their sources.
    pub numbers: BTreeMap<FamilyQuantity, Figure<u64>>,
    /// Note on these figures.
    pub notes: String,
}

impl Family {
    /// A number, if it is known.
    pub fn number(&self, quantity: FamilyQuantity) -> Option<u64> {
        self.numbers.get(&quantity).map(|figure| figure.value)
    }
}

/// The catalogue of controllers and of the modules that extend them.
///
/// Invariant: no two rows have the same vendor and model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Catalogue {
    controllers: BTreeMap<(String, String), Controller>,
    /// Families by name; a controller's family may be missing.
    pub families: BTreeMap<String, Family>,
}

impl Catalogue {
    /// All rows by vendor and model: controllers and modules.
    pub fn rows(&self) -> impl Iterator<Item = &Controller> {
        self.controllers.values()
    }

    /// All controllers by vendor and model.
    pub fn controllers(&self) -> impl Iterator<Item = &Controller> {
        self.rows().filter(|row| row.kind != Kind::Module)
    }

    /// All modules that extend controllers, by vendor and model.
    pub fn modules(&self) -> impl Iterator<Item = &Controller> {
        self.rows().filter(|row| row.kind == Kind::Module)
    }

    /// Number of controllers.
    pub fn len(&self) -> usize {
        self.controllers().count()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.controllers.is_empty()
    }

    /// The row of this vendor and model.
    pub fn get(&self, vendor: &str, model: &str) -> Option<&Controller> {
        self.controllers.get(&(vendor.to_owned(), model.to_owned()))
    }

    /// Rows with this name: the model, or vendor and model separated by a blank.
    pub fn named(&self, name: &str) -> Vec<&Controller> {
        self.rows().filter(|found| found.model == name || found.to_string() == name).collect()
    }

    /// Models whose names are like `name`, the most alike first.
    pub fn like(&self, name: &str) -> Vec<String> {
        let wanted = name.to_lowercase();
        let part = |model: &str| model.to_lowercase().contains(&wanted);
        let models = || self.rows().map(|controller| controller.model.as_str());
        let mut found: Vec<&str> = models().filter(|model| part(model)).collect();
        found.sort_unstable();
        let others = spelling::alike(name, models().filter(|model| !part(model)));
        let found = found.into_iter().chain(others).take(5);
        found.map(str::to_owned).collect()
    }

    /// Adds a row, or new figures for one that is there; answers with the names of figures that it had and that changed.
    pub fn put(&mut self, controller: Controller) -> Vec<&'static str> {
        let key = (controller.vendor.clone(), controller.model.clone());
        match self.controllers.get_mut(&key) {
            Some(old) => old.update(controller),
            None => {
                self.controllers.insert(key, controller);
                Vec::new()
            }
        }
    }

    /// Takes a row out; figures of its family stay.
    pub(crate) fn take(&mut self, vendor: &str, model: &str) -> Option<Controller> {
        self.controllers.remove(&(vendor.to_owned(), model.to_owned()))
    }

    /// Adds figures of a family.
    pub fn put_family(&mut self, name: &str, family: Family) {
        let old = self.families.entry(name.to_owned()).or_default();
        old.numbers.extend(family.numbers);
        if !family.notes.is_empty() {
            old.notes = family.notes;
        }
    }
}
