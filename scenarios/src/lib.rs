//! Scenario files, the laboratory that runs them, the journal, figures and reports.

mod account;
mod campaign;
mod figure;
mod injection;
mod joining;
mod journal;
mod kept;
mod laboratory;
mod leftovers;
mod members;
mod named_files;
mod observed;
mod operator;
mod outlook;
mod read;
mod record;
mod report;
mod run_directory;
mod scenario;
mod schema;
mod simulation;
mod summary;
mod table;
mod terms;
mod troubles;
mod verdict;
mod write;
mod writer;

pub use account::{
    Account, Counts, Interval, Numbering, OriginRule, Presence, Service, Stall, Terms,
};
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
pub use journal::{JOURNAL_LIMIT_BYTES, Journal, JournalError, JournalState, records, records_of};
pub use kept::{KeptError, keep_cluster, kept_cluster};
pub use laboratory::{
    Afterwards, Deaths, HostKind, LaboratoryError, LaboratoryRun, LaboratorySettings,
    NetworkSettings, Progress, monotonic_ns, run_commanded, run_laboratory,
};
pub use members::Members;
pub use named_files::{ALLOWED_FOLDERS, named_file};
pub use observed::{JournalView, ObservationError, observe_journal};
pub use operator::{
    Acknowledgement, Command, Commanded, Commander, Commands, OperatorAction, Refusal, RunSocket,
    commands,
};
pub use outlook::{JournalOutlook, look_ahead};
pub use read::{MAXIMUM_CYCLES, MAXIMUM_STEPS, ReadScenario, looks_like_a_scenario, read};
pub use record::{Happening, LABORATORY, Record, RunEvent, moment};
pub use report::{ReportError, report};
pub use run_directory::{RunDirectory, RunDirectoryError, time_name};
pub use scenario::{
    ACTIONS, During, Expectation, SOURCES, Scenario, TABLE_TWO, action_word, source_word,
};
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
pub use writer::{Writing, writing};
