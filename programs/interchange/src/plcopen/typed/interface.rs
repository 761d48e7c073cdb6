//! Variables, types and initial values of a document.

use understudy_structured_text::parser::{Places, parse_expression_at, parse_initializer_at};
use understudy_structured_text::syntax::{
    Class, Declaration, Expression, Initializer, Name, Retention, TypeDefinition, TypeKind,
    TypeName,
};
use understudy_text::xml::Node;

use super::make;
use super::{Typed, make::name};
use crate::plcopen::xml::{attribute, child, children, elements, start_tag, text, word};

/// Types in each other that are followed.
const MAXIMUM_NESTING: usize = 32;

impl Typed {
    /// The lists of variables of a unit, and what a function answers.
    pub(super) fn interface(
        &mut self,
        interface: Node<'_, '_>,
    ) -> (Vec<Declaration>, Option<TypeName>) {
        let mut declarations = Vec::new();
        let mut result = None;
        for list in elements(interface) {
            let class = match list.tag_name().name() {
                "inputVars" => Class::Input,
                "outputVars" => Class::Output,
                "inOutVars" => Class::InOut,
                "localVars" => Class::Local,
                "tempVars" => Class::Temporary,
                "externalVars" => Class::External,
                "globalVars" => Class::Global,
                "returnType" => {
                    result = self.type_in(list, 0);
                    continue;
                }
                _ => continue,
            };
            self.variables(list, class, &mut declarations);
        }
        (declarations, result)
    }

    pub(super) fn variables(
        &mut self,
        list: Node<'_, '_>,
        class: Class,
        into: &mut Vec<Declaration>,
    ) {
        let retention = self.retention(list);
        for node in children(list, "variable") {
            let Some(written) = self.needed(node, "name") else {
                continue;
            };
            let Some(of) = child(node, "type").and_then(|of| self.type_in(of, 0)) else {
                let message = format!("the variable `{written}` has no type");
                self.error("U1002", message, start_tag(node));
                continue;
            };
            let initial = child(node, "initialValue");
            let initial = initial.and_then(|value| self.initial(value, &of, 0));
            let address = attribute(node, "address").filter(|address| !address.is_empty());
            into.push(Declaration {
                name: name(&written),
                class,
                constant: is(list, "constant"),
                retention,
                edge: None,
                address: address
                    .map(|address| Name::new(address.to_ascii_uppercase(), address.span())),
                of,
                initial,
                description: description(node),
            });
        }
    }

    /// The type that stands in an element.
    pub(super) fn type_in(&mut self, node: Node<'_, '_>, depth: usize) -> Option<TypeName> {
        let kind = elements(node).find(|inner| inner.tag_name().name() != "addData")?;
        let span = start_tag(kind);
        if depth > MAXIMUM_NESTING {
            let message = format!("types are nested more than {MAXIMUM_NESTING} deep");
            self.error("U1033", message, span);
            return None;
        }
        let kind = match kind.tag_name().name() {
            "derived" => {
                let written = self.needed(kind, "name")?;
                match panel(&written) {
                    Some("STRING") => TypeKind::Text { wide: false, length: None },
                    Some(usual) => TypeKind::Named(Name::new(usual, written.span())),
                    None => TypeKind::Named(name(&written)),
                }
            }
            word @ ("string" | "wstring" | "STRING" | "WSTRING") => TypeKind::Text {
                wide: word.eq_ignore_ascii_case("wstring"),
                length: self.value(kind, "length").map(Box::new),
            },
            "subrangeSigned" | "subrangeUnsigned" => {
                let range = child(kind, "range").unwrap_or(kind);
                let (lower, upper) = self.bounds(range)?;
                let base = child(kind, "baseType").and_then(|base| self.type_in(base, depth + 1));
                let Some(TypeName { kind: TypeKind::Named(base), .. }) = base else {
                    let message = "a subrange is one of an integer type".to_owned();
                    self.error("U1002", message, span);
                    return None;
                };
                TypeKind::Subrange(base, Box::new(lower), Box::new(upper))
            }
            "array" => {
                let mut dimensions = Vec::new();
                for dimension in children(kind, "dimension") {
                    dimensions.push(self.bounds(dimension)?);
                }
                let element = child(kind, "baseType")?;
                TypeKind::Array(dimensions, Box::new(self.type_in(element, depth + 1)?))
            }
            "struct" => {
                let mut fields = Vec::new();
                for field in children(kind, "variable") {
                    let written = self.needed(field, "name")?;
                    let of = child(field, "type").and_then(|of| self.type_in(of, depth + 1))?;
                    let value = child(field, "initialValue");
                    let mut made =
                        make::declare(written.as_str(), Class::Local, of, &written.span());
                    made.initial = value.and_then(|value| self.initial(value, &made.of, 0));
                    made.description = description(field);
                    fields.push(made);
                }
                TypeKind::Structure(fields)
            }
            "enum" => {
                let mut values = Vec::new();
                for value in
                    child(kind, "values").iter().flat_map(|values| children(*values, "value"))
                {
                    let written = self.needed(value, "name")?;
                    let number = match attribute(value, "value") {
                        Some(number) if !number.is_empty() => self.value(value, "value"),
                        _ => None,
                    };
                    values.push((name(&written), number));
                }
                let base = child(kind, "baseType").and_then(|base| self.type_in(base, depth + 1));
                let base = base.and_then(|base| match base.kind {
                    TypeKind::Named(base) => Some(base),
                    _ => None,
                });
                TypeKind::Enumeration(values, base)
            }
            "pointer" => {
                let base = child(kind, "baseType")?;
                TypeKind::Pointer(Box::new(self.type_in(base, depth + 1)?))
            }
            // Everything else that may stand here is the name of an elementary type.
            word => TypeKind::Named(Name::new(word, span.clone())),
        };
        Some(TypeName { kind, span })
    }

