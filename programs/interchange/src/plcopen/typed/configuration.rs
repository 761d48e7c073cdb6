//! What runs: configurations, resources, tasks, instances of programs, global variables.

use understudy_structured_text::parser::{Places, parse_expression_at};
use understudy_structured_text::syntax::{Class, ProgramInstance, Retention, Task};
use understudy_text::xml::Node;

use super::Typed;
use super::make::name;
use crate::plcopen::literal::{interval, no_interval};
use crate::plcopen::xml::{attribute, children, elements, program_type, start_tag};

impl Typed {
    pub(super) fn instances(&mut self, node: Node<'_, '_>) {
        for list in elements(node) {
            for configuration in children(list, "configuration") {
                self.globals(configuration);
                for resource in children(configuration, "resource") {
                    self.resource(resource);
                }
            }
        }
    }

    pub(super) fn resource(&mut self, resource: Node<'_, '_>) {
        self.globals(resource);
        self.runs(resource);
        for task in children(resource, "task") {
            self.task(task);
        }
    }

    pub(super) fn globals(&mut self, node: Node<'_, '_>) {
        for list in children(node, "globalVars") {
            let mut globals = Vec::new();
            self.variables(list, Class::Global, &mut globals);
            self.file.globals.extend(globals);
        }
    }

    fn task(&mut self, node: Node<'_, '_>) {
        let Some(called) = self.needed(node, "name") else {
            return;
        };
        let given = |name: &str| attribute(node, name).filter(|value| !value.is_empty());
        let interval = given("interval").and_then(|written| {
            let found = interval(&written);
            if found.is_none() {
                self.diagnostics.push(no_interval(&written, written.span()));
            }
            i64::try_from(found?.as_nanos()).ok()
        });
        let single = given("single").map(|single| {
            let start = single.span().start;
            let places: Places<'_> = &|span| start + span.start..start + span.end;
            let (value, found) = parse_expression_at(&single, places);
            self.diagnostics.extend(found);
            value
        });
        let priority = given("priority").and_then(|priority| priority.parse().ok());
        self.file.tasks.push(Task { name: name(&called), interval, priority, single });
        let before = self.file.instances.len();
        self.runs(node);
        for instance in &mut self.file.instances[before..] {
            instance.task = Some(name(&called));
        }
    }

    /// The instances of programs in a task or a resource.
    fn runs(&mut self, node: Node<'_, '_>) {
        for instance in children(node, "pouInstance") {
            let of = program_type(instance);
            let Some(of) = of.or_else(|| self.needed(instance, "typeName")) else {
                continue;
            };
            let called = attribute(instance, "name").unwrap_or_else(|| of.clone());
            if self.is_block(&of) {
                let message = format!("the task runs `{of}`, which is not a program");
                self.error("U1013", message, start_tag(instance));
                continue;
            }
            self.file.instances.push(ProgramInstance {
                retention: Retention::Unstated,
                name: name(&called),
                task: None,
                of: name(&of),
                connections: Vec::new(),
            });
        }
    }
}
