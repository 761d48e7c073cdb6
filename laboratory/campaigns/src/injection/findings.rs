//! What a campaign found: `campaign.json`.

use std::fmt::{self, Write as _};

use serde::{Deserialize, Serialize};
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_journal::Members;
use understudy_scenarios::write;
use understudy_simulator::Tally;

use super::coverage::{Coverage, CoverageRow};
use super::kind::{Kind, Phase};
use super::minimise::Violating;
use super::seeds::Seeds;
use super::{Count, InjectionPlan};

/// Version of `campaign.json`.
const FORMAT: u32 = 2;

/// Failures that are listed for people, at most.
const LISTED_FAILURES: usize = 20;

/// The whole of `campaign.json`. It holds no time and no name of a machine: equal campaigns have equal findings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    /// Of this format: 2.
    pub format: u32,
    /// The cluster's name.
    pub cluster: String,
    /// Hash of all programs, roles and timings.
    pub configuration: String,
    /// `full` or `paper`.
    pub mode: String,
    /// What was asked for; of several seeds, the plan of each, with the seed 0.
    pub plan: InjectionPlan,
    /// Seeds of which runs were made.
    pub seeds: Seeds,
    /// Runs that the shard or the seeds asked for; fewer were made where the time ran out.
    pub runs_asked: u64,
    /// Runs that were made.
    pub runs_made: u64,
    /// Runs in which the property did not hold.
    pub runs_failed: u64,
    /// Deadlines of all remote I/Os in all runs.
    pub deadlines: Deadlines,
    /// Kind × role × phase of what was injected.
    pub coverage: Vec<CoverageRow>,
    /// Failed runs, each made small. Of one seed those with the lowest numbers, at most [`super::MAXIMUM_FAILURES`]; of a store the smallest and the
    /// fastest one for each set of kinds of faults.
    pub failures: Vec<Failure>,
}

/// Deadlines by what was applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Deadlines {
    /// From the controller itself.
    pub direct: u64,
    /// By (12).
    pub reconstructed: u64,
    /// The last true output.
    pub held: u64,
    /// The configured values.
    pub fail_safe: u64,
}

impl Deadlines {
    pub(super) fn count(&mut self, tally: &Tally) {
        self.direct += tally.direct;
        self.reconstructed += tally.reconstructed;
        self.held += tally.held;
        self.fail_safe += tally.fail_safe;
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.direct += other.direct;
        self.reconstructed += other.reconstructed;
        self.held += other.held;
        self.fail_safe += other.fail_safe;
    }
}

/// A run in which the property did not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Seed of the campaign.
    pub campaign_seed: u64,
    /// Its number in the campaign.
    pub run: u64,
    /// Kinds of the faults that are enough, ascending.
    pub kinds: Vec<Kind>,
    /// Faults that were drawn for it.
    pub faults_drawn: usize,
    /// Faults that are enough.
    pub faults: usize,
    /// Cycles that are enough.
    pub cycles: u64,
    /// The seed of the small run.
    pub seed: u64,
    /// Where it shows first, in the small run.
    pub cycle: u64,
    /// The member that it shows at; nothing where it is all of them.
    pub member: Option<String>,
    /// What shows.
    pub what: String,
    /// The small run as the text of a scenario file.
    pub scenario: String,
}

impl Failure {
    pub(super) fn new(
        cluster: &Cluster,
        plan: &InjectionPlan,
        run: u64,
        faults_drawn: usize,
        small: &Violating,
    ) -> Self {
        let members = Members::of(cluster);
        let title = format!("{} in run {run} of seed {}", plan.property.word(), plan.seed);
        let expect = plan.property.expectation();
        let mut scenario = small.faultload.scenario(title, small.cycles, small.seed, expect);
        scenario.spare_after = plan.spare_after;
        let remarks = [
            format!("Cycle {}: {}", small.symptom.cycle, small.symptom.what),
            format!(
                "Made small from a run of {} cycles with {faults_drawn} faults. `understudy simulate` repeats it with the seed below.",
                plan.cycles
            ),
        ];
        Self {
            campaign_seed: plan.seed,
            run,
            kinds: small.faultload.kinds(),
            faults_drawn,
            faults: small.faultload.size().0,
            cycles: small.cycles,
            seed: small.seed,
            cycle: small.symptom.cycle,
            member: small.symptom.member.map(|member| members.name(member).to_owned()),
            what: small.symptom.what.clone(),
            scenario: write(&scenario, &members, &remarks),
        }
    }

    /// The name of its scenario file.
    pub fn file_name(&self) -> String {
        format!("seed-{}-run-{}.toml", self.campaign_seed, self.run)
    }
}

