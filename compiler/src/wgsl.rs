//! Graph → WGSL: the scene as functions, with one `let` per operation. Only steps behind guards are
//! conditional.
//!
//! The functions are `scene_distance(p)`, `scene_gradient(p)` (the gradient in `xyz`, the distance in
//! `w`) and, if a scene has several materials, `scene_surface(p, n)`. They call the operations'
//! recorded bodies, as the interpreter does. Identifiers come from the names in the scene, reduced to
//! letters, digits and underscores; no other text of the scene is copied.

mod blocks;

use crate::graph::{Graph, GraphChainStep, GraphNode, GraphNumber, Guard, NodeId};
use blocks::Blocks;
use sdfc_vm::apply::wgsl_name;
use sdfc_vm::material_weights::{tie_signs, tie_wgsl};
use sdfc_vm::record::scalar_literal;
use sdfc_vm::row::{Category, Input, ParameterType};
use sdfc_vm::table::Op;
use sdfc_vm::wgsl_library::{GUARD_NAME, WgslLibrary};
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

/// Selects one of a scene's functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WgslFunction {
    /// `scene_distance(p: vec3f) -> f32`
    Distance,
    /// `scene_gradient(p: vec3f) -> vec4f`
    Gradient,
    /// `scene_surface(p: vec3f, n: vec3f) -> Surface`, of a graph of surfaces.
    Surface,
}

/// Writes one of a scene's functions and marks the functions that it calls in `library`. Uniform
/// numbers are read from `uniforms[i / 4][i % 4]`.
pub fn write(graph: &Graph, function: WgslFunction, library: &mut WgslLibrary) -> String {
    let mut writer = FunctionWriter {
        graph,
        dual: function != WgslFunction::Distance,
        surface: function == WgslFunction::Surface,
        library,
        names: HashMap::new(),
        // Names of the function's parameters.
        reserved_names: HashSet::from(["p".to_owned(), "n".to_owned()]),
        body: String::new(),
        blocks: Blocks::new(graph),
        block: blocks::ROOT_BLOCK,
    };
    writer.statements();
    let result = writer.name(graph.root);
    let body = writer.body;
    match function {
        WgslFunction::Distance => {
            format!("fn scene_distance(p: vec3f) -> f32 {{\n{body}    return {result};\n}}\n")
        }
        WgslFunction::Gradient => {
            library.use_points();
            format!(
                "fn scene_gradient(p: vec3f) -> vec4f {{\n{WORLD_POINT}{body}    return {result};\n}}\n"
            )
        }
        WgslFunction::Surface => {
            library.use_points();
            // Only if surfaces are mixed.
            let tie = match body.contains("tie)") {
                true => format!("    {}\n", tie_wgsl("p")),
                false => String::new(),
            };
            format!(
                "fn scene_surface(p: vec3f, n: vec3f) -> Surface {{\n{WORLD_POINT}{tie}{body}    \
                 return {result}_surface;\n}}\n"
            )
        }
    }
}

/// Returns the seed of the first operand, which takes precedence at equal values.
fn first_seed(op: Op, a: &str, b: &str) -> String {
    let [tie, second] = tie_signs(op).map(|sign| if sign < 0.0 { "-" } else { "" });
    match op.row().facts.set {
        Some(_) => format!("first_seed({a}, {second}{b}, {tie}tie)"),
        None => format!("vec4f(1.0, 0.0, 0.0, {a}.w)"),
    }
}

const WORLD_POINT: &str = "    let world = DualPoint(p, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), \
                    vec3f(0.0, 0.0, 1.0));\n";

struct FunctionWriter<'a> {
    graph: &'a Graph,
    dual: bool,
    surface: bool,
    library: &'a mut WgslLibrary,
    names: HashMap<NodeId, String>,
    reserved_names: HashSet<String>,
    body: String,
    blocks: Blocks,
    /// Block that text is added to.
    block: usize,
}

