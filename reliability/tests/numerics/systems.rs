use proptest::prelude::*;
use understudy_reliability::{
    AfterFailure, CommonCause, CommonCauseConvention, MINIMUM_PROBABILITY, Options, Probability,
    ReliabilityError, Rule, SharedPart, UnequalBoxes,
};

use crate::support::{check, check_within, fixture, hours, kind, number, rows, system, whole};

fn groups_of(groups: u32, boxes: u32, mtbf: f64, mttr: f64) -> understudy_reliability::System {
    let mut system = system(groups * (boxes - 1), 1, Rule::Paper, mtbf, mttr);
    system.groups = groups;
    system
}

/// The chain of the paper's model, (14), with coverage, against its closed form of (15) to (20) in 60 digits.
#[test]
fn the_paper_s_model_to_twelve_digits() {
    for row in rows(&fixture(), "three_state") {
        let [lambda, mu] = ["failure_rate", "repair_rate"].map(|key| number(row, key));
        let controllers = whole(row, "controllers");
        let mut system = system(controllers, 1, Rule::Paper, 1.0 / lambda, 1.0 / mu);
        system.coverage = Probability::new("coverage", number(row, "coverage")).expect("coverage");
        let chain = system.chain().expect("a chain");
        let found = chain.time_to_failure().expect("moments");
        let what = format!("{controllers} controllers, repair {mu}");
        check(found.mean_hours, number(row, "mttf"), &what);
        let variance = number(row, "variance");
        check_within(found.variance_hours_squared, variance, 1e-10, &what);
        for at in rows(row, "times") {
            let hours = number(at, "hours");
            let found = chain.transient(hours, AfterFailure::Final).expect("P(t)");
            let [p0, p1, p2] = ["p0", "p1", "p2"].map(|key| number(at, key));
            let working = [(found.probabilities[0], p0), (found.working, p0 + p1)];
            for (value, expected) in working.into_iter().chain([(found.failed, p2)]) {
                if expected >= MINIMUM_PROBABILITY {
                    check(value, expected, &format!("{what}, {hours} h"));
                }
            }
        }
    }
}

#[test]
fn lumped_groups_to_twelve_digits() {
    for row in rows(&fixture(), "degraded_groups") {
        let (lambda, mu) = (number(row, "failure_rate"), number(row, "repair_rate"));
        let (groups, boxes, crews) =
            (whole(row, "groups"), whole(row, "boxes"), whole(row, "crews"));
        let mut system = groups_of(groups, boxes, 1.0 / lambda, 1.0 / mu);
        system.crews = Some(crews);
        let chain = system.chain().expect("a chain");
        check(chain.mttf().expect("a mean"), number(row, "mttf"), &row.to_string());
    }
}

#[test]
fn the_cluster_as_built_to_twelve_digits() {
    for row in rows(&fixture(), "cluster") {
        let (lambda, mu) = (number(row, "failure_rate"), number(row, "repair_rate"));
        let mut system = system(
            whole(row, "controllers"),
            whole(row, "spares"),
            Rule::AsBuilt,
            1.0 / lambda,
            1.0 / mu,
        );
        system.crews = Some(whole(row, "crews"));
        let mean = system.chain().expect("a chain").mttf().expect("a mean");
        check(mean, number(row, "mttf"), &row.to_string());
    }
}

#[test]
fn twenty_controllers_and_one_understudy_are_as_good_as_a_full_duplex() {
    let mean = |system: understudy_reliability::System| {
        let found = system.chain().expect("a chain").mttf().expect("a mean");
        (found, system.boxes())
    };
    let (one, boxes) = mean(system(20, 1, Rule::AsBuilt, 10_000.0, 24.0));
    assert_eq!((one.round(), boxes), (110_906.0, 21));
    let (duplex, boxes) = mean(groups_of(20, 2, 10_000.0, 24.0));
    assert_eq!((duplex.round(), boxes), (104_939.0, 40));
    let (paper, boxes) = mean(system(20, 1, Rule::Paper, 10_000.0, 24.0));
    assert_eq!((paper.round(), boxes), (10_897.0, 21));
    let (two, _) = mean(system(20, 2, Rule::AsBuilt, 10_000.0, 24.0));
    assert!((2.95e7..3.05e7).contains(&two), "{two}");
    let (none, _) = mean(system(20, 0, Rule::AsBuilt, 10_000.0, 24.0));
    check(none, 500.0, "without an understudy");
}

