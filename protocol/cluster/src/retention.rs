//! What the members of a cluster keep for the time after a power failure, and what that costs their disks.

use std::time::Duration;

use understudy_wire::{
    Cycle, Digest, Epoch, Image, Lineage, Moment, ProgramId, Retained, RetainedState, RetainedStep,
};

use crate::cluster::Cluster;

const DAY: Duration = Duration::from_secs(86_400);

impl Cluster {
    /// Whether a program of it has retentive variables.
    pub fn is_retentive(&self) -> bool {
        self.programs.iter().any(|program| program.executable.is_retentive())
    }

    /// Steps of a program with retentive variables after which a station writes its whole state to disk.
    pub fn retain_every(&self) -> u32 {
        let period = self.agreement.schedule.period().as_nanos().max(1);
        u32::try_from(self.retain_every.as_nanos().div_ceil(period)).unwrap_or(u32::MAX).max(1)
    }

    /// Bytes that each station which runs a program writes to its files in a day, at most; `None` of a program without retentive variables.
    pub fn retained_bytes_a_day(&self, program: ProgramId) -> Option<u64> {
        let compiled = self.programs.get(program.index())?;
        let executable = &compiled.executable;
        if !executable.is_retentive() {
            return None;
        }
        // The widest numbers, and the widest values.
        let (lineage, stepped) =
            (Lineage(u64::MAX), Moment { epoch: Epoch(u64::MAX), cycle: Cycle(u64::MAX) });
        let image = |width: usize| Image::from_bits((0..width).map(|_| true));
        let step = Retained::Step(RetainedStep {
            program,
            stepped,
            inputs: image(executable.input_count()),
            after: lineage,
        });
        let state = Retained::State(RetainedState {
            cluster: self.agreement.cluster,
            program,
            hash: compiled.hash,
            number: u64::MAX,
            born: stepped,
            lineage,
            stepped,
            digest: Digest(u64::MAX),
            state: image(executable.state_count()),
        });
        let bytes = |record: Retained| {
            let mut bytes = Vec::new();
            record.write(&mut bytes);
            bytes.len() as u128
        };
        let steps = DAY.as_nanos() / self.agreement.schedule.period().as_nanos().max(1);
        let states = steps / u128::from(self.retain_every());
        u64::try_from(steps * bytes(step) + states * bytes(state)).ok()
    }
}
