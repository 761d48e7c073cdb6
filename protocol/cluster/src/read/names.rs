//! Names and addresses that are given once.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;

use super::Member;
use crate::fields::Placed;

/// All that were given so far, each with its place.
#[derive(Default)]
pub(crate) struct Names {
    members: BTreeMap<String, Range<usize>>,
    addresses: BTreeMap<SocketAddr, Range<usize>>,
}

impl Names {
    /// Reports a name that another member has.
    pub(crate) fn declare(
        &mut self,
        name: &str,
        span: Range<usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        if let Some(first) = self.members.get(name) {
            let message = format!("two members are named `{name}`");
            diagnostics.push(
                Diagnostic::error("U0208", message, span)
                    .with_related(first.clone(), "the first is here")
                    .with_help("stations, remote I/Os and plants share one set of names"),
            );
        } else {
            self.members.insert(name.to_owned(), span);
        }
    }

    /// Reports an address that another member has.
    pub(crate) fn listen(
        &mut self,
        address: Option<&Placed<SocketAddr>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let Some(Placed { value, span }) = address else {
            return;
        };
        if let Some(first) = self.addresses.get(value) {
            let message = format!("two members have the address {value}");
            diagnostics.push(
                Diagnostic::error("U0210", message, span.clone())
                    .with_related(first.clone(), "the first is here"),
            );
        } else {
            self.addresses.insert(*value, span.clone());
        }
    }
}

/// The index of the controller that a section is for. `taken` holds those that have their `what` already.
pub(crate) fn find_controller(
    members: &[Member],
    name: &Placed<String>,
    what: &str,
    taken: &mut BTreeMap<usize, Range<usize>>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<usize> {
    let index = members.iter().position(|member| member.name == name.value);
    let Some(index) = index else {
        let message = format!("there is no controller `{}`", name.value);
        let known = members.iter().map(|member| member.name.as_str());
        let known = known.filter(|name| !name.is_empty());
        diagnostics.push(
            Diagnostic::error("U0209", message, name.span.clone())
                .with_help(suggestion(&name.value, known)),
        );
        return None;
    };
    if let Some(first) = taken.get(&index) {
        let message = format!("`{}` has {what} already", name.value);
        diagnostics.push(
            Diagnostic::error("U0208", message, name.span.clone())
                .with_related(first.clone(), "the first is here"),
        );
        return None;
    }
    taken.insert(index, name.span.clone());
    Some(index)
}
