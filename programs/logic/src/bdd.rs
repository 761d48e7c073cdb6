//! Binary decision diagrams: canonical, so two functions of one [`Diagrams`] are equal exactly when their diagrams are.
//!
//! The diagrams are those of the library `oxidd`; no other module names its types. They are the plain ones: with complemented edges
//! version 0.13 keeps f ⊕ g and f ⊕ ¬g in the same place of its cache, where they evict each other, and sums, of which parity is
//! made, take exponential time. What is bounded is the number of nodes alive at once. Recursion is as deep as there are variables; past `SHALLOW` of them the work is done on the
//! deep stack that the library keeps for it.

mod reorder;

use std::collections::{HashMap, HashSet};

use oxidd::bdd::{BDDFunction, BDDManagerRef, new_manager};
use oxidd::util::{AllocResult, OptBool, SatCountCache};
use oxidd::{
    BooleanFunction, BooleanFunctionQuant, Function, FunctionSubst, HasWorkers, Manager,
    ManagerRef, Subst, Substitution as _, VarNo, WorkerPool,
};

use crate::expression::{Expression, Graph, Operation, Variable};
use reorder::Need;

/// So many variables are no danger to an ordinary stack.
const SHALLOW: usize = 500;

type Nodes<'id> = <BDDFunction as Function>::Manager<'id>;

/// What an operation of the library makes of diagrams.
macro_rules! operated {
    ($diagrams:ident, $operation:ident, $($operand:ident),+) => {
        $diagrams.made(|nodes| {
            let made = BDDFunction::$operation(nodes, $($operand.0.as_edge(nodes)),+)?;
            Ok(BDDFunction::from_edge(nodes, made))
        })
    };
}

/// Why a diagram could not be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BddError {
    /// Its nodes and those of the other diagrams pass the bound.
    #[error(
        "U0412: the decision diagram needs more than {limit} nodes; split the function or raise the bound"
    )]
    TooManyNodes {
        /// The bound that was set.
        limit: usize,
    },
    /// A variable that was not declared when the diagrams were set up.
    #[error("U0413: {0:?} is not among the variables of the decision diagrams")]
    UnknownVariable(Variable),
}

impl BddError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::TooManyNodes { .. } => "U0412",
            Self::UnknownVariable(_) => "U0413",
        }
    }
}

/// Diagrams over an order of variables, which stays as it is unless [`Diagrams::reordered_by_need`] was asked for.
pub struct Diagrams {
    manager: BDDManagerRef,
    variables: Vec<Variable>,
    numbers: HashMap<Variable, VarNo>,
    limit: usize,
    need: Option<Need>,
}

/// One function; equal to another of the same [`Diagrams`] exactly when the functions are equal.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Diagram(BDDFunction);

/// Functions in the place of variables, all at once. What is worked out under one substitution is remembered for the next use of it.
pub struct Substitution(Option<Subst<BDDFunction>>);

impl Diagrams {
    /// Nodes alive at once by default; about 100 MB when they are all in use.
    pub const DEFAULT_LIMIT: usize = 4_000_000;

    /// Diagrams over `order`, the top variable first, with at most `limit` nodes alive at once.
    pub fn new(order: impl IntoIterator<Item = Variable>, limit: usize) -> Self {
        Self::with_room(order, limit, limit)
    }

    /// With room for so many nodes, dead ones and those of unfinished results included.
    fn with_room(order: impl IntoIterator<Item = Variable>, limit: usize, room: usize) -> Self {
        let mut numbers = HashMap::new();
        let mut variables = Vec::new();
        for variable in order {
            numbers.entry(variable).or_insert_with(|| {
                variables.push(variable);
                variables.len() as VarNo - 1
            });
        }
        let cache = (limit / 8).clamp(1 << 8, 1 << 17);
        let manager = new_manager(room, cache, 1);
        manager.with_manager_exclusive(|manager| manager.add_vars(variables.len() as VarNo));
        Self { manager, variables, numbers, limit, need: None }
    }

    /// The same without any diagram yet, but the order changes between operations when the diagrams have grown, and when there is no node left; within an
    /// operation there may be twice as many. Verdicts are the same with and
    /// without; sizes, and which of several assignments is found, are not.
    #[must_use]
    pub fn reordered_by_need(self) -> Self {
        self.reordered(Need::new)
    }

