//! The configurations that programs have in one run, one after the other, and the cluster with some of their programs.

use std::sync::Arc;

use understudy_cycle::OnlineChange;
use understudy_executable::Interface;
use understudy_wire::{ConfigurationHash, ProgramHash, ProgramId};

use super::ChangeTexts;
use crate::cluster::{Cluster, Controller};

/// The configurations of one run: that with which it began, and those that online changes were to lead to.
#[derive(Debug, Clone)]
pub struct OnlineChanges {
    /// That with which it began, and the others in the order in which a change began or ended there last.
    clusters: Vec<Arc<Cluster>>,
}

/// Configurations of one run that are known, at most.
const MOST_CONFIGURATIONS: usize = 32;

impl OnlineChanges {
    /// The configurations of a run that begins with this cluster.
    pub fn of(cluster: Arc<Cluster>) -> Self {
        Self { clusters: vec![cluster] }
    }

    /// The next change; none where its texts are of no configuration that is known, and so were refused by its members.
    pub fn load(&mut self, texts: &ChangeTexts) -> Option<OnlineChange> {
        let place = self.clusters.iter().rposition(|it| texts.name().has(configuration(it)))?;
        let known = Arc::clone(&self.clusters[place]);
        let change = texts.load(&known).ok()?;
        let other = match configuration(&known) == texts.before {
            true => texts.after,
            false => texts.before,
        };
        let changed = self.clusters.iter().find(|it| configuration(it) == other).cloned();
        let changed = match changed {
            Some(changed) => changed,
            None => Arc::new(known.changed(texts, other).ok()?),
        };
        for used in [known, changed] {
            self.use_again(used);
        }
        Some(change)
    }

    fn use_again(&mut self, used: Arc<Cluster>) {
        let first = configuration(&self.clusters[0]);
        let own = configuration(&used);
        if own == first {
            return;
        }
        self.clusters.retain(|it| configuration(it) != own);
        self.clusters.push(used);
        if self.clusters.len() > MOST_CONFIGURATIONS {
            self.clusters.remove(1);
        }
    }

    /// That with which it began.
    pub fn first(&self) -> &Arc<Cluster> {
        &self.clusters[0]
    }

    /// The controller of a program where that is the one with this hash.
    pub fn controller(&self, program: ProgramId, hash: ProgramHash) -> Option<&Controller> {
        self.cluster_with(program, hash)?.controllers().get(program.index())
    }

    /// The newest configuration in which a program is the one with this hash.
    pub fn cluster_with(&self, program: ProgramId, hash: ProgramHash) -> Option<&Arc<Cluster>> {
        let has_it = |cluster: &&Arc<Cluster>| {
            let controller = cluster.controllers().get(program.index());
            controller.is_some_and(|controller| controller.hash == hash)
        };
        self.clusters.iter().rev().find(has_it)
    }
}

fn configuration(cluster: &Cluster) -> ConfigurationHash {
    cluster.agreement().configuration
}

impl Cluster {
    /// The same cluster with a program of another configuration, with its points and what its remote I/O does with them: for views of a run in which the
    /// programs change one after the other. It has the agreement and the texts of this one.
    #[must_use]
    pub fn with_program_of(&self, other: &Self, program: ProgramId) -> Self {
        let place = program.index();
        let mut cluster = self.clone();
        let mut programs = cluster.programs.to_vec();
        if let (Some(own), Some(new)) =
            (cluster.controllers.get_mut(place), other.controllers.get(place))
        {
            own.code.clone_from(&new.code);
            own.interface.clone_from(&new.interface);
            own.hash = new.hash;
        }
        if let (Some(own), Some(new)) =
            (cluster.remote_ios.get_mut(place), other.remote_ios.get(place))
        {
            own.inputs.clone_from(&new.inputs);
            own.field.clone_from(&new.field);
            own.fallback.clone_from(&new.fallback);
        }
        if let (Some(own), Some(new)) = (programs.get_mut(place), other.programs.get(place)) {
            own.clone_from(new);
        }
        cluster.programs = programs.into();
        cluster
    }

    /// The same cluster without the inputs and outputs of a program, where they are not known: for the same views.
    #[must_use]
    pub fn without_points_of(&self, program: ProgramId) -> Self {
        let mut cluster = self.clone();
        if let Some(controller) = cluster.controllers.get_mut(program.index()) {
            controller.interface = Interface::default();
        }
        if let Some(remote_io) = cluster.remote_ios.get_mut(program.index()) {
            remote_io.inputs.clear();
        }
        cluster
    }
}
