//! The rule of two input modules against one that is told by looking back, for every sequence of readings.

use understudy_typed::Elementary;

use super::*;

const PATIENCE: u32 = 2;

/// What happens to a BOOL that counts as FALSE at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Read([Option<bool>; 2]),
    Release,
}

fn steps() -> impl Iterator<Item = Step> {
    let values = [None, Some(false), Some(true)];
    let both = values.into_iter().flat_map(move |one| values.map(|other| Step::Read([one, other])));
    both.chain([Step::Release])
}

/// The value that counts after these steps, the module that is excluded, and whether they are in doubt, by the words of the rule.
fn told(steps: &[Step]) -> (bool, Option<usize>, bool) {
    let (mut value, mut excluded) = (false, None);
    // Readings of both since they differ, and whether one alone was read after the last of them.
    let (mut differing, mut is_broken): (Vec<[bool; 2]>, bool) = (Vec::new(), false);
    for step in steps {
        match *step {
            Step::Release => (excluded, differing) = (None, Vec::new()),
            Step::Read([None, None]) => {}
            Step::Read([Some(one), Some(other)]) => {
                let now = [one, other];
                let is_doubted = differing.len() >= PATIENCE as usize;
                let moves_from = differing.last().filter(|_| is_doubted && !is_broken);
                is_broken = false;
                if let (None, Some(before)) = (excluded, moves_from) {
                    let moved = [0, 1].map(|module| now[module] != before[module]);
                    match moved {
                        [true, false] => excluded = Some(1),
                        [false, true] => excluded = Some(0),
                        _ => {}
                    }
                }
                match excluded {
                    Some(module) => {
                        differing.clear();
                        value = now[1 - module];
                    }
                    None if one == other => {
                        differing.clear();
                        value = one;
                    }
                    None => differing.push(now),
                }
            }
            Step::Read(readings) => {
                is_broken = true;
                let module = if readings[0].is_some() { 0 } else { 1 };
                if excluded != Some(module) {
                    value = readings[module] == Some(true);
                }
            }
        }
    }
    (value, excluded, differing.len() >= PATIENCE as usize)
}

#[test]
fn every_sequence_is_as_the_rule_tells() {
    let inputs = PairedInput::exact(&PointPlace::booleans(1));
    let start = PairedInputs::new(&inputs, Image::zero(1));
    let mut open = vec![(Vec::new(), start)];
    let mut seen = [0; 3];
    while let Some((before, machine)) = open.pop() {
        for step in steps() {
            let mut taken = before.clone();
            taken.push(step);
            let mut machine = machine.clone();
            match step {
                Step::Release => machine.release(&inputs),
                Step::Read(readings) => {
                    let images = readings.map(|it| it.map(|value| Image::from_bits([value])));
                    let read =
                        machine.take(&inputs, images.each_ref().map(Option::as_ref), PATIENCE);
                    assert_eq!(read.is_none(), readings == [None, None]);
                    assert!(read.is_none_or(|read| read == *machine.last()));
                }
            }
            let distrusted = machine.distrusted(&inputs).map(|image| image.get(0));
            let doubted = distrusted == [true; 2];
            assert_eq!(doubted, machine.standings[0].told() == InputChange::Differs, "{taken:?}");
            let excluded = distrusted.iter().position(|is_excluded| *is_excluded && !doubted);
            let found = (machine.last().get(0), excluded, doubted);
            assert_eq!(found, told(&taken), "{taken:?}");
            seen[usize::from(excluded.is_some()) + 2 * usize::from(doubted)] += 1;
            if taken.len() < 6 {
                open.push((taken, machine));
            }
        }
    }
    assert!(seen.iter().all(|count| *count > 10_000), "{seen:?}");
}

