//! Two runs beside each other.

use understudy_scenarios::Scenario;
use understudy_view::{Differing, diff};

use crate::support::{KILL_EACH, cell, model, scenario};

#[test]
fn a_run_does_not_differ_from_itself() {
    let cell = cell();
    let scenario = scenario(&cell, KILL_EACH);
    let found = diff(&model(&cell, &scenario, 1), &model(&cell, &scenario, 1));
    assert!(found.same_configuration);
    assert_eq!(found.compared, 300);
    assert_eq!(found.differences, []);
}

/// Killing changes sources and events, and neither inputs nor outputs: that is what it is all for.
#[test]
fn a_masked_failure_changes_sources_only() {
    let cell = cell();
    let undisturbed = Scenario { title: "quiet".into(), cycles: 300, ..Scenario::default() };
    let killed = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let found = diff(&model(&cell, &undisturbed, 1), &killed);
    let images = [Differing::Inputs, Differing::Outputs];
    let differing: Vec<_> =
        found.differences.iter().filter(|difference| images.contains(&difference.what)).collect();
    assert_eq!(differing, Vec::<&understudy_view::Difference>::new());
    let source = found
        .differences
        .iter()
        .find(|difference| difference.what == Differing::Source && difference.name == "robot")
        .expect("the robot was killed");
    assert_eq!(
        (source.cycle, source.left.as_str(), source.right.as_str()),
        (30, "direct", "reconstructed")
    );
}

#[test]
fn a_lost_program_differs_in_its_outputs() {
    let cell = cell();
    let text = "title = \"two\"\ncycles = 300\n\
                [[step]]\nat = 20\naction = \"crash\"\nstation = \"understudy\"\n\
                [[step]]\nat = 30\naction = \"crash\"\nstation = \"robot\"\n";
    let lost = model(&cell, &scenario(&cell, text), 1);
    let undisturbed = Scenario { title: "quiet".into(), cycles: 300, ..Scenario::default() };
    let found = diff(&lost, &model(&cell, &undisturbed, 1));
    let first = found.differences.iter().find(|difference| difference.what == Differing::Outputs);
    let first = first.expect("its outputs fell safe");
    assert_eq!(first.name, "robot");
    assert!(first.cycle >= 30, "{first:?}");
    // Outputs by name, only those that differ, with opposite values.
    let robot = cell.controllers()[0].interface.outputs.iter();
    let names: Vec<&str> = robot.map(|output| output.name.as_str()).collect();
    let (left, right): (Vec<&str>, Vec<&str>) =
        (first.left.split(", ").collect(), first.right.split(", ").collect());
    assert_eq!(left.len(), right.len(), "{first:?}");
    for (left, right) in left.into_iter().zip(right) {
        let (name, value) = left.split_once(" = ").expect("a name and a value");
        assert!(names.contains(&name), "{left}");
        let opposite = if value == "0" { "1" } else { "0" };
        assert_eq!(right, format!("{name} = {opposite}"));
    }
    assert!(found.differences.is_sorted_by_key(|difference| difference.cycle));
}
