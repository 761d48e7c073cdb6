//! One run, or 64 runs at once.

/// The words of a run of one [`Machine`](crate::Machine): word k of inputs, registers and outputs is element k, and bit l of it the run l.
#[derive(Debug, Clone)]
pub struct Frame {
    pub(crate) words: Vec<u64>,
    pub(crate) registers: usize,
    pub(crate) outputs: usize,
    pub(crate) temporary: usize,
}

impl Frame {
    /// u, to be set before a step.
    pub fn inputs(&mut self) -> &mut [u64] {
        &mut self.words[..self.registers]
    }

    /// x, which each step replaces.
    pub fn registers(&mut self) -> &mut [u64] {
        &mut self.words[self.registers..self.outputs]
    }

    /// y of the last step.
    pub fn outputs(&self) -> &[u64] {
        &self.words[self.outputs..self.temporary]
    }
}
