//! The node manager: values are read from memory, and those of operator inputs are written through the gate of the run.
//!
//! Invariant: a write waits for its outcome outside the address space, so that no other request waits for it.

use std::collections::BTreeMap;
use std::sync::Arc;

use async_trait::async_trait;
use opcua::server::address_space::AddressSpace;
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::memory::{
    InMemoryNodeManager, InMemoryNodeManagerBuilder, InMemoryNodeManagerImpl,
};
use opcua::server::node_manager::{
    NodeManagerBuilder, ParsedWriteValue, RequestContext, ServerContext, WriteNode,
};
use opcua::sync::RwLock;
use opcua::types::{AttributeId, Identifier, StatusCode, Variant};
use understudy_gateway::WriteGate;
use understudy_journal::{Refusal, RequestedValue, WriteRequest};
use understudy_typed::Elementary;
use understudy_wire::Role;

use crate::security::Login;
use crate::tree::{Variable, WritableInput};

/// Reason of every write in the journal.
const REASON: &str = "by OPC UA";

/// Operator inputs and those who may write them.
pub(crate) struct Writing {
    pub(crate) gate: WriteGate,
    /// By the token of the user.
    pub(crate) logins: BTreeMap<String, Login>,
    /// By the identifiers of their nodes.
    inputs: BTreeMap<String, WritableInput>,
}

impl Writing {
    pub(crate) fn new(
        gate: WriteGate,
        logins: BTreeMap<String, Login>,
        variables: &[Variable],
    ) -> Self {
        let inputs = variables.iter();
        let inputs = inputs.filter_map(|variable| {
            let input = variable.writable()?.clone();
            Some((variable.path(), input))
        });
        Self { gate, logins, inputs: inputs.collect() }
    }

    async fn write(&self, token: &str, input: &WritableInput, value: &Variant) -> StatusCode {
        let login = self.logins.get(token);
        let Some(login) = login.filter(|login| login.role >= Role::Operator) else {
            return StatusCode::BadUserAccessDenied;
        };
        // An online change may have brought another input of its name.
        if !self.gate.has(input.member, &input.point) {
            return StatusCode::BadInvalidState;
        }
        let stored = match stored_of(input.point.of, value) {
            Ok(stored) => stored,
            Err(status) => return status,
        };
        let request = WriteRequest {
            input: &input.point.name,
            value: RequestedValue::Stored(stored),
            role: login.role,
            owner: &login.user,
            reason: REASON,
        };
        let done = match self.gate.check(input.member, &request) {
            Ok(write) => self.gate.send(input.member, write, None).await,
            Err(refusal) => Err(refusal),
        };
        match done {
            Ok(_cycle) => StatusCode::Good,
            Err(refusal) => status_of(&refusal),
        }
    }
}

/// The status of a refusal. The gate has logged its code and text.
fn status_of(refusal: &Refusal) -> StatusCode {
    match refusal.code().as_str() {
        "U0641" => StatusCode::BadTypeMismatch,
        "U0642" => StatusCode::BadOutOfRange,
        "U0643" => StatusCode::BadUserAccessDenied,
        "U0648" => StatusCode::BadTimeout,
        _ => StatusCode::BadInvalidState,
    }
}

/// A value as an input of that type stores it. Times are nanoseconds. A client may write a shorter type of the same kind, such as a Float for a
/// REAL or an Int32 for an INT.
fn stored_of(of: Elementary, value: &Variant) -> Result<u64, StatusCode> {
    let is_whole = of != Elementary::Bool && !of.is_real();
    match (value, whole_of(value)) {
        (Variant::Boolean(value), _) if of == Elementary::Bool => Ok(u64::from(*value)),
        (Variant::Float(value), _) if of == Elementary::Real => Ok(u64::from(value.to_bits())),
        (Variant::Float(value), _) if of.is_real() => Ok(f64::from(*value).to_bits()),
        (Variant::Double(value), _) if of == Elementary::Real => {
            let shorter = *value as f32;
            // A number that no REAL holds is out of its range, and not infinite.
            let fits = shorter.is_finite() || !value.is_finite();
            let stored = u64::from(shorter.to_bits());
            fits.then_some(stored).ok_or(StatusCode::BadOutOfRange)
        }
        (Variant::Double(value), _) if of.is_real() => Ok(value.to_bits()),
        (_, Some(number)) if is_whole => {
            let stored = number as u64 & of.mask();
            let is_same = of.signed(stored) == number;
            is_same.then_some(stored).ok_or(StatusCode::BadOutOfRange)
        }
        _ => Err(StatusCode::BadTypeMismatch),
    }
}

/// The number of a variant that has a whole one.
fn whole_of(value: &Variant) -> Option<i128> {
    Some(match value {
        Variant::SByte(value) => i128::from(*value),
        Variant::Byte(value) => i128::from(*value),
        Variant::Int16(value) => i128::from(*value),
        Variant::UInt16(value) => i128::from(*value),
        Variant::Int32(value) => i128::from(*value),
        Variant::UInt32(value) => i128::from(*value),
        Variant::Int64(value) => i128::from(*value),
        Variant::UInt64(value) => i128::from(*value),
        _ => return None,
    })
}

/// Keeps the nodes in memory.
pub(crate) struct Nodes {
    namespace: NamespaceMetadata,
    writing: Option<Arc<Writing>>,
}

