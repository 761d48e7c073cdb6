use understudy_cluster::{Cluster, Overrides, press_cell, read_with};
use understudy_wire::Mode;

use super::*;

fn cell(mode: Mode) -> Cluster {
    let files = press_cell();
    let overrides = Overrides {
        mode: Some(mode),
        ..Overrides::default()
    };
    let loaded = read_with(files[0].name, files[0].text, overrides, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        file.map(|file| file.text.to_owned())
            .ok_or_else(|| "no such file".to_owned())
    });
    loaded.cluster.expect("the press cell is right")
}

fn plan(failures: u64, threads: usize) -> CampaignPlan {
    CampaignPlan {
        mtbf_cycles: 300.0,
        mttr_cycles: 50.0,
        acceleration: 1.0,
        failures,
        seed: 3,
        maximum_cycles: 1_000_000,
        threads,
    }
}

#[test]
fn a_campaign_is_the_same_on_any_number_of_processors() {
    let cell = cell(Mode::Full);
    let one = run_campaign(&cell, &plan(6, 1));
    let three = run_campaign(&cell, &plan(6, 3));
    assert_eq!(one, three);
    let other = CampaignPlan {
        seed: 4,
        ..plan(6, 1)
    };
    assert_ne!(one, run_campaign(&cell, &other));
}

#[test]
fn every_failure_of_the_system_has_the_cause_that_its_definition_names() {
    for (mode, second) in [(Mode::Full, "understudy"), (Mode::Paper, " after ")] {
        let found = run_campaign(&cell(mode), &plan(30, 2)).expect("in step");
        assert_eq!(found.campaign.failures.len(), 30);
        assert_eq!(found.violations, Vec::<String>::new());
        assert_eq!(found.unmasked, 0, "one failure at a time is masked");
        for failure in &found.campaign.failures {
            assert!(failure.cause.contains(second), "{}", failure.cause);
            assert!(failure.cause.contains(" after "), "{}", failure.cause);
        }
        let detection = found.detection_cycles.expect("failures are detected");
        assert!(detection < 10.0, "{detection}");
    }
}

#[test]
fn a_replica_that_does_not_fail_is_censored() {
    let lasting = CampaignPlan {
        mtbf_cycles: 1e9,
        maximum_cycles: 200,
        ..plan(2, 1)
    };
    let found = run_campaign(&cell(Mode::Full), &lasting).expect("in step");
    assert_eq!(found.campaign.failures.len(), 0);
    assert_eq!(found.campaign.censored_hours.len(), 2);
}
