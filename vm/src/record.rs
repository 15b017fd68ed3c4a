//! The recorder: a number type whose values are expression nodes, so that evaluating a generic body on it
//! records the body as a WGSL function.
//!
//! Vectors are kept as vectors. A node that is used once is written in place. A node that is used more often
//! becomes a `let`, with the name from the body. Recording a body on [`Dual`] numbers gives WGSL that returns
//! the value together with its gradient. A scalar result becomes a `vec4f` with the gradient in `xyz`, a
//! point becomes a `DualPoint` (see [`DUAL_POINT`]). Recording it on [`RecordedInterval`]s gives WGSL that
//! returns bounds over a box: a `vec2f` for a scalar, a `BoxPoint` for a point (see [`BOX_POINT`]).

mod interval;

pub use interval::{BOX_POINT, RecordedInterval};

use crate::dual::{Dual, DualVec3};
use crate::real::{Real, Vector2, Vector3};
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The WGSL declaration of a point with its Jacobian, the equivalent of `DualVec3`.
pub const DUAL_POINT: &str = "struct DualPoint { p: vec3f, dx: vec3f, dy: vec3f, dz: vec3f }\n";

/// A recorded WGSL function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedFunction {
    /// Its name in WGSL.
    pub name: String,
    /// Its text, from `fn` to the closing brace.
    pub text: String,
    /// The functions of the prelude that it calls, sorted; see [`crate::prelude`].
    pub calls: Vec<&'static str>,
}

/// The type of a WGSL value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RecordedType {
    /// `bool`
    Bool,
    /// `f32`
    Scalar,
    /// `vec2f`
    Vec2,
    /// `vec3f`
    Vec3,
    /// `vec4f`: a scalar with its gradient.
    DualScalar,
    /// A point with its Jacobian.
    DualPoint,
    /// `vec2f`: the ends of an interval.
    Interval,
    /// A box of points.
    BoxPoint,
}

impl RecordedType {
    fn wgsl(self) -> &'static str {
        match self {
            RecordedType::Bool => "bool",
            RecordedType::Scalar => "f32",
            RecordedType::Vec2 => "vec2f",
            RecordedType::Vec3 => "vec3f",
            RecordedType::DualScalar => "vec4f",
            RecordedType::DualPoint => "DualPoint",
            RecordedType::Interval => "vec2f",
            RecordedType::BoxPoint => "BoxPoint",
        }
    }
}

