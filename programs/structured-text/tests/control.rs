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
    for block in ["PI", "PID_ISA"] {
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
    let mut running = running("c : PID_ISA;", body);
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
    let mut running = running("c : PID_ISA;", body);
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
    let mut running = running("c : PID_ISA;", body);
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
        "c : SETPOINT_RAMP;",
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
        running("c : INTEGRATOR;", "c(RUN := TRUE, R1 := b, XIN := x, X0 := 7.0); y := c.XOUT;");
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
    let mut derivative = running("c : DIFFERENTIATOR;", "c(RUN := TRUE, XIN := x); y := c.XOUT;");
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
        running("c : COMPARATOR;", "c(XIN1 := x, XIN2 := 10.0, EPS := 1.0); q := c.Q;");
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

/// The blocks of the standard as they are written in its second edition, in `f32`.
#[derive(Default)]
struct Standard {
    integral: f32,
    derivative: f32,
    before: [f32; 3],
    ramp_from: f32,
    ramp_time: i64,
    above: bool,
}

impl Standard {
    fn integral(&mut self, run: bool, reset: bool, xin: f32, x0: f32, cycle: f32) -> f32 {
        if reset {
            self.integral = x0;
        } else if run {
            self.integral += xin * cycle;
        }
        self.integral
    }

    fn derivative(&mut self, run: bool, xin: f32, cycle: f32) -> f32 {
        let [x1, x2, x3] = self.before;
        if run {
            self.derivative = (3.0 * (xin - x3) + x1 - x2) / (10.0 * cycle);
            self.before = [xin, x1, x2];
        } else {
            self.derivative = 0.0;
            self.before = [xin; 3];
        }
        self.derivative
    }

    fn pid(&mut self, auto: bool, [pv, sp, x0, kp, tr, td]: [f32; 6], cycle: f32) -> f32 {
        let error = pv - sp;
        let integral = self.integral(auto, !auto, error, tr * (x0 - error), cycle);
        let derivative = self.derivative(auto, error, cycle);
        kp * (error + integral / tr + derivative * td)
    }

    fn ramp(&mut self, run: bool, x0: f32, x1: f32, time: i64, cycle: i64) -> (bool, f32) {
        if !run {
            (self.ramp_from, self.ramp_time) = (x0, 0);
            return (false, x0);
        }
        if self.ramp_time >= time {
            return (false, x1);
        }
        let seconds = |nanoseconds: i64| (nanoseconds as f64 / 1e9) as f32;
        let share = (x1 - self.ramp_from) * seconds(self.ramp_time) / seconds(time);
        self.ramp_time += cycle;
        (true, self.ramp_from + share)
    }

    fn hysteresis(&mut self, one: f32, two: f32, eps: f32) -> bool {
        self.above = if self.above { one >= two - eps } else { one > two + eps };
        self.above
    }
}

#[test]
fn blocks_of_the_standard_do_what_it_says_bit_for_bit() {
    let text = "PROGRAM main
        VAR_INPUT on : BOOL; reset : BOOL; x : REAL; z : REAL; END_VAR
        VAR_OUTPUT a : REAL; b : REAL; c : REAL; d : REAL; q : BOOL; busy : BOOL; above : BOOL; END_VAR
        VAR p : PID; i : INTEGRAL; s : DERIVATIVE; r : RAMP; h : HYSTERESIS; END_VAR
        p(AUTO := on, PV := x, SP := z, X0 := 1.5, KP := -2.25, TR := 7.5, TD := 0.3, CYCLE := T#30ms);
        i(RUN := on, R1 := reset, XIN := x, X0 := z, CYCLE := T#30ms);
        s(RUN := on, XIN := x, CYCLE := T#30ms);
        r(RUN := on, X0 := z, X1 := x, TR := T#200ms, CYCLE := T#30ms);
        h(XIN1 := x, XIN2 := z, EPS := 0.5);
        a := p.XOUT; b := i.XOUT; c := s.XOUT; d := r.XOUT; q := i.Q; busy := r.BUSY; above := h.Q;
        END_PROGRAM";
    let mut running = Running::new(program(text));
    let [mut p, mut i, mut s, mut r, mut h] = [(); 5].map(|()| Standard::default());
    let mut random = 0x5eed_u64;
    for at in 0..600 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let on = at / 25 % 2 == 1;
        let reset = random.is_multiple_of(11);
        let x = (random % 4_000) as f32 / 100.0 - 20.0;
        let z = (random / 4_000 % 4_000) as f32 / 1_000.0;
        let inputs = [u64::from(on), u64::from(reset), x.to_bits().into(), z.to_bits().into()];
        let found = running.scan(&inputs);
        assert_eq!(running.fault(), None);
        let cycle = 0.03_f32;
        let (busy, ramp) = r.ramp(on, z, x, 200_000_000, 30_000_000);
        let reals = [
            p.pid(on, [x, z, 1.5, -2.25, 7.5, 0.3], cycle),
            i.integral(on, reset, x, z, cycle),
            s.derivative(on, x, cycle),
            ramp,
        ];
        let bits = [!reset, busy, h.hysteresis(x, z, 0.5)];
        let expected = reals.map(|value| u64::from(value.to_bits()));
        assert_eq!(found[..4], expected, "scan {at}");
        assert_eq!(found[4..], bits.map(u64::from), "scan {at}");
    }
}

#[test]
fn a_controller_of_the_standard_without_a_reset_time_or_a_cycle_has_a_number() {
    let text = |arguments: &str| {
        format!(
            "PROGRAM main VAR_INPUT on : BOOL; END_VAR VAR_OUTPUT y : REAL; END_VAR VAR c : PID; END_VAR
             c(AUTO := on, PV := 60.0, SP := 50.0, X0 := 4.0, KP := -2.0, {arguments}); y := c.XOUT; END_PROGRAM"
        )
    };
    let cases = [
        ("TR := 0.0, CYCLE := T#10ms", [-8.0, -20.0, -20.0]),
        ("TR := 0.0, CYCLE := T#0s", [-8.0, -20.0, -20.0]),
        ("TR := 10.0, TD := 3.0, CYCLE := T#0s", [-8.0, -8.0, -8.0]),
        ("TR := 10.0, CYCLE := T#100ms", [-8.0, -8.2, -8.4]),
    ];
    for (arguments, expected) in cases {
        let mut running = Running::new(program(&text(arguments)));
        for (on, expected) in [0, 1, 1].into_iter().zip(expected) {
            let found = f32::from_bits(running.scan(&[on])[0] as u32);
            assert_eq!(running.fault(), None, "{arguments}");
            assert!((found - expected).abs() < 1e-4, "{arguments}: {found} is not {expected}");
        }
    }
}

#[test]
fn who_takes_a_block_of_the_standard_for_ours_is_told_its_name() {
    let cases = [
        ("c : PID;", "c(PV := x, SP := 1.0, LOW := 0.0);", "PID_ISA"),
        ("c : PID;", "c(PV := l, SP := 1.0);", "PID_ISA"),
        ("c : PID;", "c(AUTO := TRUE, SATURATED => b);", "PID_ISA"),
        ("c : PID;", "b := c.SATURATED;", "PID_ISA"),
        ("c : PID := (HIGH := 5.0);", "c();", "PID_ISA"),
        ("c : PID;", "c(AUTO := TRUE, PV := x, SP := 50.0, KP := 1.0);", "PID_ISA"),
        ("c : RAMP;", "c(X0 := l);", "SETPOINT_RAMP"),
        ("c : INTEGRAL;", "c(XIN := l);", "INTEGRATOR"),
        ("c : DERIVATIVE;", "c(XIN := l);", "DIFFERENTIATOR"),
        ("c : HYSTERESIS;", "c(XIN1 := l);", "COMPARATOR"),
    ];
    for (declared, body, name) in cases {
        let text = format!(
            "PROGRAM main VAR x : REAL; l : LREAL; b : BOOL; {declared} END_VAR {body} END_PROGRAM"
        );
        let (_, found) = running::read(&text, None);
        let shown = running::shown(&text, &found, understudy_text::Severity::Error);
        assert!(shown.contains(name), "{body}: {shown}");
    }
    // The time may be set elsewhere.
    for (declared, body) in
        [("c : RAMP := (CYCLE := T#1s);", "c();"), ("c : PID;", "c(); c.CYCLE := T#1s;")]
    {
        let text = format!("PROGRAM main VAR {declared} END_VAR {body} END_PROGRAM");
        let (_, found) = running::read(&text, None);
        assert_eq!(running::shown(&text, &found, understudy_text::Severity::Error), "", "{body}");
    }
    // A block of the file has the name to itself.
    let text = "FUNCTION_BLOCK PID VAR_INPUT v : REAL; END_VAR END_FUNCTION_BLOCK
        PROGRAM main VAR c : PID; END_VAR c(LOW := 1.0); END_PROGRAM";
    let (_, found) = running::read(text, None);
    let shown = running::shown(text, &found, understudy_text::Severity::Error);
    assert!(!shown.is_empty() && !shown.contains("PID_ISA"), "{shown}");
}
