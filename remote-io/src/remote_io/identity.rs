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
            unknown_points,
            member,
            arbiter,
            inputs,
            actuation,
            // Only said with the outputs.
            sampled_at: _,
            protection,
            resumed,
            noting,
            pairing,
            turns,
            deadline,
            differed,
            replacing,
        } = self;
        (member, arbiter, inputs, actuation, noting, pairing).hash(hasher);
        (resumed, protection, turns, deadline, differed).hash(hasher);
        (replacing, self.named(Some(*laid_out)), unknown_points).hash(hasher);
    }
}
