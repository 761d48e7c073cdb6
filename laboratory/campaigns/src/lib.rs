//! Campaigns: many runs that are drawn from a seed, in the simulator or on processes, and what they measure.
//!
//! Fault injection looks for a run that breaks a property and shrinks it ([`inject`]). A measurement lets stations fail and be repaired until a
//! program is lost ([`run_campaign`], [`run_real_campaign`]). An outlook takes the same figures from the journal of a run ([`look_ahead`]).

mod campaign;
mod injection;
mod observed;
mod outlook;

pub use campaign::{
    CampaignError, CampaignPlan, Found, Measured, OwnTime, PartTimes, PartsFound, Planned,
    Question, QuestionError, RealCampaign, RealCampaignRun, SharedFound, Speed, hold_against_model,
    measure_shared, options_of, plan_campaign, run_campaign, run_real_campaign, set_unequal,
};
pub use injection::{
    CoverageRow, Deadlines, Failure, Findings, FindingsError, InjectionPlan, Kind,
    MAXIMUM_FAILURES, MAXIMUM_RUN_CYCLES, MINIMUM_RUN_CYCLES, Phase, PictureError, Property, Role,
    Seeds, Store, StoreError, inject, merge, picture,
};
pub use observed::{JournalView, ObservationError, observe_journal};
pub use outlook::{JournalOutlook, look_ahead};

/// When spares wake and retire in a simulated plant, and the parts of a search.
pub use understudy_simulator::{NoShard, Shard, ShardError, SpareTimes};
