//! Options of remote I/Os, field devices and networks of a cell.

use clap::Args;
use understudy_cluster::Cluster;
use understudy_reliability::{FieldDevices, Hours, Networks, Options, ReliabilityError, RemoteIos};

use super::Times;

/// What is in series with the stations.
#[derive(Debug, Args)]
pub(super) struct CellArguments {
    /// MTBF and MTTR of a remote I/O; without them remote I/Os do not fail
    #[arg(long, value_name = "MTBF,MTTR", allow_hyphen_values = true)]
    remote_io: Option<String>,
    /// Number of programs whose remote I/O has a twin, without a cluster file
    #[arg(
        long,
        value_name = "T",
        default_value_t = 0,
        requires = "remote_io",
        conflicts_with = "cluster"
    )]
    twins: u32,
    /// Probability that a twin takes over
    #[arg(
        long,
        value_name = "C",
        default_value_t = 1.0,
        allow_hyphen_values = true,
        requires = "remote_io"
    )]
    switchover: f64,
    /// MTBF and MTTR of a field device with its terminals; without them field devices do not fail
    #[arg(long, value_name = "MTBF,MTTR", allow_hyphen_values = true)]
    field_device: Option<String>,
    /// Number of twins with a field device of their own (wiring `parallel`), without a cluster file
    #[arg(
        long,
        value_name = "D",
        default_value_t = 0,
        requires = "field_device",
        conflicts_with = "cluster"
    )]
    parallel: u32,
    /// Probability that the failure of one of two field devices is masked
    #[arg(
        long,
        value_name = "C",
        default_value_t = 1.0,
        allow_hyphen_values = true,
        requires = "field_device"
    )]
    device_coverage: f64,
    /// MTBF and MTTR of a network; without them networks do not fail
    #[arg(long, value_name = "MTBF,MTTR", allow_hyphen_values = true)]
    network: Option<String>,
    /// Number of networks, 1 or 2, without a cluster file
    #[arg(
        long,
        value_name = "W",
        default_value_t = 1,
        requires = "network",
        conflicts_with = "cluster"
    )]
    networks: u32,
    /// Common-cause factor beta of the two of a pair: of a remote I/O and its twin, of their field devices, of two networks
    #[arg(long, value_name = "BETA", default_value_t = 0.0, allow_hyphen_values = true)]
    pair_beta: f64,
}

/// Times of remote I/Os, field devices and networks.
pub(super) struct CellTimes {
    remote_io: Option<MeanTimes>,
    field_device: Option<MeanTimes>,
    network: Option<MeanTimes>,
}

impl CellArguments {
    /// Reads the times; errors are noted in `times`.
    pub(super) fn read(&self, times: &mut Times) -> CellTimes {
        CellTimes {
            remote_io: times.parsed("remote-io", self.remote_io.as_slice()).pop(),
            field_device: times.parsed("field-device", self.field_device.as_slice()).pop(),
            network: times.parsed("network", self.network.as_slice()).pop(),
        }
    }
}

impl CellTimes {
    /// Sets the remote I/Os, field devices and networks of `options`; their numbers are those of the cluster, where there is one.
    pub(super) fn set(
        &self,
        arguments: &CellArguments,
        options: &mut Options,
        cluster: Option<&Cluster>,
    ) {
        let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let twins = cluster.map_or(arguments.twins, |cluster| count(cluster.twins().len()));
        let with_devices = |cluster: &Cluster| {
            let twins = cluster.remote_ios().iter().filter_map(|it| it.twin.as_ref());
            count(twins.filter(|twin| twin.is_parallel()).count())
        };
        let redundant = cluster.map_or(arguments.parallel, with_devices);
        let networks =
            cluster.map_or(arguments.networks, |cluster| 1 + u32::from(cluster.has_two_networks()));
        options.remote_ios = self.remote_io.map(|MeanTimes { mtbf, mttr }| RemoteIos {
            count: options.controllers,
            twins,
            mtbf,
            mttr,
            switchover: arguments.switchover,
            beta: arguments.pair_beta,
        });
        options.field_devices = self.field_device.map(|MeanTimes { mtbf, mttr }| FieldDevices {
            count: options.controllers,
            redundant,
            mtbf,
            mttr,
            coverage: arguments.device_coverage,
            beta: arguments.pair_beta,
        });
        options.networks = self.network.map(|MeanTimes { mtbf, mttr }| Networks {
            count: networks,
            mtbf,
            mttr,
            beta: arguments.pair_beta,
        });
    }
}

/// `MTBF,MTTR`
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeanTimes {
    pub(crate) mtbf: Hours,
    pub(crate) mttr: Hours,
}

impl std::str::FromStr for MeanTimes {
    type Err = ReliabilityError;

    fn from_str(text: &str) -> Result<Self, ReliabilityError> {
        let (mtbf, mttr) = text.split_once(',').ok_or_else(|| ReliabilityError::TimeText {
            text: text.to_owned(),
            why: "expected MTBF,MTTR, such as 20000h,24h".to_owned(),
        })?;
        Ok(Self { mtbf: mtbf.trim().parse()?, mttr: mttr.trim().parse()? })
    }
}