/// A module that is stuck, against one that is right: the value that counts is right from the next edge on.
#[test]
fn a_stuck_module_is_found_at_the_next_edge() {
    let inputs = PairedInput::exact(&PointPlace::booleans(1));
    for (stuck_at, module) in [(false, 0), (false, 1), (true, 0), (true, 1)] {
        let mut machine = PairedInputs::new(&inputs, Image::from_bits([stuck_at]));
        let mut changes = Vec::new();
        for right in [stuck_at, !stuck_at, !stuck_at, !stuck_at, stuck_at, !stuck_at, stuck_at] {
            let [right, stuck] = [right, stuck_at].map(|value| Image::from_bits([value]));
            let readings = if module == 0 { [&stuck, &right] } else { [&right, &stuck] };
            let before = machine.last().clone();
            let read = machine.take(&inputs, readings.map(Some), PATIENCE).expect("two readings");
            let is_excluded = matches!(machine.standings[0], Standing::Excluded(_));
            assert_eq!(read, if is_excluded { right } else { before });
            changes.extend(machine.take_changes());
        }
        let stuck = if module == 0 { Module::First } else { Module::Twin };
        assert_eq!(changes, [(0, InputChange::Differs), (0, InputChange::Excluded(stuck))]);
        // The one that is left does not count, and the last value stays.
        let alone = Image::from_bits([!stuck_at]);
        let readings = if module == 0 { [Some(&alone), None] } else { [None, Some(&alone)] };
        assert_eq!(machine.take(&inputs, readings, PATIENCE), Some(Image::from_bits([stuck_at])));
    }
}

/// The modules of a twin are not read for long: the doubt and its alarm last until both are read and agree. The module that has moved in between is not
/// taken for the intact one, since the other one may have moved too.
#[test]
fn a_doubt_lasts_while_one_module_is_not_read() {
    let inputs = PairedInput::exact(&PointPlace::booleans(1));
    for (back, ends) in [([true, true], true), ([false, false], true), ([false, true], false)] {
        let mut machine = PairedInputs::new(&inputs, Image::zero(1));
        let mut take = |readings: [Option<bool>; 2]| {
            let images = readings.map(|it| it.map(|value| Image::from_bits([value])));
            let read = machine.take(&inputs, images.each_ref().map(Option::as_ref), PATIENCE);
            (read.expect("a reading").get(0), machine.take_changes())
        };
        assert_eq!(take([Some(true), Some(false)]), (false, vec![]));
        assert_eq!(take([Some(true), Some(false)]), (false, vec![(0, InputChange::Differs)]));
        for alone in [true, false, true] {
            assert_eq!(take([Some(alone), None]), (alone, vec![]), "it counts alone");
        }
        let changes = if ends { vec![(0, InputChange::Agrees)] } else { vec![] };
        let value = if ends { back[0] } else { true };
        assert_eq!(take(back.map(Some)), (value, changes), "{back:?}");
    }
}

/// Two modules that are read together in every second sample only: the samples between them end no count, so the alarm comes.
#[test]
fn a_module_that_is_read_now_and_then_is_found() {
    let inputs = PairedInput::exact(&PointPlace::booleans(1));
    let mut machine = PairedInputs::new(&inputs, Image::zero(1));
    let [on, off] = [true, false].map(|value| Image::from_bits([value]));
    for _ in 0..PATIENCE {
        machine.take(&inputs, [Some(&on), None], PATIENCE);
        assert_eq!(machine.take_changes(), []);
        machine.take(&inputs, [Some(&on), Some(&off)], PATIENCE);
    }
    assert_eq!(machine.take_changes(), [(0, InputChange::Differs)]);
}

#[test]
fn an_author_goes_on_with_what_the_last_one_has_not_trusted() {
    let inputs = PairedInput::exact(&PointPlace::booleans(3));
    let mut first = PairedInputs::new(&inputs, Image::zero(3));
    for readings in [[0b011, 0b000], [0b011, 0b000], [0b010, 0b000]] {
        let images = readings.map(|word| Image::from_words(3, &[word]).expect("three bits"));
        first.take(&inputs, images.each_ref().map(Some), PATIENCE);
    }
    let distrusted = first.distrusted(&inputs);
    let expected = [[false, true, false], [true, true, false]].map(Image::from_bits);
    assert_eq!(distrusted, expected);
    let mut second = PairedInputs::new(&inputs, first.last().clone());
    second.distrust(&inputs, &distrusted);
    let changes = [(0, InputChange::Excluded(Module::Twin)), (1, InputChange::Differs)];
    assert_eq!(second.take_changes(), changes);
    assert_eq!(second.distrusted(&inputs), distrusted);
    second.release(&inputs);
    assert_eq!(second.take_changes(), [(0, InputChange::Agrees), (1, InputChange::Agrees)]);
}

