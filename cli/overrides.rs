//! What the command line says instead of the cluster file, and passes on to every process.

use std::net::SocketAddr;
use std::time::Duration;

use clap::{Args, ValueEnum};
use understudy_bus::LinkKind;
use understudy_cluster::{Link, Overrides, Security};
use understudy_wire::Mode;

#[derive(Debug, Clone, Default, Args)]
pub(crate) struct OverrideArguments {
    /// Period of a cycle in place of the cluster file's, such as 10ms
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    period: Option<Duration>,
    /// What carries the frames, in place of the cluster file's
    #[arg(long, value_enum)]
    link: Option<LinkArgument>,
    /// Who may speak, in place of the cluster file's
    #[arg(long, value_enum)]
    security: Option<SecurityArgument>,
    /// How many failures are masked, in place of the cluster file's
    #[arg(long, value_enum)]
    mode: Option<ModeArgument>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LinkArgument {
    /// Plain UDP
    Udp,
    /// Zenoh
    Zenoh,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SecurityArgument {
    /// Whoever has the keys of the cluster
    Keys,
    /// Everybody on the network
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModeArgument {
    /// Any number, as long as an understudy lives
    Full,
    /// One, as in the paper
    Paper,
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
        }
    }

    /// Whether the command line says the period.
    pub(crate) fn has_period(&self) -> bool {
        self.period.is_some()
    }

    /// The same with a period.
    pub(crate) fn with_period(&self, period: Duration) -> Self {
        Self {
            period: Some(period),
            ..self.clone()
        }
    }

    /// The same over the link that was asked for, or over each of them.
    pub(crate) fn each_link(&self) -> Vec<(LinkKind, Self)> {
        let links = [
            (LinkKind::Udp, LinkArgument::Udp),
            (LinkKind::Zenoh, LinkArgument::Zenoh),
        ];
        let asked = links
            .into_iter()
            .filter(|(_, link)| self.link.is_none_or(|asked| asked == *link));
        let over = asked.map(|(kind, link)| {
            let link = Some(link);
            (
                kind,
                Self {
                    link,
                    ..self.clone()
                },
            )
        });
        over.collect()
    }

    /// The same as arguments of another process.
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
        word(
            "--link",
            self.link.and_then(|link| link.to_possible_value()),
        );
        word(
            "--security",
            self.security
                .and_then(|security| security.to_possible_value()),
        );
        word(
            "--mode",
            self.mode.and_then(|mode| mode.to_possible_value()),
        );
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
            "{text:?} is no size of at least 100kB with its unit, such as 200MB or 1GB"
        )),
    }
}

/// `127.0.0.1:7480`.
pub(crate) fn parse_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        format!(
            "{text:?} is no address with its port, the host as a number, such as 127.0.0.1:7480"
        )
    })
}

/// `10ms`, `500us`, `2s`, `100ns`.
fn parse_time(text: &str) -> Result<Duration, String> {
    let expected = || format!("{text:?} is no time with its unit, such as 10ms, 500us or 1s");
    let unit = text
        .find(|letter: char| letter.is_ascii_alphabetic())
        .ok_or_else(expected)?;
    let (number, unit) = text.split_at(unit);
    let nanoseconds = match unit {
        "s" => 1e9,
        "ms" => 1e6,
        "us" => 1e3,
        "ns" => 1.0,
        _ => return Err(expected()),
    };
    let number: f64 = number.trim().parse().map_err(|_| expected())?;
    let time = number * nanoseconds;
    if (1.0..1e13).contains(&time) {
        Ok(Duration::from_nanos(time as u64))
    } else {
        Err(expected())
    }
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

    #[test]
    fn times_have_units() {
        let check = |text, expected| assert_eq!(parse_time(text).ok(), expected, "{text}");
        check("10ms", Some(Duration::from_millis(10)));
        check("1.5s", Some(Duration::from_millis(1500)));
        check("200 us", Some(Duration::from_micros(200)));
        check("10000000ns", Some(Duration::from_millis(10)));
        check("10", None);
        check("ms", None);
        check("-1s", None);
        check("1e99s", None);
        check("10min", None);
    }
}