#[test]
fn a_pair_is_the_same_under_both_rules() {
    for crews in [None, Some(1)] {
        let mut paper = system(1, 1, Rule::Paper, 10_000.0, 24.0);
        let mut built = system(1, 1, Rule::AsBuilt, 10_000.0, 24.0);
        (paper.crews, built.crews) = (crews, crews);
        let mean =
            |system: &understudy_reliability::System| system.chain().unwrap().mttf().unwrap();
        check(mean(&paper), mean(&built), "one controller, one understudy");
    }
}

#[test]
fn latency_of_detection_adds_to_repair() {
    let mut slow = system(3, 1, Rule::Paper, 10_000.0, 24.0);
    slow.detection = Some(hours(6.0));
    let mean = slow.chain().unwrap().mttf().unwrap();
    // S1 lasts until it is detected and then repaired: by hand, with both as stages.
    let (n, l, d, m) = (3.0, 1e-4, 1.0 / 6.0, 1.0 / 24.0);
    let survive = d / (n * l + d) * (m / (n * l + m));
    let stay = 1.0 / (n * l + d) + d / (n * l + d) / (n * l + m);
    check_within(mean, (1.0 / ((n + 1.0) * l) + stay) / (1.0 - survive), 1e-11, "stages");
}

#[test]
fn shared_parts_and_common_causes_end_it_from_every_state() {
    let plain = system(5, 1, Rule::AsBuilt, 10_000.0, 24.0);
    let mut shared = plain.clone();
    shared.shared = vec![
        SharedPart::single("network", hours(50_000.0)),
        SharedPart::single("power", hours(200_000.0)),
    ];
    let reliability = |system: &understudy_reliability::System| {
        system.chain().unwrap().reliability(1000.0).unwrap()
    };
    let both: f64 = 1000.0 * (1.0 / 50_000.0 + 1.0 / 200_000.0);
    check(reliability(&shared), reliability(&plain) * (-both).exp(), "in series");

    let mut common = plain.clone();
    let beta = Probability::new("beta", 0.1).unwrap();
    common.common_cause = Some(CommonCause { beta, convention: CommonCauseConvention::Additive });
    check(reliability(&common), reliability(&plain) * (-0.01_f64).exp(), "additive");
    common.common_cause = Some(CommonCause { beta, convention: CommonCauseConvention::Split });
    let mut fewer = plain.clone();
    fewer.controllers[0].mtbf = hours(10_000.0 / 0.9);
    fewer.understudies.mtbf = hours(10_000.0 / 0.9);
    check(reliability(&common), reliability(&fewer) * (-0.01_f64).exp(), "split");
}

#[test]
fn splitting_beta_can_raise_the_mean_of_a_large_system() {
    let mut large = system(1000, 1, Rule::Paper, 10_000.0, 24.0);
    let mean = |system: &understudy_reliability::System| system.chain().unwrap().mttf().unwrap();
    let plain = mean(&large);
    let beta = Probability::new("beta", 0.1).unwrap();
    large.common_cause = Some(CommonCause { beta, convention: CommonCauseConvention::Split });
    assert!(mean(&large) > plain);
    large.common_cause = Some(CommonCause { beta, convention: CommonCauseConvention::Additive });
    assert!(mean(&large) < plain);
}

