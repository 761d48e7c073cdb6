//! What differs between two clusters, program by program, as far as an online change can make it.

use std::collections::BTreeSet;

use understudy_cycle::PointsChange;
use understudy_wire::ProgramId;

use super::later::changed_links;
use super::point_fates::changed_points;
use super::points::{are_other_points, fixed_points, points_change};
use super::settings::{ChangedSetting, changed_settings};
use super::{ChangedFallback, NeedsStop, Unfit};
use crate::cluster::Cluster;
use crate::code::Way;

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
    let both = || {
        let controllers = before.controllers.iter().zip(&after.controllers);
        (0..).map(ProgramId).zip(controllers).filter(|(_, (old, new))| old.name == new.name)
    };
    let with_points = both().filter(|(program, _)| are_other_points(before, after, *program));
    let with_points: BTreeSet<ProgramId> = with_points.map(|(program, _)| program).collect();
    // Where the inputs of a program come from is a part of its points.
    let of_points: Vec<String> = with_points
        .iter()
        .map(|program| format!("remote I/O `{}`", before.remote_ios[program.index()].name))
        .collect();
    let is_of_points = |setting: &ChangedSetting| matches!(setting, ChangedSetting::Key { of, key, .. } if key == "`inputs`" && of_points.contains(of));
    let changed = changed_settings(&before.frame_text, &after.frame_text);
    let others = changed.into_iter().filter(|setting| !is_of_points(setting));
    let mut reasons: Vec<NeedsStop> = others.map(NeedsStop::Setting).collect();
    reasons.extend(changed_links(before, after).into_iter().map(NeedsStop::Setting));
    let mut differences = Vec::new();
    for (program, (old, new)) in both() {
        let is_replaced = old.hash != new.hash;
        if with_points.contains(&program) {
            let name = || old.name.clone();
            if !is_replaced {
                let points = changed_points(before, after, program, Way::There);
                reasons.push(Unfit::Unmarked { program: name(), points: points.into() }.into());
            }
            let fixed = fixed_points(before, after, program);
            reasons.extend(fixed.map(|why| Unfit::Fixed { program: name(), why }.into()));
        }
        let points = points_change(before, after, program);
        let mut fallback = None;
        let remote_ios = [before, after].map(|cluster| cluster.remote_ios.get(program.index()));
        if let [Some(one), Some(other)] = remote_ios {
            match ChangedFallback::between(program, one, other) {
                Ok(changed) => fallback = changed,
                Err(changed) => reasons.push(NeedsStop::Setting(changed)),
            }
        }
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
