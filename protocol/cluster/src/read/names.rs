//! Names and addresses that are given once.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::ops::Range;

use understudy_executable::Interface;
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_typed::Point;
use understudy_wire::{ProgramId, Via, ZENOH_PORT_OFFSET};

use super::Member;
use crate::address::Addresses;
use crate::cluster::Link;
use crate::fields::Placed;

/// All that were given so far, each with its place.
pub(crate) struct Names {
    members: BTreeMap<String, Range<usize>>,
    addresses: BTreeMap<SocketAddr, Range<usize>>,
    link: Link,
    has_multicast: bool,
    /// Nothing where their number is an error, which was reported.
    networks: Option<u32>,
    /// By host, which path it is on, and where in the file; hosts of loopback are on all.
    hosts: BTreeMap<IpAddr, (Via, Range<usize>)>,
}

impl Names {
    /// None, in a cluster with this link.
    pub(crate) fn new(link: Link, has_multicast: bool, networks: Option<u32>) -> Self {
        Self {
            members: BTreeMap::new(),
            addresses: BTreeMap::new(),
            link,
            has_multicast,
            networks,
            hosts: BTreeMap::new(),
        }
    }

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

    /// Reports addresses at which a member cannot listen, or that are not of as many networks as the cluster has.
    pub(crate) fn listen(
        &mut self,
        addresses: &Addresses<Placed<SocketAddr>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let mut report = |message: String, place: &Placed<SocketAddr>, help: &str| {
            let span = place.span.clone();
            diagnostics.push(Diagnostic::error("U0240", message, span).with_help(help));
        };
        match (&addresses.first, &addresses.second) {
            (_, Some(second)) if self.networks == Some(1) => report(
                "a `second_address` in a cluster with one network".to_owned(),
                second,
                "add `networks = 2` to `[cluster]`, and a `second_address` to every member",
            ),
            (Some(first), None) if self.networks == Some(2) => report(
                format!("the member at {} has no `second_address`", first.value),
                first,
                "with `networks = 2` every member has an address on each network",
            ),
            (None, Some(second)) => report(
                format!("the member at {} has a `second_address` and no `address`", second.value),
                second,
                "with `networks = 2` every member has an address on each network",
            ),
            _ => {}
        }
        for via in Via::ALL {
            if let Some(address) = addresses.as_ref().at(via) {
                self.listen_at(address, diagnostics);
                self.place_host(address, via, diagnostics);
            }
        }
    }

    /// Reports a host that is on two paths: what they share can take both away.
    fn place_host(
        &mut self,
        Placed { value, span }: &Placed<SocketAddr>,
        via: Via,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let host = value.ip().to_canonical();
        if host.is_loopback() {
            return;
        }
        let (known, first) = self.hosts.entry(host).or_insert_with(|| (via, span.clone()));
        let (code, message, related, help) = match (*known, via) {
            (known, via) if known == via => return,
            (Via::Link, network) | (network, Via::Link) => (
                "U0263",
                format!("{host} is on {network} and on the direct link"),
                "the other path is here",
                "the direct link needs an interface of its own, with an address of its own",
            ),
            // That the second one is too many was reported.
            _ if self.networks != Some(2) => return,
            _ => (
                "U0240",
                format!("{host} is on the first and on the second network"),
                "the other network is here",
                "each network needs an interface of its own, with an address of its own",
            ),
        };
        diagnostics.push(
            Diagnostic::error(code, message, span.clone())
                .with_related(first.clone(), related)
                .with_help(help),
        );
    }

    /// Reports an address at which a member cannot listen: another member has it, or the link cannot use it.
    fn listen_at(
        &mut self,
        Placed { value, span }: &Placed<SocketAddr>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        if let Some(first) = self.addresses.get(value) {
            let message = format!("two members have the address {value}");
            diagnostics.push(
                Diagnostic::error("U0210", message, span.clone())
                    .with_related(first.clone(), "the first is here"),
            );
            return;
        }
        if self.has_multicast && value.is_ipv6() {
            let message = format!("{value} is an IPv6 address, and `multicast` is a group of IPv4");
            let help = "use IPv4 addresses, or leave `multicast` out";
            diagnostics.push(Diagnostic::error("U0210", message, span.clone()).with_help(help));
        }
        if self.link == Link::Zenoh {
            self.listen_for_frames(*value, span, diagnostics);
        }
        self.addresses.insert(*value, span.clone());
    }

    /// Reports an address whose frames over Zenoh have no port of their own.
    fn listen_for_frames(
        &self,
        address: SocketAddr,
        span: &Range<usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let port = address.port();
        let highest = u16::MAX - ZENOH_PORT_OFFSET;
        if port > highest {
            let message = format!(
                "{address} cannot be used over Zenoh: its frames need the TCP port {ZENOH_PORT_OFFSET} higher, and ports end at {}",
                u16::MAX
            );
            let help = format!("use a port up to {highest}, or `link = \"udp\"`");
            diagnostics.push(Diagnostic::error("U0580", message, span.clone()).with_help(help));
        }
        let above = port.checked_add(ZENOH_PORT_OFFSET);
        let below = port.checked_sub(ZENOH_PORT_OFFSET);
        for other in [above, below].into_iter().flatten() {
            let other = SocketAddr::new(address.ip(), other);
            let Some(first) = self.addresses.get(&other) else {
                continue;
            };
            let (lower, higher) = (other.min(address), other.max(address));
            let message = format!(
                "{lower} and {higher} need the same TCP port: the frames of {lower} over Zenoh use the port {ZENOH_PORT_OFFSET} higher"
            );
            diagnostics.push(
                Diagnostic::error("U0210", message, span.clone())
                    .with_related(first.clone(), "the other is here")
                    .with_help("use another port, or `link = \"udp\"`"),
            );
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

/// The signal `controller.signal`, and whether it is an output.
pub(crate) fn find_signal<'m>(
    signal: &Placed<String>,
    members: &'m [Member],
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<(ProgramId, &'m Point, bool)> {
    let Placed { value, span } = signal;
    let mut unknown = |message: String, help: String| {
        diagnostics.push(Diagnostic::error("U0209", message, span.clone()).with_help(help));
        None
    };
    let Some((controller, name)) = value.split_once('.') else {
        let message = format!("`{value}` names no signal of a controller");
        let help = "write controller and signal with a dot between, such as \"tank.level\"";
        return unknown(message, help.to_owned());
    };
    let Some(index) = members.iter().position(|member| member.name == controller) else {
        let known = members.iter().map(|member| member.name.as_str());
        let message = format!("there is no controller `{controller}`");
        return unknown(message, suggestion(controller, known));
    };
    let (_, Interface { inputs, outputs }) = members[index].code.as_ref()?;
    let input = inputs.find(name).map(|point| (point, false));
    let found = input.or_else(|| outputs.find(name).map(|point| (point, true)));
    let Some((point, is_output)) = found else {
        let known = inputs.names().chain(outputs.names());
        let message = format!("`{controller}` has no input or output `{name}`");
        return unknown(message, suggestion(name, known));
    };
    Some((ProgramId(index as u8), point, is_output))
}
