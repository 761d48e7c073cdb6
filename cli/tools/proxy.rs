//! `understudy proxy`: an impaired link between two programs.

use std::net::SocketAddr;

use clap::{Args, ValueEnum};
use serde::Serialize;
use understudy_network::{
    Impairment, ProxyCounters, Rate, Route, Share, Transport, run_proxy, serve_proxy,
};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::overrides::parse_address;

/// Forward datagrams or streams with loss, delay and corruption
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy proxy --listen 127.0.0.1:7500 --to 192.168.1.11:7450 --loss 1% --delay 1ms --jitter 500us

The proxy runs until SIGINT or SIGTERM and then prints its counters. Replies are returned to their clients. Over TCP a loss delays the stream
by 200 ms, like a retransmission; --duplicate and --reorder have no effect.")]
pub struct Arguments {
    /// Listening address; port 0 selects a free port
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address, required_unless_present = "in_laboratory")]
    listen: Option<SocketAddr>,
    /// Destination address
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address, required_unless_present = "in_laboratory")]
    to: Option<SocketAddr>,
    /// Transport protocol
    #[arg(long, value_enum, default_value_t = TransportArgument::Udp)]
    transport: TransportArgument,
    #[command(flatten)]
    impairment: ImpairmentArguments,
    /// Impair only the forward direction
    #[arg(long)]
    one_way: bool,
    /// Seed of the random network faults
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Read the routes from standard input and run until it ends
    #[arg(long, hide = true, exclusive = true)]
    in_laboratory: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TransportArgument {
    /// UDP datagrams
    Udp,
    /// TCP streams
    Tcp,
}

/// Impairments of a link, in each direction.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ImpairmentArguments {
    /// Loss, such as 1%
    #[arg(long, value_name = "SHARE")]
    loss: Option<Share>,
    /// Delay, such as 1ms
    #[arg(long, value_name = "TIME", value_parser = Impairment::parse_delay)]
    delay: Option<std::time::Duration>,
    /// Jitter: maximum deviation from the delay
    #[arg(long, value_name = "TIME", value_parser = Impairment::parse_delay)]
    jitter: Option<std::time::Duration>,
    /// Share of duplicated datagrams
    #[arg(long, value_name = "SHARE")]
    duplicate: Option<Share>,
    /// Share of reordered datagrams
    #[arg(long, value_name = "SHARE")]
    reorder: Option<Share>,
    /// Share of datagrams with one inverted bit
    #[arg(long, value_name = "SHARE")]
    corrupt: Option<Share>,
    /// Bandwidth, such as 10mbit
    #[arg(long, value_name = "RATE")]
    rate: Option<Rate>,
}

impl ImpairmentArguments {
    /// The same arguments with a loss of `share`, unless a loss was given.
    pub(crate) fn losing(&self, share: Share) -> Self {
        Self { loss: Some(self.loss.unwrap_or(share)), ..self.clone() }
    }

    pub(crate) fn impairment(&self) -> Impairment {
        Impairment {
            loss: self.loss.unwrap_or_default(),
            delay: self.delay.unwrap_or_default(),
            jitter: self.jitter.unwrap_or_default(),
            duplicate: self.duplicate.unwrap_or_default(),
            reorder: self.reorder.unwrap_or_default(),
            corrupt: self.corrupt.unwrap_or_default(),
            rate: self.rate,
        }
    }
}

#[derive(Serialize)]
struct Carried {
    listened: SocketAddr,
    to: SocketAddr,
    #[serde(flatten)]
    counters: ProxyCounters,
}

/// Runs the proxy.
pub fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    let (Some(listen), Some(to)) = (arguments.listen, arguments.to) else {
        return in_laboratory();
    };
    let impairment = arguments.impairment.impairment();
    let route = Route {
        listen,
        to,
        transport: match arguments.transport {
            TransportArgument::Udp => Transport::Udp,
            TransportArgument::Tcp => Transport::Tcp,
        },
        forth: impairment,
        back: if arguments.one_way { Impairment::default() } else { impairment },
    };
    let mut listened = listen;
    let ran = run_proxy(&[route], arguments.seed, |addresses| {
        for address in addresses {
            listened = *address;
            console.note(&format!("listening on {address}, forwarding to {to}"));
        }
    });
    match ran {
        Ok(counters) => {
            let text = format!(
                "{} received, {} forwarded, {} lost by impairment, {} refused",
                counters.came, counters.passed, counters.lost, counters.refused
            );
            let carried = Carried { listened, to, counters };
            Answer::done(text, carried)
        }
        Err(error) => Answer::failed(Status::Failed, error.code(), error),
    }
}

/// Standard output is the laboratory's, so this answer is silent.
fn in_laboratory() -> Answer {
    match serve_proxy(std::io::stdin().lock(), std::io::stdout()) {
        Ok(()) => Answer::done(String::new(), ()),
        Err(error) => Answer::failed(Status::Failed, "U0529", error),
    }
}
