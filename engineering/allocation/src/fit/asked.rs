//! Requirements of a person.

use super::Verdict;
use super::judge::Judge;
use crate::figures::Figure;
use crate::need::Need;
use crate::requirement::{Asked, Bound, Requirement};

pub(super) fn judge(judge: &mut Judge<'_>, requirement: &Requirement, need: &Need) {
    let controller = judge.controller;
    let criterion = requirement.criterion();
    let instruction_time = judge.instruction_time();
    let mut is = |holds: bool, message: String, sources: Vec<String>| {
        let verdict = if holds { Verdict::Fits } else { Verdict::DoesNotFit };
        judge.said(&criterion, verdict, message, sources);
    };
    match &requirement.asked {
        Asked::Vendor(vendor) => {
            let holds = controller.vendor.eq_ignore_ascii_case(vendor);
            is(holds, format!("is made by {}", controller.vendor), Vec::new());
        }
        Asked::Family(family) => {
            let holds = controller.family.eq_ignore_ascii_case(family);
            is(holds, format!("is of the family {}", controller.family), Vec::new());
        }
        Asked::Model(model) => {
            let holds = controller.model.eq_ignore_ascii_case(model);
            is(holds, format!("is {}", controller.model), Vec::new());
        }
        Asked::Kind(kind) => {
            let holds = controller.kind == *kind;
            is(holds, format!("is {}", controller.kind.name()), Vec::new());
        }
        Asked::Contains(statement, words) => match controller.texts.get(statement) {
            Some(Figure { value, source }) => {
                let holds = value.to_lowercase().contains(words);
                is(holds, format!("{statement}: {value}"), vec![source.clone()]);
            }
            None => judge.unknown(&criterion, format!("its {statement} is unknown")),
        },
        Asked::Number(quantity, bound, value) => match controller.numbers.get(quantity) {
            Some(figure) => {
                let holds = match bound {
                    Bound::AtLeast => figure.value >= *value,
                    Bound::AtMost => figure.value <= *value,
                    Bound::Exactly => figure.value == *value,
                };
                let has = quantity.text(figure.value);
                is(holds, format!("{quantity}: {has}"), vec![figure.source.clone()]);
            }
            None => judge.unknown(&criterion, format!("its {quantity} is unknown")),
        },
        Asked::ScanTime(within) => {
            let Some(program) = &need.program else { return };
            match instruction_time {
                Some(figure) => {
                    let scan = u128::from(figure.value) * u128::from(program.instructions);
                    let message = format!("scans in about {scan} ns");
                    is(scan <= within.as_nanos(), message, vec![figure.source]);
                }
                None => {
                    let message = "the instruction time is unknown".to_owned();
                    judge.unknown(&criterion, message);
                }
            }
        }
        Asked::Ethernet => super::network(judge),
    }
}
