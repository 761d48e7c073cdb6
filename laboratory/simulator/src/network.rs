//! What the network does to a frame on its way to one receiver.

use std::ops::Range;
use std::time::Duration;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use understudy_wire::Via;

/// The same for every pair of members.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// The least time that a frame is on its way.
    pub latency: Duration,
    /// Drawn evenly from 0 to this and added, for each receiver: frames overtake each other.
    pub jitter: Duration,
    /// Share of frames that do not arrive, from 0 to 1, for each receiver.
    pub loss: f64,
    /// Share of frames that arrive twice, from 0 to 1, for each receiver.
    pub duplicate: f64,
    /// Share of arriving frames of which a bit has flipped on their way, from 0 to 1, for each receiver.
    #[serde(default)]
    pub corruption: f64,
    /// The path that is so, while the others are quiet; all networks where absent, and the direct links are quiet then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over: Option<Via>,
}

/// A network that is another one for a while.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Disturbance {
    /// What it is then; before and after it is the usual one.
    pub network: Network,
    /// The scenario's cycles in which frames are sent over it; nothing for the whole run, coming into step included.
    pub cycles: Option<Range<u64>>,
}

impl Disturbance {
    /// Whether a frame that is sent in `cycle` goes over it.
    pub(crate) fn holds(&self, cycle: Option<u64>) -> bool {
        match (&self.cycles, cycle) {
            (None, _) => true,
            (Some(cycles), Some(cycle)) => cycles.contains(&cycle),
            (Some(_), None) => false,
        }
    }
}

impl Default for Network {
    /// A quiet local network: 100 µs, and nothing is lost.
    fn default() -> Self {
        Self {
            latency: Duration::from_micros(100),
            jitter: Duration::ZERO,
            loss: 0.0,
            duplicate: 0.0,
            corruption: 0.0,
            over: None,
        }
    }
}

impl Network {
    /// What one of several paths is.
    pub(crate) fn at(self, via: Via) -> Self {
        let is_so = self.over.map_or(via != Via::Link, |over| over == via);
        if is_so { self } else { Self::default() }
    }

    /// Whether all receivers hear a frame at the same time, and surely.
    pub(crate) fn is_even(&self) -> bool {
        let shares = [self.loss, self.duplicate, self.corruption];
        self.jitter.is_zero() && shares.iter().all(|&share| share <= 0.0)
    }

    /// The delays with which a frame reaches one receiver: none if it is lost, two if it is duplicated.
    pub fn arrivals(&self, random: &mut Pcg64Mcg) -> impl Iterator<Item = Duration> + use<> {
        let mut arrival = |share: f64| {
            let arrives = random.random::<f64>() < share;
            let jitter = self.jitter.mul_f64(random.random::<f64>());
            arrives.then(|| self.latency + jitter)
        };
        let first = arrival(1.0 - self.loss);
        let second = arrival(self.duplicate).filter(|_| first.is_some());
        first.into_iter().chain(second)
    }
}
