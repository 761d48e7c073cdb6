//! The cell of section V in a closed loop, without a network: y(t) = h(x(t), u(t)), then the plants step, then u(t+1).
//!
//! The programs are (24)-(25) and (28)-(29) written out by hand, once with the set terms as printed (u15 and not u15) and once in
//! the working reading (x17 and not x17 in their place).

use proptest::prelude::*;
use understudy_logic::{Circuit, CircuitBuilder, Scan, Scratch};
use understudy_plant::{ModelKind, Plant, PressParameters, RobotParameters, Signals};
use understudy_wire::{Field, Image};

#[derive(Clone, Copy, PartialEq)]
enum Reading {
    Working,
    AsPrinted,
}

const ROBOT_OUTPUTS: [&str; 5] = ["move_right", "move_left", "move_down", "move_up", "grip"];

fn robot(reading: Reading) -> Circuit {
    let mut builder = CircuitBuilder::new("robot");
    let names = ["part_present", "arm_left", "arm_right", "arm_up", "arm_down", "stop"];
    let [u10, u11, u12, u13, u14, u15] = names.map(|name| builder.input(name));
    let registers = [1, 2, 3, 4, 5, 6, 7].map(|k| builder.register(format!("x1{k}"), false));
    let [x11, x12, x13, x14, x15, x16, x17] = registers.map(|(_, value)| value);
    let graph = builder.graph();
    let run = graph.not(u15);
    let at_hand_over = graph.and(u12, u14);
    let (loaded, empty) = match reading {
        Reading::Working => (x17, graph.not(x17)),
        Reading::AsPrinted => (u15, run),
    };
    // (set ∨ hold ∧ ¬end) ∧ gate ∧ ¬u15
    let mut row = |set: &[_], hold, end, gate: &[_]| {
        let set = graph.all(set.iter().copied());
        let not_end = graph.not(end);
        let kept = graph.and(hold, not_end);
        let either = graph.or(set, kept);
        let gated = graph.all(gate.iter().copied());
        graph.and(either, gated)
    };
    let next = [
        row(&[u13, u11, loaded], x11, u12, &[u13, run]),
        row(&[u13, u12, empty], x12, u11, &[u13, run]),
        row(&[u10, u11, u13, empty], x13, u14, &[u11, run]),
        row(&[u14, u11, loaded], x14, u13, &[u11, run]),
        row(&[u12, u13, loaded], x15, u14, &[u12, run]),
        row(&[u14, u12, empty], x16, u13, &[u12, run]),
        row(&[u11, u14], x17, at_hand_over, &[run]),
    ];
    let values = [
        graph.all([x11, u13, run]),
        graph.all([x12, u13, run]),
        {
            let either = graph.or(x13, x15);
            graph.and(either, run)
        },
        {
            let either = graph.or(x14, x16);
            graph.and(either, run)
        },
        graph.and(x17, run),
    ];
    for ((register, _), next) in registers.into_iter().zip(next) {
        builder.set_next(register, next);
    }
    for (name, value) in ROBOT_OUTPUTS.into_iter().zip(values) {
        builder.output(name, value);
    }
    builder.finish().expect("a circuit")
}

fn press() -> Circuit {
    let mut builder = CircuitBuilder::new("press");
    let names = ["part_present", "ram_up", "ram_down", "stop"];
    let [u20, u21, u22, u23] = names.map(|name| builder.input(name));
    let (down, x21) = builder.register("x21", false);
    let (up, x22) = builder.register("x22", false);
    let graph = builder.graph();
    let run = graph.not(u23);
    let [not_up, not_down] = [u21, u22].map(|end| graph.not(end));
    let set = graph.and(u20, u21);
    let hold = graph.and(x21, not_down);
    let lowering = graph.or(set, hold);
    let hold = graph.and(x22, not_up);
    let raising = graph.or(u22, hold);
    let [next_down, next_up, y21, y22] =
        [lowering, raising, x21, x22].map(|value| graph.and(value, run));
    builder.set_next(down, next_down);
    builder.set_next(up, next_up);
    builder.output("move_down", y21);
    builder.output("move_up", y22);
    builder.finish().expect("a circuit")
}

struct Loop {
    scan: Scan,
    scratch: Scratch,
    state: Image,
    outputs: Image,
    plant: Plant,
    field: Field,
}

