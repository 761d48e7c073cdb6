//! Expansion modules: the cheapest that make a controller sufficient, and what is wrong with the modules of a catalogue.

use std::collections::{BTreeMap, BTreeSet};

use good_lp::{
    Expression, ProblemVariables, Solution, SolverModel, Variable, WithTimeLimit, constraint,
    microlp, variable,
};
use serde::Serialize;
use understudy_text::spelling::suggestion;

use crate::controller::{Catalogue, Controller};
use crate::figures::{Figure, Quantity, Statement};
use crate::fit::{Fit, Verdict, fit};
use crate::need::{Need, Terms};
use crate::requirement::{Asked, Bound};

/// Seconds after which the solver is stopped.
const MAXIMUM_SECONDS: f64 = 5.0;

/// Modules of one model beside a controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Modules {
    /// Vendor of the module.
    pub vendor: String,
    /// Its model.
    pub model: String,
    /// How many.
    pub count: u64,
}

/// How a controller alone meets a need, and the modules that make it sufficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// Comparison of the controller alone; what modules could change says so.
    pub alone: Fit,
    /// The controller with the modules that it needs, if modules make it sufficient.
    pub extended: Option<(Controller, Vec<Modules>)>,
}

/// Compares a controller with a need, and adds modules of its family where `terms` allow it and it alone is not sufficient.
///
/// With `by_price` the modules with the smallest sum of prices are taken, if all of the family have one; otherwise the fewest.
pub fn assess(
    catalogue: &Catalogue,
    controller: &Controller,
    need: &Need,
    terms: &Terms,
    by_price: bool,
) -> Assessment {
    let family = catalogue.families.get(&controller.family);
    let mut alone = fit(controller, family, need, terms);
    let lacking = Lacking::of(controller, &alone, need, terms);
    if !terms.expansion || lacking.criteria.is_empty() {
        return Assessment { alone, extended: None };
    }
    let modules: Vec<&Controller> =
        catalogue.modules().filter(|module| module.family == controller.family).collect();
    let most = controller.numbers.get(&Quantity::ExpansionModules);
    let (open, message, sources) = match (modules.is_empty(), most) {
        (_, Some(Figure { value: 0, source })) => {
            (false, "; it takes no modules".to_owned(), vec![source.clone()])
        }
        (true, _) => match controller.texts.get(&Statement::MaxExpansionIo) {
            Some(Figure { value, source }) => {
                let message = format!(
                    " on board, and \"{value}\" as expansion: check whether that is sufficient"
                );
                (true, message, vec![source.clone()])
            }
            None => return Assessment { alone, extended: None },
        },
        (false, None) => {
            let message = " on board; how many modules it takes is unknown (expansion_modules)";
            (true, message.to_owned(), Vec::new())
        }
        (false, Some(Figure { value, source })) => {
            let chosen = cheapest(controller, &modules, &lacking, *value, by_price);
            let extended = chosen.map(|chosen| {
                let counts: Vec<Modules> =
                    chosen.iter().map(|(module, count)| Modules::of(module, *count)).collect();
                (extended(controller, &chosen), counts)
            });
            // The answer of the solver counts only if the comparison of the sums confirms it.
            if let Some((with, _)) = &extended
                && lacking.has_enough(with)
            {
                return Assessment { alone, extended };
            }
            let unknown = lacking.totals.keys().find_map(|quantity| {
                let unknown = modules.iter().find(|module| module.number(*quantity).is_none())?;
                Some((unknown, quantity))
            });
            let sources = vec![source.clone()];
            match unknown {
                Some((module, quantity)) => {
                    let message = format!(
                        " on board; up to {value} modules with known figures do not suffice, and the {quantity} of {module} is unknown"
                    );
                    (true, message, sources)
                }
                None => (
                    false,
                    format!("; up to {value} modules of its family do not suffice"),
                    sources,
                ),
            }
        }
    };
    for finding in &mut alone.findings {
        if finding.verdict != Verdict::DoesNotFit || !lacking.criteria.contains(&finding.criterion)
        {
            continue;
        }
        if open {
            finding.verdict = Verdict::Unknown;
        }
        finding.message.push_str(&message);
        finding.sources.extend(sources.iter().cloned());
    }
    let verdicts = alone.findings.iter().map(|finding| finding.verdict);
    alone.verdict = verdicts.max().unwrap_or(Verdict::Fits);
    Assessment { alone, extended: None }
}

