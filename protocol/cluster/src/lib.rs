//! The cluster file: which programs, stations, remote I/Os and plants there are.
//!
//! [`read`] takes the text of a `cluster.toml` and a function that gives the ladders that it names, and answers with a
//! [`Cluster`] and with everything that is wrong in any of these files. From a cluster comes what each member is told when it
//! starts. Two members that read equal files have equal [`configuration`](understudy_cycle::Agreement::configuration) hashes,
//! and only such members work together; the hash is of [`Cluster::canonical_text`].
//!
//! The format is described in `docs/reference/cluster-file.md`.

mod address;
mod alarm;
mod canonical;
mod card;
mod change;
mod cluster;
mod code;
mod configuration;
mod device;
mod draft;
mod fields;
mod file;
mod format;
mod notify;
mod place;
mod plant_file;
mod read;
mod retention;
mod schema;
mod settings;
mod source;
mod source_text;
mod taken_over;
mod template;
mod undriven;

pub use address::{
    Addresses, MAXIMUM_NAME_LENGTH, MULTICAST_GROUPS, is_multicast_range, is_name, why_unreachable,
};
pub use alarm::{AlarmCondition, AlarmDeclaration, MAXIMUM_ALARMS, Priority};
pub use card::{Card, CardFacts, MAXIMUM_DECIMALS};
pub use change::{
    ChangeError, ChangeTexts, ChangedFallback, ChangedInitial, ChangedPoint, ChangedPoints,
    ChangedSetting, ChangedText, CommonPoints, FallbackText, FixedPoints, NeedsStop, OnlineChanges,
    PairReason, PointFate, PointList, ProgramText, Unfit, change_with_points, changed_fallbacks,
    changed_initials, changed_points, done_pairs, fates, input_name_after, later_settings,
    same_point,
};
pub use cluster::{Cluster, Controller, Link, PlantPlace, RemoteIo, Security, Twin, Understudy};
pub use code::{Code, Unnamed, Way};
pub use device::{BAUD_RATES, Binding, Connection, FieldDevice, Parity, SerialLine, Side};
pub use draft::{Draft, DraftProgram, MAXIMUM_PROGRAM_NAME};
pub use notify::Notify;
pub use place::{BitPlace, ByteOrder, Place, PlaceError, RegisterTable, Registers};
pub use plant_file::{
    LoadedPlant, PlantFile, PlantGroup, PlantMachine, PlantSpare, Serves, load_of,
    looks_like_a_plant_file, read_plant_file, station_load,
};
pub use read::{Loaded, MAXIMUM_TEXT_BYTES, Overrides, read, read_with};
pub use schema::{plant_file_schema, schema};
pub use source::{
    GroupSignal, InputSource, InputSourceKind, OperatorDeclaration, SignalDeclaration,
};
pub use source_text::{SourceText, read_kept};
pub use taken_over::{nearest_of, origins, states_at_change};
pub use template::{TemplateFile, minimal, modbus_cell, press_cell, read_with_files, template};
pub use understudy_executable::{stored_value, typed_value, value_text};
