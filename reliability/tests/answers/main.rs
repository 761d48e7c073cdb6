//! The answers to whole questions: what is printed, what stands in JSON, and the report.

use rand::RngExt;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use understudy_reliability::{
    Answer, Campaign, CommonCauseConvention, Hours, Law, Options, Provenance, SharedPart,
    SystemFailure, answer_chain, assess, by_understudies, calculate, figures_5_and_6, read_chain,
    report, report_data, sensitivities, what_if,
};

fn hours(text: &str) -> Hours {
    text.parse().expect("a time")
}

fn options(controllers: u32) -> Options {
    Options {
        mission: Some(hours("1000h")),
        ..Options::new(controllers, hours("10000h"), hours("24h"))
    }
}

fn check(found: impl Into<Option<f64>>, expected: f64, what: &str) {
    let found = found.into().expect(what);
    assert!((found / expected - 1.0).abs() < 1e-12, "{what}: {found} instead of {expected}");
}

#[test]
fn twenty_controllers() {
    let answer = calculate(&options(20)).expect("an answer");
    insta::assert_snapshot!(answer.to_text());
    // (20): ((2N+1) MTTR + MTBF) MTBF/(N (N+1) MTTR)
    let mttf = (41.0 * 24.0 + 10_000.0) * 10_000.0 / (20.0 * 21.0 * 24.0);
    check(answer.mttf_paper_hours, mttf, "(20)");
    let mission = answer.mission.expect("a mission");
    let paper = |controllers| {
        let answer = calculate(&options(controllers)).expect("an answer");
        answer.mission.and_then(|at| at.reliability_paper).expect("R")
    };
    check(mission.reliability_duplex, paper(1).powi(20), "(21): (18) at N = 1");
    check(mission.reliability_tmr, paper(2).powi(20), "TMR: (18) at N = 2");
    check(mission.reliability_simplex, (-2.0_f64).exp(), "no spare");
    let p1 = mission.p1.expect("P1");
    check(mission.density_paper_per_hour, 20.0 * 1e-4 * p1, "dP2/dt of (14): N lambda P1");
    check(mission.density_simplex_per_hour, 2e-3 * (-2.0_f64).exp(), "no spare");
}

/// The density is the derivative of 1 - R: for each configuration, with everything that the model has, a central difference agrees.
#[test]
fn the_density_is_the_derivative_of_the_unreliability() {
    let plain = options(7);
    let loaded = Options {
        spares: 2,
        coverage: 0.97,
        beta: 0.02,
        crews: Some(3),
        detection: Some(hours("10min")),
        shared: vec![SharedPart::single("power", hours("50000h"))],
        ..options(7)
    };
    for options in [plain, loaded] {
        let at = |time: f64| {
            let mission = Some(hours(&format!("{time}h")));
            let options = Options { mission, ..options.clone() };
            calculate(&options).expect("an answer").mission.expect("a mission")
        };
        for time in [1.0, 100.0, 5_000.0] {
            let step = time / 256.0;
            let (before, now, after) = (at(time - step), at(time), at(time + step));
            let rows = [
                (now.density_paper_per_hour, before.unreliability_paper, after.unreliability_paper),
                (
                    now.density_cluster_per_hour,
                    before.unreliability_cluster,
                    after.unreliability_cluster,
                ),
                (
                    now.density_duplex_per_hour,
                    before.unreliability_duplex,
                    after.unreliability_duplex,
                ),
                (
                    now.density_simplex_per_hour,
                    before.unreliability_simplex,
                    after.unreliability_simplex,
                ),
                (now.density_tmr_per_hour, before.unreliability_tmr, after.unreliability_tmr),
            ];
            for (place, (density, before, after)) in rows.into_iter().enumerate() {
                let slope = (after.expect("1 - R") - before.expect("1 - R")) / (2.0 * step);
                let density = density.expect("a density");
                let apart = (density / slope - 1.0).abs();
                assert!(apart < 1e-3, "{place} at {time} h: {density} and {slope}");
            }
        }
    }
}