#[test]
fn unequal_boxes_that_are_equal_are_one_kind() {
    let plain = system(6, 1, Rule::AsBuilt, 8_000.0, 12.0);
    let mut named = plain.clone();
    named.controllers = vec![kind("robots", 2, 8_000.0, 12.0), kind("presses", 4, 8_000.0, 12.0)];
    let states = |system: &understudy_reliability::System| system.chain().unwrap().states();
    assert_eq!(states(&plain), states(&named));
    named.controllers[0].mtbf = hours(8_000.0 * (1.0 + 1e-12));
    assert!(states(&named) > states(&plain));
    let mean = |system: &understudy_reliability::System| system.chain().unwrap().mttf().unwrap();
    check_within(mean(&named), mean(&plain), 1e-11, "nearly equal");
}

#[test]
fn eleven_kinds_that_are_nearly_equal_are_eleven_equal_boxes() {
    // Too many states next to each other for an elimination: the sweeps answer, and to the same digits.
    let plain = system(11, 1, Rule::AsBuilt, 8_000.0, 12.0);
    let mut named = plain.clone();
    named.controllers = (0..11)
        .map(|k| {
            kind(
                &format!("c{k}"),
                1,
                8_000.0 * (1.0 + 1e-15 * f64::from(k)),
                12.0 * (1.0 + 1e-15 * f64::from(k)),
            )
        })
        .collect();
    let chain = named.chain().unwrap();
    assert!(chain.states() > 2_000, "{}", chain.states());
    check(chain.mttf().unwrap(), plain.chain().unwrap().mttf().unwrap(), "nearly equal");
}

#[test]
fn twelve_controllers_in_groups_of_every_size() {
    let mut last = 0.0;
    for groups in [1, 2, 3, 4, 6, 12] {
        let mut system = system(12, 1, Rule::AsBuilt, 10_000.0, 24.0);
        system.groups = groups;
        let chain = system.chain().unwrap();
        let mean = chain.mttf().unwrap();
        // With a crew each the groups are independent: R(t) is the power of one group's.
        let mut one = system.clone();
        one.groups = 1;
        one.controllers[0].count = 12 / groups;
        let alone = one.chain().unwrap().reliability(5_000.0).unwrap();
        check_within(
            chain.reliability(5_000.0).unwrap(),
            alone.powi(groups as i32),
            1e-11,
            "groups",
        );
        assert!(mean > 0.9 * last, "{groups} groups: {mean}");
        last = mean;
        system.crews = Some(1);
        assert!(system.chain().unwrap().mttf().unwrap() < mean);
    }
    let mut odd = system(12, 1, Rule::AsBuilt, 10_000.0, 24.0);
    odd.groups = 5;
    assert_eq!(
        odd.chain().expect_err("12 by 5"),
        [ReliabilityError::Groups { controllers: 12, groups: 5 }]
    );
}

