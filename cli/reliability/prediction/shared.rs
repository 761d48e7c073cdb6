//! Spares that the groups of a plant share, compared with hot-standby pairs.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use understudy_reliability::{
    Hours, Options, Probability, ReliabilityError, SharedSpares, grouped,
};

use super::{Arguments, Times, refused};
use crate::answer::Answer;

/// One way to protect the plant.
#[derive(Serialize)]
struct Row {
    name: String,
    boxes: u32,
    mttf_hours: f64,
}

/// Mean time to failure of stations that fail after `stations_hours`, in series with remote I/Os, field devices and networks. All of them fail rarely compared with their
/// repair, so the times to failure are exponential.
fn in_series(stations_hours: f64, options: &Options) -> Result<f64, Vec<ReliabilityError>> {
    match options.parts_chain()? {
        None => Ok(stations_hours),
        Some(parts) => {
            let parts_hours = parts.mttf().map_err(|error| vec![error])?;
            Ok(1.0 / (1.0 / stations_hours + 1.0 / parts_hours))
        }
    }
}

/// The pairs, and 0 to `most` shared spares.
pub(super) fn compared(
    arguments: &Arguments,
    options: &Options,
    most: u32,
) -> Result<Answer, Answer> {
    let mut times = Times::default();
    let wake = times.required("wake", Some(&arguments.wake));
    let coverage = Probability::new("the coverage of the wake-up", arguments.wake_coverage);
    times.finish(coverage.clone().err().into_iter().collect())?;
    if arguments.too_large >= options.groups {
        let wrong = ReliabilityError::Count {
            what: "the number of groups that are too large for the spares".to_owned(),
            count: u64::from(arguments.too_large),
            minimum: 0,
            maximum: u64::from(options.groups.saturating_sub(1)),
        };
        return Err(refused(&[wrong]));
    }
    let (wake, coverage): (Option<Hours>, _) = (wake, coverage.unwrap_or(Probability::ONE));
    let stations =
        Options { remote_ios: None, field_devices: None, networks: None, ..options.clone() };
    let pairs = stations.system().and_then(|system| system.copies_chain(2));
    let pairs = pairs.and_then(|chain| chain.mttf().map_err(|error| vec![error]));
    let pairs = pairs.and_then(|hours| in_series(hours, options));
    let mut rows = vec![Row {
        name: "hot-standby pairs".to_owned(),
        boxes: 2 * options.controllers + options.other_boxes(),
        mttf_hours: pairs.map_err(|errors| refused(&errors))?,
    }];
    // From the largest number down, so that one out of its bounds is refused at once.
    for (spares, wake) in (0..=most).rev().zip(std::iter::repeat(wake).flatten()) {
        let plant = SharedSpares {
            groups: options.groups.saturating_sub(arguments.too_large),
            too_large: arguments.too_large,
            controllers: options.controllers / options.groups.max(1),
            spares,
            mtbf: options.mtbf,
            mttr: options.mttr,
            wake,
            coverage,
        };
        rows.insert(
            1,
            Row {
                name: format!("{spares} shared spare{}", if spares == 1 { "" } else { "s" }),
                boxes: options.controllers + options.groups + spares + options.other_boxes(),
                mttf_hours: plant
                    .mttf()
                    .and_then(|hours| in_series(hours, options))
                    .map_err(|errors| refused(&errors))?,
            },
        );
    }
    let mut text = format!("{:<18} {:>6} {:>14}\n", "", "boxes", "MTTF in h");
    for Row { name, boxes, mttf_hours } in &rows {
        let mean = grouped(*mttf_hours);
        let _ = writeln!(text, "{name:<18} {boxes:>6} {mean:>14}");
    }
    Ok(Answer::done(text, json!({ "options": options, "compared": rows })))
}