fn check(of: Elementary, tolerance: f64, readings: [u64; 2], expected: Option<u64>) {
    let place = PointPlace { bit: 3, of };
    let inputs = [PairedInput { place, tolerance }];
    let mut last = Image::zero(80);
    place.set(&mut last, 77);
    for readings in [readings, [readings[1], readings[0]]] {
        let images = readings.map(|stored| {
            let mut image = Image::zero(80);
            place.set(&mut image, stored);
            image
        });
        let mut machine = PairedInputs::new(&inputs, last.clone());
        let read = machine.take(&inputs, images.each_ref().map(Some), PATIENCE);
        let found = place.get(&read.expect("two readings"));
        assert_eq!(found, expected.unwrap_or(77), "{of:?} {readings:?}");
    }
}

/// Numbers within the tolerance count as their mean, others as the last one; bit strings agree where they are equal.
#[test]
fn numbers_agree_within_their_tolerance() {
    let below = |value: i16| u64::from(value as u16);
    check(Elementary::Int, 2.0, [10, 12], Some(11));
    check(Elementary::Int, 2.0, [10, 13], None);
    check(Elementary::Int, 3.0, [below(-1), 2], Some(0));
    check(Elementary::Int, 1.0, [below(-2), below(-1)], Some(below(-2)));
    check(Elementary::Int, 65_535.0, [below(i16::MIN), below(i16::MAX)], Some(below(-1)));
    check(Elementary::Ulint, 1.0, [u64::MAX, u64::MAX - 1], Some(u64::MAX - 1));
    check(Elementary::Ulint, 0.0, [u64::MAX, u64::MAX - 1], None);
    check(Elementary::Word, 9.0, [8, 8], Some(8));
    check(Elementary::Word, 9.0, [8, 9], None);
    check(Elementary::Bool, 9.0, [0, 1], Some(77 & 1));
    let real = |value: f32| u64::from(value.to_bits());
    check(Elementary::Real, 0.5, [real(1.0), real(1.5)], Some(real(1.25)));
    check(Elementary::Real, 0.5, [real(1.0), real(1.75)], None);
    check(Elementary::Real, 0.5, [real(f32::NAN), real(1.0)], None);
    check(Elementary::Real, 0.5, [real(f32::INFINITY), real(1.0)], None);
    check(Elementary::Real, 0.0, [real(0.0), real(-0.0)], Some(real(0.0)));
    let largest = f64::MAX.to_bits();
    check(Elementary::Lreal, 1.0, [largest, largest], Some(largest));
    let near = (f64::MAX * 0.75).to_bits();
    check(Elementary::Lreal, f64::MAX, [largest, near], Some((f64::MAX * 0.875).to_bits()));
}

/// The first to leave the values of the doubt by more than the tolerance is intact.
#[test]
fn a_number_moves_by_more_than_its_tolerance() {
    let place = PointPlace { bit: 0, of: Elementary::Int };
    let inputs = [PairedInput { place, tolerance: 2.0 }];
    let mut machine = PairedInputs::new(&inputs, Image::zero(16));
    let mut take = |readings: [u64; 2]| {
        let images = readings.map(|word| Image::from_words(16, &[word]).expect("an INT"));
        let read = machine.take(&inputs, images.each_ref().map(Some), PATIENCE);
        (place.get(&read.expect("two readings")), machine.standings[0])
    };
    assert_eq!(take([50, 50]), (50, Standing::Agree));
    assert_eq!(take([50, 60]), (50, Standing::Differ(1)));
    assert_eq!(take([50, 60]), (50, Standing::Doubted(Some([50, 60]))));
    assert_eq!(take([52, 58]), (50, Standing::Doubted(Some([50, 60]))), "noise");
    assert_eq!(take([53, 60]), (53, Standing::Excluded(Module::Twin)));
    assert_eq!(take([54, 54]), (54, Standing::Excluded(Module::Twin)));
}