/// A text that is no `campaign.json`.
#[derive(Debug, thiserror::Error)]
pub enum FindingsError {
    /// It is another kind of text.
    #[error("it is no campaign.json: {0}")]
    Json(#[from] serde_json::Error),
    /// It was written by another version.
    #[error("it has format {found}, and {FORMAT} is expected")]
    Format {
        /// The version that it says.
        found: u32,
    },
}

impl Findings {
    pub(super) fn new(
        cluster: &Cluster,
        plan: &InjectionPlan,
        count: Count,
        failures: Vec<Failure>,
    ) -> Self {
        let agreement = cluster.agreement();
        Self {
            format: FORMAT,
            cluster: cluster.name().to_owned(),
            configuration: agreement.configuration.to_string(),
            mode: match agreement.mode {
                Mode::Full => "full",
                Mode::Paper => "paper",
            }
            .to_owned(),
            plan: plan.clone(),
            seeds: Seeds::range(plan.seed, plan.seed),
            runs_asked: plan.shard.share(plan.runs),
            runs_made: count.runs,
            runs_failed: count.failed,
            deadlines: count.deadlines,
            coverage: count.coverage.into_rows(),
            failures,
        }
    }

    /// The same without any run.
    pub(super) fn emptied(&self) -> Self {
        Self {
            seeds: Seeds::default(),
            runs_asked: 0,
            runs_made: 0,
            runs_failed: 0,
            deadlines: Deadlines::default(),
            coverage: Coverage::of(&self.plan.kinds).into_rows(),
            failures: Vec::new(),
            ..self.clone()
        }
    }

    /// Adds the runs of another part of the campaign.
    pub(super) fn add(&mut self, other: Self) {
        self.seeds.add(&other.seeds);
        self.runs_asked += other.runs_asked;
        self.runs_made += other.runs_made;
        self.runs_failed += other.runs_failed;
        self.deadlines.add(&other.deadlines);
        let mut coverage = Coverage::of(&self.plan.kinds);
        coverage.add(&self.coverage);
        coverage.add(&other.coverage);
        self.coverage = coverage.into_rows();
        self.failures.extend(other.failures);
    }

    /// Reads the text of a `campaign.json`.
    ///
    /// # Errors
    /// [`FindingsError`] where it is another kind of text.
    pub fn parse(text: &str) -> Result<Self, FindingsError> {
        let findings: Self = serde_json::from_str(text)?;
        if findings.format == FORMAT {
            Ok(findings)
        } else {
            Err(FindingsError::Format { found: findings.format })
        }
    }

    /// The text of `campaign.json`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Whether every run that was asked for was made, and none failed.
    pub fn is_good(&self) -> bool {
        self.runs_failed == 0 && self.runs_made == self.runs_asked
    }

    /// What was injected, as a table.
    pub fn coverage_text(&self) -> String {
        let mut text = format!("{:18}{:12}", "fault", "role");
        for phase in Phase::ALL {
            let _ = write!(text, "{:>13}", phase.word());
        }
        text.push('\n');
        for row in &self.coverage {
            let _ = write!(text, "{:18}{:12}", row.kind, row.role);
            for count in row.counts {
                let _ = write!(text, "{count:>13}");
            }
            text.push('\n');
        }
        text
    }
}

/// For people.
impl fmt::Display for Findings {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { plan, deadlines, .. } = self;
        let shard = match plan.shard {
            super::Shard::WHOLE => String::new(),
            shard => format!(" of shard {shard}"),
        };
        writeln!(
            formatter,
            "{} of {} runs{shard} of {} cycles on {} (mode {}), {}\n",
            self.runs_made, self.runs_asked, plan.cycles, self.cluster, self.mode, self.seeds
        )?;
        writeln!(formatter, "{}", self.coverage_text())?;
        let total =
            deadlines.direct + deadlines.reconstructed + deadlines.held + deadlines.fail_safe;
        let share = |count: u64| 100.0 * count as f64 / total.max(1) as f64;
        let parts = [
            ("direct", deadlines.direct),
            ("reconstructed", deadlines.reconstructed),
            ("held", deadlines.held),
            ("fail-safe", deadlines.fail_safe),
        ];
        for (word, count) in parts {
            writeln!(formatter, "{word:15}{count:>14} deadlines, {:.3} %", share(count))?;
        }
        writeln!(
            formatter,
            "\n{}: {} of {} runs",
            plan.property.word(),
            self.runs_failed,
            self.runs_made
        )?;
        for failure in self.failures.iter().take(LISTED_FAILURES) {
            let member = failure.member.as_deref().unwrap_or("all");
            let seed = match self.seeds.count() {
                1 => String::new(),
                _ => format!("seed {}, ", failure.campaign_seed),
            };
            writeln!(
                formatter,
                "  {seed}run {}: {} of {} faults and {} cycles are enough; cycle {}, {member}: {}",
                failure.run,
                failure.faults,
                failure.faults_drawn,
                failure.cycles,
                failure.cycle,
                failure.what
            )?;
        }
        let listed = self.failures.len().min(LISTED_FAILURES) as u64;
        if self.runs_failed > listed {
            writeln!(formatter, "  and {} more", self.runs_failed - listed)?;
        }
        Ok(())
    }
}