impl Modules {
    fn of(module: &Controller, count: u64) -> Self {
        Self { vendor: module.vendor.clone(), model: module.model.clone(), count }
    }
}

/// Words for a controller with its modules: `1766-L32BWA with 2 x 1762-IQ16`.
pub(crate) fn with_modules(name: &str, modules: &[Modules]) -> String {
    if modules.is_empty() { name.to_owned() } else { format!("{name} with {}", words(modules)) }
}

/// Models with their numbers: `2 x 1762-IQ16, 1 x 1762-OW8`.
pub(crate) fn words(modules: &[Modules]) -> String {
    let words = modules.iter().map(|of| format!("{} x {}", of.count, of.model));
    words.collect::<Vec<_>>().join(", ")
}

/// What a controller has too little of, and modules can add to.
struct Lacking {
    /// What it must have in all.
    totals: BTreeMap<Quantity, u64>,
    /// The criteria that depend on it.
    criteria: BTreeSet<String>,
}

impl Lacking {
    fn of(controller: &Controller, alone: &Fit, need: &Need, terms: &Terms) -> Self {
        let mut lacking = Self { totals: BTreeMap::new(), criteria: BTreeSet::new() };
        for quantity in Quantity::EXTENDABLE {
            let Some(has) = controller.number(quantity) else { continue };
            let findings = alone.findings.iter().filter(|found| found.criterion == quantity.name());
            let needs = findings.filter_map(|finding| {
                Some((finding.criterion.clone(), terms.capacity_for(finding.need?)))
            });
            let asked =
                terms.requirements.iter().filter_map(|requirement| match requirement.asked {
                    Asked::Number(asked, Bound::AtLeast, total)
                        if asked == quantity && requirement.is_of(need.role) =>
                    {
                        Some((requirement.criterion(), total))
                    }
                    _ => None,
                });
            for (criterion, total) in needs.chain(asked).filter(|(_, total)| *total > has) {
                lacking.criteria.insert(criterion);
                let most = lacking.totals.entry(quantity).or_insert(0);
                *most = total.max(*most);
            }
        }
        lacking
    }

    fn has_enough(&self, controller: &Controller) -> bool {
        let mut totals = self.totals.iter();
        totals
            .all(|(quantity, total)| controller.number(*quantity).is_some_and(|has| has >= *total))
    }
}

/// The modules that add what is lacking; nothing where `most` of them are not enough.
///
/// ```text
/// min  Σ c_m n_m          n_m modules of the model m, at the price c_m, or at 1 each
/// (1)  Σ n_m <= most
/// (2)  Σ q_m n_m >= d_q   for every quantity q of which the controller lacks d_q; an unknown figure adds nothing
/// ```
fn cheapest<'a>(
    controller: &Controller,
    modules: &[&'a Controller],
    lacking: &Lacking,
    most: u64,
    by_price: bool,
) -> Option<Vec<(&'a Controller, u64)>> {
    let mut variables = ProblemVariables::new();
    let mut bounded = || variables.add(variable().integer().min(0.0).max(most as f64));
    let counts: Vec<Variable> = modules.iter().map(|_| bounded()).collect();
    let prices: Option<Vec<u64>> =
        modules.iter().map(|module| module.number(Quantity::Price)).collect();
    let prices = prices.filter(|_| by_price).unwrap_or_else(|| vec![1; modules.len()]);
    let sum = |factors: &mut dyn Iterator<Item = f64>| {
        let parts = factors.zip(&counts);
        parts.fold(Expression::from(0.0), |sum, (factor, &count)| sum + factor * count)
    };
    let mut model = variables
        .minimise(sum(&mut prices.iter().map(|price| *price as f64)))
        .using(microlp)
        .with_time_limit(MAXIMUM_SECONDS)
        .with(constraint!(sum(&mut modules.iter().map(|_| 1.0)) <= most as f64)); // (1)
    for (&quantity, total) in &lacking.totals {
        let short = total.saturating_sub(controller.number(quantity).unwrap_or(0)) as f64;
        let part = |module: &&Controller| module.number(quantity).unwrap_or(0) as f64 / short;
        model = model.with(constraint!(sum(&mut modules.iter().map(part)) >= 1.0)); // (2)
    }
    let solution = model.solve().ok()?;
    let found = modules.iter().zip(&counts);
    let found = found.map(|(&module, &count)| (module, solution.value(count).round() as u64));
    let found: Vec<_> = found.filter(|(_, count)| *count > 0).collect();
    (found.iter().map(|(_, count)| count).sum::<u64>() <= most).then_some(found)
}

