//! When two remote I/Os are the same state.

use std::hash::{Hash, Hasher};

use super::RemoteIo;

/// Two remote I/Os of equal settings that are drained and hash alike go on alike.
impl Hash for RemoteIo {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let Self {
            settings: _,
            // That of `laid_out`, which counts where an online change replaces the points.
            layout: _,
            laid_out,
            sensed: _,
            unknown_points,
            member,
            holders,
            knowledge,
            question,
            authority,
            sensors,
            field,
            // Only said with the outputs.
            sampled_at: _,
            diagnosing,
            diagnosed,
            looked,
            protection,
            resumed,
            forcing,
            writing,
            signals,
            noting,
            pairing,
            turns,
            deadline,
            missed,
            applied,
            last_true,
            descent,
            program,
            trust,
            differed,
            replacing,
        } = self;
        (member, holders, knowledge, question, authority).hash(hasher);
        (sensors, field, diagnosing, diagnosed, forcing).hash(hasher);
        (writing, signals, noting, pairing).hash(hasher);
        (looked, resumed, protection, turns, deadline, missed, applied).hash(hasher);
        (last_true, descent, program, trust, differed).hash(hasher);
        (replacing, self.named(Some(*laid_out)), unknown_points).hash(hasher);
    }
}
