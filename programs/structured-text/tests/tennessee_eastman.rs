//! The Tennessee Eastman process of the example against published values, and against a run of its authors' equations in C.

mod running;

use std::fmt::Write;

use running::{Running, program};

const PROCESS: &str = include_str!("../../../examples/tennessee-eastman/process.st");

/// Measurements of the base case: J. J. Downs and E. F. Vogel 1993, with the digits of N. L. Ricker's archive.
const BASE_CASE: [f64; 41] = [
    0.2505213768,
    3664.038884863,
    4509.2683901682,
    9.3477423425,
    26.9024403996,
    42.3388488563,
    2705.0000000464,
    74.9999999809,
    120.4000000017,
    0.3371170513,
    80.1094022593,
    49.9999999957,
    2633.7278831266,
    25.1601733849,
    50.0000000045,
    3102.213137237,
    22.9487300898,
    65.7310290341,
    230.3078204048,
    341.4336508454,
    94.59927549,
    77.29698353,
    32.1876130945,
    8.8932726456,
    26.3832894332,
    6.8820117573,
    18.7763059474,
    1.6567273566,
    32.9575372908,
    13.8229458674,
    23.9781442398,
    1.2565424847,
    18.5792697025,
    2.2633413851,
    4.8436409545,
    2.2985780751,
    0.017865525,
    0.8357022623,
    0.0985769135,
    53.7239787893,
    43.8280218936,
];

/// Measurements in the steps 200 and 1000 of 0.9 s, where five valves move in step 20: `temexd_mod.c` of Bathelt, Ricker and Jelali
/// (2015) with numbers of double precision, integrated by Euler's method.
const MOVED: [(usize, [f64; 41]); 2] = [
    (
        200,
        [
            0.2505213767843,
            3664.038884863,
            4509.268390168,
            8.844242449986,
            26.40828656178,
            42.05739565741,
            2682.661923509,
            75.37816140824,
            123.4758596542,
            0.3690155087572,
            79.34113420079,
            50.74748839112,
            2607.705694808,
            25.12026883728,
            49.82376671296,
            3075.658586755,
            22.89479046938,
            65.34968171705,
            196.3259313657,
            340.6600460221,
            98.92992109792,
            73.71132328175,
            32.12136784696,
            8.943404685515,
            26.27106491397,
            6.904078516675,
            18.88324111455,
            1.666712771373,
            33.02434653321,
            13.96722954365,
            23.95102221114,
            1.026270061966,
            18.69406291161,
            2.294907848166,
            4.779882146253,
            2.262278744005,
            0.01781291429102,
            0.846373457433,
            0.09988122377906,
            53.73901482102,
            43.81859207543,
        ],
    ),
    (
        1000,
        [
            0.2505213767843,
            3664.038884863,
            4509.268390168,
            8.844242449986,
            22.79692109233,
            39.08486078856,
            2486.277342546,
            70.31634796809,
            138.5391486771,
            0.3235816782677,
            93.47294560996,
            71.44840454594,
            2401.458209311,
            25.81130022534,
            51.95665389652,
            2847.551222132,
            22.90502859115,
            70.04405821647,
            169.7279696701,
            321.0291640811,
            110.4923093997,
            72.80965163755,
            31.21894729432,
            9.567186816666,
            25.09312981568,
            6.870288778279,
            18.46716003534,
            2.0944366553,
            30.49600953344,
            16.16793009541,
            20.53889042368,
            0.2567174866095,
            17.175315194,
            3.550196795295,
            7.774894599075,
            4.040045872499,
            0.009917399512877,
            0.7570061332725,
            0.1041371604456,
            53.47770543638,
            44.23567648687,
        ],
    ),
];

/// The block of the example in a program of its own: outputs are the measurements and the greatest slope of a state.
fn process() -> Running {
    let blocks = PROCESS
        .split("(* Plant of the reactor's controller")
        .next()
        .expect("the blocks come before the program");
    let valves = [
        63.05263039,
        53.97970677,
        24.64355755,
        61.30192144,
        22.21,
        40.06374673,
        38.1003437,
        46.53415582,
        47.44573456,
        41.10581288,
        18.11349055,
        50.0,
    ];
    let moved = [(4, 58.0), (6, 44.0), (9, 40.0), (10, 35.0), (11, 25.0)];
    let (mut outputs, mut body) = (String::new(), String::new());
    for (valve, position) in (1..).zip(valves) {
        let _ = write!(body, "p.VALVE[{valve}] := {position:?}; ");
    }
    for (valve, position) in moved {
        let _ = write!(body, "IF moved THEN p.VALVE[{valve}] := {position:?}; END_IF; ");
    }
    body += "p(STEP_TIME := 0.9); slope := p.GREATEST_SLOPE; ";
    for measurement in 1..=41 {
        let _ = write!(outputs, "m{measurement} : LREAL; ");
        let _ = write!(body, "m{measurement} := p.XMEAS[{measurement}]; ");
    }
    Running::new(program(&format!(
        "{blocks} PROGRAM main VAR_INPUT moved : BOOL; END_VAR VAR_OUTPUT {outputs} slope : LREAL; END_VAR
         VAR p : TENNESSEE_EASTMAN; END_VAR {body} END_PROGRAM"
    )))
}

fn scan(process: &mut Running, moved: bool) -> Vec<f64> {
    let outputs = process.scan(&[u64::from(moved)]);
    assert_eq!(process.fault(), None);
    outputs.into_iter().map(f64::from_bits).collect()
}

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    for (number, (found, expected)) in (1..).zip(found.iter().zip(expected)) {
        assert!(
            (found - expected).abs() <= tolerance * expected.abs(),
            "XMEAS({number}): {found} is not {expected}"
        );
    }
}

#[test]
fn the_base_case_is_the_published_one_and_stands_still() {
    let mut process = process();
    let outputs = scan(&mut process, false);
    near(&outputs, &BASE_CASE, 1e-8);
    // Of amounts up to 160 lb-mol, an hour.
    assert!(outputs[41] < 2e-3, "{}", outputs[41]);
}

#[test]
fn a_run_with_moved_valves_is_that_of_the_authors_equations() {
    let mut process = process();
    let mut expected = MOVED.iter();
    let mut next = expected.next();
    for step in 0..=1000 {
        let outputs = scan(&mut process, step >= 20);
        if let Some((at, measurements)) = next
            && *at == step
        {
            near(&outputs, measurements, 1e-9);
            next = expected.next();
        }
    }
    assert_eq!(next, None);
}
