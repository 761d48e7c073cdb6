//! Short words for building rungs.

use understudy_ladder::{Coil, CoilKind, Contact, ContactKind, Element, Name, Rung};

fn contact(kind: ContactKind, operand: &Name) -> Element {
    Element::Contact(Contact { kind, operand: operand.clone() })
}

/// `a`
pub(crate) fn open(operand: &Name) -> Element {
    contact(ContactKind::NormallyOpen, operand)
}

/// `/a`
pub(crate) fn closed(operand: &Name) -> Element {
    contact(ContactKind::NormallyClosed, operand)
}

/// `+a`
pub(crate) fn rising(operand: &Name) -> Element {
    contact(ContactKind::Rising, operand)
}

/// Conducts while one of `operands` is 1; `None` without operands.
pub(crate) fn any<'n>(operands: impl IntoIterator<Item = &'n Name>) -> Option<Element> {
    let mut contacts: Vec<Element> = operands.into_iter().map(open).collect();
    match contacts.len() {
        0 => None,
        1 => contacts.pop(),
        _ => Some(Element::Branches(contacts.into_iter().map(|contact| vec![contact]).collect())),
    }
}

fn coil(kind: CoilKind, target: &Name) -> Coil {
    Coil { kind, target: target.clone() }
}

/// `( y )`
pub(crate) fn write(target: &Name) -> Coil {
    coil(CoilKind::Plain, target)
}

/// `(S y )`
pub(crate) fn set(target: &Name) -> Coil {
    coil(CoilKind::Set, target)
}

/// `(R y )`
pub(crate) fn reset(target: &Name) -> Coil {
    coil(CoilKind::Reset, target)
}

/// A rung with a title.
pub(crate) fn rung(title: impl Into<String>, network: Vec<Element>, coils: Vec<Coil>) -> Rung {
    Rung { title: Some(title.into()), network, coils, ..Rung::default() }
}
