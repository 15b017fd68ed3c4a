//! Rewrites the functions of strict kernels where a driver or a device would not compute as written.
//!
//! **Barriers** are the portable form, for backends without decorations. Whatever a driver could fuse, reorder
//! or simplify is hidden from it in the module itself, and thus in every language that naga writes. A barrier
//! follows each operation that rounds, and hides each constant before its use:
//!
//! ```wgsl
//! let e_5 = select(0u, 1u, arrayLength(&made) == 0u);           // once in a function
//! let sum = bitcast<f32>(bitcast<u32>(a * b) ^ e_5) + …
//! ```
//!
//! No bound buffer has an array without elements, which WebGPU guarantees and no driver relies on. The mask
//! is therefore zero and the bits stay unchanged, but the driver cannot know the number. With all results and
//! constants unknown there are no two operations left that could be merged, and no constant to divide by.
//! Operations that select an operand or change a sign (`min`, `select`, `abs`, negation) need no barrier, nor
//! does a zero. However they are rewritten, the bits are the same.
//!
//! **Software rounding** replaces quotients and square roots by calls of the functions of [`super::rounding`],
//! for devices that round these operations by rules of their own.

use naga::valid::{FunctionInfo, GlobalUse, ModuleInfo};
use naga::{
    AddressSpace, Arena, ArraySize, BinaryOperator, Block, Expression, Function, GlobalVariable,
    Handle, Literal, MathFunction, Module, Scalar, ScalarKind, Span, Statement, SwitchCase, Type,
    TypeInner, UniqueArena, VectorSize,
};

use super::rounding::RoundingFunctions;

/// The changes to a module.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Rewrites {
    /// Inserts barriers.
    pub(in super::super) barriers: bool,
    /// Computes quotients and square roots with the module's rounding functions, if given.
    pub(in super::super) rounding: Option<RoundingFunctions>,
}

impl Rewrites {
    /// Reports whether there is any change.
    pub(in super::super) fn any(self) -> bool {
        self.barriers || self.rounding.is_some()
    }
}

/// Returns the module with these changes, for the entry point of this name. The error names the part that
/// cannot be rewritten.
pub(in super::super) fn rewrite(
    module: &Module,
    info: &ModuleInfo,
    entry: &str,
    rewrites: Rewrites,
) -> Result<Module, String> {
    let mut variables = module.global_variables.iter();
    if rewrites.barriers && variables.any(|(_, variable)| variable.init.is_some()) {
        return Err("a variable outside all functions begins with a value".to_owned());
    }
    let runtime_array = find_runtime_array(module, info, entry);
    let mut types = module.types.clone();
    let mut rewrite = |function, info| {
        Rewriter::rewrite(module, function, info, &mut types, rewrites, runtime_array)
    };
    let functions = module.functions.iter();
    let functions: Vec<Option<Function>> = functions
        .map(|(handle, function)| match rewrites.rounding {
            Some(rounding) if rounding.contains(handle) => Ok(None),
            _ => rewrite(function, &info[handle]),
        })
        .collect::<Result<_, _>>()?;
    let entries = module.entry_points.iter().enumerate();
    let entries: Vec<Option<Function>> = entries
        .map(|(index, entry)| rewrite(&entry.function, info.get_entry_point(index)))
        .collect::<Result<_, _>>()?;

    let mut module = module.clone();
    module.types = types;
    let old_functions = module.functions.iter_mut().map(|(_, function)| function);
    let old_entries = module.entry_points.iter_mut().map(|e| &mut e.function);
    let old = old_functions.chain(old_entries);
    for (old, new) in old.zip(functions.into_iter().chain(entries)) {
        if let Some(new) = new {
            *old = new;
        }
    }
    Ok(module)
}

/// A runtime-sized array: its buffer, and its member index if the buffer is a structure.
type RuntimeArray = (Handle<GlobalVariable>, Option<u32>);

