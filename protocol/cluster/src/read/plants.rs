//! Plants: models bound to their controllers, and who feeds whom.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::time::Duration;

use understudy_executable::Interface;
use understudy_plant::{
    BindingProblem, Direction, Followed, ModelKind, Plant, PlantProgram, Signals, Terminal,
};
use understudy_text::Diagnostic;
use understudy_text::spelling::{nearest, suggestion};
use understudy_text::tables::key_text;
use understudy_typed::Declared;
use understudy_wire::ProgramId;

use super::Member;
use super::follows;
use super::inputs::{OTHER_NUMBERS, names_of_valid};
use super::ladders::Ladders;
use super::limits::too_wide;
use super::names::{Names, find_controller};
use crate::cluster::{PlantPlace, RemoteIo};
use crate::code::Code;
use crate::configuration::plant_text;
use crate::fields::{MAXIMUM_MISFITS, Placed};
use crate::file::{ModelSection, PlantSection};
use crate::undriven::remains;

/// The plants by program, and what the configuration hash has to know of each.
pub(crate) struct Plants {
    pub(crate) places: Vec<Option<PlantPlace>>,
    pub(crate) texts: Vec<String>,
}

/// A section that stands behind a controller.
pub(crate) struct Draft {
    pub(crate) section: PlantSection,
    pub(crate) name: String,
    pub(crate) program: usize,
    pub(crate) kind: Option<ModelKind>,
    /// Of a model that is a program.
    code: Option<Code>,
}

pub(crate) fn place(
    sections: Vec<PlantSection>,
    period: Duration,
    members: &[Member],
    remote_ios: &[RemoteIo],
    ladders: &mut Ladders<'_>,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Plants {
    let mut taken = BTreeMap::new();
    let mut drafts = Vec::new();
    for section in sections {
        names.listen(&section.addresses, diagnostics);
        if let Some(name) = &section.name {
            names.declare(&name.value, name.span.clone(), diagnostics);
        }
        let controller = section.controller.as_ref();
        let program = controller.and_then(|controller| {
            find_controller(members, controller, "a plant", &mut taken, diagnostics)
        });
        let name = section.name.as_ref().map(|name| name.value.clone());
        let name = name.unwrap_or_else(|| {
            let Some(controller) = controller else {
                return String::new();
            };
            let name = format!("{}-plant", controller.value);
            names.declare(&name, controller.span.clone(), diagnostics);
            name
        });
        let mut code = None;
        let kind = match &section.model {
            Some(ModelSection::Robot(parameters)) => Some(ModelKind::Robot(parameters.clone())),
            Some(ModelSection::Press(parameters)) => Some(ModelKind::Press(parameters.clone())),
            Some(ModelSection::Ladder(file)) => {
                let read = ladders.code(file, &name, period, diagnostics);
                let too_wide = read.as_ref().and_then(|code| too_wide(&file.value, code));
                code = read.filter(|_| too_wide.is_none());
                if let Some(message) = too_wide {
                    diagnostics.push(Diagnostic::error("U0213", message, file.span.clone()));
                }
                code.as_ref().map(|code| {
                    ModelKind::Program(Box::new(PlantProgram {
                        executable: code.executable(),
                        interface: code.interface(),
                    }))
                })
            }
            None => None,
        };
        for Terminal { name: counted, declared } in kind.iter().flat_map(ModelKind::counted_numbers)
        {
            let message = format!("`{counted}` of the plant `{name}` is {declared}, not BOOL");
            let help = "parts and plant faults are counted at the edges of a BOOL";
            let span = section.span.clone();
            diagnostics.push(Diagnostic::error("U0227", message, span).with_help(help));
        }
        if let Some(program) = program {
            drafts.push(Draft { section, name, program, kind, code });
        }
    }
    let mut plants = Plants {
        places: members.iter().map(|_| None).collect(),
        texts: vec![String::new(); members.len()],
    };
    for draft in &drafts {
        let fed_by = feeder(draft, &drafts, diagnostics);
        let follows = follows::resolve(draft, &drafts, members, diagnostics);
        let (Some(kind), Some((_, interface))) = (&draft.kind, &members[draft.program].code) else {
            continue;
        };
        plants.texts[draft.program] =
            plant_text(kind, draft.code.as_ref(), &signals(&draft.section), fed_by, &follows);
        plants.places[draft.program] =
            bound(draft, kind, interface, fed_by, follows, remote_ios, diagnostics);
    }
    plants
}

fn signals(section: &PlantSection) -> Signals {
    section
        .signals
        .iter()
        .map(|(terminal, (_, signal))| (terminal.clone(), signal.value.clone()))
        .collect()
}

