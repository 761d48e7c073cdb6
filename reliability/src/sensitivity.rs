//! What the MTTF rests on: elasticities, what happens when one thing is twice as good or half as good, and what to buy.

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::parts::Pair;
use crate::quantity::{Hours, Probability, stated};
use crate::system::System;

/// One bar of the tornado.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Name of the changed parameter.
    pub parameter: String,
    /// Value of the parameter with its unit.
    pub value: String,
    /// d ln MTTF/d ln parameter: by how many per cent the MTTF changes where the parameter changes by one.
    pub elasticity: f64,
    /// MTTF in hours where the parameter is half as large.
    pub halved_hours: f64,
    /// MTTF in hours where it is twice as large.
    pub doubled_hours: f64,
}

/// One thing that could be done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WhatIf {
    /// Name of the change.
    pub change: String,
    /// MTTF in hours with it.
    pub mttf_hours: f64,
    /// MTTF with it over MTTF without it.
    pub factor: f64,
    /// 1 - R over the mission, with it; nothing without a mission, or below [`MINIMUM_PROBABILITY`](crate::MINIMUM_PROBABILITY).
    pub unreliability: Option<f64>,
}

/// MTTF by number of understudies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ByUnderstudies {
    /// Number of understudies of each group.
    pub understudies: u32,
    /// MTTF in hours.
    pub mttf_hours: f64,
    /// MTTF gained over the system without understudies, for each box added; nothing for that system.
    pub gained_per_box_hours: Option<f64>,
}

/// A change of a system by a factor.
type Change = Box<dyn Fn(&mut System, f64) -> Changed>;

/// Whether a change was possible.
type Changed = Result<(), ReliabilityError>;

fn mean(system: &System) -> Result<f64, Vec<ReliabilityError>> {
    system.chain()?.mttf().map_err(|error| vec![error])
}

fn scaled(hours: Hours, factor: f64) -> Result<Hours, ReliabilityError> {
    Hours::new("the changed time", hours.get() * factor)
}

fn parameters(system: &System) -> Vec<(String, String, Change)> {
    let mut parameters: Vec<(String, String, Change)> = Vec::new();
    let kinds = system.controllers.len();
    for index in 0..=kinds {
        let kind = if index < kinds { &system.controllers[index] } else { &system.understudies };
        if kind.count == 0 {
            continue;
        }
        parameters.push((
            format!("MTBF of {}", kind.name),
            kind.mtbf.to_string(),
            Box::new(move |system, factor| {
                let kind = kind_at(system, index);
                kind.mtbf = scaled(kind.mtbf, factor)?;
                Ok(())
            }),
        ));
        parameters.push((
            format!("MTTR of {}", kind.name),
            kind.mttr.to_string(),
            Box::new(move |system, factor| {
                let kind = kind_at(system, index);
                kind.mttr = scaled(kind.mttr, factor)?;
                Ok(())
            }),
        ));
    }
    let uncovered = 1.0 - system.coverage.get();
    if uncovered > 0.0 {
        parameters.push((
            "share of failures that are not covered".into(),
            format!("{uncovered:.3e}"),
            Box::new(|system, factor| {
                let share = ((1.0 - system.coverage.get()) * factor).min(1.0);
                system.coverage = Probability::new("the coverage", 1.0 - share)?;
                Ok(())
            }),
        ));
    }
    if let Some(latency) = system.detection {
        parameters.push((
            "time to detect".into(),
            latency.to_string(),
            Box::new(|system, factor| {
                system.detection =
                    system.detection.map(|latency| scaled(latency, factor)).transpose()?;
                Ok(())
            }),
        ));
    }
    if let Some(cause) = system.common_cause {
        parameters.push((
            "share β of common causes".into(),
            format!("{}", cause.beta.get()),
            Box::new(|system, factor| {
                if let Some(cause) = &mut system.common_cause {
                    cause.beta = Probability::new("beta", (cause.beta.get() * factor).min(1.0))?;
                }
                Ok(())
            }),
        ));
    }
    for (index, part) in system.shared.iter().enumerate() {
        parameters.push((
            format!("MTBF of {}", part.name),
            part.mtbf.to_string(),
            Box::new(move |system, factor| {
                system.shared[index].mtbf = scaled(system.shared[index].mtbf, factor)?;
                Ok(())
            }),
        ));
        let Some(pair) = part.pair else {
            continue;
        };
        let mut of_pair = |name: &str, value: String, change: fn(&mut Pair, f64) -> Changed| {
            parameters.push((
                format!("{name} of {}", part.name),
                value,
                Box::new(move |system, factor| {
                    let pair = system.shared[index].pair.as_mut();
                    pair.map_or(Ok(()), |pair| change(pair, factor))
                }),
            ));
        };
        of_pair("MTTR", pair.mttr.to_string(), |pair, factor| {
            pair.mttr = scaled(pair.mttr, factor)?;
            Ok(())
        });
        let uncovered = 1.0 - pair.switchover.get();
        if uncovered > 0.0 {
            of_pair("share of failed switchovers", format!("{uncovered:.3e}"), |pair, factor| {
                let share = ((1.0 - pair.switchover.get()) * factor).min(1.0);
                pair.switchover = Probability::new("the coverage of the switchover", 1.0 - share)?;
                Ok(())
            });
        }
        if pair.beta.get() > 0.0 {
            of_pair("share β", pair.beta.get().to_string(), |pair, factor| {
                pair.beta = Probability::new("beta", (pair.beta.get() * factor).min(1.0))?;
                Ok(())
            });
        }
    }
    parameters
}