/// Returns the first runtime-sized array among the buffers that the entry point uses, since these are bound.
fn find_runtime_array(module: &Module, info: &ModuleInfo, entry: &str) -> Option<RuntimeArray> {
    let index = module.entry_points.iter().position(|e| e.name == entry)?;
    let uses = info.get_entry_point(index);
    let is_runtime_sized = |ty: Handle<naga::Type>| {
        let inner = &module.types[ty].inner;
        matches!(
            inner,
            TypeInner::Array {
                size: ArraySize::Dynamic,
                ..
            }
        )
    };
    let buffers = module
        .global_variables
        .iter()
        .filter(|&(handle, variable)| {
            matches!(variable.space, AddressSpace::Storage { .. })
                && uses[handle] != GlobalUse::empty()
        });
    buffers
        .filter_map(
            |(handle, variable)| match &module.types[variable.ty].inner {
                TypeInner::Struct { members, .. } => {
                    let last = members.last().filter(|member| is_runtime_sized(member.ty));
                    last.map(|_| (handle, Some(members.len() as u32 - 1)))
                }
                _ => is_runtime_sized(variable.ty).then_some((handle, None)),
            },
        )
        .next()
}

/// Rebuilds a function, since operands must precede the expressions that use them.
struct Rewriter<'a> {
    module: &'a Module,
    old: &'a Function,
    info: &'a FunctionInfo,
    /// The types of the new module.
    types: &'a mut UniqueArena<Type>,
    rewrites: Rewrites,
    expressions: Arena<Expression>,
    /// Number of new expressions that statements emit, or that need none.
    emitted: usize,
    /// The new expression for each old one visited so far.
    new: Vec<Option<Handle<Expression>>>,
    /// The masks for numbers of one to four components.
    masks: Vec<Handle<Expression>>,
    /// Number of inserted barriers.
    barriers: usize,
    /// Number of inserted calls of rounding functions.
    calls: usize,
}

