//! The diagnosing ladder of the filling line: silent while all is well, and right about channels that stick or flicker.

mod bench;

use bench::{Bench, analysed};

/// Longer than any box takes from the belt to the printer.
const BOX_SCANS: usize = 130;

#[test]
fn nobody_is_accused_while_all_is_well() {
    for channels in
        [&["ps1"][..], &["ps1", "Filling_done"], &["ps1", "ps2", "Filling_done", "Weight_recd"]]
    {
        let (project, outcome) = analysed(channels);
        let mut bench = Bench::new(&project, &outcome);
        for scan in 0..3000 {
            bench.cycle(&|_, shown| shown, false);
            for channel in channels {
                assert!(!bench.diagnosed(channel), "{channel} in scan {scan} of {channels:?}");
            }
        }
        assert_eq!(bench.plant_faults, Vec::<String>::new());
        assert!(bench.finished > 20, "{} boxes", bench.finished);
    }
}

/// What came of a fault that begins in one scan of the making of a box.
struct Fault<'a> {
    channel: &'a str,
    /// What the sensor shows in a scan, counted from the first, in place of a value.
    shows: &'a dyn Fn(usize, bool) -> bool,
    /// For so many scans.
    lasts: usize,
}

struct Came {
    found: Option<usize>,
    believed_again: Option<usize>,
    others_accused: bool,
    /// Boxes after the operator has looked and released.
    finished: u32,
    plant_faults: Vec<String>,
}

/// The operator looks and releases, and presses Ready.
const LOOKS: usize = 400;
const PRESSES: std::ops::Range<usize> = 410..413;
const ENDS: usize = 900;

fn suffer(bench: &Bench, channels: &[&str], fault: &Fault<'_>) -> Came {
    let mut bench = bench.clone();
    let mut came = Came {
        found: None,
        believed_again: None,
        others_accused: false,
        finished: 0,
        plant_faults: Vec::new(),
    };
    for scan in 0..ENDS {
        let sensor = |name: &str, shown: bool| {
            if scan < fault.lasts && name == fault.channel {
                (fault.shows)(scan, shown)
            } else {
                shown || name == "Ready" && PRESSES.contains(&scan)
            }
        };
        bench.cycle(&sensor, scan == LOOKS);
        let is_found = bench.diagnosed(fault.channel);
        if is_found {
            came.found = came.found.or(Some(scan));
            came.believed_again = None;
        } else if came.found.is_some() {
            came.believed_again = came.believed_again.or(Some(scan));
        }
        let others = channels.iter().filter(|name| **name != fault.channel);
        came.others_accused |= others.clone().any(|other| bench.diagnosed(other));
        if scan == LOOKS {
            came.finished = bench.finished;
        }
    }
    came.finished = bench.finished - came.finished;
    came.plant_faults = bench.plant_faults;
    came
}

/// The line after two boxes, once for each scan in which the next one is made, with what its channels show.
fn scans_of_a_box(channels: &[&str], step: usize) -> Vec<Bench> {
    let (project, outcome) = analysed(channels);
    let mut bench = Bench::new(&project, &outcome);
    let mut found = Vec::new();
    for scan in 0..300 + BOX_SCANS {
        bench.cycle(&|_, shown| shown, false);
        if scan >= 300 && scan % step == 0 {
            found.push(bench.clone());
        }
    }
    found
}

/// Stuck for 30 s, at either value, from any moment on. A beam that says "a box" when one is expected is believed; no other
/// sensor of this line could tell.
#[test]
fn a_stuck_channel_is_found_before_anything_goes_wrong() {
    let channels = ["ps1", "Filling_done"];
    for bench in scans_of_a_box(&channels, 4) {
        for channel in channels {
            for value in [false, true] {
                let is_plausible = |expected: bool| value && !bench.shows(channel) && expected;
                let box_expected = channel == "ps1" && bench.drives("Motor");
                let fill_expected = channel == "Filling_done" && bench.drives("Filling");
                if is_plausible(box_expected || fill_expected) || bench.unsteady(channel) {
                    continue;
                }
                let came =
                    suffer(&bench, &channels, &Fault { channel, shows: &|_, _| value, lasts: 300 });
                let what = format!("{channel} stuck at {value} in scan {}", bench.scans);
                assert!(came.found.is_some_and(|scan| scan < 120), "{what}: {:?}", came.found);
                assert!(!came.others_accused, "{what}");
                let again = came.believed_again;
                assert!(again.is_some_and(|scan| scan >= 300), "{what}: believed in {again:?}");
                assert_eq!(came.plant_faults, Vec::<String>::new(), "{what}");
                assert!(came.finished >= 2, "{what}: {} boxes after it", came.finished);
            }
        }
    }
}

/// Every other scan the wrong value, for 3 s: nobody believes it, and it is believed again when it is quiet.
#[test]
fn a_channel_that_flickers_is_found_and_believed_again() {
    let channels = ["ps1", "Filling_done"];
    for bench in scans_of_a_box(&channels, 4) {
        for channel in channels {
            let came = suffer(
                &bench,
                &channels,
                &Fault { channel, shows: &|scan, shown| shown ^ (scan % 2 == 0), lasts: 30 },
            );
            let what = format!("{channel} flickers in scan {}", bench.scans);
            assert!(came.found.is_some_and(|scan| scan < 6), "{what}: {:?}", came.found);
            assert!(!came.others_accused, "{what}");
            assert!(came.believed_again.is_some_and(|scan| scan > 30), "{what}");
            assert_eq!(came.plant_faults, Vec::<String>::new(), "{what}");
            assert!(came.finished >= 2, "{what}: {} boxes after it", came.finished);
        }
    }
}

/// A channel that fails again and again is believed again a few times only, and then when the operator says so.
#[test]
fn what_fails_too_often_waits_for_the_operator() {
    let channels = ["ps1"];
    let benches = scans_of_a_box(&channels, BOX_SCANS);
    let came = suffer(
        &benches[0],
        &channels,
        &Fault { channel: "ps1", shows: &|scan, shown| shown ^ (scan % 40 == 0), lasts: 300 },
    );
    assert_eq!(came.believed_again, Some(LOOKS));
    assert_eq!(came.plant_faults, Vec::<String>::new());
    assert!(came.finished >= 2, "{} boxes", came.finished);
}
