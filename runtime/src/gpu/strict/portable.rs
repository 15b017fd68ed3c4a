//! The portable form of strict kernels, for interfaces that take no decorations: what a driver could
//! fuse, reorder or simplify is hidden from it, in the module itself, so every language that naga
//! writes says it.
//!
//! A barrier stands behind each operation that rounds and before each use of a number that is written
//! down:
//!
//! ```wgsl
//! let e_5 = select(0u, 1u, arrayLength(&made) == 0u);           // once in a function
//! let sum = bitcast<f32>(bitcast<u32>(a * b) ^ e_5) + …
//! ```
//!
//! No buffer that is bound has an array without an element, which WebGPU promises and no driver
//! relies on: the mask is zero, the bits stay as they are, and nothing is known of the number. With
//! all results and all constants unknown there are no two operations left that could be made one, and
//! no constant to divide by. What picks one of its operands or turns a sign (`min`, `select`, `abs`,
//! negation) needs no barrier, nor does a zero: whatever is made of them, the bits are the same.
//!
//! What is left to the device is, as for decorations, the rounding of single operations.

use naga::valid::{FunctionInfo, GlobalUse, ModuleInfo};
use naga::{
    AddressSpace, Arena, ArraySize, BinaryOperator, Block, Expression, Function, GlobalVariable,
    Handle, Literal, MathFunction, Module, ScalarKind, Span, Statement, SwitchCase, TypeInner,
    VectorSize,
};

/// The module with barriers, for its entry point of this name; the error says what of it has no
/// portable form.
pub(in super::super) fn rewritten(
    module: &Module,
    info: &ModuleInfo,
    entry: &str,
) -> Result<Module, String> {
    let mut variables = module.global_variables.iter();
    if variables.any(|(_, variable)| variable.init.is_some()) {
        return Err("a variable outside all functions begins with a value".to_owned());
    }
    let unknown = unknown_length(module, info, entry);
    let with_barriers = |function, info| Rewriting::of(module, function, info, unknown);
    let functions = module.functions.iter();
    let functions: Vec<Option<Function>> = functions
        .map(|(handle, function)| with_barriers(function, &info[handle]))
        .collect::<Result<_, _>>()?;
    let entries = module.entry_points.iter().enumerate();
    let entries: Vec<Option<Function>> = entries
        .map(|(at, entry)| with_barriers(&entry.function, info.get_entry_point(at)))
        .collect::<Result<_, _>>()?;

    let mut module = module.clone();
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

/// An array whose length is known when the kernel runs: the buffer, and the member of it if it is a
/// structure.
type Length = (Handle<GlobalVariable>, Option<u32>);

/// The first such array of those that the entry point uses, since these are bound.
fn unknown_length(module: &Module, info: &ModuleInfo, entry: &str) -> Option<Length> {
    let at = module.entry_points.iter().position(|e| e.name == entry)?;
    let uses = info.get_entry_point(at);
    let is_unknown = |ty: Handle<naga::Type>| {
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
                    let last = members.last().filter(|member| is_unknown(member.ty));
                    last.map(|_| (handle, Some(members.len() as u32 - 1)))
                }
                _ => is_unknown(variable.ty).then_some((handle, None)),
            },
        )
        .next()
}

/// A function that is made anew, since operands stand before what uses them.
struct Rewriting<'a> {
    module: &'a Module,
    old: &'a Function,
    info: &'a FunctionInfo,
    made: Arena<Expression>,
    /// The new expression for each old one that was met.
    new: Vec<Option<Handle<Expression>>>,
    /// The mask for numbers of one to four components.
    masks: Vec<Handle<Expression>>,
    barriers: usize,
}