impl FunctionWriter<'_> {
    fn name(&self, id: NodeId) -> String {
        match self.graph.get(id) {
            GraphNode::World if self.dual => "world".to_owned(),
            GraphNode::World => "p".to_owned(),
            _ => self.names.get(&id).cloned().unwrap_or_default(),
        }
    }

    fn number(&self, number: GraphNumber) -> String {
        match number {
            GraphNumber::Constant(v) => scalar_literal(v),
            GraphNumber::Uniform(u) => format!("uniforms[{}][{}]", u / 4, u % 4),
        }
    }

    fn numbers(&self, numbers: &[GraphNumber]) -> String {
        let list: Vec<String> = numbers.iter().map(|&n| self.number(n)).collect();
        list.join(", ")
    }

    /// Returns an unused name, from the scene if the node has one, otherwise from its kind.
    fn new_name(&mut self, id: NodeId, kind: &str) -> String {
        let scene_name = self
            .graph
            .origin(id)
            .map(|o| identifier(&o.name))
            .filter(|n| !n.is_empty());
        let stem = scene_name.unwrap_or_else(|| kind.to_owned());
        let mut name = stem.clone();
        // A name and that of its surface are both reserved; the counter ends the search.
        let mut number = id.0;
        while self.reserved_names.contains(&name)
            || self.reserved_names.contains(&format!("{name}_surface"))
        {
            name = format!("{stem}_{number}");
            number += 1;
        }
        self.reserved_names.insert(name.clone());
        self.reserved_names.insert(format!("{name}_surface"));
        self.names.insert(id, name.clone());
        name
    }

    fn line(&mut self, name: &str, value: &str) {
        self.text(&format!("let {name} = {value};"));
    }

    /// Writes a line with the indentation of the block.
    fn text(&mut self, content: &str) {
        let indent = 4 * (1 + self.blocks.depth(self.block));
        let _ = writeln!(self.body, "{:indent$}{content}", "");
    }

    /// Writes the nodes of the current block.
    fn statements(&mut self) {
        for id in self.blocks.members(self.block) {
            self.statement(id);
        }
    }

    fn statement(&mut self, id: NodeId) {
        let graph = self.graph;
        match graph.get(id) {
            GraphNode::World => {}
            GraphNode::Moved { point, by } => {
                let (from, by) = (self.name(*point), self.numbers(by));
                let name = self.new_name(id, "q");
                if self.dual {
                    let value = format!(
                        "DualPoint({from}.p + vec3f({by}), {from}.dx, {from}.dy, {from}.dz)"
                    );
                    self.line(&name, &value);
                } else {
                    self.line(&name, &format!("{from} + vec3f({by})"));
                }
            }
            GraphNode::Mapped { point, rows } => {
                let from = self.name(*point);
                // WGSL's matrices are written by columns.
                let column = |c: usize| self.numbers(&[rows[c], rows[4 + c], rows[8 + c]]);
                let matrix = format!(
                    "mat3x3f({}, {}, {}), vec3f({})",
                    column(0),
                    column(1),
                    column(2),
                    column(3)
                );
                let name = self.new_name(id, "q");
                if self.dual {
                    self.library.use_mapped_gradient();
                    self.line(&name, &format!("mapped_gradient({from}, {matrix})"));
                } else {
                    self.library.use_mapped();
                    self.line(&name, &format!("mapped({from}, {matrix})"));
                }
            }
            GraphNode::Constant(number) => {
                let number = self.number(*number);
                let name = self.new_name(id, "c");
                let value = if self.dual {
                    format!("vec4f(0.0, 0.0, 0.0, {number})")
                } else {
                    number
                };
                self.line(&name, &value);
            }
            GraphNode::Normal { point, axis } => {
                let from = self.name(*point);
                let axis = ["x", "y", "z"][usize::from(*axis)];
                let name = self.new_name(id, "n");
                self.library.use_local_normal();
                let value = format!(
                    "vec4f(0.0, 0.0, 0.0, local_normal({from}.dx, {from}.dy, {from}.dz, n).{axis})"
                );
                self.line(&name, &value);
            }
            GraphNode::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                self.application(id, *op, *point, values, parameters);
            }
            GraphNode::Chain {
                op,
                parameters,
                first,
                steps,
            } => {
                let from = self.name(*first);
                let name = self.new_name(id, "d");
                self.text(&format!("var {name} = {from};"));
                if self.surface {
                    let surface = self.surface_name(*first);
                    let surface = surface.unwrap_or_else(|| "unpainted_surface()".to_owned());
                    self.text(&format!("var {name}_surface = {surface};"));
                }
                let chain = OpenChain {
                    name,
                    op: *op,
                    constants: self.parameters(*op, parameters),
                };
                self.steps(id, &chain, steps);
            }
            GraphNode::Paint {
                value,
                constants,
                channels,
            } => {
                self.paint(id, *value, constants, channels);
            }
        }
    }

    /// Writes the steps of a chain, in a block behind each guard. Recursion over nested guards, whose
    /// depth the format bounds.
    fn steps(&mut self, id: NodeId, chain: &OpenChain, steps: &[GraphChainStep]) {
        // Ends of the open blocks.
        let mut ends: Vec<(usize, usize)> = Vec::new();
        for (index, step) in steps.iter().enumerate() {
            self.close(&mut ends, index);
            match step {
                GraphChainStep::Blend(value) => self.blend(chain, *value),
                GraphChainStep::Guard(guard) => {
                    self.condition(chain, guard);
                    ends.push((index + 1 + guard.steps as usize, self.block));
                    self.block = self.blocks.block_behind(id, index);
                    self.statements();
                }
            }
        }
        self.close(&mut ends, steps.len());
    }

    /// Closes the blocks that end before a step.
    fn close(&mut self, ends: &mut Vec<(usize, usize)>, index: usize) {
        while let Some((_, outer)) = ends.pop_if(|(end, _)| *end <= index) {
            self.block = outer;
            self.text("}");
        }
    }

    fn condition(&mut self, chain: &OpenChain, guard: &Guard) {
        self.library.use_guard();
        let point = self.name(guard.point);
        let (point, value) = if self.dual {
            (format!("{point}.p"), format!("{}.w", chain.name))
        } else {
            (point, chain.name.clone())
        };
        let [x, y, z, reach, a, b, c, factor] = guard.numbers.map(|n| self.number(n));
        self.text(&format!(
            "if !({GUARD_NAME}({point}, {value}, vec3f({x}, {y}, {z}), {reach}, \
             vec3f({a}, {b}, {c}), {factor}) > 0.0) {{"
        ));
    }

    /// Blends a value into the value of a chain so far.
    fn blend(&mut self, chain: &OpenChain, value: NodeId) {
        let OpenChain {
            name,
            op,
            constants,
        } = chain;
        let other = self.name(value);
        if self.surface {
            let surface = self.surface_name(value);
            let surface = surface.unwrap_or_else(|| "unpainted_surface()".to_owned());
            let own_surface = format!("{name}_surface");
            let mixed = self.mixed_surface(
                *op,
                None,
                [name, &other],
                [&own_surface, &surface],
                constants,
            );
            self.text(&format!("{own_surface} = {mixed};"));
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

    /// Returns the surface of a combination of two.
    fn mixed_surface(
        &mut self,
        op: Op,
        point: Option<String>,
        [a, b]: [&str; 2],
        [first, second]: [&str; 2],
        constants: &[String],
    ) -> String {
        // The point is constant: only the derivatives by the operands are used.
        let constant_point = point.map(|q| format!("DualPoint({q}.p, vec3f(), vec3f(), vec3f())"));
        let seeds = vec![first_seed(op, a, b), format!("vec4f(0.0, 1.0, 0.0, {b}.w)")];
        let mut arguments = inputs(op, constant_point, seeds);
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
        parameters: &[GraphNumber],
    ) {
        let from = point.map(|p| self.name(p));
        let operands: Vec<String> = values.iter().map(|&v| self.name(v)).collect();
        let mut arguments = inputs(op, from.clone(), operands);
        let constants = self.parameters(op, parameters);
        arguments.extend(constants.iter().cloned());
        let function = wgsl_name(op);
        let kind = if node_is_point(op) { "q" } else { "d" };
        let name = self.new_name(id, kind);
        let arguments = arguments.join(", ");
        if self.dual {
            self.library.use_gradient(op);
            self.line(&name, &format!("{function}_gradient({arguments})"));
        } else {
            self.library.use_value(op);
            self.line(&name, &format!("{function}({arguments})"));
        }
        if self.surface && !node_is_point(op) {
            self.result_surface(&name, op, from, values, &constants);
        }
    }

    /// Writes the surface of an operation's result: mixed for combinations, otherwise that of the first
    /// operand.
    fn result_surface(
        &mut self,
        name: &str,
        op: Op,
        point: Option<String>,
        values: &[NodeId],
        constants: &[String],
    ) {
        let surfaces: Vec<String> = values
            .iter()
            .filter_map(|&v| self.surface_name(v))
            .collect();
        let value = match (values, surfaces.as_slice()) {
            ([a, b], [first, second]) if op.row().facts.category == Category::Combine => {
                let (a, b) = (self.name(*a), self.name(*b));
                self.mixed_surface(op, point, [&a, &b], [first, second], constants)
            }
            (_, [first, ..]) => first.clone(),
            _ => "unpainted_surface()".to_owned(),
        };
        self.line(&format!("{name}_surface"), &value);
    }

    fn surface_name(&self, id: NodeId) -> Option<String> {
        match self.graph.get(id) {
            GraphNode::Constant(_) | GraphNode::Normal { .. } => None,
            _ => Some(format!("{}_surface", self.name(id))),
        }
    }

    fn paint(
        &mut self,
        id: NodeId,
        value: NodeId,
        constants: &[GraphNumber; 12],
        channels: &[(u8, NodeId)],
    ) {
        let from = self.name(value);
        let name = self.new_name(id, "painted");
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

    /// Returns an operation's parameters as WGSL arguments.
    fn parameters(&self, op: Op, parameters: &[GraphNumber]) -> Vec<String> {
        let mut remaining = parameters;
        let mut list = Vec::new();
        for parameter in op.row().parameters {
            let (numbers, following) = remaining.split_at(parameter.ty.width());
            remaining = following;
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
struct OpenChain {
    /// Variable with the value so far.
    name: String,
    op: Op,
    /// The operation's parameters.
    constants: Vec<String>,
}

/// Returns the inputs of an operation in their order.
fn inputs(op: Op, point: Option<String>, values: Vec<String>) -> Vec<String> {
    let mut values = values.into_iter();
    let rows = op.row().inputs.iter();
    let arguments = rows.filter_map(|input| match input {
        Input::Point => point.clone(),
        Input::Value => values.next(),
    });
    arguments.collect()
}

fn node_is_point(op: Op) -> bool {
    op.row().output == sdfc_vm::row::Output::Point
}

/// Converts a name of the scene to a WGSL identifier of letters, digits and underscores. A prefix avoids all
/// words of WGSL and all functions here.
fn identifier(name: &str) -> String {
    let letters: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .take(40)
        .collect();
    let letters = letters.trim_matches('_').to_owned();
    if letters.is_empty() {
        letters
    } else {
        format!("s_{letters}")
    }
}
