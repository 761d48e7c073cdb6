//! Plants that act on each other, as processes of their own: the main burner burns over the flame of the pilot burner.

use super::{PERIOD, answer, empty_folder, no_orphan, some_at_a_time};

#[test]
fn the_main_burner_lights_at_the_flame_of_the_pilot_burner() {
    let _one = some_at_a_time();
    let out = empty_folder("boiler");
    let cluster = "examples/boiler/cluster.toml";
    // The purge takes 5 s, the rest of lighting less than one.
    let run = ["lab", cluster, "--link", "udp", "--period", PERIOD];
    let more = ["--cycles", "200", "--out", out.to_str().expect("text")];
    let (_, document, errors) = answer(&[&run[..], &more].concat());
    no_orphan(&out);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    let remote_ios = summary["remote_ios"].as_array().expect("remote I/Os");
    let served = |remote_io: &serde_json::Value| {
        let counts = &remote_io["counts"];
        counts["direct"].as_u64() == Some(200)
    };
    // A host that stood still may have put a flame out; what is wrong was asked already.
    if !remote_ios.iter().all(served) {
        return;
    }
    for plant in summary["plants"].as_array().expect("plants") {
        assert_eq!(plant["plant_faults"], 0, "{plant:#}");
        let flames = plant["finished"].as_u64();
        assert!(flames.is_some_and(|flames| flames >= 1), "{plant:#}");
    }
}
