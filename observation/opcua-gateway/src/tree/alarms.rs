//! The alarms of the cluster file on signals.

use opcua::types::{StatusCode, Variant};
use understudy_cluster::AlarmDeclaration;
use understudy_view::ProcessAlarm;

use super::{Kind, Reading, Seen, Tree, text};

impl Tree {
    pub(super) fn alarm(&mut self, place: usize, declared: &AlarmDeclaration) {
        // The folder next to `Open` and `Texts` keeps their identifiers free for any name.
        self.enter(&["Alarms", "Signals", &declared.name]);
        let of = move |read: fn(&ProcessAlarm) -> Option<Variant>| {
            move |seen: &Seen<'_>| {
                if seen.observation.past_percent.is_some() {
                    return Reading::WAITING;
                }
                let alarms = &seen.observation.snapshot.process_alarms;
                seen.present(alarms.get(place).and_then(read), StatusCode::Good)
            }
        };
        self.add(
            "Active",
            Kind::Boolean,
            "whether the alarm is active; bad while that is unknown",
            of(|alarm| alarm.active.map(Variant::from)),
        );
        self.add(
            "State",
            Kind::String,
            "normal, unacknowledged, acknowledged, returned, shelved or unknown",
            of(|alarm| Some(text(alarm.state.word()))),
        );
    }
}