    /// As [`Self::reordered_by_need`], but each time that the diagrams have doubled from a few thousand nodes on: for sets that stay small in a good
    /// order, and are given up where they do not.
    #[must_use]
    pub fn reordered_early(self) -> Self {
        self.reordered(Need::early)
    }

    /// Leaves the order as it is below this number of nodes, as far as there is room.
    pub fn expect(&self, nodes: usize) {
        if let Some(need) = &self.need {
            need.expect(nodes);
        }
    }

    fn reordered(self, need: impl FnOnce(usize) -> Need) -> Self {
        let limit = self.limit;
        let room = Need::room(limit);
        Self { need: Some(need(limit)), ..Self::with_room(self.variables, limit, room) }
    }

    /// Diagrams over the variables that `roots` depend on, in the order of [`depth_first_order`].
    pub fn for_roots(graph: &Graph, roots: &[Expression], limit: usize) -> Self {
        Self::new(depth_first_order(graph, roots), limit)
    }

    /// The declared variables, as they were declared: the top one first, as long as nothing was reordered.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Makes diagrams of expressions of `graph`, each variable renamed by `place`.
    pub fn builder<'a>(
        &'a self,
        graph: &'a Graph,
        place: impl Fn(Variable) -> Variable + Send + 'a,
    ) -> Builder<'a> {
        Builder { diagrams: self, graph, place: Box::new(place), made: HashMap::new() }
    }

    /// The diagram of one expression of `graph`.
    ///
    /// # Errors
    /// Too many nodes, or a variable that is not declared.
    pub fn of(&self, graph: &Graph, root: Expression) -> Result<Diagram, BddError> {
        self.builder(graph, |variable| variable).diagram(root)
    }

    /// 0 or 1.
    pub fn constant(&self, value: bool) -> Diagram {
        self.manager.with_manager_shared(|manager| {
            Diagram(if value { BDDFunction::t(manager) } else { BDDFunction::f(manager) })
        })
    }

    /// A declared variable.
    ///
    /// # Errors
    /// It is not declared, or there is no node left.
    pub fn variable(&self, variable: Variable) -> Result<Diagram, BddError> {
        let number = *self.numbers.get(&variable).ok_or(BddError::UnknownVariable(variable))?;
        self.made(|nodes| BDDFunction::var(nodes, number))
    }

    /// Negation.
    pub fn not(&self, operand: &Diagram) -> Result<Diagram, BddError> {
        operated!(self, not_edge, operand)
    }

    /// Logical product.
    pub fn and(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        operated!(self, and_edge, left, right)
    }

    /// Logical sum.
    pub fn or(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        operated!(self, or_edge, left, right)
    }

    /// Exclusive or.
    pub fn xor(&self, left: &Diagram, right: &Diagram) -> Result<Diagram, BddError> {
        operated!(self, xor_edge, left, right)
    }

    /// `one` where `condition` holds, `zero` elsewhere.
    ///
    /// # Errors
    /// Too many nodes.
    pub fn choose(
        &self,
        condition: &Diagram,
        one: &Diagram,
        zero: &Diagram,
    ) -> Result<Diagram, BddError> {
        operated!(self, ite_edge, condition, one, zero)
    }

    /// Whether the function is 1 for some value of each variable of the product `variables`.
    ///
    /// # Errors
    /// Too many nodes.
    pub fn exists(&self, diagram: &Diagram, variables: &Diagram) -> Result<Diagram, BddError> {
        operated!(self, exists_edge, diagram, variables)
    }

    /// The product of declared variables, for [`Self::exists`].
    ///
    /// # Errors
    /// One of them is not declared, or there is no node left.
    pub fn product(
        &self,
        variables: impl IntoIterator<Item = Variable>,
    ) -> Result<Diagram, BddError> {
        let one = self.constant(true);
        variables
            .into_iter()
            .try_fold(one, |product, variable| self.and(&product, &self.variable(variable)?))
    }

    /// Puts each function in the place of its variable.
    ///
    /// # Errors
    /// A variable that is not declared.
    pub fn substitution(
        &self,
        pairs: impl IntoIterator<Item = (Variable, Diagram)>,
    ) -> Result<Substitution, BddError> {
        let (mut variables, mut functions) = (Vec::new(), Vec::new());
        for (variable, function) in pairs {
            let number = self.numbers.get(&variable);
            variables.push(*number.ok_or(BddError::UnknownVariable(variable))?);
            functions.push(function.0);
        }
        let any = !variables.is_empty();
        Ok(Substitution(any.then(|| Subst::new(variables, functions))))
    }

    /// The function with those of `substitution` in the place of its variables.
    ///
    /// # Errors
    /// Too many nodes.
    pub fn substitute(
        &self,
        diagram: &Diagram,
        substitution: &Substitution,
    ) -> Result<Diagram, BddError> {
        match &substitution.0 {
            None => Ok(diagram.clone()),
            Some(pairs) => self.made(|nodes| {
                let pairs = pairs.map(|(variable, one)| (variable, one.as_edge(nodes)));
                let made = BDDFunction::substitute_edge(nodes, diagram.0.as_edge(nodes), pairs)?;
                Ok(BDDFunction::from_edge(nodes, made))
            }),
        }
    }

    /// The function's value under an assignment of all declared variables.
    pub fn value(&self, diagram: &Diagram, assignment: impl Fn(Variable) -> bool) -> bool {
        let values = self.variables.iter().enumerate();
        let values = values.map(|(number, &variable)| (number as VarNo, assignment(variable)));
        diagram.0.eval(values)
    }

    /// Under how many assignments of all declared variables the function is 1; `None` for more than 127 variables.
    pub fn count(&self, diagram: &Diagram) -> Option<u128> {
        let variables = u32::try_from(self.variables.len()).ok()?;
        (variables <= 127).then(|| {
            let mut cache: SatCountCache<u128, std::hash::RandomState> = SatCountCache::default();
            diagram.0.sat_count(variables, &mut cache)
        })
    }

    /// An assignment under which the function is 1, of as few variables as the diagram asks for; `None` if it is 0.
    pub fn satisfying(&self, diagram: &Diagram) -> Option<Vec<(Variable, bool)>> {
        let cube = self.deep(|| diagram.0.pick_cube(|_, _, _| false))?;
        let values = self.variables.iter().zip(cube);
        let chosen = values.filter_map(|(&variable, value)| match value {
            OptBool::None => None,
            OptBool::False => Some((variable, false)),
            OptBool::True => Some((variable, true)),
        });
        Some(chosen.collect())
    }

    /// An assignment under which the two functions differ; `None` where they are equal.
    ///
    /// # Errors
    /// Too many nodes.
    pub fn difference(
        &self,
        left: &Diagram,
        right: &Diagram,
    ) -> Result<Option<Vec<(Variable, bool)>>, BddError> {
        if left == right {
            return Ok(None);
        }
        Ok(self.satisfying(&self.xor(left, right)?))
    }

    /// The place of the top variable in the order; `None` for a constant.
    pub fn top(&self, diagram: &Diagram) -> Option<usize> {
        let level = diagram.0.with_manager_shared(|manager, edge| manager.get_node(edge).level());
        Some(level as usize).filter(|&level| level < self.variables.len())
    }

    /// The variable at a place of the order.
    pub fn variable_at(&self, place: usize) -> Variable {
        let number =
            self.manager.with_manager_shared(|manager| manager.level_to_var(place as VarNo));
        self.variables[number as usize]
    }

    /// The functions where the variable at `place`, at or above the top one, is 0 and is 1.
    pub fn cofactors(&self, diagram: &Diagram, place: usize) -> (Diagram, Diagram) {
        match diagram.0.cofactors() {
            Some((one, zero)) if self.top(diagram) == Some(place) => (Diagram(zero), Diagram(one)),
            _ => (diagram.clone(), diagram.clone()),
        }
    }

    /// Does `work` where the stack is deep enough for recursion over all variables.
    pub(crate) fn deep<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        if self.variables.len() <= SHALLOW {
            return work();
        }
        self.manager.with_manager_shared(|manager| manager.workers().install(work))
    }

    /// What `operation` makes; where it finds no free node, once more without the dead ones, or in a better order if it may change.
    fn made(
        &self,
        operation: impl for<'id> Fn(&Nodes<'id>) -> AllocResult<BDDFunction> + Sync,
    ) -> Result<Diagram, BddError> {
        let mut made = self.operate(&operation);
        if let Some(need) = &self.need {
            if made.is_ok() {
                if !need.look(&self.manager) {
                    return Err(BddError::TooManyNodes { limit: self.limit });
                }
            } else if need.make_room(&self.manager) {
                made = self.operate(&operation);
            }
        } else if made.is_err() && self.makes_room() {
            made = self.operate(&operation);
        }
        made.map(Diagram).map_err(|_| BddError::TooManyNodes { limit: self.limit })
    }

    /// Alone with the diagrams, so that the library's own collection of dead nodes waits: in the middle of an operation it would clear the cache of what
    /// was worked out, again and again near the bound, and the operation would begin again and again. On the deep stack another operation may be at work.
    fn operate(
        &self,
        operation: &(impl for<'id> Fn(&Nodes<'id>) -> AllocResult<BDDFunction> + Sync),
    ) -> AllocResult<BDDFunction> {
        if self.variables.len() <= SHALLOW {
            return self.manager.with_manager_exclusive(|nodes| operation(nodes));
        }
        self.manager.with_manager_shared(|nodes| nodes.workers().install(|| operation(nodes)))
    }

    /// Nodes of all diagrams, with those of no use that were not removed yet.
    pub fn nodes(&self) -> usize {
        self.manager.with_manager_shared(|manager| manager.num_inner_nodes())
    }

    /// Removes dead nodes; whether they were an eighth of all, so that another try is worth while.
    fn makes_room(&self) -> bool {
        if self.variables.len() > SHALLOW {
            // Somebody may be at work on the deep stack, and who waited here for being alone would wait for ever.
            return false;
        }
        self.collect_garbage();
        self.nodes() < self.limit / 8 * 7
    }

    /// Alone with the diagrams: where the library's own collection is still at work, it is waited for.
    fn collect_garbage(&self) {
        self.manager.with_manager_exclusive(|manager| manager.gc());
    }
}

