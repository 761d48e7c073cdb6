//! What programs need of the controllers that run them, which controllers have it, and which to take.
//!
//! [`Resources`] counts what a program consists of, [`Catalogue`] holds what is known of controllers that can be bought, [`fit`] compares
//! the two in three values, and [`allocate`] ranks the controllers for every box of a plant and packs the boxes. The selection of
//! controllers is that of the paper on the deployment of controllers, sections 2 and 3; what it adds is the plant's
//! redundancy: one failure must not take two.
//!
//! [`distribute`] places the stations, understudies and spares of a plant on the machines that it has, by failure domain.
//!
//! Unknown is unknown: a figure that is not in the catalogue never counts as 0 and never as enough.

mod additions;
mod allocate;
mod bill;
mod controller;
mod csv;
mod domains;
mod ethernet;
mod figures;
pub mod file;
mod fit;
mod instructions;
mod memory;
mod modules;
mod need;
pub mod packing;
mod plant;
mod report;
mod requirement;
mod resources;
mod search;

pub use additions::{Added, AdditionError, InUse, Mode};
pub use allocate::{
    Allocation, AllocationError, BoxOnPlan, Candidate, Item, Options, Placed, Preference, Stock,
    Verification, allocate,
};
pub use bill::{BillRow, Price};
pub use controller::{Catalogue, Controller, Family, Kind};
pub use domains::{Conflict, Distribution, Domain, Machine, PlantRole, Shortage, distribute};
pub use figures::{FamilyQuantity, Figure, Quantity, Statement};
pub use fit::{Dimension, Finding, Fit, Load, Verdict, fit};
pub use instructions::{Instruction, Operator, instructions};
pub use modules::{Assessment, ModuleFault, Modules, assess};
pub use need::{MOST_RESERVE_PERCENT, Need, Terms};
pub use plant::{Group, Member, Twin, alone};
pub use report::{Provenance, ReportError, csv, html, text};
pub use requirement::{Asked, Bound, Requirement, RequirementError, Role};
pub use resources::Resources;
pub use search::{Found, Lacking, search};
