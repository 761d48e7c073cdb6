//! What each member is told when it starts.

use std::collections::BTreeSet;
use std::sync::Arc;

use understudy_cycle::Mode;
use understudy_remote_io::{
    Channel, Layout, PairSettings, PointPlace, SharedOutputs, SignalSource,
};
use understudy_wire::{Image, Member, Moment, PointsHash, ProgramId, StationId};

use crate::canonical::points_hash;
use crate::cluster::{Cluster, RemoteIo, Twin};
use crate::undriven::initial_image;

impl Cluster {
    /// What a station is told when it starts; `founds` is the first moment of the epoch that it founds when it receives no
    /// other member.
    ///
    /// Nothing where the cluster has no such station.
    pub fn station_settings(
        &self,
        station: StationId,
        founds: Moment,
    ) -> Option<understudy_node::Settings> {
        self.member_name(Member::Station(station))?;
        let evaluates_generated =
            self.agreement.mode == Mode::Paper && self.agreement.schedule.is_understudy(station);
        Some(understudy_node::Settings {
            station,
            agreement: Arc::clone(&self.agreement),
            programs: Arc::clone(&self.programs),
            generated: self.generated().filter(|_| evaluates_generated).map(Arc::new),
            founds,
        })
    }

    /// The generated parity controller, on the first registers of the states that stations hold.
    fn generated(&self) -> Option<understudy_node::Generated> {
        let parity = self.parity.as_ref()?;
        let widths = parity.summands().iter().map(|summand| summand.registers.len());
        Some(understudy_node::Generated {
            executable: parity.circuit().into(),
            widths: widths.collect(),
        })
    }

    /// What a remote I/O is told when it starts; nothing where the cluster has no such program.
    pub fn remote_io_settings(&self, program: ProgramId) -> Option<understudy_remote_io::Settings> {
        let remote_io = self.remote_ios.get(program.index())?;
        let controller = &self.controllers[program.index()];
        Some(understudy_remote_io::Settings {
            program,
            agreement: Arc::clone(&self.agreement),
            hash: controller.hash,
            layout: Arc::new(self.layout(program)?),
            diagnosis: remote_io.diagnosis.as_ref().map(|it| Arc::clone(&it.compiled)),
            fallback: remote_io.fallback.clone(),
            pair: remote_io.twin.as_ref().map(|twin| PairSettings {
                wiring: twin.wiring,
                ..PairSettings::exclusive(twin.take_over_after)
            }),
            paired_inputs: remote_io
                .twin
                .as_ref()
                .map_or_else(Vec::new, |twin| twin.paired_inputs.clone()),
            shared_outputs: self.shared_outputs(program, remote_io),
        })
    }

    /// The points of a program; nothing where the cluster has no such program.
    pub fn layout(&self, program: ProgramId) -> Option<Layout> {
        let remote_io = self.remote_ios.get(program.index())?;
        let controller = self.controllers.get(program.index())?;
        let (inputs, outputs) = (&controller.interface.inputs, &controller.interface.outputs);
        Some(Layout {
            hash: self.points_hash(program)?,
            undriven: initial_image(inputs),
            input_points: inputs.iter().map(PointPlace::of).collect(),
            output_points: outputs.iter().map(PointPlace::of).collect(),
            operator_inputs: remote_io.operator_inputs().map(|it| it.input).collect(),
            signals: remote_io.signals().map(|signal| signal.input).collect(),
            signal_sources: self.signal_sources(remote_io),
            channels: Channel::of_inputs(&inputs.bit_names()),
            stop: controller.stop_points(),
        })
    }

    /// Identifies the points of a program, to its remote I/O; nothing where the cluster has no such program.
    pub fn points_hash(&self, program: ProgramId) -> Option<PointsHash> {
        Some(points_hash(&self.controllers.get(program.index())?.interface))
    }

    /// What the second remote I/O of a program is told when it starts; nothing where the program has none.
    pub fn twin_settings(&self, program: ProgramId) -> Option<understudy_remote_io::Settings> {
        let settings = self.remote_io_settings(program)?;
        let pair = PairSettings { is_twin: true, ..settings.pair? };
        Some(understudy_remote_io::Settings { pair: Some(pair), ..settings })
    }

    /// The programs whose signals a remote I/O reads.
    fn signal_sources(&self, remote_io: &RemoteIo) -> Vec<SignalSource> {
        let programs: BTreeSet<ProgramId> =
            remote_io.signals().map(|signal| signal.input.from).collect();
        let sources = programs.into_iter().map(|program| {
            let controller = &self.controllers[program.index()];
            SignalSource {
                program,
                outputs: controller.interface.outputs.width(),
                stopped: controller.stop_points().map(|points| points.stopped),
            }
        });
        sources.collect()
    }

    /// What a plant is told when it starts; nothing where the program has no simulated plant.
    pub fn plant_settings(&self, program: ProgramId) -> Option<understudy_plant::Settings> {
        let place = self.plants.get(program.index())?.as_ref()?;
        let remote_io = &self.remote_ios[program.index()];
        let has_two_modules = remote_io.twin.as_ref().is_some_and(Twin::is_parallel);
        let fail_safe = &remote_io.fallback.fail_safe;
        Some(understudy_plant::Settings {
            program,
            agreement: Arc::clone(&self.agreement),
            plant: place.plant.clone(),
            fed_by: place.fed_by,
            follows: place.follows.clone(),
            // Modules that are not driven are released.
            fail_safe: match has_two_modules {
                true => Image::zero(fail_safe.width()),
                false => fail_safe.clone(),
            },
            watchdog_cycles: place.watchdog_cycles,
            has_two_modules,
            shared_outputs: self.shared_outputs(program, remote_io),
        })
    }

    /// Numbers that two modules of a program share. The watchdog of a simulated plant is that of its modules, and may be longer than is needed.
    fn shared_outputs(&self, program: ProgramId, remote_io: &RemoteIo) -> SharedOutputs {
        let Some(twin) = &remote_io.twin else {
            return SharedOutputs::default();
        };
        let pair = PairSettings::exclusive(twin.take_over_after);
        let plant = self.plants.get(program.index()).and_then(Option::as_ref);
        let later = plant.map_or(0, |plant| plant.watchdog_cycles.saturating_sub(pair.lasting()));
        let shared = &twin.shared_outputs;
        SharedOutputs { places: shared.places.clone(), delay: shared.delay.max(later) }
    }
}
