//! The canonical text of a configuration: everything that the members have to agree on, and nothing else.
//!
//! Not in it: addresses, the link, file names, comments, titles, and the names inside of programs' texts that are not signals.

use std::fmt::Write;

use understudy_cycle::{Mode, Turns};
use understudy_plant::{Followed, ModelKind, Signals};
use understudy_remote_io::{Fallback, Wiring};
use understudy_wire::ProgramId;

use crate::canonical::circuit_text;
use crate::cluster::Cluster;
use crate::code::Code;
use crate::format::TRIAL_CYCLES;
use crate::source::{InputSource, InputSourceKind};

/// Raised when equal texts would mean something else than before.
const VERSION: u32 = 1;

/// `plants` in the order of programs, from [`plant_text`]; empty where there is none. `program_text` says what of a program is in it, and `fallback`
/// what of that which a remote I/O does where nothing is proved.
pub(crate) fn configuration_text(
    cluster: &Cluster,
    plants: &[String],
    program_text: impl Fn(&Code) -> String,
    fallback: impl Fn(&Fallback) -> String,
) -> String {
    let agreement = &cluster.agreement;
    let schedule = &agreement.schedule;
    let mut text = String::new();
    let mut line = |line: std::fmt::Arguments<'_>| {
        writeln!(text, "{line}").expect("a string takes everything");
    };
    line(format_args!("configuration {VERSION}"));
    line(format_args!("cluster {}", cluster.name));
    line(format_args!("period {} ns", schedule.period().as_nanos()));
    let mode = match agreement.mode {
        Mode::Full => "full",
        Mode::Paper => "paper",
    };
    line(format_args!("mode {mode}"));
    // As it was before there was a choice, so that such a cluster keeps its hash.
    if schedule.turns() == Turns::Parallel {
        line(format_args!("schedule parallel"));
    }
    line(format_args!("copies {}", schedule.copies()));
    line(format_args!("history {}", agreement.history));
    line(format_args!("flag after {}", agreement.flag_after));
    line(format_args!("shadow {}", agreement.shadow_cycles));
    line(format_args!("listen {}", agreement.listen_cycles));
    let remote_ios = cluster.remote_ios.iter().zip(&cluster.plants).zip(plants);
    let controllers = cluster.controllers.iter();
    for (controller, ((remote_io, plant), plant_text)) in controllers.zip(remote_ios) {
        line(format_args!("controller {}", controller.name));
        line(format_args!("{}", indented(&program_text(&controller.code))));
        line(format_args!("remote io {}", remote_io.name));
        for setting in fallback(&remote_io.fallback).lines() {
            line(format_args!("{setting}"));
        }
        if let Some(twin) = &remote_io.twin {
            let after = twin.take_over_after;
            match twin.wiring {
                Wiring::Exclusive => line(format_args!("  twin {} exclusive {after}", twin.name)),
                Wiring::Parallel { discrepancy_cycles: cycles } => {
                    line(format_args!("  twin {} parallel {after} {cycles}", twin.name));
                }
            }
            for input in twin.paired_inputs.iter().filter(|input| input.tolerance > 0.0) {
                let (bit, tolerance) = (input.place.bit, input.tolerance.to_bits());
                line(format_args!("  tolerance {bit} {tolerance:016x}"));
            }
            for place in &twin.shared_outputs.places {
                line(format_args!("  share {} {}", place.bit, twin.shared_outputs.delay));
            }
        }
        for source in &remote_io.inputs {
            line(format_args!("{}", input_line(source)));
        }
        if let Some(diagnosis) = &remote_io.diagnosis {
            line(format_args!("diagnosis"));
            let text = circuit_text(&diagnosis.circuit, &[]);
            line(format_args!("{}", indented(&text)));
        }
        if let Some(plant) = plant {
            line(format_args!("plant {}", plant.name));
            line(format_args!("  watchdog {}", plant.watchdog_cycles));
            line(format_args!("{}", indented(plant_text)));
        }
    }
    for understudy in &cluster.understudies {
        let spare = if understudy.spare { " spare" } else { "" };
        line(format_args!("understudy {}{spare}", understudy.name));
    }
    text
}