#[test]
fn the_json_has_the_keys_that_others_check() {
    let answer = calculate(&options(3)).expect("an answer");
    let json: serde_json::Value =
        serde_json::from_str(&answer.to_json().expect("JSON")).expect("JSON");
    for key in [
        "mttf_paper_hours",
        "mttf_cluster_hours",
        "mttf_duplex_hours",
        "mttf_simplex_hours",
        "mttf_tmr_hours",
        "reliability_paper",
        "reliability_duplex",
        "p0",
        "p1",
        "p2",
    ] {
        assert!(json[key].is_f64(), "{key}: {}", json[key]);
    }
    // At full precision: reading gives back the very number.
    assert_eq!(json["mttf_paper_hours"].as_f64(), Some(answer.mttf_paper_hours));
    let without = Options { mission: None, ..options(3) };
    let json = calculate(&without).expect("an answer").to_json().expect("JSON");
    assert!(!json.contains("reliability_paper") && json.contains("mttf_tmr_hours"));
}

#[test]
fn a_part_that_hardly_fails_changes_nothing() {
    let plain = calculate(&options(5)).expect("an answer");
    let mut shared = options(5);
    shared.shared = vec![SharedPart::single("network", hours("1e15h"))];
    let shared = calculate(&shared).expect("an answer");
    let figures = |answer: &Answer| {
        let at = answer.mission.expect("a mission");
        let shares = [at.p0, at.p1, at.p2, at.reliability_duplex].map(|share| share.expect("R"));
        [&[answer.mttf_paper_hours][..], &shares].concat()
    };
    for (with, without) in figures(&shared).into_iter().zip(figures(&plain)) {
        assert!((with / without - 1.0).abs() < 1e-9, "{with} {without}");
    }
}

