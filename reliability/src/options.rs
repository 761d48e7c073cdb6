//! Options of a reliability calculation, from the command line or a cluster file, and the resulting system.

use serde::Serialize;

use crate::boxes::UnequalBoxes;
use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::parts::{FieldDevices, Networks, RemoteIos, SharedPart, chain_of_parts};
use crate::quantity::{Hours, Probability};
use crate::system::{BoxKind, CommonCause, CommonCauseConvention, Rule, System};

/// Options of `understudy reliability`, as they are given; [`Options::system`] checks them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// N
    pub controllers: u32,
    /// Understudies of each group, S.
    pub spares: u32,
    /// Groups that share no understudy.
    pub groups: u32,
    /// The rule by which a group fails.
    pub rule: Rule,
    /// Mean time between failures of each station.
    pub mtbf: Hours,
    /// Mean time to repair each station, from the detection of its failure.
    pub mttr: Hours,
    /// Stations with times of their own; all others have the times above.
    pub unequal: Vec<UnequalBoxes>,
    /// Repair crews; nothing: one for each box.
    pub crews: Option<u32>,
    /// Probability that a failure is masked.
    pub coverage: f64,
    /// Mean time to detect a failure.
    pub detection: Option<Hours>,
    /// Common-cause factor β: share of failures that affect all stations.
    pub beta: f64,
    /// Convention for β.
    pub convention: CommonCauseConvention,
    /// Parts that everything depends on.
    pub shared: Vec<SharedPart>,
    /// Remote I/Os with their twins; nothing: they do not fail.
    pub remote_ios: Option<RemoteIos>,
    /// Field devices; nothing: they do not fail.
    pub field_devices: Option<FieldDevices>,
    /// Networks; nothing: they do not fail.
    pub networks: Option<Networks>,
    /// Mission time.
    pub mission: Option<Hours>,
}

impl Options {
    /// One understudy, a crew each, perfect coverage, nothing shared.
    pub fn new(controllers: u32, mtbf: Hours, mttr: Hours) -> Self {
        Self {
            controllers,
            spares: 1,
            groups: 1,
            rule: Rule::AsBuilt,
            mtbf,
            mttr,
            unequal: Vec::new(),
            crews: None,
            coverage: 1.0,
            detection: None,
            beta: 0.0,
            convention: CommonCauseConvention::Additive,
            shared: Vec::new(),
            remote_ios: None,
            field_devices: None,
            networks: None,
            mission: None,
        }
    }

    /// The cluster as it is built.
    ///
    /// # Errors
    /// Everything that is wrong with the options.
    pub fn system(&self) -> Result<System, Vec<ReliabilityError>> {
        let coverage = Probability::new("the coverage", self.coverage);
        let beta = Probability::new("the share beta of common causes", self.beta);
        let mut errors: Vec<ReliabilityError> =
            [&coverage, &beta].into_iter().filter_map(|found| found.clone().err()).collect();
        let kind = |name: &str, count, mtbf, mttr| BoxKind { name: name.into(), count, mtbf, mttr };
        let apart = || self.unequal.iter().filter(|boxes| !boxes.understudies);
        let apart_count: u64 = apart().map(|boxes| u64::from(boxes.count)).sum();
        if apart_count > u64::from(self.controllers) {
            errors.push(ReliabilityError::Count {
                what: "the number of controllers with times of their own".into(),
                count: apart_count,
                minimum: 0,
                maximum: u64::from(self.controllers),
            });
        }
        let alike = u64::from(self.controllers).saturating_sub(apart_count);
        let mut controllers = Vec::new();
        if alike > 0 || apart_count == 0 {
            let alike = u32::try_from(alike).unwrap_or(u32::MAX);
            controllers.push(kind("controllers", alike, self.mtbf, self.mttr));
        }
        controllers
            .extend(apart().map(|boxes| kind(&boxes.name, boxes.count, boxes.mtbf, boxes.mttr)));
        let of_understudies = self.unequal.iter().find(|boxes| boxes.understudies);
        let (mtbf, mttr) =
            of_understudies.map_or((self.mtbf, self.mttr), |boxes| (boxes.mtbf, boxes.mttr));
        let shared = self.parts(&mut errors);
        let system = System {
            controllers,
            understudies: kind("understudies", self.spares, mtbf, mttr),
            groups: self.groups,
            rule: self.rule,
            crews: self.crews,
            coverage: coverage.unwrap_or(Probability::ONE),
            detection: self.detection,
            common_cause: beta
                .ok()
                .filter(|beta| beta.get() > 0.0)
                .map(|beta| CommonCause { beta, convention: self.convention }),
            shared,
        };
        if let Err(found) = system.check() {
            errors.extend(found);
        }
        if errors.is_empty() { Ok(system) } else { Err(errors) }
    }
}

impl Options {
    /// All parts in series with the stations. Errors are added to `errors`.
    fn parts(&self, errors: &mut Vec<ReliabilityError>) -> Vec<SharedPart> {
        let mut parts = self.shared.clone();
        let devices = self.field_devices.as_ref();
        parts.extend(self.remote_ios.iter().flat_map(|them| them.parts(devices, errors)));
        let remote_ios_fail = self.remote_ios.is_some();
        parts.extend(devices.iter().flat_map(|them| them.parts(remote_ios_fail, errors)));
        parts.extend(self.networks.iter().map(|them| them.part(self.groups, errors)));
        parts
    }

    /// Chain of the parts in series with the stations, as if stations did not fail; nothing where there are none.
    ///
    /// # Errors
    /// Everything that is wrong with the parts.
    pub fn parts_chain(&self) -> Result<Option<Chain>, Vec<ReliabilityError>> {
        let mut errors = Vec::new();
        let parts = self.parts(&mut errors);
        if !errors.is_empty() {
            return Err(errors);
        }
        if parts.is_empty() { Ok(None) } else { chain_of_parts(&parts).map(Some) }
    }

    /// Whether anything but stations fails that a cell has of its own.
    pub fn is_whole_cell(&self) -> bool {
        self.remote_ios.is_some() || self.field_devices.is_some() || self.networks.is_some()
    }

    /// Boxes that are no stations: remote I/Os with their twins, field devices, and one switch for each network, as far as their times are given.
    pub fn other_boxes(&self) -> u32 {
        let networks = self.networks.map_or(0, |them| them.count.saturating_mul(self.groups));
        let devices = self.field_devices.map_or(0, |them| them.boxes());
        let remote_ios = self.remote_ios.map_or(0, |them| them.boxes());
        remote_ios.saturating_add(devices).saturating_add(networks)
    }
}

impl System {
    /// The same stations in paper mode, with one understudy: S2 after any second failure, (14).
    pub fn as_paper(&self) -> Self {
        let mut paper = self.clone();
        paper.rule = Rule::Paper;
        paper.groups = 1;
        paper.understudies.count = 1;
        paper
    }

    /// The controllers alone.
    pub fn as_simplex(&self) -> Self {
        let mut simplex = self.clone();
        simplex.rule = Rule::AsBuilt;
        simplex.groups = 1;
        simplex.understudies.count = 0;
        simplex
    }
}