/// The controller with its modules: sums, with the sources of all parts.
fn extended(controller: &Controller, modules: &[(&Controller, u64)]) -> Controller {
    let mut sum = controller.clone();
    for quantity in Quantity::EXTENDABLE {
        let Some(figure) = sum.numbers.get_mut(&quantity) else { continue };
        for (module, count) in modules {
            if let Some(of_it) = module.numbers.get(&quantity).filter(|of_it| of_it.value > 0) {
                figure.value = figure.value.saturating_add(of_it.value.saturating_mul(*count));
                figure.source.push_str(&format!(" ; {}: {}", module.model, of_it.source));
            }
        }
    }
    // Of price and reliability the whole is known only if every part is.
    let parts = |quantity| {
        let modules = modules.iter().map(move |(module, count)| (*module, *count));
        let parts = [(controller, 1)].into_iter().chain(modules);
        let figures = parts.map(move |(part, count)| Some((part.numbers.get(&quantity)?, count)));
        figures.collect::<Option<Vec<_>>>()
    };
    let price = parts(Quantity::Price).map(|parts| {
        parts
            .iter()
            .fold(0, |sum: u64, (of, count)| sum.saturating_add(of.value.saturating_mul(*count)))
    });
    let mtbf = parts(Quantity::MtbfHours).map(|parts| {
        let rates = parts.iter().map(|(of, count)| *count as f64 / of.value.max(1) as f64);
        (1.0 / rates.sum::<f64>()) as u64
    });
    for (quantity, value) in [(Quantity::Price, price), (Quantity::MtbfHours, mtbf)] {
        match (value, sum.numbers.get_mut(&quantity)) {
            (Some(value), Some(figure)) => figure.value = value,
            _ => {
                sum.numbers.remove(&quantity);
            }
        }
    }
    if let Some(currency) = sum.texts.get_mut(&Statement::Currency) {
        for (module, _) in modules {
            match module.text(Statement::Currency) {
                // Prices in several currencies are refused where prices are compared.
                Some(other) if other != currency.value => {
                    currency.value = format!("{} and {other}", currency.value);
                }
                _ => {}
            }
        }
    }
    sum
}

/// A fault of the modules of a catalogue.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ModuleFault {
    /// No controller takes the module.
    #[error(
        "U1142: the module {module} extends the family `{family}`, and the catalogue has no controller of it; {help}"
    )]
    NoController {
        /// Vendor and model.
        module: String,
        /// Its family.
        family: String,
        /// A family with a like name, or the families.
        help: String,
    },
    /// The module adds neither inputs nor outputs nor memory.
    #[error(
        "U1143: the module {module} adds nothing: none of {} is above 0",
        Quantity::EXTENDABLE.map(Quantity::name).join(", ")
    )]
    Empty {
        /// Vendor and model.
        module: String,
    },
}

impl ModuleFault {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoController { .. } => "U1142",
            Self::Empty { .. } => "U1143",
        }
    }
}

impl Catalogue {
    /// Everything that is wrong with the modules.
    pub fn module_faults(&self) -> Vec<ModuleFault> {
        let families: BTreeSet<&str> = self.controllers().map(|of| of.family.as_str()).collect();
        let mut faults = Vec::new();
        for module in self.modules() {
            if !families.contains(module.family.as_str()) {
                faults.push(ModuleFault::NoController {
                    module: module.to_string(),
                    family: module.family.clone(),
                    help: suggestion(&module.family, families.iter().copied()),
                });
            }
            let adds = |quantity: &Quantity| module.number(*quantity).is_some_and(|of| of > 0);
            if !Quantity::EXTENDABLE.iter().any(adds) {
                faults.push(ModuleFault::Empty { module: module.to_string() });
            }
        }
        faults
    }
}
