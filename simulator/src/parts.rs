//! What a cluster consists of, ready to be started again and again.

use understudy_plant::Plant;
use understudy_wire::ProgramId;

/// The settings of every party. Remote I/Os and plants are indexed by program.
#[derive(Debug, Clone)]
pub struct Parts {
    /// By rank.
    pub stations: Vec<understudy_node::Settings>,
    /// By program.
    pub remote_ios: Vec<understudy_remote_io::Settings>,
    /// By program; one without a plant sees zeros.
    pub plants: Vec<Option<Plant>>,
    /// For each plant, the program of the plant that it gets its parts from.
    pub fed_by: Vec<Option<ProgramId>>,
}
