//! Scenario files, the laboratory that runs them, the journal, figures and reports.

mod account;
mod campaign;
mod figure;
mod injection;
mod joining;
mod laboratory;
mod observed;
mod outlook;
mod read;
mod report;
mod results;
mod scenario;
mod schema;
mod simulation;
mod summary;
mod table;
mod terms;
mod troubles;
mod write;

pub use account::{Account, Counts, Interval, OriginRule, Presence, Service, Stall, Terms};
pub use campaign::{
    CampaignError, CampaignPlan, Found, Measured, OwnTime, Planned, Question, QuestionError,
    RealCampaign, RealCampaignRun, Speed, hold_against_model, options_of, plan_campaign,
    run_campaign, run_real_campaign, set_unequal,
};
pub use figure::{FigureError, Signals, figure};
pub use injection::{
    CoverageRow, Deadlines, Failure, Findings, FindingsError, InjectionPlan, Kind,
    MAXIMUM_FAILURES, MAXIMUM_RUN_CYCLES, MINIMUM_RUN_CYCLES, MergeError, NoShard, Phase,
    PictureError, Property, Role, Shard, inject, merge, picture,
};
pub use joining::{JOIN_CYCLES, Joined, join_trial};
pub use laboratory::{
    Afterwards, Deaths, HostKind, LaboratoryError, LaboratoryRun, LaboratorySettings,
    NetworkSettings, Progress, run_commanded, run_laboratory,
};
pub use observed::{JournalView, ObservationError, observe_journal};
pub use outlook::{JournalOutlook, look_ahead};
pub use read::{MAXIMUM_CYCLES, MAXIMUM_STEPS, ReadScenario, looks_like_a_scenario, read};
pub use report::{ReportError, report};
pub use results::{ResultsError, write_results};
pub use scenario::{ACTIONS, During, Expectation, Scenario, TABLE_TWO, action_word};
pub use schema::scenario_schema;
pub use simulation::{NotInStep, simulate};
pub use summary::{
    Circumstances, DeathSummary, ExpectationSummary, PlantSummary, RefusedSummary, RemoteIoSummary,
    StationSummary, StepSummary, Summary, ViolationSummary, World,
};
pub use table::{Cell, Row, Table};
pub use terms::parts;
pub use troubles::{Target, Trouble, TroubleRow};
pub use understudy_simulator::{Action, Disturbance, Fault, Network};
pub use write::write;