/// What a remote I/O does where nothing is proved, a line for each setting.
pub(crate) fn fallback_text(fallback: &Fallback) -> String {
    let Fallback {
        hold_cycles,
        trial_cycles,
        fail_safe,
        ramps,
        release,
        value_fault,
        stale_state,
        restart,
    } = fallback;
    let mut text = String::new();
    let mut line = |line: std::fmt::Arguments<'_>| {
        writeln!(text, "  {line}").expect("a string takes everything");
    };
    line(format_args!("hold {hold_cycles}"));
    // As it was before there was a choice, so that such a cluster keeps its hash.
    if *trial_cycles != TRIAL_CYCLES {
        line(format_args!("trial {trial_cycles}"));
    }
    line(format_args!("fail-safe {fail_safe}"));
    for ramp in ramps {
        line(format_args!("ramp {} {:016x}", ramp.place.bit, ramp.step.to_bits()));
    }
    line(format_args!("release {release:?}"));
    line(format_args!("value fault {value_fault:?}"));
    line(format_args!("stale state {stale_state:?}"));
    if let Some(restart) = restart {
        line(format_args!("restart {restart:?}"));
    }
    text
}

/// What stands for a program in a text of which only the rest counts.
pub(crate) const PROGRAM: &str = "the program";

/// The line that stands for what a remote I/O does where nothing is proved.
pub(crate) const FALLBACK: &str = "  what it does where nothing is proved";

/// A text that has [`PROGRAM`] in the place of each program and [`FALLBACK`] in that of the settings of each remote I/O, with the programs and the
/// settings that are given one after another.
pub(crate) fn filled(
    text: &str,
    mut programs: impl Iterator<Item = String>,
    mut fallbacks: impl Iterator<Item = String>,
) -> String {
    let place = indented(PROGRAM);
    let lines = text.lines().map(|line| match line {
        _ if line == place => indented(&programs.next().unwrap_or_default()) + "\n",
        FALLBACK => fallbacks.next().unwrap_or_default(),
        _ => line.to_owned() + "\n",
    });
    lines.collect()
}

/// Beginning of the line of an input.
pub(crate) const INPUT: &str = "  input ";

/// The line of an input.
pub(crate) fn input_line(source: &InputSource) -> String {
    format!("{INPUT}{}", source_text(source))
}

/// Source of an input; texts for people are not in it.
fn source_text(source: &InputSource) -> String {
    match &source.kind {
        InputSourceKind::Operator(declaration) => match &declaration.group {
            Some(group) => format!("{:?} {group:?}", declaration.input),
            None => format!("{:?}", declaration.input),
        },
        InputSourceKind::Signal(declaration) => format!("{:?}", declaration.input),
    }
}

/// A plant's model, its signals, its feeder, and what it follows by terminal.
pub(crate) fn plant_text(
    kind: &ModelKind,
    code: Option<&Code>,
    signals: &Signals,
    fed_by: Option<ProgramId>,
    follows: &[(String, Followed)],
) -> String {
    let mut text = match kind {
        ModelKind::Robot(parameters) => format!(
            "robot {} {} {}\n",
            parameters.horizontal_cycles, parameters.vertical_cycles, parameters.feed_cycles
        ),
        ModelKind::Press(parameters) => {
            format!("press {} {}\n", parameters.ram_cycles, parameters.feed_cycles)
        }
        ModelKind::Program(_) => {
            format!("program\n{}", code.map(Code::text).unwrap_or_default())
        }
    };
    for (terminal, signal) in signals {
        writeln!(text, "signal {terminal} {signal}").expect("a string takes everything");
    }
    if let Some(feeder) = fed_by {
        writeln!(text, "fed by {}", feeder.0).expect("a string takes everything");
    }
    for (terminal, Followed { from, sensor, bits: _ }) in follows {
        writeln!(text, "follows {terminal} {} {sensor}", from.0)
            .expect("a string takes everything");
    }
    text
}

fn indented(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(|line| format!("  {line}")).collect();
    lines.join("\n")
}