impl Rewriting<'_> {
    /// The function with its barriers; `None` if it needs none.
    fn of(
        module: &Module,
        old: &Function,
        info: &FunctionInfo,
        unknown: Option<Length>,
    ) -> Result<Option<Function>, String> {
        let mut this = Rewriting {
            module,
            old,
            info,
            made: Arena::new(),
            new: vec![None; old.expressions.len()],
            masks: Vec::new(),
            barriers: 0,
        };
        // These belong to no statement.
        for (handle, expression) in old.expressions.iter() {
            if expression.needs_pre_emit() {
                this.copy(handle);
            }
        }
        let mut body = Block::new();
        this.begin(unknown, &mut body);
        let local_variables = this.locals(&mut body)?;
        body.extend_block(this.block(&old.body)?);
        if this.barriers == 0 {
            return Ok(None);
        }
        if unknown.is_none() {
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
            expressions: this.made,
            named_expressions,
            body,
            diagnostic_filter_leaf: old.diagnostic_filter_leaf,
        }))
    }

    /// The masks.
    fn begin(&mut self, unknown: Option<Length>, body: &mut Block) {
        let [zero, one] = [0, 1].map(|n| self.append(Expression::Literal(Literal::U32(n))));
        let Some((buffer, member)) = unknown else {
            // Without barriers they are not used.
            self.masks = vec![zero; 4];
            return;
        };
        let buffer = self.append(Expression::GlobalVariable(buffer));
        let start = self.made.len();
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
        self.emit(start, body);
    }

    /// The local variables. What they begin with is stored into them: a beginning in place is a
    /// constant that every driver sees.
    fn locals(&mut self, body: &mut Block) -> Result<Arena<naga::LocalVariable>, String> {
        let mut locals = self.old.local_variables.clone();
        for (handle, local) in locals.iter_mut() {
            if let Some(value) = local.init.take() {
                let pointer = self.append(Expression::LocalVariable(handle));
                let value = self.operand(value, body)?;
                body.push(Statement::Store { pointer, value }, Span::UNDEFINED);
            }
        }
        Ok(locals)
    }

    fn append(&mut self, expression: Expression) -> Handle<Expression> {
        self.made.append(expression, Span::UNDEFINED)
    }

    /// An expression that has no operands, as it is.
    fn copy(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        let span = self.old.expressions.get_span(old);
        let made = self.made.append(self.old.expressions[old].clone(), span);
        self.new[old.index()] = Some(made);
        made
    }

    /// Emits what was made since there were `start` expressions.
    fn emit(&mut self, start: usize, block: &mut Block) {
        if self.made.len() > start {
            let range = self.made.range_from(start);
            block.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }

    /// How many components an expression has, if it is made of floats.
    fn floats(&self, old: Handle<Expression>) -> Option<usize> {
        let (scalar, components) = match *self.info[old].ty.inner_with(&self.module.types) {
            TypeInner::Scalar(scalar) => (scalar, 1),
            TypeInner::Vector { size, scalar } => (scalar, size as usize),
            _ => return None,
        };
        (scalar.kind == ScalarKind::Float).then_some(components)
    }

    /// The same numbers, of which nothing is known.
    fn barrier(&mut self, number: Handle<Expression>, components: usize) -> Handle<Expression> {
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

    /// An expression where another one uses it: of what is written down nothing is known there.
    fn used(&mut self, old: Handle<Expression>) -> Result<Handle<Expression>, String> {
        let new = match self.new[old.index()] {
            Some(new) => new,
            // What no statement emits is a constant.
            None => self.made_anew(old)?,
        };
        let is_written = match self.old.expressions[old] {
            Expression::Literal(Literal::F32(number)) => number != 0.0,
            Expression::Constant(_) | Expression::Override(_) => true,
            _ => false,
        };
        Ok(match self.floats(old) {
            Some(components) if is_written => self.barrier(new, components),
            _ => new,
        })
    }

    /// The same where a statement uses it.
    fn operand(
        &mut self,
        old: Handle<Expression>,
        block: &mut Block,
    ) -> Result<Handle<Expression>, String> {
        let start = self.made.len();
        let new = self.used(old)?;
        self.emit(start, block);
        Ok(new)
    }

    /// Whether an expression is part of a table that is written down.
    fn is_of_table(&self, mut old: Handle<Expression>) -> bool {
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

    /// An expression over what was made of its operands, with a barrier behind it if it rounds.
    fn made_anew(&mut self, old: Handle<Expression>) -> Result<Handle<Expression>, String> {
        let mut expression = self.old.expressions[old].clone();
        let rounds = match &mut expression {
            Expression::Compose { components, .. } => {
                for component in components {
                    *component = self.used(*component)?;
                }
                false
            }
            Expression::Access { base, index } => {
                [*base, *index] = [self.used(*base)?, self.used(*index)?];
                self.is_of_table(old)
            }
            Expression::AccessIndex { base, .. } => {
                *base = self.used(*base)?;
                self.is_of_table(old)
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
                *operand = self.used(*operand)?;
                false
            }
            Expression::As { expr, convert, .. } => {
                *expr = self.used(*expr)?;
                convert.is_some()
            }
            Expression::Binary { left, right, .. } => {
                [*left, *right] = [self.used(*left)?, self.used(*right)?];
                true
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                for operand in [condition, accept, reject] {
                    *operand = self.used(*operand)?;
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
                *arg = self.used(*arg)?;
                for operand in [arg1, arg2, arg3].into_iter().flatten() {
                    *operand = self.used(*operand)?;
                }
                !matches!(
                    fun,
                    MathFunction::Abs | MathFunction::Min | MathFunction::Max
                )
            }
            other => return Err(format!("{other:?} is not known to it")),
        };
        let span = self.old.expressions.get_span(old);
        let new = self.made.append(expression, span);
        Ok(match self.floats(old) {
            Some(components) if rounds => self.barrier(new, components),
            _ => new,
        })
    }

    fn block(&mut self, old: &Block) -> Result<Block, String> {
        let mut new = Block::with_capacity(old.len());
        for (statement, span) in old.span_iter() {
            let statement = match statement {
                Statement::Emit(range) => {
                    let start = self.made.len();
                    for handle in range.clone() {
                        self.new[handle.index()] = Some(self.made_anew(handle)?);
                    }
                    self.emit(start, &mut new);
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
                } => {
                    let body = self.block(body)?;
                    let mut continuing = self.block(continuing)?;
                    let break_if =
                        break_if.map(|condition| self.operand(condition, &mut continuing));
                    Statement::Loop {
                        body,
                        break_if: break_if.transpose()?,
                        continuing,
                    }
                }
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
