//! Cluster files as a whole: what loads, what is found, what the hash is of.

mod alarms;
mod cards;
mod changed_settings;
mod common;
mod configuration;
mod findings;
mod inputs;
mod meeting;
mod notify;
mod online_change;
mod plant_file;
mod points;
mod press_cell;
mod renamed;
mod retention;
mod schema;
mod template;
mod twins;
mod undriven;
