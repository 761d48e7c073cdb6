//! Every key of models, nets and maps of signals, once: the readers and the schemas are made from these tables.

use std::time::Duration;

use understudy_text::duration;
use understudy_text::tables::format::{Kind, Table, key, required};

use crate::ads::MAXIMUM_LABEL;
use crate::ladder::{Agent, When};

/// Tokens and capacities of places, at most.
const MAXIMUM_TOKENS: u64 = 32_767;

const TEXTS: Kind = Kind::List(&Kind::Text);
const NAMES: Kind = Kind::OneOrMany(&Kind::Text);
const TIME: Kind = Kind::Time(Duration::ZERO, duration::MAXIMUM);
const ADDRESSES: Kind = Kind::Entries(&Kind::Pattern("^%[IQM]X?[0-9]+(\\.[0-9]+)*$"));
const TRANSITIONS: Kind = Kind::List(&Kind::Pattern("^\\s*\\S+\\s+\\S+\\s+\\S+\\s*$"));
const MARKED: Kind = Kind::Either(&Kind::Word(|| vec!["all"]), &TEXTS);
const WHEN: Kind = Kind::Word(|| When::WORDS.map(|(word, _)| word).to_vec());
const BY: Kind = Kind::Word(|| Agent::WORDS.map(|(word, _)| word).to_vec());
const LABEL: Kind = Kind::Count(0, MAXIMUM_LABEL as u64);

pub(crate) static MODEL: Table = Table {
    what: "a model",
    keys: &[
        key("name", Kind::Text),
        key("events", Kind::Entries(&Kind::Table(&SIGNAL_EVENT))),
        key("addresses", ADDRESSES),
        key("plant", Kind::List(&Kind::TableOr(&AUTOMATON, &NET_PLANT))),
        key("specification", Kind::List(&Kind::Table(&AUTOMATON))),
        key("supervisor", Kind::List(&Kind::Table(&AUTOMATON))),
    ],
};

/// An event of a net.
pub(crate) static EVENT: Table =
    Table { what: "an event", keys: &[key("controllable", Kind::Flag), key("label", LABEL)] };

/// An event of a model, which may be bound to a signal.
pub(crate) static SIGNAL_EVENT: Table = Table {
    what: "an event",
    keys: &[
        key("controllable", Kind::Flag),
        key("label", LABEL),
        key("signal", Kind::Text),
        key("when", WHEN),
    ],
};

pub(crate) static AUTOMATON: Table = Table {
    what: "an automaton",
    keys: &[
        key("name", Kind::Text),
        key("file", Kind::Text),
        key("events", TEXTS),
        key("initial", Kind::Text),
        key("marked", MARKED),
        key("states", TEXTS),
        key("transitions", TRANSITIONS),
    ],
};

pub(crate) static NET_PLANT: Table =
    Table { what: "a plant that is a net", keys: &[required("net", Kind::Text)] };

pub(crate) static NET_FILE: Table = Table {
    what: "a net",
    keys: &[
        required("name", Kind::Text),
        key("events", Kind::Entries(&Kind::Table(&EVENT))),
        key("place", Kind::List(&Kind::Table(&PLACE))),
        key("transition", Kind::List(&Kind::Table(&TRANSITION))),
        key("addresses", ADDRESSES),
    ],
};

pub(crate) static PLACE: Table = Table {
    what: "a place",
    keys: &[
        required("name", Kind::Text),
        key("tokens", Kind::Count(0, MAXIMUM_TOKENS)),
        key("capacity", Kind::Count(1, MAXIMUM_TOKENS)),
        key("level", NAMES),
        key("impulse", NAMES),
    ],
};

pub(crate) static TRANSITION: Table = Table {
    what: "a transition",
    keys: &[
        required("name", Kind::Text),
        key("event", Kind::Text),
        key("takes", NAMES),
        key("gives", NAMES),
        key("inhibited_by", NAMES),
        key("enabled_by", NAMES),
        key("when", Kind::Text),
        key("after", TIME),
    ],
};

pub(crate) static MAP: Table = Table {
    what: "a map",
    keys: &[
        required("program", Kind::Text),
        key("start", Kind::Text),
        key("events", Kind::Entries(&Kind::Count(0, u64::MAX))),
        key("input", Kind::List(&Kind::Table(&INPUT))),
        key("switch", Kind::List(&Kind::Table(&SWITCH))),
        key("pulse", Kind::List(&Kind::Table(&PULSE))),
        key("timer", Kind::List(&Kind::Table(&TIMER))),
        key("request", Kind::List(&Kind::Table(&REQUEST))),
        key("addresses", ADDRESSES),
    ],
};

pub(crate) static INPUT: Table = Table {
    what: "an input",
    keys: &[
        required("event", Kind::Text),
        required("signal", Kind::Text),
        key("when", WHEN),
        key("by", BY),
    ],
};

pub(crate) static SWITCH: Table = Table {
    what: "a switch",
    keys: &[
        key("off", Kind::Text),
        required("positions", Kind::List(&Kind::Table(&POSITION))),
        key("memory", Kind::Flag),
    ],
};

pub(crate) static POSITION: Table = Table {
    what: "a position",
    keys: &[required("event", Kind::Text), required("signal", Kind::Text)],
};

pub(crate) static PULSE: Table = Table {
    what: "a pulse",
    keys: &[
        required("event", Kind::Text),
        required("signal", Kind::Text),
        key("memory", Kind::Flag),
    ],
};

pub(crate) static TIMER: Table = Table {
    what: "a timer",
    keys: &[
        required("event", Kind::Text),
        required("name", Kind::Text),
        required("runs_while", Kind::Text),
        required("preset", TIME),
    ],
};

pub(crate) static REQUEST: Table = Table {
    what: "a request",
    keys: &[required("event", Kind::Text), required("signal", Kind::Text)],
};
