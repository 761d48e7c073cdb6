//! The alert rules of `deployment/monitoring`: each asks for metrics, labels and states that a run exposes.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use understudy_testing::skip;

use crate::gateway::{exposed_by, finished_run, metric_names};
use crate::understudy_in;

const RULES: &str = "deployment/monitoring/alerts.yaml";

/// The part of a line between two marks.
fn between<'t>(text: &'t str, from: &str, to: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(from)?;
    Some(rest.split_once(to)?.0)
}

/// Name, expression and summary of each rule.
fn rules(text: &str) -> Vec<[&str; 3]> {
    let rules = text.split("- alert: ").skip(1);
    let parts = rules.map(|rule| {
        let name = rule.lines().next().expect("a name");
        let severity = between(rule, "labels: {severity: ", "}");
        assert!(
            severity.is_some_and(|word| ["critical", "warning"].contains(&word)),
            "{name}: {severity:?}"
        );
        let expression = between(rule, "expr: ", "\n").expect("an expression");
        let summary = between(rule, "summary: \"", "\"\n").expect("a summary");
        [name, expression, summary]
    });
    parts.collect()
}

/// A metric, and the labels that it is selected by with their values.
type Selector<'a> = (&'a str, Vec<(&'a str, Vec<&'a str>)>);

/// The selectors of an expression with braces: the metric, and each label with its values.
fn selectors(expression: &str) -> Vec<Selector<'_>> {
    let pieces: Vec<&str> = expression.split('{').collect();
    let pairs = pieces.windows(2).map(|pair| {
        let belongs = |character: char| character.is_ascii_alphanumeric() || character == '_';
        let metric = pair[0].rsplit(|character| !belongs(character)).next();
        let labels = pair[1].split_once('}').expect("a closing brace").0;
        let labels = labels.split(',').map(|label| {
            let (name, values) = label.split_once('=').expect("a label");
            let values = values.trim_start_matches('~').trim_matches('"');
            (name.trim(), values.split('|').collect())
        });
        (metric.expect("a name"), labels.collect())
    });
    pairs.collect()
}

#[test]
fn every_rule_asks_for_what_a_run_exposes() {
    let folder = finished_run("gateway_alerts");
    let answer = understudy_in(&folder, &["gateway", "metrics", "runs/latest", "--once"]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let two_networks = exposed_by(&folder, "two-networks", "network-fails.toml");
    let exposed = answer.output + &two_networks;
    let samples: Vec<&str> = exposed.lines().filter(|line| !line.starts_with('#')).collect();
    let of = |metric: &str| {
        let start = format!("{metric}{{");
        let own = samples.iter().filter(move |line| line.starts_with(&start));
        own.copied().collect::<Vec<_>>()
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join(RULES)).expect("a file");
    let rules = rules(&text);
    let names: BTreeSet<&str> = rules.iter().map(|[name, ..]| *name).collect();
    assert_eq!(names.len(), rules.len(), "each name is of one rule");
    for asked in [
        "up{",
        "understudy_run_state",
        "understudy_state_lost",
        "understudy_protected",
        "understudy_output_source",
        "understudy_station_state",
        "understudy_records_received",
        "understudy_journal_records_lost_total",
    ] {
        assert!(rules.iter().any(|rule| rule[1].contains(asked)), "no rule asks for {asked}");
    }
    for [name, expression, summary] in &rules {
        let metrics = metric_names(expression);
        for metric in &metrics {
            assert!(!of(metric).is_empty(), "{name}: {metric} is not exposed");
        }
        for (metric, labels) in selectors(expression) {
            // Prometheus makes `up` itself.
            for (label, values) in labels.iter().filter(|_| metric != "up") {
                for value in values {
                    let wanted = format!("{label}=\"{value}\"");
                    let is_exposed = of(metric).iter().any(|line| line.contains(&wanted));
                    assert!(is_exposed, "{name}: {metric} never has {wanted}");
                }
            }
        }
        for label in summary.split("$labels.").skip(1) {
            let label = label.split(' ').next().expect("a name");
            let start = format!("{label}=\"");
            let is_exposed =
                metrics.iter().any(|metric| of(metric).iter().any(|line| line.contains(&start)));
            assert!(is_exposed || label == "instance", "{name}: no label {label}");
        }
    }
    let state = |state: &str| format!("state=\"{state}\"}} 1");
    let run = of("understudy_run_state");
    assert!(run.iter().any(|line| line.ends_with(&state("finished"))), "{run:?}");
}

#[test]
fn promtool_reads_every_rule() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let checked =
        Command::new("promtool").args(["check", "rules", RULES]).current_dir(root).output();
    let checked = match checked {
        Ok(checked) => checked,
        Err(error) => {
            skip(format_args!("promtool: {error}; it is part of Prometheus"));
            return;
        }
    };
    let said = String::from_utf8_lossy(&checked.stdout);
    let errors = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{said}{errors}");
    let text = fs::read_to_string(root.join(RULES)).expect("a file");
    let count = format!("{} rules found", rules(&text).len());
    assert!(said.contains(&count), "{said}");
}