#[test]
fn everything_wrong_with_the_options_is_said_at_once() {
    let wrong = Options { controllers: 0, crews: Some(0), coverage: 1.5, beta: -0.1, ..options(1) };
    let said: Vec<String> =
        calculate(&wrong).expect_err("wrong").iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn figures_5_and_6_are_those_of_the_paper() {
    let points =
        figures_5_and_6(hours("10000h"), hours("24h"), [1, 5, 10, 20, 50]).expect("points");
    let rows: Vec<String> = points
        .iter()
        .map(|point| {
            format!(
                "{:>2} | {:>9.1} {:>12.1} {:>12.1} {:>12.1} | {:>12.1} {:>12.1} | {:>12.1} {:>12.1}",
                point.controllers, point.simplex_hours, point.paper.mttf_hours, point.cluster.mttf_hours,
                point.duplex.mttf_hours, point.paper.per_added_hours, point.duplex.per_added_hours,
                point.paper.gained_per_added_hours, point.duplex.gained_per_added_hours,
            )
        })
        .collect();
    insta::assert_snapshot!(rows.join("\n"));
    // The paper's claim: by added unit, the proposed system is the most efficient.
    assert!(
        points
            .iter()
            .skip(1)
            .all(|point| point.paper.per_added_hours > point.duplex.per_added_hours)
    );
}

#[test]
fn sensitivities_are_derivatives() {
    let system = options(3).system().expect("a system");
    let found = sensitivities(&system).expect("sensitivities");
    // Where repair is fast, the MTTF goes with MTBF² and with 1/MTTR, whoever's they are.
    let sum = |what: &str| -> f64 {
        found.iter().filter(|bar| bar.parameter.starts_with(what)).map(|bar| bar.elasticity).sum()
    };
    assert!((sum("MTBF") - 2.0).abs() < 0.02, "{found:?}");
    assert!((sum("MTTR") + 1.0).abs() < 0.02, "{found:?}");
    // Scaling all times by one factor scales the MTTF by it.
    assert!((sum("MTBF") + sum("MTTR") - 1.0).abs() < 1e-6, "{found:?}");
    let changes = what_if(&system, Some(hours("1000h"))).expect("changes");
    check(changes[0].factor, 1.0, "as it is");
    assert!(changes.iter().skip(1).all(|change| change.factor > 1.5), "{changes:?}");
    let table = by_understudies(&system, 3).expect("a table");
    assert!(
        table.windows(2).all(|pair| pair[1].mttf_hours > 50.0 * pair[0].mttf_hours),
        "{table:?}"
    );
}

fn campaign(acceleration: f64, mttr: f64, failures: usize) -> Campaign {
    let pair = Options::new(1, hours("10000h"), Hours::new("mttr", mttr).expect("a time"));
    let chain = pair.system().expect("a system").chain();
    let law = Law::of_chain(&chain.expect("a chain")).expect("a law");
    let mut random = Pcg64::seed_from_u64(11);
    let causes = ["robot after understudy", "understudy after robot"];
    Campaign {
        world: "simulator".into(),
        seed: 11,
        acceleration,
        failures: (0..failures)
            .map(|k| SystemFailure {
                hours: law.quantile(random.random()),
                cause: causes[k % 2].into(),
            })
            .collect(),
        censored_hours: Vec::new(),
        box_failures: 5_000,
        masked: 5_000,
        detection_hours: vec![1e-5; 40],
        repair_hours: vec![200.0; 40],
        unfinished_repair_hours: Vec::new(),
    }
}

#[test]
fn a_campaign_is_held_against_the_model() {
    let pair = Options::new(1, hours("10000h"), hours("200h"));
    let system = pair.system().expect("a system");
    let good = assess(&campaign(100.0, 200.0, 400), &system, 0.95, 1).expect("an assessment");
    assert!(good.agrees && good.doubts.is_empty(), "{:?}", good.doubts);
    assert!(good.rare_event.mean_hours.covers(good.model_hours));
    assert_eq!(good.causes.values().sum::<u64>(), 400);
    let mut lies = campaign(100.0, 20_000.0, 400);
    lies.masked = 4_000;
    let bad = assess(&lies, &system, 0.95, 1).expect("an assessment");
    insta::assert_snapshot!(bad.doubts.join("\n"));
    let mut none = campaign(1.0, 200.0, 0);
    none.censored_hours = vec![1_000.0];
    none.box_failures = 0;
    let none = assess(&none, &system, 0.95, 1).expect("an assessment");
    assert!(none.fit.is_none() && none.coverage.is_none() && none.mttf_hours.estimate.is_none());
}

#[test]
fn a_report_is_whole_and_stands_alone() {
    let mut asked = Options::new(1, hours("10000h"), hours("200h"));
    asked.mission = Some(hours("1000h"));
    asked.coverage = 0.9995;
    asked.beta = 0.01;
    asked.convention = CommonCauseConvention::Additive;
    asked.detection = Some(hours("1h"));
    asked.shared = vec![SharedPart::single("<network & power>", hours("100y"))];
    let system = asked.system().expect("a system");
    let measured = assess(&campaign(100.0, 200.0, 300), &system, 0.95, 1).expect("an assessment");
    let provenance = Provenance {
        title: "press <cell>".into(),
        configuration: Some("0123456789abcdef".into()),
        version: "0.1.0".into(),
        date: "2026-01-01".into(),
        repeat: "understudy reliability cluster.toml --report out".into(),
    };
    let data = report_data(&asked, provenance, Some(measured)).expect("data");
    let files = report(&data).expect("a report");
    for outside in ["http:", "https:", "src=", "href=", "<script", "url(\"", "@import"] {
        let html = files.html.replace("http://www.w3.org/2000/svg", "");
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(files.html.contains("press &lt;cell&gt;") && !files.html.contains("<network"));
    assert_eq!(files.html.matches("<svg").count(), 9, "every picture is there");
    for nonsense in ["NaN", "inf ", ">none<", "undefined"] {
        assert!(!files.html.contains(nonsense), "{nonsense}");
    }
    let json: serde_json::Value = serde_json::from_str(&files.json).expect("JSON");
    assert_eq!(json["figures"].as_array().map(Vec::len), Some(50));
    assert!(files.csv.lines().all(|line| line.split(',').count() == 3), "three columns");
}

#[test]
fn a_chain_is_answered_as_far_as_it_can_be() {
    let said = |text: &str| {
        let chain = read_chain("a.chain", text).chain.expect("a chain");
        answer_chain(&chain, Some(hours("100h"))).expect("an answer").to_text()
    };
    let repaired = "state up\nstate down failure\nup -> down : 1 / 1000h\ndown -> up : 1 / 10h\n";
    let last = "state up\nstate down failure\nup -> down : 1 / 1000h\n";
    let endless = "state a\nstate b\na -> b : 1 / 1000h\nb -> a : 1 / 10h\n";
    insta::assert_snapshot!([repaired, last, endless].map(said).join("\n"));
}
