//! `understudy proxy`: a link that misbehaves, between any two programs.

use std::net::SocketAddr;

use clap::{Args, ValueEnum};
use serde::Serialize;
use understudy_network::{Impairment, ProxyCounters, Rate, Route, Share, Transport, run_proxy};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::overrides::parse_address;

/// Pass datagrams or streams on, and lose, delay, double, reorder, change or slow down what passes
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy proxy --listen 127.0.0.1:7500 --to 192.168.1.11:7450 --loss 1% --delay 1ms --jitter 500us

It runs until SIGINT or SIGTERM, and says then what passed. Answers find back to whom they are for. Over TCP a loss delays by
200 ms, as the system's own repetition does; `--duplicate` and `--reorder` mean nothing there.")]
pub(crate) struct Arguments {
    /// Where it listens; port 0 for any that is free
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address)]
    listen: SocketAddr,
    /// Where it passes on to
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address)]
    to: SocketAddr,
    /// What it carries
    #[arg(long, value_enum, default_value_t = TransportArgument::Udp)]
    transport: TransportArgument,
    #[command(flatten)]
    impairment: ImpairmentArguments,
    /// Spare the way back
    #[arg(long)]
    one_way: bool,
    /// What the fates of datagrams come from
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TransportArgument {
    /// Datagrams
    Udp,
    /// Streams
    Tcp,
}

/// What a link does to what passes, in each direction.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ImpairmentArguments {
    /// Share that is lost, such as 1%
    #[arg(long, value_name = "SHARE")]
    loss: Option<Share>,
    /// Everything arrives so much later, such as 1ms
    #[arg(long, value_name = "TIME", value_parser = Impairment::parse_delay)]
    delay: Option<std::time::Duration>,
    /// By up to so much earlier or later than the delay
    #[arg(long, value_name = "TIME", value_parser = Impairment::parse_delay)]
    jitter: Option<std::time::Duration>,
    /// Share that arrives twice
    #[arg(long, value_name = "SHARE")]
    duplicate: Option<Share>,
    /// Share that is overtaken by what comes behind it
    #[arg(long, value_name = "SHARE")]
    reorder: Option<Share>,
    /// Share that arrives with one bit turned over
    #[arg(long, value_name = "SHARE")]
    corrupt: Option<Share>,
    /// What the link carries at most, such as 10mbit
    #[arg(long, value_name = "RATE")]
    rate: Option<Rate>,
}

impl ImpairmentArguments {
    /// The same, losing a share where it loses nothing.
    pub(crate) fn losing(&self, share: Share) -> Self {
        Self {
            loss: Some(self.loss.unwrap_or(share)),
            ..self.clone()
        }
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

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    let impairment = arguments.impairment.impairment();
    let route = Route {
        listen: arguments.listen,
        to: arguments.to,
        transport: match arguments.transport {
            TransportArgument::Udp => Transport::Udp,
            TransportArgument::Tcp => Transport::Tcp,
        },
        forth: impairment,
        back: if arguments.one_way {
            Impairment::default()
        } else {
            impairment
        },
    };
    let mut listened = arguments.listen;
    let ran = run_proxy(&[route], arguments.seed, |addresses| {
        for address in addresses {
            listened = *address;
            console.note(&format!(
                "listening on {address}, passing on to {}",
                arguments.to
            ));
        }
    });
    match ran {
        Ok(counters) => {
            let text = format!(
                "{} came, {} passed on, {} lost on purpose, {} refused",
                counters.came, counters.passed, counters.lost, counters.refused
            );
            let carried = Carried {
                listened,
                to: arguments.to,
                counters,
            };
            Answer::done(text, carried)
        }
        Err(error) => Answer::failed(Status::Failed, error.code(), error.to_string()),
    }
}
