//! Signs, colours and dashes of states and sources, as on the page of a run. No state is shown by colour alone.

use understudy_wire::Source;

use crate::station::StationState;

const GREEN: &str = "#0a7a33";
const BLUE: &str = "#1f5fa8";
const AMBER: &str = "#9a6200";
const RED: &str = "#a8220e";

pub(super) struct Sign {
    pub(super) sign: &'static str,
    pub(super) colour: &'static str,
    /// Of a line, as SVG writes them.
    pub(super) dashes: &'static str,
}

const fn sign(sign: &'static str, colour: &'static str, dashes: &'static str) -> Sign {
    Sign { sign, colour, dashes }
}

pub(super) const fn of_state(state: StationState) -> Sign {
    match state {
        StationState::Publishing => sign("●", GREEN, "none"),
        StationState::Killed | StationState::Ended => sign("✕", RED, "6 4"),
        StationState::Refused => sign("✗", RED, "6 4"),
        StationState::NotReceived => sign("○", AMBER, "2 3"),
        StationState::Flagged => sign("⚑", AMBER, "2 3"),
        StationState::Suspended => sign("‖", AMBER, "2 3"),
        StationState::NotStarted | StationState::Standby => sign("…", BLUE, "10 3"),
        StationState::Joining => sign("↻", BLUE, "10 3"),
        StationState::ShadowMode => sign("◐", BLUE, "10 3"),
    }
}

pub(super) const fn of_source(source: Source) -> Sign {
    match source {
        Source::Direct => sign("→", GREEN, "none"),
        Source::Reconstructed => sign("⊕", BLUE, "7 4"),
        Source::Held => sign("‖", AMBER, "2 4"),
        Source::FailSafe => sign("■", RED, "1 6"),
    }
}