#[test]
fn all_that_is_wrong_is_said_at_once() {
    let mut wrong = system(12, 1, Rule::AsBuilt, 10_000.0, 24.0);
    wrong.groups = 7;
    wrong.crews = Some(0);
    wrong.controllers.push(kind("valves", 0, 1.0, 1.0));
    let codes: Vec<_> =
        wrong.check().expect_err("wrong").iter().map(ReliabilityError::code).collect();
    assert_eq!(codes, ["U0704", "U0704", "U0718"]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn more_of_what_helps_never_hurts(
        controllers in 1_u32..9,
        spares in 0_u32..3,
        mttr in 1.0..2_000.0_f64,
        crews in 1_u32..4,
        coverage in 0.5..1.0_f64,
    ) {
        let mut base = system(controllers, spares, Rule::AsBuilt, 10_000.0, mttr);
        base.crews = Some(crews);
        let mean = |system: &understudy_reliability::System| system.chain().unwrap().mttf().unwrap();
        let now = mean(&base) * (1.0 - 1e-12);
        let mut faster = base.clone();
        faster.controllers[0].mttr = hours(mttr / 2.0);
        faster.understudies.mttr = hours(mttr / 2.0);
        prop_assert!(mean(&faster) >= now);
        let mut staffed = base.clone();
        staffed.crews = Some(crews + 1);
        prop_assert!(mean(&staffed) >= now);
        let mut spared = base.clone();
        spared.understudies.count += 1;
        prop_assert!(mean(&spared) >= now);
        let mut detected = base.clone();
        detected.detection = Some(hours(10.0));
        prop_assert!(mean(&detected) * (1.0 - 1e-12) <= mean(&base));
        let mut covered = base.clone();
        covered.coverage = Probability::new("c", coverage).unwrap();
        prop_assert!(mean(&covered) * (1.0 - 1e-12) <= mean(&base));
    }
}

#[test]
fn without_coverage_another_spare_is_another_box_that_may_end_it() {
    let mean = |spares| {
        let mut system = system(1, spares, Rule::AsBuilt, 10_000.0, 24.0);
        system.coverage = Probability::new("c", 0.5).unwrap();
        system.chain().unwrap().mttf().unwrap()
    };
    assert!(mean(1) > mean(2) && mean(2) > mean(3));
}

/// With a repair crew for each station the pairs are independent.
#[test]
fn a_duplex_of_unequal_controllers_is_the_product_of_its_pairs() {
    let mut options = Options::new(3, hours(1_000.0), hours(24.0));
    options.unequal = vec!["old*2=400h,48h".parse().expect("boxes")];
    let system = options.system().expect("a system");
    assert_eq!(system.controller_count(), 3);
    let duplex = system.copies_chain(2).expect("a chain");
    let pair = |mtbf: f64, mttr: f64, hours: f64| {
        let chain = crate::support::system(1, 1, Rule::Paper, mtbf, mttr).chain();
        chain.expect("a chain").reliability(hours).expect("R")
    };
    for t in [1.0, 100.0, 5_000.0] {
        let expected = pair(1_000.0, 24.0, t) * pair(400.0, 48.0, t).powi(2);
        check_within(duplex.reliability(t).expect("R"), expected, 1e-10, "R");
    }
    let cluster = system.chain().expect("a chain").mttf().expect("a mean");
    let alike = Options::new(3, hours(1_000.0), hours(24.0));
    let alike = alike.system().expect("a system").chain().expect("a chain");
    assert!(cluster < alike.mttf().expect("a mean"));
    // TMR: two of three, and each of the three may be the first.
    let one = Options::new(1, hours(1_000.0), hours(24.0));
    let tmr = one.system().expect("a system").copies_chain(3).expect("a chain");
    let (l, m) = (1e-3, 1.0 / 24.0);
    let expected = (5.0 * l + m) / (6.0 * l * l);
    assert!((tmr.mttf().expect("a mean") / expected - 1.0).abs() < 1e-12);
}

#[test]
fn boxes_of_their_own_are_read_or_refused() {
    let read = |text: &str| text.parse::<UnequalBoxes>();
    let boxes = read("old * 3 = 4000h, 48h").expect("boxes");
    assert_eq!((boxes.name.as_str(), boxes.count, boxes.understudies), ("old", 3, false));
    assert!(read("understudies=1y,1d").expect("boxes").understudies);
    let refused = [
        ("", "U0720"),
        ("old", "U0720"),
        ("=1h,1h", "U0720"),
        ("old=1h", "U0720"),
        ("old*0=1h,1h", "U0720"),
        ("old*-1=1h,1h", "U0720"),
        ("old=1,1h", "U0705"),
        ("old=1h,0h", "U0701"),
    ];
    for (text, code) in refused {
        assert_eq!(read(text).expect_err(text).code(), code, "{text}");
    }
    assert_eq!("power".parse::<SharedPart>().expect_err("no time").code(), "U0720");
    let mut options = Options::new(2, boxes.mtbf, boxes.mttr);
    options.unequal = vec![boxes];
    assert_eq!(options.system().expect_err("three of two")[0].code(), "U0704");
}
