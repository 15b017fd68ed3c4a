//! Graph → WGSL: the scene as functions, one `let` per operation. Only what a guard stands for lies
//! behind a condition.
//!
//! `scene_distance(p)`, `scene_gradient(p)` (the gradient in `xyz`, the distance in `w`) and, where
//! a scene has several materials, `scene_surface(p, n)`. They call the operations' recorded bodies,
//! the same ones that the interpreter calls. Identifiers come from the names in the scene, cut to
//! letters and digits; none of the scene's text gets in.

mod blocks;

use crate::graph::{Graph, Guard, Node, NodeId, Number, Step};
use blocks::Blocks;
use sdfc_vm::apply::wgsl_name;
use sdfc_vm::library::{GUARD_NAME, Library};
use sdfc_vm::record::scalar_literal;
use sdfc_vm::row::{Category, Input, ParameterType};
use sdfc_vm::surface::{precedence, tie_line};
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Which of a scene's functions is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// `scene_distance(p: vec3f) -> f32`
    Distance,
    /// `scene_gradient(p: vec3f) -> vec4f`
    Gradient,
    /// `scene_surface(p: vec3f, n: vec3f) -> Surface`, of a graph of surfaces.
    Surface,
}

/// Writes one of a scene's functions and marks in `library` what it calls. Uniform numbers are read
/// from `uniforms[i / 4][i % 4]`.
pub fn write(graph: &Graph, function: Function, library: &mut Library) -> String {
    let mut writer = Writer {
        graph,
        dual: function != Function::Distance,
        surface: function == Function::Surface,
        library,
        names: HashMap::new(),
        // The parameters' names.
        taken: HashSet::from(["p".to_owned(), "n".to_owned()]),
        body: String::new(),
        blocks: Blocks::of(graph),
        block: blocks::OUTERMOST,
    };
    writer.statements();
    let result = writer.name(graph.root);
    let body = writer.body;
    match function {
        Function::Distance => {
            format!("fn scene_distance(p: vec3f) -> f32 {{\n{body}    return {result};\n}}\n")
        }
        Function::Gradient => {
            library.use_points();
            format!(
                "fn scene_gradient(p: vec3f) -> vec4f {{\n{SEED}{body}    return {result};\n}}\n"
            )
        }
        Function::Surface => {
            library.use_points();
            // Only where something is mixed.
            let tie = match body.contains("tie)") {
                true => format!("    {}\n", tie_line("p")),
                false => String::new(),
            };
            format!(
                "fn scene_surface(p: vec3f, n: vec3f) -> Surface {{\n{SEED}{tie}{body}    \
                 return {result}_surface;\n}}\n"
            )
        }
    }
}

/// The seed of the first operand, which shows where both are alike.
fn first_seed(op: Op, a: &str, b: &str) -> String {
    match precedence(op) {
        sign if sign > 0.0 => format!("first_seed({a}, {b}, tie)"),
        sign if sign < 0.0 => format!("first_seed({a}, {b}, -tie)"),
        _ => format!("vec4f(1.0, 0.0, 0.0, {a}.w)"),
    }
}

const SEED: &str = "    let world = DualPoint(p, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), \
                    vec3f(0.0, 0.0, 1.0));\n";

struct Writer<'a> {
    graph: &'a Graph,
    dual: bool,
    surface: bool,
    library: &'a mut Library,
    names: HashMap<NodeId, String>,
    taken: HashSet<String>,
    body: String,
    blocks: Blocks,
    /// The block that text is added to.
    block: usize,
}