impl Diagram {
    /// Whether it is 1 (or 0) under every assignment.
    pub fn is_constant(&self, value: bool) -> bool {
        if value { self.0.valid() } else { !self.0.satisfiable() }
    }

    /// Its nodes, the terminal included.
    pub fn node_count(&self) -> usize {
        self.0.node_count()
    }
}

/// Makes diagrams of the expressions of one graph, and remembers those of shared subexpressions.
pub struct Builder<'a> {
    diagrams: &'a Diagrams,
    graph: &'a Graph,
    place: Box<dyn Fn(Variable) -> Variable + Send + 'a>,
    made: HashMap<Expression, Diagram>,
}

impl Builder<'_> {
    /// The diagram of `root`.
    ///
    /// # Errors
    /// Too many nodes even for this one alone, or a variable that is not declared.
    pub fn diagram(&mut self, root: Expression) -> Result<Diagram, BddError> {
        let diagrams = self.diagrams;
        match self.make(root) {
            Err(BddError::TooManyNodes { .. }) => {
                // What is remembered for sharing may be what fills the memory.
                self.made.clear();
                diagrams.collect_garbage();
                self.make(root)
            }
            result => result,
        }
    }

    fn make(&mut self, root: Expression) -> Result<Diagram, BddError> {
        let made = &mut self.made;
        let mut pending = vec![root];
        while let Some(&expression) = pending.last() {
            if made.contains_key(&expression) {
                pending.pop();
                continue;
            }
            let operation = self.graph.operation(expression);
            let waiting = pending.len();
            pending.extend(operation.operands().filter(|operand| !made.contains_key(operand)));
            if pending.len() > waiting {
                continue;
            }
            let diagrams = self.diagrams;
            let diagram = match operation {
                Operation::Constant(value) => diagrams.constant(value),
                Operation::Variable(variable) => diagrams.variable((self.place)(variable))?,
                Operation::Not(operand) => diagrams.not(&made[&operand])?,
                Operation::And(left, right) => diagrams.and(&made[&left], &made[&right])?,
                Operation::Or(left, right) => diagrams.or(&made[&left], &made[&right])?,
                Operation::Xor(left, right) => diagrams.xor(&made[&left], &made[&right])?,
            };
            made.insert(expression, diagram);
        }
        Ok(made[&root].clone())
    }
}

/// The variables that `roots` depend on, in the order in which a reader from left to right meets them.
///
/// What is used together comes together, and programs that share no variable stay apart; so the diagram of a sum over such
/// programs is only as large as theirs together.
pub fn depth_first_order(graph: &Graph, roots: &[Expression]) -> Vec<Variable> {
    let mut order = Vec::new();
    let mut seen = HashSet::new();
    for &root in roots {
        let mut pending = vec![root];
        while let Some(expression) = pending.pop() {
            if !seen.insert(expression) {
                continue;
            }
            let operation = graph.operation(expression);
            if let Operation::Variable(variable) = operation {
                order.push(variable);
            }
            let operands: Vec<Expression> = operation.operands().collect();
            pending.extend(operands.into_iter().rev());
        }
    }
    order
}
