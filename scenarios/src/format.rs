//! Every key of a scenario file, once: the reader and the schema are made from these tables.

use std::time::Duration;

use understudy_journal::{SOURCES, source_word};
use understudy_text::tables::format::{Kind, Table, key, required};

use crate::scenario::ACTIONS;

/// Cycles of one scenario, at most.
pub const MAXIMUM_CYCLES: u64 = 100_000_000;

/// Frames, bits and ages of a step, at most.
const MAXIMUM_NUMBER: u64 = 1000;

/// How long a frame is on its way, at most.
const MAXIMUM_LATENCY: Duration = Duration::from_secs(3600);

/// How late a slow member is, at most.
const MAXIMUM_SLOWNESS: Duration = Duration::from_secs(1);

const ANY: Kind = Kind::Count(0, u64::MAX);
const SHARE: Kind = Kind::Number(0.0, 1.0);
const LATENCY: Kind = Kind::Time(Duration::ZERO, MAXIMUM_LATENCY);
const VALUE: Kind =
    Kind::Either(&Kind::Flag, &Kind::Either(&Kind::Number(f64::MIN, f64::MAX), &Kind::Text));
const SOURCE: Kind = Kind::Word(|| SOURCES.into_iter().map(source_word).collect());

/// The whole file.
pub(crate) static SCENARIO: Table = Table {
    what: "a scenario",
    keys: &[
        required("title", Kind::Text),
        required("cycles", Kind::Count(1, MAXIMUM_CYCLES)),
        key("seed", ANY),
        key("spare_after", Kind::Count(1, 100_000)),
        key("step", Kind::List(&Kind::Table(&STEP))),
        key("network", Kind::Table(&NETWORK)),
        key("expect", Kind::Table(&EXPECTATION)),
    ],
};

/// Keys of a step that every action has; the others belong to some actions.
const COMMON_KEYS: usize = 4;

pub(crate) static STEP: Table = Table {
    what: "a step",
    keys: &[
        required("at", ANY),
        required("action", Kind::Word(|| ACTIONS.to_vec())),
        required("station", Kind::Text),
        key("phase", SHARE),
        key("to", Kind::OneOrMany(&Kind::Text)),
        key("both_ways", Kind::Flag),
        key("network", Kind::Count(1, 2)),
        key("direct_link", Kind::Flag),
        key("others", Kind::Flag),
        key("by", Kind::Time(Duration::ZERO, MAXIMUM_SLOWNESS)),
        key("frames", Kind::Count(1, MAXIMUM_NUMBER)),
        key("age", Kind::Count(1, MAXIMUM_NUMBER)),
        key("program", Kind::Text),
        key("bit", Kind::Count(0, MAXIMUM_NUMBER)),
        key("epoch", ANY),
        key("input", Kind::Text),
        key("value", VALUE),
    ],
};

/// Keys of a step that only some actions have.
pub(crate) fn action_keys() -> Vec<&'static str> {
    STEP.names().split_off(COMMON_KEYS)
}

pub(crate) static NETWORK: Table = Table {
    what: "the network",
    keys: &[
        key("loss", SHARE),
        key("duplicate", SHARE),
        key("corruption", SHARE),
        key("latency", LATENCY),
        key("jitter", LATENCY),
        key("network", Kind::Count(1, 2)),
        key("from", ANY),
        key("to", ANY),
    ],
};

pub(crate) static EXPECTATION: Table = Table {
    what: "the expectation",
    keys: &[
        key("wrong", ANY),
        key("held", ANY),
        key("fail_safe", ANY),
        key("missed", ANY),
        key("plant_faults", ANY),
        key("protected", Kind::Flag),
        key("functional", Kind::OneOrMany(&Kind::Text)),
        key("finished", Kind::Entries(&ANY)),
        key("during", Kind::List(&Kind::Table(&DURING))),
    ],
};

pub(crate) static DURING: Table = Table {
    what: "a range",
    keys: &[
        required("from", ANY),
        required("to", ANY),
        required("remote_io", Kind::Text),
        required("source", Kind::OneOrMany(&SOURCE)),
    ],
};