impl Loop {
    fn new(circuit: &Circuit, kind: &ModelKind, fed: bool) -> Self {
        let (plant, problems) = Plant::new(kind, &circuit.into(), &Signals::new(), fed);
        assert_eq!(problems, []);
        let plant = plant.expect("it fits");
        let scan = Scan::new(circuit);
        let state = Image::from_words(scan.register_count(), scan.initial()).expect("in bounds");
        Self {
            field: plant.field(),
            scratch: Scratch::default(),
            outputs: Image::zero(scan.output_count()),
            state,
            scan,
            plant,
        }
    }

    fn cycle(&mut self, arrived: u64) {
        self.outputs = self.scanned();
        self.field = self.plant.step(&self.outputs, arrived);
    }

    /// A cycle in which the plant moves on with the outputs of the last one, whether the program is scanned or not.
    fn held(&mut self, arrived: u64, scanned: bool) {
        if scanned {
            self.scanned();
        }
        self.field = self.plant.step(&self.outputs, arrived);
    }

    fn scanned(&mut self) -> Image {
        let mut outputs = Image::zero(self.scan.output_count());
        self.scan.step(
            &mut self.scratch,
            self.state.words_mut(),
            self.field.sensors.words(),
            outputs.words_mut(),
        );
        outputs
    }
}

/// Runs the cell; answers with what both plants have counted.
fn run(reading: Reading, cycles: usize) -> (Field, Field) {
    let arm = ModelKind::Robot(RobotParameters::default());
    let ram = ModelKind::Press(PressParameters::default());
    let mut robot = Loop::new(&robot(reading), &arm, false);
    let mut press = Loop::new(&press(), &ram, true);
    for _ in 0..cycles {
        let before = robot.field.handed_over;
        robot.cycle(0);
        press.cycle(robot.field.handed_over - before);
    }
    (robot.field, press.field)
}

#[test]
fn the_working_reading_finishes_six_parts_in_300_cycles() {
    let (arm, ram) = run(Reading::Working, 300);
    assert_eq!((arm.handed_over, arm.finished, arm.plant_faults), (6, 6, 0));
    assert_eq!((ram.finished, ram.plant_faults), (6, 0));
}

/// Whichever cycle it is, and whether the samples of the held cycles are scanned or lost: outputs that are held for one or two
/// cycles move an axis a little further, and nothing breaks.
#[test]
fn outputs_that_are_held_for_two_cycles_break_nothing() {
    let arm = ModelKind::Robot(RobotParameters::default());
    let ram = ModelKind::Press(PressParameters::default());
    let mut broken = Vec::new();
    for begin in 0..150 {
        for (length, scanned, holds) in [1, 2]
            .into_iter()
            .flat_map(|length| [false, true].map(|scanned| (length, scanned)))
            .flat_map(|(length, scanned)| [1, 2, 3].map(|holds| (length, scanned, holds)))
        {
            let mut robot = Loop::new(&robot(Reading::Working), &arm, false);
            let mut press = Loop::new(&press(), &ram, true);
            for cycle in 0..300 {
                let is_held = (begin..begin + length).contains(&cycle);
                let before = robot.field.handed_over;
                let step = |one: &mut Loop, arrived, bit| {
                    if is_held && holds & bit != 0 {
                        one.held(arrived, scanned);
                    } else {
                        one.cycle(arrived);
                    }
                };
                step(&mut robot, 0, 1);
                let arrived = robot.field.handed_over - before;
                step(&mut press, arrived, 2);
            }
            let plant_faults = (robot.field.plant_faults, press.field.plant_faults);
            let finished = press.field.finished;
            if plant_faults != (0, 0) || finished < 5 {
                broken.push((begin, length, scanned, holds, plant_faults, finished));
            }
        }
    }
    assert_eq!(broken, []);
}

#[test]
fn the_equations_as_printed_never_lift_a_part() {
    let (arm, ram) = run(Reading::AsPrinted, 300);
    assert_eq!((arm.handed_over, ram.finished), (0, 0));
}

fn outputs(names: &[&str]) -> Image {
    Image::from_bits(ROBOT_OUTPUTS.map(|output| names.contains(&output)))
}

