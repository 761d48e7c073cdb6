//! What is asked of a campaign, and the plan that answers it.

use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_reliability::{
    Hours, MAXIMUM_ACCELERATION, Networks, Options, ReliabilityError, RemoteIos, Rule, System,
    UNDERSTUDIES, UnequalBoxes, acceleration_bias, grouped,
};
use understudy_wire::Member;

use super::{CampaignPlan, PartTimes};

/// Cycles of a mean repair, where nobody says how fast the campaign is.
const CYCLES_OF_A_REPAIR: f64 = 50.0;

/// Cycles of a campaign in virtual time, at most: above, more than an hour.
const MAXIMUM_CAMPAIGN_CYCLES: f64 = 1e9;

/// A replica that takes so many times its expectation is given up.
const PATIENCE: f64 = 1000.0;

/// How much faster than the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// So many times.
    Factor(f64),
    /// So that a mean repair takes so many cycles.
    CyclesPerRepair(f64),
    /// So that a mean repair takes 50 cycles, but 10,000 times at most and never slower than the plant.
    Usual,
}

/// What is asked of a campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Question {
    /// Mean time between failures of a station.
    pub mtbf: Hours,
    /// Mean time to repair one, from its detection on.
    pub mttr: Hours,
    /// MTBF and MTTR of a remote I/O; nothing: they do not fail.
    pub remote_io: Option<(Hours, Hours)>,
    /// MTBF and MTTR of a network; nothing: they do not fail.
    pub network: Option<(Hours, Hours)>,
    /// Stations that are repaired at the same time, at most.
    pub crews: Option<u32>,
    /// Failures of the system to wait for.
    pub failures: u64,
    /// Of all chance.
    pub seed: u64,
    /// How much faster than the plant.
    pub speed: Speed,
    /// Whether it may be faster than is sensible, and take for hours.
    pub forced: bool,
}

/// Why a campaign is not begun.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuestionError {
    /// A number of the question.
    #[error(transparent)]
    Reliability(#[from] ReliabilityError),
    /// It would take for hours.
    #[error(
        "U0609: this campaign needs about {} cycles, and more than {} take hours; ask for fewer failures, \
         accelerate more, or take an MTBF nearer to the MTTR (force it if that is wanted)",
        grouped(*.cycles),
        grouped(MAXIMUM_CAMPAIGN_CYCLES)
    )]
    TooLong {
        /// So many are expected.
        cycles: f64,
    },
}

impl QuestionError {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Reliability(error) => error.code(),
            Self::TooLong { .. } => "U0609",
        }
    }
}

/// A question with the model that its answer is held against.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// What is done.
    pub plan: CampaignPlan,
    /// The plant's boxes, for a report.
    pub options: Options,
    /// The model, without the protocol's own time.
    pub system: System,
    /// Its MTTF.
    pub closed_form_hours: f64,
    /// The cluster's period.
    pub period_hours: f64,
    /// Whether any acceleration is allowed.
    pub forced: bool,
}

