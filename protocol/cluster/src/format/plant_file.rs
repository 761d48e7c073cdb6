//! The sections of a plant file.

use std::time::Duration;

use super::{Kind, MANY_CYCLES, Section, count, key, required, time};

pub(crate) static GROUP: Section = Section {
    name: "group",
    repeated: true,
    meaning: "a cluster that spares serve; the order is the preference between groups with equal remaining redundancy",
    keys: keys! {
        required name: Kind::Name, "names the group";
        required cluster: Kind::Text, "its cluster file, relative to the plant file";
        key failure_domain: Kind::Text, "the rack, feeder or switch of its stations";
    },
};

pub(crate) static SPARE: Section = Section {
    name: "spare",
    repeated: true,
    meaning: "a machine that serves one group at a time; the order is the rank of the spares",
    keys: keys! {
        required name: Kind::Name, "names the spare";
        required groups: Kind::Names, "the slot in each group that it serves, by the name of the group, such as `{ line-1 = \"spare\" }`";
        key capacity: count(1, u32::MAX, u32::MAX), "operations in a second that its machine executes for a group; a group that needs more is never served";
        key failure_domain: Kind::Text, "its rack, feeder or switch";
        key spare_after: count(1, MANY_CYCLES, 50), "cycles for which a station must be flagged before the spare wakes";
        key retire_after: time(Duration::from_millis(100), Duration::from_secs(86_400), Duration::from_secs(30)), "time for which the group must be complete without the spare before it retires";
    },
};

pub(crate) static MACHINE: Section = Section {
    name: "machine",
    repeated: true,
    meaning: "a machine on which `understudy allocate` places stations, understudies, spares and remote I/Os",
    keys: keys! {
        required name: Kind::Name, "names the machine";
        key rack: Kind::Text, "its rack";
        key feeder: Kind::Text, "the feeder of its power";
        key switch: Kind::Text, "the switch that it is connected to";
        key stations: count(1, u32::MAX, 1), "stations, understudies and spares that it executes at most";
        key remote_ios: count(0, u32::MAX, 0), "remote I/Os that it executes at most; without a machine that has it, remote I/Os are not placed";
        key capacity: count(1, u32::MAX, u32::MAX), "operations in a second that it executes for all stations and spares";
    },
};
