//! The state of a run, live or finished, folded from its journal.
//!
//! ```text
//!   journal ──► Source ──► Model::note(record) ──┬─► snapshot(cycle): states, sources, remaining redundancy, alarms
//!   (files that grow, or a channel)              ├─► events, counters, trends, bands
//!                                                ├─► History: x(i), u(i) of each cycle ──► why, power flow
//!                                                ├─► diff of two runs
//!                                                └─► with those of other groups: the overview of a plant
//! ```
//!
//! This is the only fold of the journal for views: page, terminal, metrics, Modbus, OPC UA and Zenoh show its snapshot. It reads files only
//! and involves no member. Memory is bounded ([`Bounds`]); older records are forgotten. Cycles are counted from the origin of the run, as
//! in its report; those before it are negative.

mod alarm;
mod coarse;
mod describe;
mod diff;
mod drawing;
mod error;
mod event;
mod event_list;
mod film;
mod following;
mod history;
mod listing;
mod margin;
mod model;
mod online_change;
mod overview;
mod process_alarm;
mod protection;
mod rehearsal;
mod run;
mod series;
mod shown_text;
mod snapshot;
mod source;
mod source_text;
mod state_signal;
mod station;
mod stop;
mod terminal;
mod timeline;
mod timing;
mod value;
mod version;
mod why;
mod zone;

pub use alarm::{Alarm, AlarmState};
pub use coarse::{Extremes, MAXIMUM_COLUMNS};
pub use diff::{Difference, Differing, RunDiff, diff};
pub use error::ViewError;
pub use event::{Event, Level};
pub use event_list::{EventFilter, EventList, EventRow};
pub use film::{Film, Scene};
pub use following::Following;
pub use history::{Driven, History, Sampled, Step};
pub use listing::{Filter, JournalLine, JournalText, Listing};
pub use margin::{Holders, Loss, Margin, Outcome};
pub use model::{Bounds, Counters, MemberCounters, Model, ProgramCounters, SentTurn};
pub use online_change::{ChangePlace, ChangeSnapshot, ChangingMember, ChangingProgram, GivenStep};
pub use overview::{
    FollowedPlant, GroupOverview, GroupState, GroupView, PlantAlarm, PlantOverview, SpareOverview,
    SpareState,
};
pub use process_alarm::{ProcessAlarm, Shelved};
pub use protection::{LackingStation, LostState, Protection};
pub use rehearsal::{FirstDifference, OutputDifference, Rehearsal, Rehearsed};
pub use run::{Run, find_run, find_run_of, find_running, find_running_of};
pub use series::{Images, Series};
pub use shown_text::{NamedValue, ShownLine, Uses};
pub use snapshot::{
    ImageSide, LinkSnapshot, MarginSnapshot, NetworkSnapshot, OutcomeSnapshot, PlantSnapshot,
    PlantState, ProgramSnapshot, RemoteIoSnapshot, RemoteIoState, RunState, Snapshot,
    SpareSnapshot, StationSnapshot, TimingSnapshot, TwinSnapshot, WordSnapshot,
};
pub use source::{BEHIND, Feed, Progress, Reading, Source, Trouble};
pub use state_signal::{StateSignal, state_signals_of};
pub use station::StationState;
pub use terminal::{Key, Screen};
pub use timeline::{Span, Timeline};
pub use timing::CycleTiming;
pub use value::{forced_point, forced_value, number_of, shown, stored, value_of};
pub use why::{Addend, Reason, Reconstructed, Why};
pub use zone::Zone;