#[derive(Clone, PartialEq, Eq, Hash)]
enum Kind {
    Parameter(String),
    /// The bits of an `f32`.
    Literal(u32),
    Prefix(&'static str, u32),
    Infix(&'static str, u32, u32),
    Call(&'static str, Vec<u32>),
    Member(u32, &'static str),
}

struct RecorderNode {
    kind: Kind,
    ty: RecordedType,
    name: Option<&'static str>,
}

#[derive(Default)]
struct Arena {
    nodes: Vec<RecorderNode>,
    ids: HashMap<Kind, u32>,
}

thread_local! {
    static ARENA: RefCell<Arena> = RefCell::default();
}

fn push(kind: Kind, ty: RecordedType) -> u32 {
    ARENA.with_borrow_mut(|arena| {
        if let Some(&known) = arena.ids.get(&kind)
            && arena.nodes[known as usize].ty == ty
        {
            return known;
        }
        let id = arena.nodes.len() as u32;
        arena.ids.insert(kind.clone(), id);
        arena.nodes.push(RecorderNode {
            kind,
            ty,
            name: None,
        });
        id
    })
}

fn set_name(id: u32, name: &'static str) {
    ARENA.with_borrow_mut(|arena| {
        arena.nodes[id as usize].name.get_or_insert(name);
    });
}

fn literal(id: u32) -> Option<f32> {
    ARENA.with_borrow(|arena| match arena.nodes[id as usize].kind {
        Kind::Literal(bits) => Some(f32::from_bits(bits)),
        _ => None,
    })
}

/// Reports whether a node is the zero of its type, which is frequent in derivatives.
fn is_zero(id: u32) -> bool {
    ARENA.with_borrow(|arena| {
        let zero = |id: u32| matches!(arena.nodes[id as usize].kind, Kind::Literal(0));
        match &arena.nodes[id as usize].kind {
            Kind::Call("vec2f" | "vec3f", parts) => parts.iter().all(|&p| zero(p)),
            _ => zero(id),
        }
    })
}

fn is_one(id: u32) -> bool {
    literal(id) == Some(1.0)
}

/// A recorded number.
#[derive(Clone, Copy, Debug)]
pub struct Scalar(u32);
/// A recorded condition.
#[derive(Clone, Copy, Debug)]
pub struct Bool(u32);
/// A recorded pair of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Vec2(u32);
/// A recorded triple of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Vec3(u32);

fn infix(op: &'static str, a: u32, b: u32, ty: RecordedType) -> u32 {
    push(Kind::Infix(op, a, b), ty)
}

fn zero(ty: RecordedType) -> u32 {
    let o = push(Kind::Literal(0), RecordedType::Scalar);
    match ty {
        RecordedType::Vec2 => push(Kind::Call("vec2f", vec![o]), ty),
        RecordedType::Vec3 => push(Kind::Call("vec3f", vec![o]), ty),
        _ => o,
    }
}

fn add(a: u32, b: u32, ty: RecordedType) -> u32 {
    match (is_zero(a), is_zero(b)) {
        (true, _) => b,
        (_, true) => a,
        _ => infix("+", a, b, ty),
    }
}
fn sub(a: u32, b: u32, ty: RecordedType) -> u32 {
    match (is_zero(a), is_zero(b)) {
        (_, true) => a,
        (true, _) => push(Kind::Prefix("-", b), ty),
        _ => infix("-", a, b, ty),
    }
}
fn mul(a: u32, b: u32, ty: RecordedType) -> u32 {
    if is_zero(a) || is_zero(b) {
        return zero(ty);
    }
    match (is_one(a), is_one(b)) {
        (true, _) if ty == RecordedType::Scalar => b,
        (_, true) => a,
        _ => infix("*", a, b, ty),
    }
}
fn neg(a: u32, ty: RecordedType) -> u32 {
    if is_zero(a) {
        a
    } else {
        push(Kind::Prefix("-", a), ty)
    }
}

macro_rules! recorded_arithmetic {
    ($name:ident, $ty:expr) => {
        impl Add for $name {
            type Output = Self;
            fn add(self, b: Self) -> Self {
                Self(add(self.0, b.0, $ty))
            }
        }
        impl Sub for $name {
            type Output = Self;
            fn sub(self, b: Self) -> Self {
                Self(sub(self.0, b.0, $ty))
            }
        }
        impl Mul for $name {
            type Output = Self;
            fn mul(self, b: Self) -> Self {
                Self(mul(self.0, b.0, $ty))
            }
        }
        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(neg(self.0, $ty))
            }
        }
    };
}
recorded_arithmetic!(Scalar, RecordedType::Scalar);
recorded_arithmetic!(Vec2, RecordedType::Vec2);
recorded_arithmetic!(Vec3, RecordedType::Vec3);

impl Div for Scalar {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        if is_zero(self.0) || is_one(b.0) {
            return self;
        }
        Self(infix("/", self.0, b.0, RecordedType::Scalar))
    }
}
impl Mul<Scalar> for Vec2 {
    type Output = Self;
    fn mul(self, b: Scalar) -> Self {
        Self(mul(self.0, b.0, RecordedType::Vec2))
    }
}
impl Mul<Scalar> for Vec3 {
    type Output = Self;
    fn mul(self, b: Scalar) -> Self {
        Self(mul(self.0, b.0, RecordedType::Vec3))
    }
}

fn call(name: &'static str, arguments: Vec<u32>, ty: RecordedType) -> u32 {
    push(Kind::Call(name, arguments), ty)
}

impl Real for Scalar {
    type Bool = Bool;
    type Vec2 = Vec2;
    type Vec3 = Vec3;

