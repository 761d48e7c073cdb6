//! The standard function blocks as the library of matiec writes them, statement by statement.

use std::time::Duration;

use crate::flow::Reading;
use crate::program::BlockKind;

/// `Q := CLK AND NOT M; M := CLK;` It pulses in the first scan when its input is 1 then.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RisingTrigger {
    memory: bool,
}

impl RisingTrigger {
    pub(super) fn call(&mut self, clock: bool) -> bool {
        let output = clock && !self.memory;
        self.memory = clock;
        output
    }
}

/// `Q := NOT CLK AND NOT M; M := NOT CLK;` It pulses in the first scan when its input is 0 then.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FallingTrigger {
    memory: bool,
}

impl FallingTrigger {
    pub(super) fn call(&mut self, clock: bool) -> bool {
        let output = !clock && !self.memory;
        self.memory = !clock;
        output
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Phase {
    #[default]
    Idle,
    Running,
    Done,
}

#[derive(Debug, Clone, Copy, Default)]
struct Timer {
    phase: Phase,
    previous_input: bool,
    output: bool,
    start: Duration,
}

impl Timer {
    fn on_delay(&mut self, preset: Duration, now: Duration, input: bool) -> bool {
        if self.phase == Phase::Idle && !self.previous_input && input {
            self.phase = Phase::Running;
            self.output = false;
            self.start = now;
        } else if !input {
            self.output = false;
            self.phase = Phase::Idle;
        } else if self.phase == Phase::Running && self.start + preset <= now {
            self.phase = Phase::Done;
            self.output = true;
        }
        self.previous_input = input;
        self.output
    }

    fn off_delay(&mut self, preset: Duration, now: Duration, input: bool) -> bool {
        if self.phase == Phase::Idle && self.previous_input && !input {
            self.phase = Phase::Running;
            self.start = now;
        } else if input {
            self.phase = Phase::Idle;
        } else if self.phase == Phase::Running && self.start + preset <= now {
            self.phase = Phase::Done;
        }
        self.previous_input = input;
        input || self.phase == Phase::Running
    }

    /// ET: since the start, and at the end the preset.
    fn elapsed(&self, preset: Duration, now: Duration) -> Duration {
        match self.phase {
            Phase::Idle => Duration::ZERO,
            Phase::Running => (now - self.start).min(preset),
            Phase::Done => preset,
        }
    }

    fn pulse(&mut self, preset: Duration, now: Duration, input: bool) -> bool {
        if self.phase == Phase::Idle && !self.previous_input && input {
            self.phase = Phase::Running;
            self.output = true;
            self.start = now;
        } else if self.phase == Phase::Running && self.start + preset <= now {
            self.phase = Phase::Done;
            self.output = false;
        }
        if self.phase == Phase::Done && !input {
            self.phase = Phase::Idle;
        }
        self.previous_input = input;
        self.output
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Counter {
    value: u16,
    up: RisingTrigger,
    down: RisingTrigger,
}

#[derive(Debug, Clone, Copy)]
enum Memory {
    Timer(Timer),
    Counter(Counter),
    Latch(bool),
    Rising(RisingTrigger),
    Falling(FallingTrigger),
}

/// What a block remembers from one scan to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockState(Memory);

impl BlockState {
    pub(super) fn new(kind: BlockKind) -> Self {
        Self(match kind {
            BlockKind::Ton(_) | BlockKind::Tof(_) | BlockKind::Tp(_) => {
                Memory::Timer(Timer::default())
            }
            BlockKind::Ctu(_) | BlockKind::Ctd(_) | BlockKind::Ctud(_) => {
                Memory::Counter(Counter::default())
            }
            BlockKind::Sr | BlockKind::Rs => Memory::Latch(false),
            BlockKind::RTrig => Memory::Rising(RisingTrigger::default()),
            BlockKind::FTrig => Memory::Falling(FallingTrigger::default()),
        })
    }

    /// CV; 0 for a block that is not a counter.
    pub(super) fn counter_value(&self) -> u16 {
        match self.0 {
            Memory::Counter(counter) => counter.value,
            _ => 0,
        }
    }

    /// What it holds after a call at `now`.
    pub(super) fn reading(&self, kind: BlockKind, now: Duration) -> Reading {
        match (self.0, kind.preset_time()) {
            (Memory::Timer(timer), Some(preset)) => Reading::Time(timer.elapsed(preset, now)),
            (Memory::Counter(counter), _) => Reading::Number(counter.value),
            _ => Reading::Nothing,
        }
    }

    /// Both outputs, in the order of [`BlockKind::outputs`]; the second is 0 where there is only one.
    pub(super) fn call(
        &mut self,
        kind: BlockKind,
        now: Duration,
        wire: bool,
        input: impl Fn(&str) -> bool,
    ) -> [bool; 2] {
        match &mut self.0 {
            Memory::Timer(timer) => match kind {
                BlockKind::Ton(preset) => [timer.on_delay(preset, now, wire), false],
                BlockKind::Tof(preset) => [timer.off_delay(preset, now, wire), false],
                BlockKind::Tp(preset) => [timer.pulse(preset, now, wire), false],
                _ => [false; 2],
            },
            Memory::Counter(counter) => count(counter, kind, wire, input),
            Memory::Latch(output) => {
                *output = match kind {
                    BlockKind::Sr => wire || !input("R") && *output,
                    _ => !input("R1") && (wire || *output),
                };
                [*output, false]
            }
            Memory::Rising(trigger) => [trigger.call(wire), false],
            Memory::Falling(trigger) => [trigger.call(wire), false],
        }
    }
}

fn count(
    counter: &mut Counter,
    kind: BlockKind,
    wire: bool,
    input: impl Fn(&str) -> bool,
) -> [bool; 2] {
    match kind {
        BlockKind::Ctu(preset) => {
            let up = counter.up.call(wire);
            if input("R") {
                counter.value = 0;
            } else if up && counter.value < preset {
                counter.value += 1;
            }
            [counter.value >= preset, false]
        }
        BlockKind::Ctd(preset) => {
            let down = counter.down.call(wire);
            if input("LD") {
                counter.value = preset;
            } else if down && counter.value > 0 {
                counter.value -= 1;
            }
            [counter.value == 0, false]
        }
        BlockKind::Ctud(preset) => {
            let up = counter.up.call(wire);
            let down = counter.down.call(input("CD"));
            if input("R") {
                counter.value = 0;
            } else if input("LD") {
                counter.value = preset;
            } else if up && !down && counter.value < preset {
                counter.value += 1;
            } else if down && !up && counter.value > 0 {
                counter.value -= 1;
            }
            [counter.value >= preset, counter.value == 0]
        }
        _ => [false; 2],
    }
}
