//! Networks that misbehave on purpose.
//!
//! [`Proxy`] stands between a member and its peer, over UDP or TCP, and loses, delays, doubles, reorders, changes and slows down
//! what passes, as an [`Impairment`] says. [`Hosts`] are network namespaces joined by a bridge, one for each host, whose links
//! `nft` cuts and thins out. Neither knows anything of the cluster.

mod error;
mod hosts;
mod impairment;
mod proxy;
mod run;
mod shaper;
mod tools;

pub use error::NetworkError;
pub use hosts::{Host, Hosts, missing_tools};
pub use impairment::{Impairment, Rate, Share, WrittenImpairment};
pub use proxy::{Proxy, ProxyCounters, Route, Transport};
pub use run::{ProxyPlan, ProxyReport, run_proxy, serve_proxy};
pub use shaper::{Passed, Shaper};
