//! The code, and the call of it.

use cranelift_codegen::ir::{AbiParam, InstBuilder, UserFuncName};
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Module, ModuleError, default_libcall_names};
use understudy_logic::Circuit;

use crate::emit::{Emitter, Homes};
use crate::frame::Frame;
use crate::plan::{Copy, Places, Plan, Statement};

/// Statements of one function: a register allocator takes longer than linear time for one function.
const STATEMENTS: usize = 256;

/// Words that an instruction can reach from the start of the frame.
const MAXIMUM_WORDS: usize = 1 << 27;

/// Why there is no machine code.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MachineError {
    /// Cranelift makes no code for this kind of processor.
    #[error("U0461: there is no code generator for this processor: {0}")]
    Processor(String),
    /// The circuit has too many values.
    #[error(
        "U0462: the circuit has {words} values, and machine code reaches {MAXIMUM_WORDS}; split the program"
    )]
    TooLarge {
        /// Values.
        words: usize,
    },
    /// No executable memory, as on a system that forbids it.
    #[error("U0463: the code could not be made executable: {0}")]
    Memory(String),
}

impl MachineError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Processor(_) => "U0461",
            Self::TooLarge { .. } => "U0462",
            Self::Memory(_) => "U0463",
        }
    }
}

impl From<ModuleError> for MachineError {
    fn from(error: ModuleError) -> Self {
        Self::Memory(error.to_string())
    }
}

type Step = unsafe extern "C" fn(*mut u64);

/// A compiled circuit.
pub struct Machine {
    /// In this order they are one step.
    steps: Vec<Step>,
    /// Owns the memory of `steps`; taken out when the machine is dropped.
    module: Option<JITModule>,
    /// How a run begins: x(0) in all lanes, everything else 0.
    start: Frame,
    code_bytes: usize,
}

impl std::fmt::Debug for Machine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = formatter.debug_struct("Machine");
        shown.field("code_bytes", &self.code_bytes).finish()
    }
}

impl Machine {
    /// Compiles what the roots of `circuit` reach.
    ///
    /// # Errors
    /// There is no code generator for the processor, the circuit is too large, or the system gives no executable memory.
    pub fn new(circuit: &Circuit) -> Result<Self, MachineError> {
        let plan = Plan::new(circuit);
        let places = Places::of(circuit);
        let words = plan.words;
        if words > MAXIMUM_WORDS {
            return Err(MachineError::TooLarge { words });
        }
        let builder = JITBuilder::with_isa(target()?, default_libcall_names());
        let mut compiler = Compiler {
            module: JITModule::new(builder),
            places: &places,
            homes: Homes::new(),
            plan: &plan,
            functions: Vec::new(),
            code_bytes: 0,
        };
        for copies in plan.first.chunks(STATEMENTS) {
            compiler.function(copies, &[])?;
        }
        for statements in plan.statements.chunks(STATEMENTS) {
            compiler.function(&[], statements)?;
        }
        for copies in plan.last.chunks(STATEMENTS) {
            compiler.function(copies, &[])?;
        }
        let mut module = compiler.module;
        module.finalize_definitions()?;
        let functions = compiler.functions.iter();
        let steps = functions.map(|&function| {
            let code = module.get_finalized_function(function);
            // SAFETY: `code` is the start of a finalized function of the signature that `Compiler::function` gives to all of them: one pointer
            // in, nothing out, in the calling convention of C on this host. It lives as long as `module`, which stands beside it.
            unsafe { std::mem::transmute::<*const u8, Step>(code) }
        });
        let mut start = vec![0; words.max(1)];
        for (place, register) in circuit.registers().iter().enumerate() {
            start[places.registers + place] = u64::from(register.initial).wrapping_neg();
        }
        Ok(Self {
            steps: steps.collect(),
            start: Frame {
                words: start,
                registers: places.registers,
                outputs: places.outputs,
                temporary: places.temporary,
            },
            code_bytes: compiler.code_bytes,
            module: Some(module),
        })
    }

    /// A run before its first step, 64 times the same.
    pub fn frame(&self) -> Frame {
        self.start.clone()
    }

    /// Bytes of machine code of one step.
    pub fn code_bytes(&self) -> usize {
        self.code_bytes
    }

    /// One step: reads u, replaces x(t) by x(t+1), writes y(t).
    ///
    /// # Panics
    /// If the frame is of a machine with another number of values.
    pub fn step(&self, frame: &mut Frame) {
        let words = &mut frame.words;
        assert_eq!(
            words.len(),
            self.start.words.len(),
            "a frame of this machine"
        );
        for step in &self.steps {
            // SAFETY: the code was made by `Emitter`, which reads and writes words of the frame below `Plan::words` only, has no loop, calls nothing
            // and traps nowhere. The frame has exactly that many words (asserted above) and is borrowed mutably. The memory of the code is
            // mapped until `self.module` is freed, which only `drop` does.
            unsafe { step(words.as_mut_ptr()) }
        }
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        self.steps.clear();
        if let Some(module) = self.module.take() {
            // SAFETY: no pointer into the code is left: `steps` was private to this machine and is empty, and `step` borrows the machine.
            unsafe { module.free_memory() }
        }
    }
}

/// Code for the processor that this runs on. The plan has done what an optimiser would do, and trees need none.
fn target() -> Result<OwnedTargetIsa, MachineError> {
    let mut flags = settings::builder();
    let wanted = [
        ("opt_level", "none"),
        ("regalloc_algorithm", "backtracking"),
        ("enable_verifier", "false"),
        ("enable_probestack", "false"),
        ("unwind_info", "false"),
        ("use_colocated_libcalls", "false"),
        ("is_pic", "false"),
    ];
    let wrong = |error: &dyn std::fmt::Display| MachineError::Processor(error.to_string());
    for (name, value) in wanted {
        flags.set(name, value).map_err(|error| wrong(&error))?;
    }
    let host = cranelift_native::builder().map_err(|error| wrong(&error))?;
    let isa = host.finish(settings::Flags::new(flags));
    isa.map_err(|error| wrong(&error))
}

struct Compiler<'a> {
    module: JITModule,
    places: &'a Places,
    homes: Homes,
    plan: &'a Plan<'a>,
    functions: Vec<FuncId>,
    code_bytes: usize,
}

impl Compiler<'_> {
    /// A function of the frame that does some copies and statements.
    fn function(&mut self, copies: &[Copy], statements: &[Statement]) -> Result<(), MachineError> {
        let mut context = self.module.make_context();
        let pointer = self.module.target_config().pointer_type();
        context.func.signature.params.push(AbiParam::new(pointer));
        let signature = context.func.signature.clone();
        let function = self.module.declare_anonymous_function(&signature)?;
        context.func.name = UserFuncName::user(0, function.as_u32());
        let mut scratch = FunctionBuilderContext::new();
        let mut builder = FunctionBuilder::new(&mut context.func, &mut scratch);
        let block = builder.create_block();
        builder.append_block_params_for_function_params(block);
        builder.switch_to_block(block);
        builder.seal_block(block);
        let frame = builder.block_params(block)[0];
        let graph = self.plan.circuit.graph();
        let mut emitter = Emitter::new(graph, self.places, &mut self.homes, &mut builder, frame);
        for copy in copies {
            emitter.copy(copy);
        }
        for statement in statements {
            emitter.statement(statement);
        }
        builder.ins().return_(&[]);
        builder.finalize(self.module.target_config());
        self.module.define_function(function, &mut context)?;
        let code = context.compiled_code();
        self.code_bytes += code.map_or(0, |code| code.code_buffer().len());
        self.functions.push(function);
        Ok(())
    }
}
