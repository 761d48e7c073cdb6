//! Overrides of the cluster file, passed on to every process.

use std::net::SocketAddr;
use std::time::Duration;

use clap::{Args, ValueEnum};
use understudy_bus::LinkKind;
use understudy_cluster::{Link, Overrides, Security};
use understudy_cycle::{Mode, Turns};
use understudy_text::duration::parse_positive;

/// Overrides of the cluster file.
#[derive(Debug, Clone, Default, Args)]
pub struct OverrideArguments {
    /// Cycle period, such as 10ms, overrides the cluster file
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    period: Option<Duration>,
    /// Link, overrides the cluster file
    #[arg(long, value_enum)]
    link: Option<LinkArgument>,
    /// Authentication, overrides the cluster file
    #[arg(long, value_enum)]
    security: Option<SecurityArgument>,
    /// Redundancy mode, overrides the cluster file
    #[arg(long, value_enum)]
    mode: Option<ModeArgument>,
    /// Schedule of the turns, overrides the cluster file
    #[arg(long, value_enum)]
    schedule: Option<ScheduleArgument>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LinkArgument {
    /// UDP
    Udp,
    /// Zenoh
    Zenoh,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SecurityArgument {
    /// Accept only frames sealed with the keys of the cluster
    Keys,
    /// Accept all frames from the network
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModeArgument {
    /// Mask any number of controller failures while one understudy is working
    Full,
    /// Mask one failure, as in the paper
    Paper,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ScheduleArgument {
    /// Each controller waits for the one before it
    Token,
    /// Controllers wait for no station, understudies for the controllers
    Parallel,
}

impl OverrideArguments {
    pub(crate) fn overrides(&self) -> Overrides {
        Overrides {
            period: self.period,
            link: self.link.map(|link| match link {
                LinkArgument::Udp => Link::Udp,
                LinkArgument::Zenoh => Link::Zenoh,
            }),
            security: self.security.map(|security| match security {
                SecurityArgument::Keys => Security::Keys,
                SecurityArgument::Off => Security::Off,
            }),
            mode: self.mode.map(|mode| match mode {
                ModeArgument::Full => Mode::Full,
                ModeArgument::Paper => Mode::Paper,
            }),
            turns: self.schedule.map(|schedule| match schedule {
                ScheduleArgument::Token => Turns::Token,
                ScheduleArgument::Parallel => Turns::Parallel,
            }),
        }
    }

    /// Whether a period was given.
    pub(crate) fn has_period(&self) -> bool {
        self.period.is_some()
    }

    /// The same overrides with a period.
    pub(crate) fn with_period(&self, period: Duration) -> Self {
        Self { period: Some(period), ..self.clone() }
    }

    /// The overrides for the given link, or for each link.
    pub fn each_link(&self) -> Vec<(LinkKind, Self)> {
        let links = [(LinkKind::Udp, LinkArgument::Udp), (LinkKind::Zenoh, LinkArgument::Zenoh)];
        let asked =
            links.into_iter().filter(|(_, link)| self.link.is_none_or(|asked| asked == *link));
        let over = asked.map(|(kind, link)| {
            let link = Some(link);
            (kind, Self { link, ..self.clone() })
        });
        over.collect()
    }

    /// The overrides as command-line arguments.
    pub(crate) fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        if let Some(period) = self.period {
            arguments.extend(["--period".to_owned(), format!("{}ns", period.as_nanos())]);
        }
        let mut word = |name: &str, value: Option<clap::builder::PossibleValue>| {
            if let Some(value) = value {
                arguments.extend([name.to_owned(), value.get_name().to_owned()]);
            }
        };
        word("--link", self.link.and_then(|link| link.to_possible_value()));
        word("--security", self.security.and_then(|security| security.to_possible_value()));
        word("--mode", self.mode.and_then(|mode| mode.to_possible_value()));
        word("--schedule", self.schedule.and_then(|schedule| schedule.to_possible_value()));
        arguments
    }
}

/// `500kB`, `200MB`, `1GB`.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let units = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12)];
    let parsed = units.iter().find_map(|(unit, bytes)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * bytes)
    });
    match parsed {
        Some(size) if (1e5..1e16).contains(&size) => Ok(size as u64),
        _ => Err(format!(
            "{text:?} is not a size: expected at least 100kB with a unit, such as 200MB or 1GB"
        )),
    }
}

/// `127.0.0.1:7480`.
pub(crate) fn parse_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        format!(
            "{text:?} is not an address: expected a numeric host and a port, such as 127.0.0.1:7480"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        let check = |text, expected| assert_eq!(parse_size(text).ok(), expected, "{text}");
        check("200MB", Some(200_000_000));
        check("1.5 GB", Some(1_500_000_000));
        check("100kB", Some(100_000));
        for text in ["99kB", "200", "MB", "-1GB", "nanMB", "1e9GB"] {
            check(text, None);
        }
    }
}