impl Rewriter<'_> {
    /// Returns the new function; `None` if nothing changes.
    fn rewrite(
        module: &Module,
        old: &Function,
        info: &FunctionInfo,
        types: &mut UniqueArena<Type>,
        rewrites: Rewrites,
        runtime_array: Option<RuntimeArray>,
    ) -> Result<Option<Function>, String> {
        let mut this = Rewriter {
            module,
            old,
            info,
            types,
            rewrites,
            expressions: Arena::new(),
            emitted: 0,
            new: vec![None; old.expressions.len()],
            masks: Vec::new(),
            barriers: 0,
            calls: 0,
        };
        // These expressions belong to no statement.
        for (handle, expression) in old.expressions.iter() {
            if expression.needs_pre_emit() {
                this.copy(handle);
            }
        }
        let mut body = Block::new();
        this.create_masks(runtime_array, &mut body);
        let local_variables = this.locals(&mut body)?;
        body.extend_block(this.block(&old.body)?);
        if this.barriers + this.calls == 0 {
            return Ok(None);
        }
        if this.barriers > 0 && runtime_array.is_none() {
            return Err("there is no storage buffer with an array of any length".to_owned());
        }
        let names = old.named_expressions.iter();
        let named_expressions = names
            .filter_map(|(old, name)| Some((this.new[old.index()]?, name.clone())))
            .collect();
        Ok(Some(Function {
            name: old.name.clone(),
            arguments: old.arguments.clone(),
            result: old.result.clone(),
            local_variables,
            expressions: this.expressions,
            named_expressions,
            body,
            diagnostic_filter_leaf: old.diagnostic_filter_leaf,
        }))
    }

    /// Creates the masks.
    fn create_masks(&mut self, runtime_array: Option<RuntimeArray>, body: &mut Block) {
        if !self.rewrites.barriers {
            self.emitted = self.expressions.len();
            return;
        }
        let [zero, one] = [0, 1].map(|n| self.append(Expression::Literal(Literal::U32(n))));
        let Some((buffer, member)) = runtime_array else {
            // Without barriers the masks are not used.
            self.masks = vec![zero; 4];
            self.emitted = self.expressions.len();
            return;
        };
        let buffer = self.append(Expression::GlobalVariable(buffer));
        self.emitted = self.expressions.len();
        let array = match member {
            Some(index) => self.append(Expression::AccessIndex {
                base: buffer,
                index,
            }),
            None => buffer,
        };
        let length = self.append(Expression::ArrayLength(array));
        let condition = self.append(Expression::Binary {
            op: BinaryOperator::Equal,
            left: length,
            right: zero,
        });
        let mask = self.append(Expression::Select {
            condition,
            accept: one,
            reject: zero,
        });
        let sizes = [VectorSize::Bi, VectorSize::Tri, VectorSize::Quad];
        let vectors = sizes.map(|size| self.append(Expression::Splat { size, value: mask }));
        self.masks = [mask].into_iter().chain(vectors).collect();
        self.emit(body);
    }

    /// Copies the local variables. Initial values are stored into them instead: an initializer is a constant
    /// that every driver sees.
    fn locals(&mut self, body: &mut Block) -> Result<Arena<naga::LocalVariable>, String> {
        let mut locals = self.old.local_variables.clone();
        for (handle, local) in locals.iter_mut() {
            if let Some(value) = local.init.take() {
                let pointer = self.append(Expression::LocalVariable(handle));
                self.emitted = self.expressions.len();
                let value = self.operand(value, body)?;
                body.push(Statement::Store { pointer, value }, Span::UNDEFINED);
            }
        }
        Ok(locals)
    }

    fn append(&mut self, expression: Expression) -> Handle<Expression> {
        self.expressions.append(expression, Span::UNDEFINED)
    }

    /// Copies an expression without operands.
    fn copy(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        let span = self.old.expressions.get_span(old);
        let copied = self
            .expressions
            .append(self.old.expressions[old].clone(), span);
        self.new[old.index()] = Some(copied);
        self.emitted = self.expressions.len();
        copied
    }

    /// Emits the expressions that no statement emits yet.
    fn emit(&mut self, block: &mut Block) {
        if self.expressions.len() > self.emitted {
            let range = self.expressions.range_from(self.emitted);
            block.push(Statement::Emit(range), Span::UNDEFINED);
            self.emitted = self.expressions.len();
        }
    }

    /// Returns the number of components of a float expression; `None` for other types.
    fn float_components(&self, old: Handle<Expression>) -> Option<usize> {
        let (scalar, components) = match *self.info[old].ty.inner_with(&self.module.types) {
            TypeInner::Scalar(scalar) => (scalar, 1),
            TypeInner::Vector { size, scalar } => (scalar, size as usize),
            _ => return None,
        };
        (scalar.kind == ScalarKind::Float).then_some(components)
    }

    /// Hides a number from the driver without changing its bits, in the portable form.
    fn barrier(&mut self, number: Handle<Expression>, components: usize) -> Handle<Expression> {
        if !self.rewrites.barriers {
            return number;
        }
        self.barriers += 1;
        let cast = |expr, kind| Expression::As {
            expr,
            kind,
            convert: None,
        };
        let left = self.append(cast(number, ScalarKind::Uint));
        let mixed = self.append(Expression::Binary {
            op: BinaryOperator::ExclusiveOr,
            left,
            right: self.masks[components - 1],
        });
        self.append(cast(mixed, ScalarKind::Float))
    }

    /// Returns an expression for use by another one; constants are hidden.
    fn used(
        &mut self,
        old: Handle<Expression>,
        block: &mut Block,
    ) -> Result<Handle<Expression>, String> {
        let new = match self.new[old.index()] {
            Some(new) => new,
            // Expressions that no statement emits are constants.
            None => self.rebuild(old, block)?,
        };
        let is_constant = match self.old.expressions[old] {
            Expression::Literal(Literal::F32(number)) => number != 0.0,
            Expression::Constant(_) | Expression::Override(_) => true,
            _ => false,
        };
        Ok(match self.float_components(old) {
            Some(components) if is_constant => self.barrier(new, components),
            _ => new,
        })
    }

    /// Returns an expression for use by a statement.
    fn operand(
        &mut self,
        old: Handle<Expression>,
        block: &mut Block,
    ) -> Result<Handle<Expression>, String> {
        let new = self.used(old, block)?;
        self.emit(block);
        Ok(new)
    }

    /// Reports whether an expression is an element of a constant table.
    fn is_table_element(&self, mut old: Handle<Expression>) -> bool {
        loop {
            match self.old.expressions[old] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    old = base;
                }
                Expression::Constant(_) => return true,
                _ => return false,
            }
        }
    }

    /// Rebuilds an expression from its new operands, followed by a barrier if it rounds.
    fn rebuild(
        &mut self,
        old: Handle<Expression>,
        block: &mut Block,
    ) -> Result<Handle<Expression>, String> {
        let mut expression = self.old.expressions[old].clone();
        let rounds = match &mut expression {
            Expression::Compose { components, .. } => {
                for component in components {
                    *component = self.used(*component, block)?;
                }
                false
            }
            Expression::Access { base, index } => {
                [*base, *index] = [self.used(*base, block)?, self.used(*index, block)?];
                self.is_table_element(old)
            }
            Expression::AccessIndex { base, .. } => {
                *base = self.used(*base, block)?;
                self.is_table_element(old)
            }
            Expression::Splat { value: operand, .. }
            | Expression::Swizzle {
                vector: operand, ..
            }
            | Expression::Load { pointer: operand }
            | Expression::ArrayLength(operand)
            | Expression::Relational {
                argument: operand, ..
            }
            | Expression::Unary { expr: operand, .. } => {
                *operand = self.used(*operand, block)?;
                false
            }
            Expression::As { expr, convert, .. } => {
                *expr = self.used(*expr, block)?;
                convert.is_some()
            }
            Expression::Binary { left, right, .. } => {
                [*left, *right] = [self.used(*left, block)?, self.used(*right, block)?];
                true
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                for operand in [condition, accept, reject] {
                    *operand = self.used(*operand, block)?;
                }
                false
            }
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                arg3,
            } => {
                *arg = self.used(*arg, block)?;
                for operand in [arg1, arg2, arg3].into_iter().flatten() {
                    *operand = self.used(*operand, block)?;
                }
                !matches!(
                    fun,
                    MathFunction::Abs | MathFunction::Min | MathFunction::Max
                )
            }
            other => return Err(format!("{other:?} is not known to it")),
        };
        if let Some(rounding) = self.rewrites.rounding
            && let Some(components) = self.float_components(old)
        {
            let (function, operands) = match expression {
                Expression::Binary {
                    op: BinaryOperator::Divide,
                    left,
                    right,
                } => (Some(rounding.quotient), vec![left, right]),
                Expression::Math {
                    fun: MathFunction::Sqrt,
                    arg,
                    ..
                } => (Some(rounding.root), vec![arg]),
                _ => (None, Vec::new()),
            };
            if let Some(function) = function {
                return Ok(self.call(function, &operands, components, block));
            }
        }
        let span = self.old.expressions.get_span(old);
        let new = self.expressions.append(expression, span);
        Ok(match self.float_components(old) {
            Some(components) if rounds => self.barrier(new, components),
            _ => new,
        })
    }

    /// Calls a function of numbers for each component of its operands.
    fn call(
        &mut self,
        function: Handle<Function>,
        operands: &[Handle<Expression>],
        components: usize,
        block: &mut Block,
    ) -> Handle<Expression> {
        self.calls += 1;
        let size = match components {
            1 => return self.call_once(function, operands.to_vec(), block),
            2 => VectorSize::Bi,
            3 => VectorSize::Tri,
            _ => VectorSize::Quad,
        };
        let results = (0..components as u32)
            .map(|index| {
                let component = |&base| self.append(Expression::AccessIndex { base, index });
                let arguments = operands.iter().map(component).collect();
                self.call_once(function, arguments, block)
            })
            .collect();
        let inner = TypeInner::Vector {
            size,
            scalar: Scalar::F32,
        };
        let ty = self
            .types
            .insert(Type { name: None, inner }, Span::UNDEFINED);
        self.append(Expression::Compose {
            ty,
            components: results,
        })
    }

    fn call_once(
        &mut self,
        function: Handle<Function>,
        arguments: Vec<Handle<Expression>>,
        block: &mut Block,
    ) -> Handle<Expression> {
        self.emit(block);
        let result = self.append(Expression::CallResult(function));
        self.emitted = self.expressions.len();
        let call = Statement::Call {
            function,
            arguments,
            result: Some(result),
        };
        block.push(call, Span::UNDEFINED);
        result
    }

    fn loop_statement(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
    ) -> Result<Statement, String> {
        let body = self.block(body)?;
        let mut continuing = self.block(continuing)?;
        let break_if = break_if.map(|condition| self.operand(condition, &mut continuing));
        Ok(Statement::Loop {
            body,
            break_if: break_if.transpose()?,
            continuing,
        })
    }

    fn block(&mut self, old: &Block) -> Result<Block, String> {
        let mut new = Block::with_capacity(old.len());
        for (statement, span) in old.span_iter() {
            let statement = match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        self.new[handle.index()] = Some(self.rebuild(handle, &mut new)?);
                    }
                    self.emit(&mut new);
                    continue;
                }
                Statement::Block(block) => Statement::Block(self.block(block)?),
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => Statement::If {
                    condition: self.operand(*condition, &mut new)?,
                    accept: self.block(accept)?,
                    reject: self.block(reject)?,
                },
                Statement::Switch { selector, cases } => {
                    let selector = self.operand(*selector, &mut new)?;
                    let cases = cases.iter().map(|case| {
                        Ok(SwitchCase {
                            value: case.value,
                            body: self.block(&case.body)?,
                            fall_through: case.fall_through,
                        })
                    });
                    let cases = cases.collect::<Result<_, String>>()?;
                    Statement::Switch { selector, cases }
                }
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => self.loop_statement(body, continuing, *break_if)?,
                Statement::Return { value } => {
                    let value = value.map(|value| self.operand(value, &mut new));
                    Statement::Return {
                        value: value.transpose()?,
                    }
                }
                Statement::Store { pointer, value } => Statement::Store {
                    pointer: self.operand(*pointer, &mut new)?,
                    value: self.operand(*value, &mut new)?,
                },
                Statement::Atomic {
                    pointer,
                    fun,
                    value,
                    result,
                } => {
                    let mut fun = *fun;
                    if let naga::AtomicFunction::Exchange {
                        compare: Some(compare),
                    } = &mut fun
                    {
                        *compare = self.operand(*compare, &mut new)?;
                    }
                    Statement::Atomic {
                        pointer: self.operand(*pointer, &mut new)?,
                        fun,
                        value: self.operand(*value, &mut new)?,
                        result: result.map(|result| self.copy(result)),
                    }
                }
                Statement::WorkGroupUniformLoad { pointer, result } => {
                    Statement::WorkGroupUniformLoad {
                        pointer: self.operand(*pointer, &mut new)?,
                        result: self.copy(*result),
                    }
                }
                Statement::Call {
                    function,
                    arguments,
                    result,
                } => {
                    let arguments = arguments.iter();
                    let arguments = arguments.map(|&argument| self.operand(argument, &mut new));
                    Statement::Call {
                        function: *function,
                        arguments: arguments.collect::<Result<_, _>>()?,
                        result: result.map(|result| self.copy(result)),
                    }
                }
                Statement::Break
                | Statement::Continue
                | Statement::Kill
                | Statement::ControlBarrier(_)
                | Statement::MemoryBarrier(_) => statement.clone(),
                other => return Err(format!("{other:?} is not known to it")),
            };
            new.push(statement, *span);
        }
        Ok(new)
    }
}

#[cfg(test)]
mod tests;