impl Writer<'_> {
    fn name(&self, id: NodeId) -> String {
        match self.graph.get(id) {
            Node::World if self.dual => "world".to_owned(),
            Node::World => "p".to_owned(),
            _ => self.names.get(&id).cloned().unwrap_or_default(),
        }
    }

    fn number(&self, number: Number) -> String {
        match number {
            Number::Constant(v) => scalar_literal(v),
            Number::Uniform(u) => format!("uniforms[{}][{}]", u / 4, u % 4),
        }
    }

    fn numbers(&self, numbers: &[Number]) -> String {
        let list: Vec<String> = numbers.iter().map(|&n| self.number(n)).collect();
        list.join(", ")
    }

    /// A name from the scene if the node has one, else from what it is.
    fn fresh(&mut self, id: NodeId, kind: &str) -> String {
        let wanted = self
            .graph
            .origin(id)
            .map(|o| identifier(&o.name))
            .filter(|n| !n.is_empty());
        let stem = wanted.unwrap_or_else(|| kind.to_owned());
        let mut name = stem.clone();
        // A name and that of its surface are both taken; a number that is counted up ends the search.
        let mut number = id.0;
        while self.taken.contains(&name) || self.taken.contains(&format!("{name}_surface")) {
            name = format!("{stem}_{number}");
            number += 1;
        }
        self.taken.insert(name.clone());
        self.taken.insert(format!("{name}_surface"));
        self.names.insert(id, name.clone());
        name
    }

    fn line(&mut self, name: &str, value: &str) {
        self.text(&format!("let {name} = {value};"));
    }

    /// A line as far in as the block is.
    fn text(&mut self, content: &str) {
        let indent = 4 * (1 + self.blocks.depth(self.block));
        let _ = writeln!(self.body, "{:indent$}{content}", "");
    }

    /// Writes what belongs into the present block.
    fn statements(&mut self) {
        for id in self.blocks.members(self.block) {
            self.statement(id);
        }
    }

    fn statement(&mut self, id: NodeId) {
        let graph = self.graph;
        match graph.get(id) {
            Node::World => {}
            Node::Moved { point, by } => {
                let (from, by) = (self.name(*point), self.numbers(by));
                let name = self.fresh(id, "q");
                if self.dual {
                    let value = format!(
                        "DualPoint({from}.p + vec3f({by}), {from}.dx, {from}.dy, {from}.dz)"
                    );
                    self.line(&name, &value);
                } else {
                    self.line(&name, &format!("{from} + vec3f({by})"));
                }
            }
            Node::Mapped { point, rows } => {
                let from = self.name(*point);
                // WGSL's matrices are given by columns.
                let column = |c: usize| self.numbers(&[rows[c], rows[4 + c], rows[8 + c]]);
                let matrix = format!(
                    "mat3x3f({}, {}, {}), vec3f({})",
                    column(0),
                    column(1),
                    column(2),
                    column(3)
                );
                let name = self.fresh(id, "q");
                if self.dual {
                    self.library.use_mapped_gradient();
                    self.line(&name, &format!("mapped_gradient({from}, {matrix})"));
                } else {
                    self.library.use_mapped();
                    self.line(&name, &format!("mapped({from}, {matrix})"));
                }
            }
            Node::Constant(number) => {
                let number = self.number(*number);
                let name = self.fresh(id, "c");
                let value = if self.dual {
                    format!("vec4f(0.0, 0.0, 0.0, {number})")
                } else {
                    number
                };
                self.line(&name, &value);
            }
            Node::Normal { point, axis } => {
                let from = self.name(*point);
                let axis = ["x", "y", "z"][usize::from(*axis)];
                let name = self.fresh(id, "n");
                self.library.use_local_normal();
                let value = format!(
                    "vec4f(0.0, 0.0, 0.0, local_normal({from}.dx, {from}.dy, {from}.dz, n).{axis})"
                );
                self.line(&name, &value);
            }
            Node::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                self.application(id, *op, *point, values, parameters);
            }
            Node::Chain {
                op,
                parameters,
                first,
                steps,
            } => {
                let from = self.name(*first);
                let name = self.fresh(id, "d");
                self.text(&format!("var {name} = {from};"));
                if self.surface {
                    let surface = self.surface_of(*first);
                    let surface = surface.unwrap_or_else(|| "unpainted_surface()".to_owned());
                    self.text(&format!("var {name}_surface = {surface};"));
                }
                let chain = Chain {
                    name,
                    op: *op,
                    constants: self.parameters(*op, parameters),
                };
                self.steps(id, &chain, steps);
            }
            Node::Paint {
                value,
                constants,
                channels,
            } => {
                self.paint(id, *value, constants, channels);
            }
        }
    }

    /// The steps of a chain, in blocks where guards stand for them. Recursion over guards within
    /// guards, of which the format allows few.
    fn steps(&mut self, id: NodeId, chain: &Chain, steps: &[Step]) {
        // Where the blocks end that were entered.
        let mut ends: Vec<(usize, usize)> = Vec::new();
        for (at, step) in steps.iter().enumerate() {
            self.close(&mut ends, at);
            match step {
                Step::Blend(value) => self.blend(chain, *value),
                Step::Guard(guard) => {
                    self.condition(chain, guard);
                    ends.push((at + 1 + guard.steps as usize, self.block));
                    self.block = self.blocks.behind(id, at);
                    self.statements();
                }
            }
        }
        self.close(&mut ends, steps.len());
    }

    /// Leaves the blocks that end in front of a step.
    fn close(&mut self, ends: &mut Vec<(usize, usize)>, at: usize) {
        while let Some((_, outer)) = ends.pop_if(|(end, _)| *end <= at) {
            self.block = outer;
            self.text("}");
        }
    }

    fn condition(&mut self, chain: &Chain, guard: &Guard) {
        self.library.use_guard();
        let point = self.name(guard.point);
        let (point, value) = if self.dual {
            (format!("{point}.p"), format!("{}.w", chain.name))
        } else {
            (point, chain.name.clone())
        };
        let [x, y, z, reach, a, b, c, factor] = guard.volume.map(|n| self.number(n));
        self.text(&format!(
            "if !({GUARD_NAME}({point}, {value}, vec3f({x}, {y}, {z}), {reach}, \
             vec3f({a}, {b}, {c}), {factor}) > 0.0) {{"
        ));
    }

    /// Blends a value into what a chain has so far.
    fn blend(&mut self, chain: &Chain, value: NodeId) {
        let Chain {
            name,
            op,
            constants,
        } = chain;
        let other = self.name(value);
        if self.surface {
            let surface = self.surface_of(value);
            let surface = surface.unwrap_or_else(|| "unpainted_surface()".to_owned());
            let own = format!("{name}_surface");
            let mixed = self.mixed(*op, None, [name, &other], [&own, &surface], constants);
            self.text(&format!("{own} = {mixed};"));
        }
        let suffix = if self.dual {
            self.library.use_gradient(*op);
            "_gradient"
        } else {
            self.library.use_value(*op);
            ""
        };
        let mut arguments = vec![name.clone(), other];
        arguments.extend(constants.iter().cloned());
        let function = wgsl_name(*op);
        let arguments = arguments.join(", ");
        self.text(&format!("{name} = {function}{suffix}({arguments});"));
    }

    /// The surface of a combination of two.
    fn mixed(
        &mut self,
        op: Op,
        point: Option<String>,
        [a, b]: [&str; 2],
        [first, second]: [&str; 2],
        constants: &[String],
    ) -> String {
        // The point stays: only the operands' shares are asked for.
        let still = point.map(|q| format!("DualPoint({q}.p, vec3f(), vec3f(), vec3f())"));
        let seeds = vec![first_seed(op, a, b), format!("vec4f(0.0, 1.0, 0.0, {b}.w)")];
        let mut arguments = inputs(op, still, seeds);
        arguments.extend(constants.iter().cloned());
        self.library.use_mixed_surface();
        format!(
            "mixed_surface({first}, {second}, {}_gradient({}))",
            wgsl_name(op),
            arguments.join(", ")
        )
    }

    fn application(
        &mut self,
        id: NodeId,
        op: Op,
        point: Option<NodeId>,
        values: &[NodeId],
        parameters: &[Number],
    ) {
        let from = point.map(|p| self.name(p));
        let operands: Vec<String> = values.iter().map(|&v| self.name(v)).collect();
        let mut arguments = inputs(op, from.clone(), operands);
        let constants = self.parameters(op, parameters);
        arguments.extend(constants.iter().cloned());
        let function = wgsl_name(op);
        let kind = if node_is_point(op) { "q" } else { "d" };
        let name = self.fresh(id, kind);
        let arguments = arguments.join(", ");
        if self.dual {
            self.library.use_gradient(op);
            self.line(&name, &format!("{function}_gradient({arguments})"));
        } else {
            self.library.use_value(op);
            self.line(&name, &format!("{function}({arguments})"));
        }
        if self.surface && !node_is_point(op) {
            self.carry(&name, op, from, values, &constants);
        }
    }

    /// The surface of an operation's result: mixed for combinations, handed on by all others.
    fn carry(
        &mut self,
        name: &str,
        op: Op,
        point: Option<String>,
        values: &[NodeId],
        constants: &[String],
    ) {
        let surfaces: Vec<String> = values.iter().filter_map(|&v| self.surface_of(v)).collect();
        let value = match (values, surfaces.as_slice()) {
            ([a, b], [first, second]) if op.row().meta.category == Category::Combine => {
                let (a, b) = (self.name(*a), self.name(*b));
                self.mixed(op, point, [&a, &b], [first, second], constants)
            }
            (_, [first, ..]) => first.clone(),
            _ => "unpainted_surface()".to_owned(),
        };
        self.line(&format!("{name}_surface"), &value);
    }

    fn surface_of(&self, id: NodeId) -> Option<String> {
        match self.graph.get(id) {
            Node::Constant(_) | Node::Normal { .. } => None,
            _ => Some(format!("{}_surface", self.name(id))),
        }
    }

    fn paint(
        &mut self,
        id: NodeId,
        value: NodeId,
        constants: &[Number; 12],
        channels: &[(u8, NodeId)],
    ) {
        let from = self.name(value);
        let name = self.fresh(id, "painted");
        let channel = |c: u8| match channels.iter().find(|(number, _)| *number == c) {
            Some((_, node)) => format!("{}.w", self.name(*node)),
            None => self.number(constants[usize::from(c)]),
        };
        let bump = match channels.iter().find(|(number, _)| *number == 8) {
            Some((_, node)) => format!("{}.xyz", self.name(*node)),
            None => "vec3f(0.0)".to_owned(),
        };
        let surface = format!(
            "Surface(vec3f({}, {}, {}), {}, vec3f({}, {}, {}), {}, {bump}, {})",
            channel(0),
            channel(1),
            channel(2),
            channel(3),
            channel(4),
            channel(5),
            channel(6),
            channel(7),
            self.number(constants[8]),
        );
        self.line(&name, &from);
        self.line(&format!("{name}_surface"), &surface);
    }

    /// A row's parameters as WGSL arguments.
    fn parameters(&self, op: Op, parameters: &[Number]) -> Vec<String> {
        let mut rest = parameters;
        let mut list = Vec::new();
        for parameter in op.row().parameters {
            let (numbers, after) = rest.split_at(parameter.ty.width());
            rest = after;
            let text = self.numbers(numbers);
            list.push(match parameter.ty {
                ParameterType::Scalar => text,
                ParameterType::Vec2 => format!("vec2f({text})"),
                ParameterType::Vec3 => format!("vec3f({text})"),
            });
        }
        list
    }
}

/// A chain while its steps are written.
struct Chain {
    /// The variable that holds what it has so far.
    name: String,
    op: Op,
    /// The operation's parameters.
    constants: Vec<String>,
}

/// The inputs of a row in their order.
fn inputs(op: Op, point: Option<String>, values: Vec<String>) -> Vec<String> {
    let mut values = values.into_iter();
    let rows = op.row().inputs.iter();
    let given = rows.filter_map(|input| match input {
        Input::Point => point.clone(),
        Input::Value => values.next(),
    });
    given.collect()
}

fn node_is_point(op: Op) -> bool {
    op.row().output == sdfc_vm::row::Output::Point
}

/// A name of the scene as a WGSL identifier: letters, digits and underscores, with a prefix that
/// keeps it apart from every word of WGSL and every function here.
fn identifier(name: &str) -> String {
    let kept: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .take(40)
        .collect();
    let kept = kept.trim_matches('_').to_owned();
    if kept.is_empty() {
        kept
    } else {
        format!("s_{kept}")
    }
}
