//! The control blocks against the closed forms of their step responses.

mod running;

use running::{Running, program};

/// A scan is 10 ms.
const PERIOD: f64 = 0.01;

fn running(variables: &str, body: &str) -> Running {
    Running::new(program(&format!(
        "PROGRAM main VAR_INPUT x : LREAL; b : BOOL; END_VAR VAR_OUTPUT y : LREAL; q : BOOL; END_VAR
         VAR {variables} END_VAR {body} END_PROGRAM"
    )))
}

/// A scan with an input and a switch: the output and the bit.
fn scan(running: &mut Running, x: f64, b: bool) -> (f64, bool) {
    let outputs = running.scan(&[x.to_bits(), u64::from(b)]);
    assert_eq!(running.fault(), None);
    (f64::from_bits(outputs[0]), outputs[1] != 0)
}

fn near(found: f64, expected: f64, place: usize) {
    assert!(
        (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
        "{place}: {found} is not {expected}"
    );
}

#[test]
fn a_pi_controller_answers_a_step_with_a_jump_and_a_slope() {
    let body = "c(SP := x, PV := 0.0, KP := 2.0, TR := 4.0, LOW := -1000.0, HIGH := 1000.0); y := c.XOUT; q := c.SATURATED;";
    for block in ["PI", "PID"] {
        let mut running = running(&format!("c : {block};"), body);
        for at in 0..500 {
            let (y, saturated) = scan(&mut running, 3.0, false);
            near(y, 2.0 * 3.0 * (1.0 + at as f64 * PERIOD / 4.0), at);
            assert!(!saturated);
        }
    }
}

#[test]
fn the_derivative_of_a_controller_acts_on_the_measurement_and_fades() {
    let body = "c(SP := 0.0, PV := x, KP := 1.0, TD := 2.0, N := 10.0, LOW := -1000.0, HIGH := 1000.0); y := c.XOUT + x;";
    let mut running = running("c : PID;", body);
    scan(&mut running, 0.0, false);
    // A step of the measurement: the filter of TD / N, in the backward form of Euler.
    let mut expected = -2.0 / (0.2 + PERIOD);
    for at in 0..200 {
        near(scan(&mut running, 1.0, false).0, expected, at);
        expected *= 0.2 / (0.2 + PERIOD);
    }
}

#[test]
fn a_limited_controller_does_not_wind_up() {
    let body = "c(SP := x, PV := 0.0, KP := 1.0, TR := 1.0, LOW := 0.0, HIGH := 10.0); y := c.XOUT; q := c.SATURATED;";
    let mut running = running("c : PID;", body);
    for _ in 0..10_000 {
        scan(&mut running, 20.0, false);
    }
    assert_eq!(scan(&mut running, 20.0, false), (10.0, true));
    // It leaves the limit at once: nothing was integrated meanwhile.
    let (y, saturated) = scan(&mut running, 5.0, false);
    assert!(y < 5.1 && !saturated, "{y}");
}

#[test]
fn manual_automatic_and_cascade_change_without_a_bump() {
    let body = "c(AUTO := b, SP := 50.0, PV := 40.0, X0 := x, KP := 2.0, TR := 10.0, CASCADE := x > 60.0, REMOTE := 90.0, LOW := -1000.0, HIGH := 1000.0);
                y := c.XOUT;";
    let mut running = running("c : PID;", body);
    for _ in 0..10 {
        assert_eq!(scan(&mut running, 33.0, false).0, 33.0);
    }
    let (y, _) = scan(&mut running, 33.0, true);
    near(y, 33.0 + 2.0 * 10.0 * PERIOD / 10.0, 0);
    let (before, _) = scan(&mut running, 33.0, true);
    let (after, _) = scan(&mut running, 61.0, true);
    near(after, before + 2.0 * 50.0 * PERIOD / 10.0, 1);
}

#[test]
fn lags_and_leads_are_exact_for_steps() {
    let mut lag = running("c : LAG1;", "c(RUN := b, XIN := x, TAU := T#500ms); y := c.XOUT;");
    scan(&mut lag, 0.0, false);
    for at in 1..500 {
        let expected = 1.0 - (-(at as f64) * PERIOD / 0.5).exp();
        near(scan(&mut lag, 1.0, true).0, expected, at);
    }
    let mut lead = running(
        "c : LEAD_LAG;",
        "c(XIN := x, KP := 2.0, LEAD := T#1s, TAU := T#250ms); y := c.XOUT;",
    );
    scan(&mut lead, 0.0, false);
    for at in 0..300 {
        let lagged = 1.0 - (-(at as f64) * PERIOD / 0.25).exp();
        near(scan(&mut lead, 1.0, true).0, 2.0 * (4.0 - 3.0 * lagged), at);
    }
}

#[test]
fn rates_ramps_and_integrals_are_straight_lines() {
    let mut rate = running(
        "c : RATE_LIMIT;",
        "c(XIN := x, RISE := 2.0, FALL := 5.0); y := c.XOUT; q := c.LIMITED;",
    );
    assert_eq!(scan(&mut rate, 1.0, false), (1.0, false));
    for at in 1..100 {
        near(scan(&mut rate, 9.0, false).0, 1.0 + 2.0 * at as f64 * PERIOD, at);
    }
    let top = 1.0 + 2.0 * 99.0 * PERIOD;
    for at in 1..20 {
        near(scan(&mut rate, -9.0, false).0, top - 5.0 * at as f64 * PERIOD, at);
    }
    let mut ramp = running(
        "c : RAMP;",
        "c(RUN := b, X0 := 10.0, X1 := x, TR := T#2s); y := c.XOUT; q := c.BUSY;",
    );
    assert_eq!(scan(&mut ramp, 30.0, false), (10.0, false));
    for at in 0..300 {
        let (y, busy) = scan(&mut ramp, 30.0, true);
        let share = (at as f64 * PERIOD / 2.0).min(1.0);
        near(y, 10.0 + 20.0 * share, at);
        // The sum of 200 periods may be one digit below 2 s.
        assert!(busy == (at < 200) || at == 200);
    }
    let mut integral =
        running("c : INTEGRAL;", "c(RUN := TRUE, R1 := b, XIN := x, X0 := 7.0); y := c.XOUT;");
    assert_eq!(scan(&mut integral, 3.0, true).0, 7.0);
    for at in 1..200 {
        near(scan(&mut integral, 3.0, false).0, 7.0 + 3.0 * at as f64 * PERIOD, at);
    }
    let mut total = running("c : TOTALISER;", "c(XIN := x, RESET := b); y := c.TOTAL;");
    for at in 0..5_000 {
        let (y, _) = scan(&mut total, 0.1, false);
        assert_eq!(y, 0.1 * PERIOD * at as f64, "{at}");
        if at == 3 {
            break;
        }
    }
}

#[test]
fn a_derivative_is_the_slope_of_a_line() {
    let mut derivative = running("c : DERIVATIVE;", "c(RUN := TRUE, XIN := x); y := c.XOUT;");
    for at in 0..50 {
        let (y, _) = scan(&mut derivative, 4.0 * at as f64 * PERIOD, false);
        if at > 3 {
            near(y, 4.0, at);
        }
    }
}

#[test]
fn bands_scales_alarms_and_means_are_as_defined() {
    let mut band = running("c : DEADBAND;", "c(XIN := x, WIDTH := 2.0); y := c.XOUT;");
    for (x, y) in [(0.0, 0.0), (2.0, 0.0), (-2.0, 0.0), (5.0, 3.0), (-3.5, -1.5)] {
        assert_eq!(scan(&mut band, x, false).0, y);
    }
    let mut hysteresis =
        running("c : HYSTERESIS;", "c(XIN1 := x, XIN2 := 10.0, EPS := 1.0); q := c.Q;");
    for (x, q) in [(10.5, false), (11.5, true), (9.5, true), (8.9, false), (10.9, false)] {
        assert_eq!(scan(&mut hysteresis, x, false).1, q, "{x}");
    }
    let body = "c(XIN := x, IN_LOW := 4.0, IN_HIGH := 20.0, OUT_LOW := 0.0, OUT_HIGH := 100.0, CLAMP := b); y := c.XOUT; q := c.OUTSIDE;";
    let mut scale = running("c : SCALE;", body);
    assert_eq!(scan(&mut scale, 12.0, false), (50.0, false));
    assert_eq!(scan(&mut scale, 24.0, false), (125.0, true));
    assert_eq!(scan(&mut scale, 24.0, true), (100.0, true));
    let mut alarm = running(
        "c : LIMIT_ALARM;",
        "c(H := 10.0, X := x, L := 1.0, EPS := 0.5, QL => q); y := BOOL_TO_LREAL(c.QH);",
    );
    let expected = [
        (5.0, 0.0, false),
        (10.1, 1.0, false),
        (9.7, 1.0, false),
        (9.4, 0.0, false),
        (0.9, 0.0, true),
        (1.4, 0.0, true),
        (1.6, 0.0, false),
    ];
    for (x, high, low) in expected {
        assert_eq!(scan(&mut alarm, x, false), (high, low), "{x}");
    }
    let mut mean = running(
        "c : MOVING_AVERAGE;",
        "c(XIN := x, N := 4, RESET := b); y := c.XOUT; q := c.FILLED;",
    );
    let expected = [(4.0, 4.0), (8.0, 6.0), (0.0, 4.0), (4.0, 4.0), (12.0, 6.0), (0.0, 4.0)];
    for (at, (x, y)) in expected.into_iter().enumerate() {
        assert_eq!(scan(&mut mean, x, false), (y, at >= 3));
    }
}