    /// `lower` and `upper`, which may be constants by their names.
    fn bounds(&mut self, node: Node<'_, '_>) -> Option<(Expression, Expression)> {
        let found = (self.value(node, "lower"), self.value(node, "upper"));
        let (Some(lower), Some(upper)) = found else {
            let message = "a range has a `lower` and an `upper` bound".to_owned();
            self.error("U1002", message, start_tag(node));
            return None;
        };
        Some((lower, upper))
    }

    /// The value of an attribute.
    fn value(&mut self, node: Node<'_, '_>, attribute_name: &str) -> Option<Expression> {
        let written = attribute(node, attribute_name)?;
        let start = written.span().start;
        let places: Places<'_> = &|span| start + span.start..start + span.end;
        let (value, found) = parse_expression_at(&written, places);
        self.diagnostics.extend(found);
        Some(value)
    }

    /// The initial value in an element.
    pub(super) fn initial(
        &mut self,
        node: Node<'_, '_>,
        of: &TypeName,
        depth: usize,
    ) -> Option<Initializer> {
        let kind = elements(node).next()?;
        let span = start_tag(kind);
        if depth > MAXIMUM_NESTING {
            let message = format!("values are nested more than {MAXIMUM_NESTING} deep");
            self.error("U1033", message, span);
            return None;
        }
        match kind.tag_name().name() {
            "simpleValue" => {
                let written = attribute(kind, "value").filter(|value| !value.is_empty())?;
                let start = written.span().start;
                let places: Places<'_> = &|span| start + span.start..start + span.end;
                let text = quoted(&written, of);
                let (value, found) = parse_initializer_at(&text, places);
                self.diagnostics.extend(found);
                value
            }
            "arrayValue" => {
                let mut values = Vec::new();
                for value in children(kind, "value") {
                    let times = match attribute(value, "repetitionValue") {
                        Some(times) if times.as_str() != "1" => {
                            self.value(value, "repetitionValue")
                        }
                        _ => None,
                    };
                    let inner = self.initial(value, of, depth + 1)?;
                    values.push((times, vec![inner]));
                }
                Some(Initializer::Array(values, span))
            }
            "structValue" => {
                let mut fields = Vec::new();
                for value in children(kind, "value") {
                    let member = self.needed(value, "member")?;
                    fields.push((name(&member), self.initial(value, of, depth + 1)?));
                }
                Some(Initializer::Structure(fields, span))
            }
            _ => None,
        }
    }

    pub(super) fn data_types(&mut self, list: Node<'_, '_>) {
        for node in children(list, "dataType") {
            let Some(written) = self.needed(node, "name") else {
                continue;
            };
            let Some(of) = child(node, "baseType").and_then(|of| self.type_in(of, 0)) else {
                let message = format!("the type `{written}` has no base type");
                self.error("U1002", message, start_tag(node));
                continue;
            };
            let initial = child(node, "initialValue");
            let initial = initial.and_then(|value| self.initial(value, &of, 0));
            self.file.types.push(TypeDefinition { name: name(&written), of, initial });
        }
    }
}

/// Texts may stand in a document without their quotes.
fn quoted(written: &str, of: &TypeName) -> String {
    match of.kind {
        TypeKind::Text { wide: false, .. } if !written.starts_with(['\'', '"', '[']) => {
            format!("'{written}'")
        }
        TypeKind::Text { wide: true, .. } if !written.starts_with(['\'', '"', '[']) => {
            format!("\"{written}\"")
        }
        _ => written.to_owned(),
    }
}

/// What the types of variables are that Beremiz shows on a panel.
fn panel(name: &str) -> Option<&'static str> {
    let of = name.strip_prefix("HMI_")?;
    match of {
        "NODE" => Some("BOOL"),
        "STRING" => Some("STRING"),
        _ => understudy_typed::Elementary::ALL
            .into_iter()
            .map(understudy_typed::Elementary::name)
            .find(|known| *known == of),
    }
}

/// The documentation of an element on one line.
pub(super) fn description(node: Node<'_, '_>) -> Option<String> {
    let written = word(child(node, "documentation")?);
    let words: Vec<&str> = written.split_whitespace().collect();
    (!words.is_empty()).then(|| words.join(" "))
}

/// The documentation of an element by its lines.
pub(super) fn comments(node: Node<'_, '_>) -> Vec<String> {
    let Some(node) = child(node, "documentation") else {
        return Vec::new();
    };
    let whole = text(node);
    let lines = whole.as_str().lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty());
    lines.map(str::to_owned).collect()
}

/// Whether an attribute is true.
fn is(of: Node<'_, '_>, name: &str) -> bool {
    attribute(of, name).is_some_and(|value| matches!(value.as_str(), "true" | "1"))
}

impl Typed {
    /// What the attributes of a list of variables say of a loss of power.
    fn retention(&mut self, list: Node<'_, '_>) -> Retention {
        for name in ["retain", "persistent", "nonretain"] {
            let Some(value) = attribute(list, name) else {
                continue;
            };
            if !matches!(value.as_str(), "true" | "1" | "false" | "0" | "") {
                let message =
                    format!("`{value}` is not a value of `{name}`: write `true` or `false`");
                self.error("U1010", message, value.span());
            }
        }
        let kept = is(list, "retain") || is(list, "persistent");
        let not_kept = is(list, "nonretain");
        if kept && not_kept {
            let message = "variables are retentive or not: both are stated".to_owned();
            self.error("U1010", message, start_tag(list));
        }
        match (kept, not_kept) {
            (true, _) => Retention::Retained,
            (false, true) => Retention::NotRetained,
            (false, false) => Retention::Unstated,
        }
    }
}
