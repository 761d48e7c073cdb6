//! Figures 5 and 6: MTTF, and MTTF by added unit, over the number of units that are not redundant.
//!
//! Figure 6 can be read in two ways, and both are given: the MTTF divided by the number of units added, and the MTTF *gained* over the
//! system without spares, divided by that number.

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::options::Options;
use crate::quantity::Hours;
use crate::system::System;

/// MTTF of one configuration, and by added unit, in hours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PerUnit {
    /// Figure 5.
    pub mttf_hours: f64,
    /// Units added to the N controllers.
    pub added: u32,
    /// Figure 6, first reading: MTTF/added.
    pub per_added_hours: f64,
    /// Figure 6, second reading: (MTTF - MTTF without spares)/added.
    pub gained_per_added_hours: f64,
}

/// One abscissa of both figures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FigurePoint {
    /// N
    pub controllers: u32,
    /// N controllers without an understudy.
    pub simplex_hours: f64,
    /// The paper's model, N + 1 stations.
    pub paper: PerUnit,
    /// The implemented cluster with one understudy, N + 1 stations.
    pub cluster: PerUnit,
    /// Full duplex, 2N controllers.
    pub duplex: PerUnit,
}

/// Points of figures 5 and 6 for stations with these times.
///
/// # Errors
/// The errors of [`System::chain`] and [`Chain::mttf`](crate::Chain::mttf).
pub fn figures_5_and_6(
    mtbf: Hours,
    mttr: Hours,
    controllers: impl IntoIterator<Item = u32>,
) -> Result<Vec<FigurePoint>, Vec<ReliabilityError>> {
    let mean = |system: &System| system.chain()?.mttf().map_err(|error| vec![error]);
    let mut points = Vec::new();
    for n in controllers {
        let system = Options::new(n, mtbf, mttr).system()?;
        let simplex_hours = mean(&system.as_simplex())?;
        let per_unit = |mttf_hours: f64, added: u32| PerUnit {
            mttf_hours,
            added,
            per_added_hours: mttf_hours / f64::from(added),
            gained_per_added_hours: (mttf_hours - simplex_hours) / f64::from(added),
        };
        let duplex = system.copies_chain(2)?.mttf().map_err(|error| vec![error])?;
        points.push(FigurePoint {
            controllers: n,
            simplex_hours,
            paper: per_unit(mean(&system.as_paper())?, 1),
            cluster: per_unit(mean(&system)?, 1),
            duplex: per_unit(duplex, n),
        });
    }
    Ok(points)
}
