//! Several programs: when each runs, which others it calls, and in which scans.

mod running;

use running::{Running, check, program, read, shown};
use understudy_structured_text::{Options, lower, parse};
use understudy_text::Severity;

/// Two programs that count their scans, with tasks of these intervals in milliseconds, and the priorities 0 and 1.
fn two_tasks(first: u64, second: u64) -> String {
    format!(
        "PROGRAM one VAR_OUTPUT n : DINT; END_VAR n := n + 1; END_PROGRAM
        PROGRAM two VAR_OUTPUT m : DINT; END_VAR m := m + 1; END_PROGRAM
        CONFIGURATION c RESOURCE r ON plc TASK f(INTERVAL := T#{first}ms, PRIORITY := 0); TASK s(INTERVAL := T#{second}ms, PRIORITY := 1);
        PROGRAM p WITH f : one; PROGRAM q WITH s : two; END_RESOURCE END_CONFIGURATION"
    )
}

/// In every pair of intervals each program runs as often as its task says.
#[test]
fn programs_run_at_the_intervals_of_their_tasks() {
    for (first, second) in
        [(10, 25), (25, 10), (10, 15), (20, 10), (10, 20), (6, 4), (7, 3), (5, 5)]
    {
        let program = program(&two_tasks(first, second));
        let period = u64::try_from(program.period).expect("a period") / 1_000_000;
        assert!(first % period == 0 && second % period == 0, "{first} {second}: {period}");
        let mut running = Running::new(program);
        for scan in 0..60 {
            let now = scan * period;
            let wanted = [now / first + 1, now / second + 1];
            assert_eq!(running.scan(&[]), wanted, "{first} ms and {second} ms at {now} ms");
        }
    }
}

/// With a period from outside, the intervals hold where they can, and where they cannot it is said.
#[test]
fn a_given_period_keeps_the_intervals_or_is_told() {
    for (intervals, period, every, told) in [
        ((10, 25), 5, [2, 5], 0),
        ((10, 25), 1, [10, 25], 0),
        ((10, 25), 10, [1, 3], 1),
        ((10, 25), 2, [5, 13], 1),
        ((10, 25), 25, [1, 1], 1),
        ((10, 25), 30, [1, 1], 2),
        ((10, 20), 20, [1, 1], 1),
        ((20, 10), 20, [1, 1], 1),
        ((100, 100), 30, [3, 3], 2),
    ] {
        let text = two_tasks(intervals.0, intervals.1);
        let (file, _) = parse(&text);
        let period = Some(period * 1_000_000);
        let lowered = lower(&file, &Options { text: &text, period, ..Options::default() });
        let program = lowered.program.expect("a program");
        let found: Vec<u32> = program.tasks.iter().map(|task| task.every).collect();
        assert_eq!(found, every, "{period:?}");
        let found = lowered.diagnostics.iter().filter(|found| found.code == "U1084");
        assert_eq!(found.count(), told, "{period:?}: {:?}", lowered.diagnostics);
    }
}

#[test]
fn programs_without_a_configuration_run_in_their_order() {
    let text = "VAR_GLOBAL g : INT; END_VAR
        PROGRAM one VAR_INPUT a : INT; END_VAR g := g + a; END_PROGRAM
        PROGRAM two VAR_OUTPUT q : INT; END_VAR q := g; END_PROGRAM";
    let (_, found) = read(text, None);
    assert!(shown(text, &found, Severity::Warning).starts_with("U1013"), "{found:?}");
    check(text, &[(&[3], "3"), (&[4], "7")]);
}

/// A PROGRAM that no task runs is called as an instance of a block is: by any unit, with inputs, and its variables can be read.
#[test]
fn a_program_that_no_task_runs_can_be_called() {
    let text = "PROGRAM main VAR_INPUT a : INT; END_VAR VAR_OUTPUT q : INT; n : INT; END_VAR VAR f : Counts; END_VAR
        second(step := a); f(); q := second.sum; n := second.calls; END_PROGRAM
        PROGRAM second VAR_INPUT step : INT; END_VAR VAR_OUTPUT sum : INT; END_VAR VAR calls : INT; END_VAR
        sum := sum + step; calls := calls + 1; END_PROGRAM
        FUNCTION_BLOCK Counts second(step := 1); END_FUNCTION_BLOCK";
    let configured = format!(
        "{text} CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 0); PROGRAM main WITH t : main; END_RESOURCE END_CONFIGURATION"
    );
    for text in [text, &configured] {
        let (_, found) = read(text, None);
        assert_eq!(shown(text, &found, Severity::Warning), "");
        check(text, &[(&[3], "4 2"), (&[10], "15 4")]);
    }
    let errors = |text: &str| shown(text, &read(text, None).1, Severity::Error);
    let circle = "PROGRAM main other(); END_PROGRAM PROGRAM other main(); END_PROGRAM";
    assert!(!errors(circle).is_empty());
    let itself = "PROGRAM main VAR x : INT; END_VAR x := 1; again(); END_PROGRAM PROGRAM again again(); END_PROGRAM";
    assert!(errors(itself).starts_with("U1047"), "{}", errors(itself));
    let both =
        configured.replace("WITH t : main;", "WITH t : main; PROGRAM second WITH t : second;");
    assert!(errors(&both).starts_with("U1040"), "{}", errors(&both));
    // A variable with the name of a program hides it.
    let hidden =
        "PROGRAM main VAR second : INT; END_VAR second(); END_PROGRAM PROGRAM second END_PROGRAM";
    assert!(errors(hidden).starts_with("U1049"), "{}", errors(hidden));
}

#[test]
fn the_variables_of_a_program_that_runs_can_be_read_elsewhere() {
    let text = "PROGRAM one VAR_INPUT a : INT; END_VAR VAR k : INT; END_VAR k := a; END_PROGRAM
        PROGRAM two VAR_OUTPUT q : INT; END_VAR q := one.k + one.a; END_PROGRAM";
    check(text, &[(&[3], "6"), (&[4], "8")]);
}
