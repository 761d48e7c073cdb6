//! One criterion after the other, each with its numbers and its sources.

use std::collections::BTreeMap;
use std::time::Duration;

use super::{Dimension, Finding, Load, Verdict};
use crate::controller::{Controller, Family};
use crate::figures::{FamilyQuantity, Figure, Quantity, Statement};
use crate::need::Terms;

/// Millionths.
const WHOLE: u64 = 1_000_000;

pub(super) struct Judge<'a> {
    pub(super) controller: &'a Controller,
    pub(super) family: Option<&'a Family>,
    pub(super) terms: &'a Terms,
    pub(super) findings: Vec<Finding>,
    pub(super) loads: BTreeMap<Dimension, Load>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(
        controller: &'a Controller,
        family: Option<&'a Family>,
        terms: &'a Terms,
    ) -> Self {
        Self { controller, family, terms, findings: Vec::new(), loads: BTreeMap::new() }
    }

    /// The time of an instruction on bits: the model's own, its family's, or what is assumed.
    pub(super) fn instruction_time(&self) -> Option<Figure<u64>> {
        let own = self.controller.numbers.get(&Quantity::BoolInstructionNs);
        own.cloned()
            .or_else(|| self.terms.of_family(self.family, FamilyQuantity::BoolInstructionNs))
    }

    /// A finding without numbers.
    pub(super) fn said(
        &mut self,
        criterion: &str,
        verdict: Verdict,
        message: String,
        sources: Vec<String>,
    ) {
        self.findings.push(Finding {
            criterion: criterion.to_owned(),
            verdict,
            need: None,
            has: None,
            margin: None,
            message,
            sources,
        });
    }

    pub(super) fn unknown(&mut self, criterion: &str, message: String) {
        self.said(criterion, Verdict::Unknown, message, Vec::new());
    }

    /// A need against a capacity of which a part stays free.
    fn compare(&mut self, criterion: &str, unit: &str, need: u64, has: u64, sources: Vec<String>) {
        let usable = self.terms.usable(has);
        let reserve = match self.terms.reserve_percent {
            0 => String::new(),
            percent => format!(" with a reserve of {percent} %"),
        };
        let (verdict, message) = if need <= usable {
            let message = format!("needs {need} of {has}{unit}{reserve}");
            (Verdict::Fits, message)
        } else {
            let message = format!("needs {need}{unit} and has {has}{reserve}");
            (Verdict::DoesNotFit, message)
        };
        self.said(criterion, verdict, message, sources);
        let finding = self.findings.last_mut().expect("just pushed");
        finding.need = Some(need);
        finding.has = Some(has);
        if has > 0 && need <= has {
            finding.margin = Some(1.0 - need as f64 / has as f64);
        }
    }

    fn source(&self, quantity: Quantity) -> Vec<String> {
        let figure = self.controller.numbers.get(&quantity);
        figure.map(|figure| figure.source.clone()).into_iter().collect()
    }

    /// The terminals that it has.
    pub(super) fn points(&mut self, quantity: Quantity, need: u64, dimension: Dimension) {
        if need == 0 {
            return;
        }
        let name = quantity.name();
        let words = name.replace('_', " ");
        let expansion = self.controller.text(Statement::MaxExpansionIo);
        match (self.controller.number(quantity), expansion) {
            (Some(has), expansion) if need <= self.terms.usable(has) || expansion.is_none() => {
                self.compare(name, "", need, has, self.source(quantity));
                let usable = self.terms.usable(has);
                let load = Load { takes: need, usable };
                self.loads.insert(dimension, load);
            }
            (Some(has), expansion) => {
                self.compare(name, "", need, has, self.source(quantity));
                if let (Some(expansion), Some(finding), false) =
                    (expansion, self.findings.last_mut(), self.terms.expansion)
                {
                    let more = format!(" on board (modules do not count here: \"{expansion}\")");
                    finding.message.push_str(&more);
                }
            }
            (None, _) => {
                let message = format!("needs {need}; how many {words} it has is unknown");
                self.unknown(name, message);
            }
        }
    }

    /// Timers and counters; `by_memory` says that only the memory limits them, which is a criterion of its own.
    pub(super) fn count(
        &mut self,
        quantity: Quantity,
        need: u64,
        dimension: Dimension,
        by_memory: Option<&str>,
    ) {
        if need == 0 {
            return;
        }
        let name = quantity.name();
        let Some(has) = self.controller.number(quantity) else {
            let Some(source) = by_memory else {
                let message = format!("needs {need}; how many {name} it has is unknown");
                return self.unknown(name, message);
            };
            let message = format!("needs {need}, and has as many as its memory holds");
            return self.said(name, Verdict::Fits, message, vec![source.to_owned()]);
        };
        self.compare(name, "", need, has, self.source(quantity));
        let usable = self.terms.usable(has);
        let load = Load { takes: need, usable };
        self.loads.insert(dimension, load);
    }

    /// `bytes` of a capacity; `fixed` of them are taken once a box.
    pub(super) fn memory(
        &mut self,
        quantity: Quantity,
        dimension: Dimension,
        bytes: u64,
        fixed: u64,
        sources: &[String],
    ) {
        let name = quantity.name();
        let Some(has) = self.controller.number(quantity) else {
            let message = format!("needs {bytes} bytes; its capacity is unknown");
            return self.unknown(name, message);
        };
        let all: Vec<String> = sources.iter().cloned().chain(self.source(quantity)).collect();
        self.compare(name, " bytes", bytes, has, all);
        let usable = self.terms.usable(has).saturating_sub(fixed);
        let load = Load { takes: bytes - fixed, usable };
        self.loads.insert(dimension, load);
    }

    /// `units` of the program take an amount that is not known.
    pub(super) fn memory_unknown(&mut self, quantity: Quantity, missing: &str, units: u64) {
        let name = quantity.name();
        let family = &self.controller.family;
        let mut message = format!("unknown figures of the family {family}: {missing}");
        match self.controller.number(quantity) {
            Some(0) => {
                let message = "needs some bytes and has none".to_owned();
                let sources = self.source(quantity);
                return self.said(name, Verdict::DoesNotFit, message, sources);
            }
            Some(has) => {
                let most = self.terms.usable(has) / units.max(1);
                message = format!(
                    "{message}; up to {most} each would be sufficient for {units} in {has} bytes"
                );
            }
            None => message.push_str("; its capacity in bytes is unknown too"),
        }
        let sources = self.source(quantity);
        self.said(name, Verdict::Unknown, message, sources);
    }

    /// Instructions one after the other, each as long as one on bits.
    pub(super) fn scan_time(&mut self, instructions: u64, within: Duration) {
        let criterion = "scan_time";
        let within_ns = u64::try_from(within.as_nanos()).unwrap_or(u64::MAX).max(1);
        let usable = self.terms.usable(within_ns.min(1 << 50));
        let Some(time) = self.instruction_time() else {
            let most = usable / instructions.max(1);
            let message = format!(
                "the instruction time is unknown; up to {most} ns would do for {instructions} in {within:?}"
            );
            return self.unknown(criterion, message);
        };
        let need = instructions.saturating_mul(time.value);
        let sources = vec![time.source];
        self.compare(criterion, " ns", need, within_ns, sources);
        let share = |part: u64| {
            let share = u128::from(part) * u128::from(WHOLE) / u128::from(within_ns);
            u64::try_from(share).unwrap_or(u64::MAX)
        };
        let load = Load { takes: share(need).max(1), usable: self.terms.usable(WHOLE) };
        self.loads.insert(Dimension::ScanTime, load);
    }
}
