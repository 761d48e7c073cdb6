//! Scenario files, the run of a scenario in the simulator, the account of any run, and its figures and report.

mod account;
mod figure;
mod format;
mod read;
mod report;
mod results;
mod scenario;
mod schema;
mod simulation;
mod summary;
mod table;
mod terms;
mod verdict;
mod write;

pub use account::{Account, Counts, Interval, OriginRule, Presence, Service, Stall, Terms};
pub use figure::{FigureError, Signals, figure};
pub use read::{MAXIMUM_CYCLES, MAXIMUM_STEPS, ReadScenario, looks_like_a_scenario, read};
pub use report::{ReportError, report};
pub use results::{ResultsError, write_results};
pub use scenario::{ACTIONS, During, Expectation, Scenario, TABLE_TWO, action_text, action_word};
pub use schema::scenario_schema;
pub use simulation::{NotInStep, simulate};
pub use summary::{
    Circumstances, DeathSummary, ExpectationSummary, NetworkFaultSummary, OutageSummary,
    PlantSummary, RefusedSummary, RemoteIoSummary, StartSummary, StationSummary, StepSummary,
    Summary, ViolationSummary, World,
};
pub use table::{Cell, Row, Table};
pub use terms::parts;
pub use understudy_simulator::{Action, Disturbance, Fault, Network};
pub use write::write;