fn kind_at(system: &mut System, index: usize) -> &mut crate::system::BoxKind {
    if index < system.controllers.len() {
        &mut system.controllers[index]
    } else {
        &mut system.understudies
    }
}

/// The sensitivities of `system`, that with the widest bar first.
///
/// # Errors
/// The errors of [`System::chain`] and [`Chain::mttf`](crate::Chain::mttf).
pub fn sensitivities(system: &System) -> Result<Vec<Sensitivity>, Vec<ReliabilityError>> {
    /// Of ln parameter; the error of the difference is of its square, that of rounding of 1e-13 over it.
    const STEP: f64 = 1e-4;
    let mut found = Vec::new();
    for (parameter, value, change) in parameters(system) {
        let at = |factor: f64| {
            let mut changed = system.clone();
            change(&mut changed, factor).map_err(|error| vec![error])?;
            mean(&changed)
        };
        found.push(Sensitivity {
            parameter,
            value,
            elasticity: (at(STEP.exp())?.ln() - at((-STEP).exp())?.ln()) / (2.0 * STEP),
            halved_hours: at(0.5)?,
            doubled_hours: at(2.0)?,
        });
    }
    let width = |bar: &Sensitivity| (bar.doubled_hours / bar.halved_hours).ln().abs();
    found.sort_by(|a, b| width(b).total_cmp(&width(a)));
    Ok(found)
}

/// Possible improvements with their effects.
///
/// # Errors
/// The errors of [`System::chain`] and [`Chain::mttf`](crate::Chain::mttf).
pub fn what_if(
    system: &System,
    mission: Option<Hours>,
) -> Result<Vec<WhatIf>, Vec<ReliabilityError>> {
    let one = |error| vec![error];
    let now = mean(system)?;
    let mut changes: Vec<(String, System)> = vec![("as it is".into(), system.clone())];
    let mut spare = system.clone();
    spare.understudies.count += 1;
    changes.push((
        if system.groups > 1 {
            "one additional understudy per group".into()
        } else {
            "one more understudy".into()
        },
        spare,
    ));
    let mut faster = system.clone();
    for index in 0..=system.controllers.len() {
        let kind = kind_at(&mut faster, index);
        kind.mttr = scaled(kind.mttr, 0.5).map_err(one)?;
    }
    changes.push(("half the MTTR".into(), faster));
    let mut better = system.clone();
    for index in 0..=system.controllers.len() {
        let kind = kind_at(&mut better, index);
        kind.mtbf = scaled(kind.mtbf, 2.0).map_err(one)?;
    }
    changes.push(("stations with twice the MTBF".into(), better));
    if let Some(crews) = system.crews {
        let mut staffed = system.clone();
        staffed.crews = Some(crews + 1);
        changes.push(("one additional repair crew".into(), staffed));
    }
    if system.coverage < Probability::ONE {
        let mut covered = system.clone();
        covered.coverage =
            Probability::new("the coverage", f64::midpoint(1.0, system.coverage.get()))
                .map_err(one)?;
        changes.push(("half as many failures that are not covered".into(), covered));
    }
    if let Some(latency) = system.detection {
        let mut sooner = system.clone();
        sooner.detection = Some(scaled(latency, 0.5).map_err(one)?);
        changes.push(("half the detection time".into(), sooner));
    }
    changes
        .into_iter()
        .map(|(change, system)| {
            let chain = system.chain()?;
            let mttf_hours = chain.mttf().map_err(one)?;
            let unreliability = match mission {
                Some(hours) => {
                    let found = chain.transient(hours.get(), crate::AfterFailure::Final);
                    stated(found.map_err(one)?.failed)
                }
                None => None,
            };
            Ok(WhatIf { change, mttf_hours, factor: mttf_hours / now, unreliability })
        })
        .collect()
}

/// MTTF with 0, 1, ..., `most` understudies in each group.
///
/// # Errors
/// The errors of [`System::chain`] and [`Chain::mttf`](crate::Chain::mttf).
pub fn by_understudies(
    system: &System,
    most: u32,
) -> Result<Vec<ByUnderstudies>, Vec<ReliabilityError>> {
    let mut found: Vec<ByUnderstudies> = Vec::new();
    for understudies in 0..=most {
        let mut changed = system.clone();
        changed.understudies.count = understudies;
        let mttf_hours = mean(&changed)?;
        let added = f64::from(understudies * system.groups);
        let bare = found.first().map(|bare| bare.mttf_hours);
        found.push(ByUnderstudies {
            understudies,
            mttf_hours,
            gained_per_box_hours: bare.map(|bare| (mttf_hours - bare) / added),
        });
    }
    Ok(found)
}
