//! What differs between two clusters, program by program, as far as an online change can make it.

use understudy_cycle::PointsChange;
use understudy_wire::ProgramId;

use super::points::{fixed_points, points_change};
use super::settings::{ChangedSetting, changed_settings};
use super::{ChangedFallback, NeedsStop, Unfit};
use crate::cluster::Cluster;

/// What differs of one program.
pub(super) struct Difference {
    pub(super) program: ProgramId,
    pub(super) is_replaced: bool,
    /// Where its points differ.
    pub(super) points: Option<PointsChange>,
    /// Where its remote I/O does something else while nothing is proved.
    pub(super) fallback: Option<ChangedFallback>,
}

/// The differences of all programs that have any, in the order of the cluster.
///
/// # Errors
/// Why they need a stop.
pub(super) fn differences(
    before: &Cluster,
    after: &Cluster,
) -> Result<Vec<Difference>, Vec<NeedsStop>> {
    if before.name() != after.name() {
        let (before, after) = (before.name().to_owned(), after.name().to_owned());
        return Err(vec![NeedsStop::OtherCluster { before, after }]);
    }
    let both = || before.controllers.iter().zip(&after.controllers);
    let replaced = both().zip(&before.remote_ios).filter(|((old, new), _)| old.hash != new.hash);
    let of_replaced: Vec<String> =
        replaced.map(|(_, remote_io)| format!("remote I/O `{}`", remote_io.name)).collect();
    // Where the inputs of a program come from is a part of its points.
    let is_of_points = |setting: &ChangedSetting| matches!(setting, ChangedSetting::Key { of, key, .. } if key == "`inputs`" && of_replaced.contains(of));
    let changed = changed_settings(&before.frame_text, &after.frame_text);
    let others = changed.into_iter().filter(|setting| !is_of_points(setting));
    let mut reasons: Vec<NeedsStop> = others.map(NeedsStop::Setting).collect();
    let mut differences = Vec::new();
    for (program, (old, new)) in (0..).map(ProgramId).zip(both()) {
        if old.name != new.name {
            continue;
        }
        let points = points_change(before, after, program);
        let fixed = points.as_ref().map(|_| fixed_points(before, after, program));
        let fixed = fixed.into_iter().flatten();
        let fixed = fixed.map(|why| Unfit::Fixed { program: old.name.clone(), why });
        reasons.extend(fixed.map(NeedsStop::from));
        let mut fallback = None;
        let remote_ios = [before, after].map(|cluster| cluster.remote_ios.get(program.index()));
        if let [Some(one), Some(other)] = remote_ios {
            match ChangedFallback::between(program, one, other) {
                Ok(changed) => fallback = changed,
                Err(changed) => reasons.push(NeedsStop::Setting(changed)),
            }
        }
        let is_replaced = old.hash != new.hash;
        if is_replaced {
            let unfit = Unfit::memory(&old.name, &old.code, &new.code).into_iter();
            let unfit = unfit.chain(Unfit::pairs(&old.name, &old.code, &new.code));
            reasons.extend(unfit.map(NeedsStop::from));
        }
        if is_replaced || fallback.is_some() {
            differences.push(Difference { program, is_replaced, points, fallback });
        }
    }
    if reasons.is_empty() { Ok(differences) } else { Err(reasons) }
}