/// The manager of all nodes of the cluster.
pub(crate) type NodeManager = InMemoryNodeManager<Nodes>;

/// Builds the manager of one namespace; without `writing` no node can be written.
pub(crate) fn node_manager(
    namespace_uri: String,
    writing: Option<Arc<Writing>>,
) -> impl NodeManagerBuilder {
    let build = move |context: ServerContext, space: &mut AddressSpace| {
        let mut types = context.type_tree.write();
        let namespace_index = types.namespaces_mut().add_namespace(&namespace_uri);
        space.add_namespace(&namespace_uri, namespace_index);
        Nodes {
            namespace: NamespaceMetadata { namespace_uri, namespace_index, ..Default::default() },
            writing,
        }
    };
    InMemoryNodeManagerBuilder::new(build)
}

impl Nodes {
    async fn write_value(
        &self,
        context: &RequestContext,
        space: &RwLock<AddressSpace>,
        written: &ParsedWriteValue,
    ) -> StatusCode {
        // The library checks the type and whether the node can be written at all.
        let checked = {
            let types = context.type_tree.read();
            let mut space = space.write();
            let node = space.validate_node_write(context, written, &*types);
            node.map(|_| ())
        };
        if let Err(status) = checked {
            return status;
        }
        let is_value =
            written.attribute_id == AttributeId::Value && !written.index_range.has_range();
        let path = match &written.node_id.identifier {
            Identifier::String(path) if is_value => path.as_ref(),
            _ => return StatusCode::BadNotWritable,
        };
        let input = self.writing.as_ref().and_then(|writing| {
            let input = writing.inputs.get(path)?;
            Some((writing, input))
        });
        let Some((writing, input)) = input else {
            return StatusCode::BadNotWritable;
        };
        match &written.value.value {
            Some(value) => writing.write(&context.token.0, input, value).await,
            None => StatusCode::BadTypeMismatch,
        }
    }
}

#[async_trait]
impl InMemoryNodeManagerImpl for Nodes {
    async fn init(&self, _space: &mut AddressSpace, _context: ServerContext) {}

    fn name(&self) -> &str {
        "understudy"
    }

    fn namespaces(&self) -> Vec<NamespaceMetadata> {
        vec![self.namespace.clone()]
    }

    async fn write(
        &self,
        context: &RequestContext,
        space: &RwLock<AddressSpace>,
        nodes: &mut [&mut WriteNode],
    ) -> Result<(), StatusCode> {
        for node in nodes {
            let status = self.write_value(context, space, node.value()).await;
            node.set_status(status);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_fits_its_type_or_has_a_status() {
        let check = |of, value: Variant, expected| {
            assert_eq!(stored_of(of, &value), expected, "{of} {value:?}");
        };
        check(Elementary::Bool, true.into(), Ok(1));
        check(Elementary::Bool, 1_u64.into(), Err(StatusCode::BadTypeMismatch));
        check(Elementary::Real, 120.0.into(), Ok(0x42f0_0000));
        check(Elementary::Sint, (-1_i64).into(), Ok(0xff));
        check(Elementary::Sint, 128_i64.into(), Err(StatusCode::BadOutOfRange));
        check(Elementary::Usint, 256_u64.into(), Err(StatusCode::BadOutOfRange));
        check(Elementary::Uint, 65_535_u64.into(), Ok(65_535));
        check(Elementary::Real, 1e300.into(), Err(StatusCode::BadOutOfRange));
        check(Elementary::Real, 1_i32.into(), Err(StatusCode::BadTypeMismatch));
        check(Elementary::Int, 1.0.into(), Err(StatusCode::BadTypeMismatch));
        check(Elementary::Bool, 1.0_f32.into(), Err(StatusCode::BadTypeMismatch));
        check(Elementary::Int, true.into(), Err(StatusCode::BadTypeMismatch));
    }

    /// Every value of a shorter type is stored as that of the type that the server shows.
    #[test]
    fn a_shorter_type_of_the_same_kind_is_stored_alike() {
        for number in [0.0_f32, -0.5, 42.5, f32::MAX, f32::MIN_POSITIVE] {
            for of in [Elementary::Real, Elementary::Lreal] {
                let longer = stored_of(of, &f64::from(number).into());
                assert!(longer.is_ok());
                assert_eq!(stored_of(of, &number.into()), longer, "{of} {number}");
            }
        }
        let whole = [
            Elementary::Sint,
            Elementary::Usint,
            Elementary::Int,
            Elementary::Uint,
            Elementary::Dint,
            Elementary::Udint,
            Elementary::Lint,
            Elementary::Ulint,
            Elementary::Word,
            Elementary::Time,
        ];
        for of in whole {
            for number in [-40_000_i64, -129, -128, -1, 0, 1, 127, 128, 255, 256, 32_767, 65_536] {
                let expected = stored_of(of, &number.into());
                let shorter = [
                    i8::try_from(number).map(Variant::from).ok(),
                    u8::try_from(number).map(Variant::from).ok(),
                    i16::try_from(number).map(Variant::from).ok(),
                    u16::try_from(number).map(Variant::from).ok(),
                    i32::try_from(number).map(Variant::from).ok(),
                    u32::try_from(number).map(Variant::from).ok(),
                    u64::try_from(number).map(Variant::from).ok(),
                ];
                for value in shorter.into_iter().flatten() {
                    assert_eq!(stored_of(of, &value), expected, "{of} {value:?}");
                }
            }
        }
    }
}
