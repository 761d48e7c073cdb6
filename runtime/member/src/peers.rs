//! The members of a cluster and their addresses.

use std::path::Path;

use understudy_bus::Peer;
use understudy_cluster::{Addresses, Cluster, why_unreachable};
use understudy_wire::{Member, Via};

use crate::error::MemberError;

/// The member of a name.
///
/// # Errors
/// [`MemberError::NoName`].
pub fn find_member(cluster: &Cluster, name: &str) -> Result<Member, MemberError> {
    cluster.member(name).ok_or_else(|| {
        let known = cluster.members().filter_map(|member| cluster.member_name(member));
        MemberError::NoName { name: name.to_owned(), known: known.map(str::to_owned).collect() }
    })
}

/// All members and their addresses from the JSON `text` of a list at `path`.
///
/// # Errors
/// [`MemberError::List`].
pub fn listed_peers(path: &Path, text: &str) -> Result<Vec<Peer>, MemberError> {
    let refused = |reason: String| MemberError::List { path: path.to_owned(), reason };
    let peers: Vec<Peer> =
        serde_json::from_str(text).map_err(|error| refused(error.to_string()))?;
    for peer in &peers {
        for (_, address) in peer.paths() {
            if let Some(why) = why_unreachable(address) {
                return Err(refused(format!("{} has the address {address}: {why}", peer.name)));
            }
        }
    }
    Ok(peers)
}

/// All members and their addresses from the cluster file.
///
/// # Errors
/// [`MemberError::NoAddress`].
pub fn addressed_peers(cluster: &Cluster) -> Result<Vec<Peer>, MemberError> {
    let name = |member| cluster.member_name(member).unwrap_or_default().to_owned();
    let known: Vec<(Member, Addresses)> =
        cluster.members().map(|member| (member, cluster.addresses(member))).collect();
    let is_complete = |(member, addresses): &&(Member, Addresses)| {
        let given = Via::ALL.into_iter().filter(|via| addresses.at(*via).is_some());
        given.eq(cluster.paths(*member))
    };
    let lacking = known.iter().filter(|it| !is_complete(it));
    let names: Vec<String> = lacking.map(|(member, _)| name(*member)).collect();
    if !names.is_empty() {
        return Err(MemberError::NoAddress { names });
    }
    let peers = known.into_iter().filter_map(|(member, addresses)| {
        let Addresses { first, second, link } = addresses;
        Some(Peer { member, name: name(member), address: first?, second, link })
    });
    Ok(peers.collect())
}