    fn constant(value: f64) -> Self {
        // Adding zero normalizes a negative zero, whose sign would be lost in the text.
        Self(push(
            Kind::Literal((value as f32 + 0.0).to_bits()),
            RecordedType::Scalar,
        ))
    }
    fn abs(self) -> Self {
        Self(call("abs", vec![self.0], RecordedType::Scalar))
    }
    fn sqrt(self) -> Self {
        Self(call("sqrt", vec![self.0], RecordedType::Scalar))
    }
    fn floor(self) -> Self {
        Self(call("floor", vec![self.0], RecordedType::Scalar))
    }
    fn min(self, b: Self) -> Self {
        Self(call("min", vec![self.0, b.0], RecordedType::Scalar))
    }
    fn max(self, b: Self) -> Self {
        Self(call("max", vec![self.0, b.0], RecordedType::Scalar))
    }
    fn at_least(self, low: Self) -> Self {
        Self::select(self.less(low), low, self)
    }
    fn at_most(self, high: Self) -> Self {
        Self::select(high.less(self), high, self)
    }
    fn sin(self) -> Self {
        Self(call("sine", vec![self.0], RecordedType::Scalar))
    }
    fn cos(self) -> Self {
        Self(call("cosine", vec![self.0], RecordedType::Scalar))
    }
    fn atan2(self, x: Self) -> Self {
        Self(call("arctangent", vec![self.0, x.0], RecordedType::Scalar))
    }
    fn exp2(self) -> Self {
        Self(call("exponential", vec![self.0], RecordedType::Scalar))
    }
    fn log2(self) -> Self {
        Self(call("logarithm", vec![self.0], RecordedType::Scalar))
    }
    fn power_of_two(self) -> Self {
        Self(call("power_of_two", vec![self.0], RecordedType::Scalar))
    }
    fn exponent(self) -> Self {
        Self(call("exponent_of", vec![self.0], RecordedType::Scalar))
    }
    fn mantissa(self) -> Self {
        Self(call("mantissa_of", vec![self.0], RecordedType::Scalar))
    }
    fn lattice(cell: Vec3, seed: Self) -> Vec3 {
        Vec3(call("lattice", vec![cell.0, seed.0], RecordedType::Vec3))
    }
    fn noise_corner_gradient(cell: Vec3, seed: Self) -> Vec3 {
        Vec3(call(
            "lattice_edge",
            vec![cell.0, seed.0],
            RecordedType::Vec3,
        ))
    }
    fn noise(p: Vec3, seed: Self) -> Self {
        Self(call("noise", vec![p.0, seed.0], RecordedType::Scalar))
    }
    fn noise_gradient(p: Vec3, seed: Self) -> (Self, Vec3) {
        let value_and_gradient = call(
            "noise_gradient",
            vec![p.0, seed.0],
            RecordedType::DualScalar,
        );
        set_name(value_and_gradient, "noise");
        let value = push(Kind::Member(value_and_gradient, "w"), RecordedType::Scalar);
        (
            Self(value),
            Vec3(push(
                Kind::Member(value_and_gradient, "xyz"),
                RecordedType::Vec3,
            )),
        )
    }
    fn ellipsoid(p: Vec3, r: Vec3) -> Self {
        Self(call("ellipsoid", vec![p.0, r.0], RecordedType::Scalar))
    }
    fn ellipsoid_gradient(p: Vec3, r: Vec3) -> (Self, Vec3) {
        let value_and_gradient = call(
            "ellipsoid_gradient",
            vec![p.0, r.0],
            RecordedType::DualScalar,
        );
        let value = push(Kind::Member(value_and_gradient, "w"), RecordedType::Scalar);
        (
            Self(value),
            Vec3(push(
                Kind::Member(value_and_gradient, "xyz"),
                RecordedType::Vec3,
            )),
        )
    }
    fn noise_slope(p: Vec3, seed: Self) -> Vec3 {
        Self::noise_gradient(p, seed).1
    }
    fn named(self, name: &'static str) -> Self {
        set_name(self.0, name);
        self
    }
    fn less(self, b: Self) -> Bool {
        Bool(infix("<", self.0, b.0, RecordedType::Bool))
    }
    fn and(a: Bool, b: Bool) -> Bool {
        Bool(infix("&", a.0, b.0, RecordedType::Bool))
    }
    fn or(a: Bool, b: Bool) -> Bool {
        Bool(infix("|", a.0, b.0, RecordedType::Bool))
    }
    fn not(a: Bool) -> Bool {
        Bool(push(Kind::Prefix("!", a.0), RecordedType::Bool))
    }
    fn select(condition: Bool, then: Self, otherwise: Self) -> Self {
        if then.0 == otherwise.0 {
            return then;
        }
        Self(call(
            "select",
            vec![otherwise.0, then.0, condition.0],
            RecordedType::Scalar,
        ))
    }
}

macro_rules! recorded_vector {
    ($name:ident, $trait:ident, $ty:expr, $constructor:literal, $length:literal, { $($axis:ident $i:literal),+ }) => {
        impl $trait<Scalar> for $name {
            fn new($($axis: Scalar),+) -> Self {
                let parts = [$($axis.0),+];
                if parts.iter().all(|&p| p == parts[0]) {
                    return Self(call($constructor, vec![parts[0]], $ty));
                }
                Self(call($constructor, parts.to_vec(), $ty))
            }
            $(fn $axis(self) -> Scalar {
                Scalar(component(self.0, stringify!($axis), $i, $constructor))
            })+
            fn abs(self) -> Self {
                Self(call("abs", vec![self.0], $ty))
            }
            fn min(self, b: Self) -> Self {
                Self(call("min", vec![self.0, b.0], $ty))
            }
            fn max(self, b: Self) -> Self {
                Self(call("max", vec![self.0, b.0], $ty))
            }
            fn select(condition: Bool, then: Self, otherwise: Self) -> Self {
                if then.0 == otherwise.0 || (is_zero(then.0) && is_zero(otherwise.0)) {
                    return then;
                }
                Self(call("select", vec![otherwise.0, then.0, condition.0], $ty))
            }
            fn named(self, name: &'static str) -> Self {
                set_name(self.0, name);
                self
            }
            fn length(self) -> Scalar {
                Scalar(call($length, vec![self.0], RecordedType::Scalar))
            }
            recorded_vector!(@extra $trait);
        }
    };
    (@extra Vector2) => {};
    (@extra Vector3) => {
        fn floor(self) -> Self {
            Self(call("floor", vec![self.0], RecordedType::Vec3))
        }
        fn xy(self) -> Vec2 {
            Vec2(pair(self, "xy", self.x(), self.y()))
        }
        fn xz(self) -> Vec2 {
            Vec2(pair(self, "xz", self.x(), self.z()))
        }
    };
}
recorded_vector!(Vec2, Vector2, RecordedType::Vec2, "vec2f", "length2", { x 0, y 1 });
recorded_vector!(Vec3, Vector3, RecordedType::Vec3, "vec3f", "length3", { x 0, y 1, z 2 });

/// Returns a component of a vector. For a constructed vector it is the part itself; for a swizzle, the
/// component of the original vector.
fn component(vector: u32, axis: &'static str, index: usize, constructor: &str) -> u32 {
    enum Component {
        Part(u32),
        Member(u32, &'static str),
    }
    let component = ARENA.with_borrow(|arena| match &arena.nodes[vector as usize].kind {
        Kind::Call(name, parts) if *name == constructor => {
            Component::Part(*parts.get(index).unwrap_or(&parts[0]))
        }
        Kind::Member(source, "xy") => Component::Member(*source, ["x", "y"][index]),
        Kind::Member(source, "xz") => Component::Member(*source, ["x", "z"][index]),
        _ => Component::Member(vector, axis),
    });
    match component {
        Component::Part(part) => part,
        Component::Member(vector, axis) => push(Kind::Member(vector, axis), RecordedType::Scalar),
    }
}

/// Returns two components of a vector as one node; for a constructed vector, a vector of its parts.
fn pair(vector: Vec3, axes: &'static str, x: Scalar, y: Scalar) -> u32 {
    let built = ARENA
        .with_borrow(|arena| matches!(arena.nodes[vector.0 as usize].kind, Kind::Call("vec3f", _)));
    if built {
        Vec2::new(x, y).0
    } else {
        push(Kind::Member(vector.0, axes), RecordedType::Vec2)
    }
}

/// The type of a parameter or result of a recorded function.
pub trait Recorded: Sized {
    /// Its WGSL type.
    const TYPE: RecordedType;
    /// Creates the parameter called `name`.
    fn parameter(name: &str) -> Self;
    /// Returns the node of the value, and constructs it if necessary.
    fn node(self) -> RecordedNode;
}

/// A node of the function that is being recorded.
#[derive(Clone, Copy, Debug)]
pub struct RecordedNode(u32);

macro_rules! recorded_plain {
    ($name:ident, $ty:expr) => {
        impl Recorded for $name {
            const TYPE: RecordedType = $ty;
            fn parameter(name: &str) -> Self {
                Self(push(Kind::Parameter(name.to_owned()), $ty))
            }
            fn node(self) -> RecordedNode {
                RecordedNode(self.0)
            }
        }
    };
}
recorded_plain!(Bool, RecordedType::Bool);
recorded_plain!(Scalar, RecordedType::Scalar);
recorded_plain!(Vec2, RecordedType::Vec2);
recorded_plain!(Vec3, RecordedType::Vec3);

impl Recorded for Dual<Scalar> {
    const TYPE: RecordedType = RecordedType::DualScalar;
    fn parameter(name: &str) -> Self {
        let parameter = push(Kind::Parameter(name.to_owned()), RecordedType::DualScalar);
        Self {
            value: Scalar(push(Kind::Member(parameter, "w"), RecordedType::Scalar)),
            gradient: Vec3(push(Kind::Member(parameter, "xyz"), RecordedType::Vec3)),
        }
    }
    fn node(self) -> RecordedNode {
        let parts = vec![self.gradient.0, self.value.0];
        RecordedNode(call("vec4f", parts, RecordedType::DualScalar))
    }
}

impl Recorded for DualVec3<Scalar> {
    const TYPE: RecordedType = RecordedType::DualPoint;
    fn parameter(name: &str) -> Self {
        let parameter = push(Kind::Parameter(name.to_owned()), RecordedType::DualPoint);
        let member = |m| Vec3(push(Kind::Member(parameter, m), RecordedType::Vec3));
        Self {
            value: member("p"),
            gradients: [member("dx"), member("dy"), member("dz")],
        }
    }
    fn node(self) -> RecordedNode {
        let [dx, dy, dz] = self.gradients;
        let parts = vec![self.value.0, dx.0, dy.0, dz.0];
        RecordedNode(call("DualPoint", parts, RecordedType::DualPoint))
    }
}

/// Collects the parameters of the function that is being recorded, in order.
#[derive(Default)]
pub struct Signature {
    parameters: Vec<String>,
}

impl Signature {
    /// Adds the next parameter, of the inferred type.
    pub fn parameter<T: Recorded>(&mut self, name: &str) -> T {
        self.parameters.push(format!("{name}: {}", T::TYPE.wgsl()));
        T::parameter(name)
    }
    /// Adds the next parameter, a plain scalar without a gradient.
    pub fn fixed(&mut self, name: &str) -> Dual<Scalar> {
        Dual::fixed(self.parameter(name))
    }
}

/// Records `body` as the WGSL function `name`.
pub fn record<T: Recorded>(name: &str, body: impl FnOnce(&mut Signature) -> T) -> RecordedFunction {
    record_nodes(
        name,
        T::TYPE.wgsl(),
        |signature| body(signature).node(),
        None,
    )
}

/// Records a body with several results. The function returns the struct `structure`, whose fields are the
/// results in order. The struct's declaration precedes the function.
pub fn record_struct(
    name: &str,
    structure: &str,
    body: impl FnOnce(&mut Signature) -> Vec<(&'static str, RecordedType, RecordedNode)>,
) -> RecordedFunction {
    let mut declaration = String::new();
    let mut function = record_nodes(
        name,
        structure,
        |signature| {
            let fields = body(signature);
            let list: Vec<String> = fields
                .iter()
                .map(|(name, ty, _)| format!("{name}: {}", ty.wgsl()))
                .collect();
            declaration = format!("struct {structure} {{ {} }}\n", list.join(", "));
            let parts = fields.iter().map(|(_, _, node)| node.0).collect();
            RecordedNode(call("#struct", parts, RecordedType::DualPoint))
        },
        Some(structure),
    );
    function.text.insert_str(0, &declaration);
    function
}

fn record_nodes(
    name: &str,
    result: &str,
    body: impl FnOnce(&mut Signature) -> RecordedNode,
    structure: Option<&str>,
) -> RecordedFunction {
    ARENA.with_borrow_mut(|arena| *arena = Arena::default());
    let mut signature = Signature::default();
    let root = body(&mut signature).0;
    let arena = ARENA.with_borrow_mut(std::mem::take);
    let mut writer = Writer::new(&arena, root, structure);
    let value = writer.expression(root, 0);
    writer.calls.sort_unstable();
    writer.calls.dedup();
    let mut text = String::new();
    let parameters = signature.parameters.join(", ");
    let _ = writeln!(text, "fn {name}({parameters}) -> {result} {{");
    text.push_str(&writer.lines);
    let _ = writeln!(text, "    return {value};\n}}");
    RecordedFunction {
        name: name.to_owned(),
        text,
        calls: writer.calls,
    }
}

/// Writes nodes as WGSL: those used once in place, the others as preceding `let`s.
struct Writer<'a> {
    arena: &'a Arena,
    uses: Vec<u32>,
    names: HashMap<u32, String>,
    taken: HashMap<String, u32>,
    structure: Option<&'a str>,
    lines: String,
    calls: Vec<&'static str>,
}

impl<'a> Writer<'a> {
    fn new(arena: &'a Arena, root: u32, structure: Option<&'a str>) -> Self {
        let mut uses = vec![0; arena.nodes.len()];
        count_uses(arena, root, &mut uses);
        let taken = arena
            .nodes
            .iter()
            .filter_map(|node| match &node.kind {
                Kind::Parameter(name) => Some((name.clone(), 1)),
                _ => None,
            })
            .collect();
        Self {
            arena,
            uses,
            names: HashMap::new(),
            taken,
            structure,
            lines: String::new(),
            calls: Vec::new(),
        }
    }

    /// Returns the text of a node; `depth` is its nesting depth within one expression.
    fn expression(&mut self, id: u32, depth: u32) -> String {
        if let Some(name) = self.names.get(&id) {
            return name.clone();
        }
        let node = &self.arena.nodes[id as usize];
        let (text, trivial) = match &node.kind {
            Kind::Parameter(name) => return name.clone(),
            Kind::Literal(bits) => return scalar_literal(f32::from_bits(*bits)),
            Kind::Prefix(op, a) => (format!("{op}{}", self.operand(*a, 5, depth)), false),
            Kind::Infix(op, a, b) => {
                let binding = binding(op);
                let left = self.operand(*a, binding.max(1), depth);
                let right = self.operand(*b, binding + 1, depth);
                (format!("{left} {op} {right}"), false)
            }
            Kind::Call(name, parts) => {
                if crate::prelude::names::is_prelude(name) {
                    self.calls.push(name);
                }
                let parts: Vec<String> = parts
                    .iter()
                    .map(|&p| self.expression(p, depth + 1))
                    .collect();
                let name = if *name == "#struct" {
                    self.structure.unwrap_or(name)
                } else {
                    name
                };
                let text = format!("{name}({})", parts.join(", "));
                let constant = self.is_constant(id);
                (text, constant)
            }
            Kind::Member(a, member) => {
                let trivial = matches!(self.arena.nodes[*a as usize].kind, Kind::Parameter(_))
                    || self.names.contains_key(a);
                let a = self.operand(*a, 5, depth);
                (format!("{a}.{member}"), trivial || !a.contains(['(', ' ']))
            }
        };
        let shared = self.uses[id as usize] > 1;
        if trivial || (!shared && node.name.is_none() && depth < 24) {
            return text;
        }
        let name = self.fresh(node.name.unwrap_or("v"));
        let _ = writeln!(self.lines, "    let {name} = {text};");
        self.names.insert(id, name.clone());
        name
    }

    /// Reports whether a node is a vector of literals, which is as short as a name for it.
    fn is_constant(&self, id: u32) -> bool {
        let literal = |id: &u32| matches!(self.arena.nodes[*id as usize].kind, Kind::Literal(_));
        matches!(&self.arena.nodes[id as usize].kind,
            Kind::Call("vec2f" | "vec3f", parts) if parts.iter().all(literal))
    }

    /// Returns the text of a node as an operand, in parentheses if its precedence is below `needed`.
    fn operand(&mut self, id: u32, needed: u32, depth: u32) -> String {
        let text = self.expression(id, depth + 1);
        let binds = match self.arena.nodes[id as usize].kind {
            _ if self.names.contains_key(&id) => 6,
            Kind::Infix(op, ..) => binding(op),
            Kind::Prefix(..) => 4,
            _ if text.starts_with('-') => 4,
            _ => 6,
        };
        if binds < needed {
            format!("({text})")
        } else {
            text
        }
    }

    /// Returns an unused name: `base`, with a number appended if it is taken.
    fn fresh(&mut self, base: &str) -> String {
        let mut name = base.to_owned();
        while self.taken.contains_key(&name) {
            let count = self.taken.entry(base.to_owned()).or_insert(1);
            *count += 1;
            name = format!("{base}{count}");
        }
        self.taken.insert(name.clone(), 1);
        name
    }
}

/// Returns the precedence of an operator; that of signs is 4, that of members 5. Comparisons and logical
/// operators have the lowest one, and are always parenthesized as operands, as WGSL requires.
fn binding(op: &str) -> u32 {
    match op {
        "*" | "/" => 3,
        "+" | "-" => 2,
        _ => 0,
    }
}

fn operands(kind: &Kind) -> &[u32] {
    match kind {
        Kind::Parameter(_) | Kind::Literal(_) => &[],
        Kind::Prefix(_, a) | Kind::Member(a, _) => std::slice::from_ref(a),
        Kind::Infix(_, _, _) => &[],
        Kind::Call(_, parts) => parts,
    }
}

fn count_uses(arena: &Arena, root: u32, uses: &mut [u32]) {
    let mut pending = vec![root];
    while let Some(id) = pending.pop() {
        uses[id as usize] += 1;
        if uses[id as usize] > 1 {
            continue;
        }
        let kind = &arena.nodes[id as usize].kind;
        if let Kind::Infix(_, a, b) = kind {
            pending.extend([*a, *b]);
        }
        pending.extend(operands(kind));
    }
}

/// Returns an `f32` as WGSL text that parses back to the same bits.
pub fn scalar_literal(value: f32) -> String {
    // Rust prints the shortest text that parses back to the same number; WGSL requires a point or an
    // exponent.
    let text = format!("{value:?}");
    if text.contains(['.', 'e']) {
        text
    } else {
        format!("{text}.0")
    }
}