/// Plans the campaign that answers `question` about `cluster`.
///
/// # Errors
/// Everything that is wrong with its numbers.
pub fn plan_campaign(
    cluster: &Cluster,
    question: &Question,
) -> Result<Planned, Vec<QuestionError>> {
    let all = |errors: Vec<ReliabilityError>| -> Vec<QuestionError> {
        errors.into_iter().map(QuestionError::from).collect()
    };
    let mut options = options_of(cluster, question.mtbf, question.mttr);
    options.crews = question.crews;
    options.remote_ios = question.remote_io.map(|times| remote_ios_of(cluster, times));
    options.networks = question.network.map(|times| networks_of(cluster, times));
    let system = options.system().map_err(all)?;
    let closed_form_hours =
        system.chain().and_then(|chain| chain.mttf().map_err(|error| vec![error])).map_err(all)?;
    let period_hours = cluster.agreement().schedule.period().as_secs_f64() / 3600.0;
    let by_cycles = |cycles: f64| question.mttr.get() / (cycles * period_hours);
    let factor = match question.speed {
        Speed::Factor(factor) => factor,
        Speed::CyclesPerRepair(cycles) => by_cycles(cycles),
        Speed::Usual => by_cycles(CYCLES_OF_A_REPAIR).clamp(1.0, MAXIMUM_ACCELERATION),
    };
    let period = Hours::new("the period", period_hours).map_err(|error| all(vec![error]))?;
    acceleration_bias(&system, period, factor, question.forced).map_err(all)?;
    let cycles = |hours: f64| hours / factor / period_hours;
    let times = |(mtbf, mttr): (Hours, Hours)| PartTimes {
        mtbf_cycles: cycles(mtbf.get()),
        mttr_cycles: cycles(mttr.get()),
    };
    let plan = CampaignPlan {
        mtbf_cycles: cycles(question.mtbf.get()),
        mttr_cycles: cycles(question.mttr.get()),
        crews: question.crews,
        acceleration: factor,
        failures: question.failures,
        seed: question.seed,
        maximum_cycles: (PATIENCE * cycles(closed_form_hours)).max(PATIENCE) as u64,
        remote_io: question.remote_io.map(times),
        network: question.network.map(times),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    Ok(Planned { plan, options, system, closed_form_hours, period_hours, forced: question.forced })
}

impl Planned {
    /// Refuses a campaign in virtual time that would take for hours, unless it is forced.
    ///
    /// # Errors
    /// [`QuestionError::TooLong`].
    pub fn check_length(&self) -> Result<(), QuestionError> {
        let each = self.closed_form_hours / self.plan.acceleration / self.period_hours;
        let cycles = each * self.plan.failures as f64;
        if cycles > MAXIMUM_CAMPAIGN_CYCLES && !self.forced {
            return Err(QuestionError::TooLong { cycles });
        }
        Ok(())
    }
}

/// Gives `boxes` to the plant of `options`; in a cluster they are stations by their names.
///
/// # Errors
/// A name that no station has, or twice the same.
pub fn set_unequal(
    options: &mut Options,
    cluster: Option<&Cluster>,
    boxes: Vec<UnequalBoxes>,
) -> Vec<ReliabilityError> {
    let mut errors = Vec::new();
    for mut boxes in boxes {
        let wrong = |why: String| ReliabilityError::BoxText { text: boxes.name.clone(), why };
        if options.unequal.iter().any(|known| known.name == boxes.name) {
            errors.push(wrong("its times are given twice".to_owned()));
            continue;
        }
        if let Some(cluster) = cluster
            && !boxes.understudies
        {
            let controllers = cluster.controllers().len();
            match cluster.member(&boxes.name) {
                Some(Member::Station(rank)) if rank.index() < controllers && boxes.count == 1 => {}
                Some(Member::Station(rank)) if rank.index() < controllers => {
                    errors.push(wrong("there is one of that name".to_owned()));
                    continue;
                }
                Some(Member::Station(_)) if cluster.lasting_understudies() == 1 => {
                    boxes.understudies = true;
                }
                Some(Member::Station(_)) => {
                    let why =
                        format!("understudies are alike: give the times of all as {UNDERSTUDIES}=");
                    errors.push(wrong(why));
                    continue;
                }
                _ => {
                    errors.push(wrong("no station of the cluster has that name".to_owned()));
                    continue;
                }
            }
        }
        options.unequal.push(boxes);
    }
    errors
}

/// The remote I/Os of a cluster with their twins.
fn remote_ios_of(cluster: &Cluster, (mtbf, mttr): (Hours, Hours)) -> RemoteIos {
    let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    let (all, twins) = (count(cluster.remote_ios().len()), count(cluster.twins().len()));
    RemoteIos { count: all, twins, mtbf, mttr, switchover: 1.0, beta: 0.0 }
}

/// The networks of a cluster.
fn networks_of(cluster: &Cluster, (mtbf, mttr): (Hours, Hours)) -> Networks {
    Networks { count: 1 + u32::from(cluster.has_two_networks()), mtbf, mttr, beta: 0.0 }
}

/// The boxes of a cluster, its mode, and the given times.
pub fn options_of(cluster: &Cluster, mtbf: Hours, mttr: Hours) -> Options {
    let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    let mut options = Options::new(count(cluster.controllers().len()), mtbf, mttr);
    options.spares = count(cluster.lasting_understudies());
    options.rule = match cluster.agreement().mode {
        Mode::Full => Rule::AsBuilt,
        Mode::Paper => Rule::Paper,
    };
    options
}