/// Drives the arm by hand: each entry is what is on, and for how many cycles.
fn check_arm(script: &[(&[&str], usize)], handed_over: u64, plant_faults: u64) {
    let kind = ModelKind::Robot(RobotParameters::default());
    let (plant, _) = Plant::new(&kind, &(&robot(Reading::Working)).into(), &Signals::new(), false);
    let mut plant = plant.expect("it fits");
    for (names, cycles) in script {
        for _ in 0..*cycles {
            plant.step(&outputs(names), 0);
        }
    }
    let field = plant.field();
    assert_eq!((field.handed_over, field.plant_faults), (handed_over, plant_faults));
}

#[test]
fn the_arm_knows_what_must_not_happen() {
    let down: (&[&str], usize) = (&["move_down"], 5);
    let take: (&[&str], usize) = (&["grip"], 1);
    let lift: (&[&str], usize) = (&["move_up", "grip"], 5);
    let carry: (&[&str], usize) = (&["move_right", "grip"], 10);
    let lower: (&[&str], usize) = (&["move_down", "grip"], 5);
    let release: (&[&str], usize) = (&[], 1);
    check_arm(&[down, take, lift, carry, lower, release], 1, 0);
    // Dropped on the way, and dropped from above the press.
    check_arm(&[down, take, lift, release], 0, 1);
    check_arm(&[down, take, lift, carry, release], 0, 1);
    // A step above the press is near enough, two are not.
    let nearly: (&[&str], usize) = (&["move_down", "grip"], 4);
    let above: (&[&str], usize) = (&["move_down", "grip"], 3);
    check_arm(&[down, take, lift, carry, nearly, release], 1, 0);
    check_arm(&[down, take, lift, carry, above, release], 0, 1);
    // Put back where it was.
    check_arm(&[down, take, release, take, lift], 0, 0);
    // Sideways while low is one plant fault, however long it lasts.
    check_arm(&[down, (&["move_right"], 7)], 0, 1);
    // Against the ends, and both ways at once.
    check_arm(&[(&["move_left", "move_up"], 9), (&["move_left", "move_right"], 3)], 0, 0);
    // Closed in the air, the gripper takes nothing.
    check_arm(&[take, lower, lift, carry, lower, release], 0, 0);
}

#[test]
fn a_part_on_an_occupied_press_or_under_its_ram_is_a_plant_fault() {
    let kind = ModelKind::Press(PressParameters::default());
    let (plant, _) = Plant::new(&kind, &(&press()).into(), &Signals::new(), true);
    let mut plant = plant.expect("it fits");
    let still = Image::zero(2);
    let down = Image::from_bits([true, false]);
    assert_eq!(plant.step(&still, 1).plant_faults, 0);
    assert_eq!(plant.step(&still, 1).plant_faults, 1);
    plant.step(&down, 0);
    assert_eq!(plant.step(&down, 2).plant_faults, 3);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever drives them: parts are conserved, counts never fall, an axis is at one end at most, positions stay in 0..=1000.
    #[test]
    fn no_output_brings_a_plant_out_of_its_bounds(script in prop::collection::vec(any::<u8>(), 1..400)) {
        let arm = ModelKind::Robot(RobotParameters::default());
        let ram = ModelKind::Press(PressParameters::default());
        let (arm, _) = Plant::new(&arm, &(&robot(Reading::Working)).into(), &Signals::new(), false);
        let (ram, _) = Plant::new(&ram, &(&press()).into(), &Signals::new(), true);
        let (mut arm, mut ram) = (arm.expect("it fits"), ram.expect("it fits"));
        let (mut handed_over, mut finished) = (0, 0);
        for byte in script {
            let seen = arm.step(&Image::from_bits((0..5).map(|bit| byte >> bit & 1 == 1)), 0);
            prop_assert!(seen.handed_over - handed_over <= 1);
            let pressed = ram.step(&Image::from_bits([byte & 32 != 0, byte & 64 != 0]), seen.handed_over - handed_over);
            prop_assert!(pressed.finished >= finished);
            prop_assert!(pressed.finished + pressed.plant_faults <= seen.handed_over);
            prop_assert!(!(seen.sensors.get(1) && seen.sensors.get(2)));
            prop_assert!(!(seen.sensors.get(3) && seen.sensors.get(4)));
            prop_assert!(seen.positions.iter().chain(&pressed.positions).all(|&position| position <= 1000));
            (handed_over, finished) = (seen.handed_over, pressed.finished);
        }
    }
}