fn bound(
    draft: &Draft,
    kind: &ModelKind,
    interface: &Interface,
    fed_by: Option<ProgramId>,
    follows: Vec<(String, Followed)>,
    remote_ios: &[RemoteIo],
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<PlantPlace> {
    let section = &draft.section;
    let remote_io = &remote_ios[draft.program];
    let (terminals, follows): (Vec<_>, Vec<_>) = follows.into_iter().unzip();
    let signals = signals(section);
    let (plant, mut problems) =
        Plant::following(kind, interface, &signals, &terminals, fed_by.is_some());
    let undriven: BTreeSet<String> = problems
        .iter()
        .filter_map(|problem| match problem {
            BindingProblem::InputNotDriven { input } => Some(input.clone()),
            _ => None,
        })
        .collect();
    // What an error left out could be the source of an input.
    if diagnostics.iter().any(super::is_error) {
        problems.retain(|problem| !matches!(problem, BindingProblem::InputNotDriven { .. }));
    }
    let not_driven = |problem: &BindingProblem, name: &str| matches!(problem, BindingProblem::InputNotDriven { input } if input == name);
    for source in &remote_io.inputs {
        let is_driven = !undriven.contains(&source.name);
        if is_driven && plant.is_some() {
            let message = format!(
                "the plant `{}` drives the input `{}`, which has another source",
                draft.name, source.name
            );
            let help = "remove the sensor from the plant, or the input from [remote_io.inputs]";
            diagnostics
                .push(Diagnostic::error("U0224", message, section.span.clone()).with_help(help));
        }
        let mut names: Vec<String> = names_of_valid(&source.name).collect();
        names.push(source.name.clone());
        problems.retain(|it| !names.iter().any(|name| not_driven(it, name)));
    }
    let is_read = |output: &str| {
        let mut readers = remote_ios.iter().flat_map(RemoteIo::signals);
        readers.any(|signal| signal.input.from.index() == draft.program && signal.output == output)
    };
    problems.retain(|problem| match problem {
        BindingProblem::OutputHasNoEffect { output } => !is_read(output),
        _ => true,
    });
    if let Some(diagnosis) = &remote_io.diagnosis {
        problems.retain(|problem| match problem {
            BindingProblem::InputNotDriven { input } => !diagnosis.drives(input),
            _ => true,
        });
    }
    let more = problems.len().saturating_sub(MAXIMUM_MISFITS);
    let problems = problems.into_iter().take(MAXIMUM_MISFITS);
    diagnostics.extend(problems.map(|problem| describe(problem, draft, interface)));
    if more > 0 {
        let message = format!("{more} more signals of the plant `{}` do not fit", draft.name);
        let span = section.span.clone();
        diagnostics.push(match plant {
            Some(_) => Diagnostic::warning("U0251", message, span),
            None => Diagnostic::error("U0209", message, span),
        });
    }
    Some(PlantPlace {
        name: draft.name.clone(),
        model: match section.model.as_ref()? {
            ModelSection::Robot(_) => "robot".into(),
            ModelSection::Press(_) => "press".into(),
            ModelSection::Ladder(file) => file.value.clone(),
        },
        plant: plant?,
        fed_by,
        follows,
        watchdog_cycles: section.watchdog_cycles,
        addresses: section.addresses.as_ref().map(|address| address.value),
    })
}

/// Who feeds it. Reports feeders that are not there, and parts that never come.
fn feeder(draft: &Draft, drafts: &[Draft], diagnostics: &mut Vec<Diagnostic>) -> Option<ProgramId> {
    let Placed { value, span } = draft.section.fed_by.as_ref()?;
    if *value == draft.name {
        let message = format!("the plant `{value}` feeds itself");
        diagnostics.push(
            Diagnostic::error("U0215", message, span.clone())
                .with_help("leave `fed_by` out: a built-in model has a feeder of its own"),
        );
        return None;
    }
    let Some(feeder) = drafts.iter().find(|other| other.name == *value) else {
        let message = format!("there is no plant `{value}`");
        let known = drafts.iter().map(|other| other.name.as_str());
        let known = known.filter(|name| *name != draft.name);
        diagnostics.push(
            Diagnostic::error("U0209", message, span.clone()).with_help(suggestion(value, known)),
        );
        return None;
    };
    let hands_over = feeder.kind.as_ref().is_none_or(ModelKind::hands_over);
    let takes_parts = draft.kind.as_ref().is_none_or(ModelKind::takes_parts);
    for (fits, message, help) in [
        (
            hands_over,
            format!("`{value}` never hands a part over"),
            "its ladder needs an output `handed_over`",
        ),
        (
            takes_parts,
            format!("`{}` never takes a part", draft.name),
            "its ladder needs an input `part_arrives`",
        ),
    ] {
        if !fits {
            let span = span.clone();
            diagnostics.push(Diagnostic::warning("U0254", message, span).with_help(help));
        }
    }
    Some(ProgramId(feeder.program as u8))
}

/// A sender and a receiver that do not agree on the values between them.
pub(crate) fn of_other_type(
    (sender, sent): (String, Declared),
    (receiver, received): (String, Declared),
    span: Range<usize>,
) -> Diagnostic {
    let message = format!("{receiver} is {received}, and {sender}, which drives it, is {sent}");
    let help = match sent.of == received.of {
        true if sent.values.is_some() => OTHER_NUMBERS.to_owned(),
        true => format!("declare the sender as {received}, or the receiver as {sent}"),
        false => "declare both with one type".to_owned(),
    };
    Diagnostic::error("U0227", message, span).with_help(help)
}

fn describe(problem: BindingProblem, draft: &Draft, interface: &Interface) -> Diagnostic {
    let section = &draft.section;
    let controller =
        section.controller.as_ref().map(|controller| controller.value.clone()).unwrap_or_default();
    // Where the model is named: the place to look at when nothing was written about a terminal.
    let model: Range<usize> = match &section.model {
        Some(ModelSection::Ladder(file)) => file.span.clone(),
        _ => section.span.clone(),
    };
    let signal_span = |terminal: &str| {
        let entry = section.signals.get(terminal);
        entry.map_or(model.clone(), |(_, signal)| signal.span.clone())
    };
    let known_names =
        |name: &str, known: &[String]| suggestion(name, known.iter().map(String::as_str));
    match problem {
        BindingProblem::UnknownTerminal { terminal, known } => {
            let message = format!("the plant `{}` has no terminal `{terminal}`", draft.name);
            let mut entries = [&section.signals, &section.follows].into_iter();
            let entry = entries.find_map(|names| names.get(&terminal));
            let span = entry.map_or(model.clone(), |(span, _)| span.clone());
            Diagnostic::error("U0209", message, span).with_help(known_names(&terminal, &known))
        }
        BindingProblem::UnknownSignal { terminal, direction, signal, known } => {
            let side = match direction {
                Direction::Sensor => "input",
                Direction::Actuator => "output",
            };
            let message =
                format!("`{controller}` has no {side} `{signal}` for the plant `{}`", draft.name);
            // A terminal that nothing was written about is bound by its own name: the way out is to write it.
            let near = nearest(&signal, known.iter().map(String::as_str));
            let help = match near {
                Some(near) if !section.signals.contains_key(&terminal) => {
                    format!(
                        "did you mean `{near}`? bind it with `signals = {{ {} = \"{near}\" }}`",
                        key_text(&terminal)
                    )
                }
                _ => known_names(&signal, &known),
            };
            Diagnostic::error("U0209", message, signal_span(&terminal)).with_help(help)
        }
        BindingProblem::OtherType { terminal, direction, signal, declared } => {
            let own = format!("`{}` of the plant `{}`", terminal.name, draft.name);
            let signal = format!("`{signal}` of `{controller}`");
            let span = signal_span(&terminal.name);
            let own = (own, terminal.declared);
            match direction {
                Direction::Sensor => of_other_type(own, (signal, declared), span),
                Direction::Actuator => of_other_type((signal, declared), own, span),
            }
        }
        BindingProblem::DrivenTwice { terminal, signal } => {
            let message = format!("two sensors drive the input `{signal}` of `{controller}`");
            Diagnostic::error("U0216", message, signal_span(&terminal))
                .with_help(format!("the second is `{terminal}`"))
        }
        BindingProblem::FollowsTwo { terminal } => {
            let message = format!(
                "`{terminal}` of the plant `{}` has both a signal of `{controller}` and a sensor of another plant",
                draft.name
            );
            let entry = section.follows.get(&terminal);
            let span = entry.map_or(model, |(span, _)| span.clone());
            Diagnostic::error("U0217", message, span)
                .with_help("keep one: in `signals`, or in `follows`")
        }
        BindingProblem::InputNotDriven { input } => {
            let point = interface.inputs.find(&input);
            let message = format!(
                "no sensor of the plant `{}` drives the input `{input}` of `{controller}`: {}",
                draft.name,
                remains(point.as_slice())
            );
            Diagnostic::warning("U0251", message, model)
        }
        BindingProblem::OutputHasNoEffect { output } => {
            let message = format!(
                "the output `{output}` of `{controller}` moves nothing in the plant `{}`",
                draft.name
            );
            Diagnostic::warning("U0252", message, model)
        }
    }
}
