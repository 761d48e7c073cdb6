//! The JSON schema of a scenario file, for editors.

use schemars::Schema;

use crate::format::SCENARIO;

/// JSON Schema 2020-12 of the data of a scenario file. Whether names and cycles fit together is beyond a schema; [`crate::read`]
/// checks it.
pub fn scenario_schema() -> Schema {
    let schema = SCENARIO.schema("Scenario file of Understudy");
    // An object is a schema.
    Schema::try_from(schema).unwrap_or_default()
}
