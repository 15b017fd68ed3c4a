//! The scene: what the text means, with names, types and compile-time loops resolved.
//!
//! What holds of every scene: each shape's operands stand before it in [`Scene::shapes`]; the
//! parameters of shapes are constant or uniform; expressions of point stage occur only where this
//! file says so, and are then about the point in the local frame of the shape they stand in;
//! numbers are in scene units, radians, seconds and linear colour.

use crate::expression::{ExprId, Expressions};
use sdfc_lang::Span;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::settings;
pub use sdfc_vm::settings::{Animation, Normals, Occlusion, ParamKind, Tonemap};
use sdfc_vm::table::Op;

/// A shape of the scene, by its position in [`Scene::shapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeId(pub u32);

/// A material of the scene, by its position in [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Three numbers.
pub type Triple = [ExprId; 3];

/// A whole scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// All numbers.
    pub expressions: Expressions,
    /// The parameters, structural ones too, in the order of the text.
    pub params: Vec<Param>,
    /// All shapes, operands before what uses them.
    pub shapes: Vec<Shape>,
    /// The shape that is drawn: the final expression, or the union of all parts.
    pub root: Option<ShapeId>,
    /// The named outputs.
    pub parts: Vec<(String, ShapeId)>,
    /// The materials; the first is the default one.
    pub materials: Vec<Material>,
    /// The cameras; never empty, since a scene without one gets one that frames its bounds, marked
    /// `automatic`.
    pub cameras: Vec<Camera>,
    /// The lights; a scene without any gets a key and a fill light.
    pub lights: Vec<Light>,
    /// What is seen where nothing is hit.
    pub sky: Sky,
    /// How it is drawn.
    pub render: Render,
    /// How it moves, if it does.
    pub animation: Option<Animation>,
    /// Conditions on uniform numbers, to be checked whenever a live parameter changes.
    pub checks: Vec<Check>,
    /// Whether the scene is a plane figure (`shape2`), drawn face on.
    pub plane: bool,
    /// Whether z is the axis that points up (`scene { up: z }`).
    pub z_up: bool,
    /// What `print` said.
    pub printed: Vec<String>,
}

impl Scene {
    /// A new shape, with the name and the text of another one.
    pub(crate) fn derived(&mut self, like: ShapeId, kind: ShapeKind) -> ShapeId {
        let shape = self.shapes[like.0 as usize].clone();
        self.shapes.push(Shape { kind, ..shape });
        ShapeId(self.shapes.len() as u32 - 1)
    }
}

/// A parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// The text of its `///`.
    pub doc: String,
    /// What kind of value it takes.
    pub kind: ParamKind,
    /// The value it has: one number, or three for colours (linear) and vectors.
    pub value: Vec<f64>,
    /// The value in the text.
    pub default: Vec<f64>,
    /// The smallest and the largest value allowed, in the units below.
    pub range: Option<(f64, f64)>,
    /// Whether the largest value itself is allowed.
    pub inclusive: bool,
    /// The distance between two values of a slider.
    pub step: Option<f64>,
    /// Whether it decides structure: then a change makes a new program.
    pub structural: bool,
    /// Where it is declared.
    pub span: Span,
}

/// A shape: a solid, or a figure in the xy plane.
#[derive(Clone, Debug)]
pub struct Shape {
    /// How it comes about.
    pub kind: ShapeKind,
    /// Whether it is a figure in the plane.
    pub plane: bool,
    /// The name it was given in the text, for readable listings; empty if none.
    pub name: String,
    /// The text that made it.
    pub span: Span,
}

/// How a shape comes about.
#[derive(Clone, Debug)]
pub enum ShapeKind {
    /// A row of shapes, its parameters already prepared (`table::prepare`), without gaps.
    Primitive {
        /// The row.
        op: Op,
        /// Its parameters' numbers.
        parameters: Vec<ExprId>,
    },
    /// A raw field: a number of point stage.
    Field {
        /// The value: negative inside.
        value: ExprId,
        /// The slope bound that the scene states (`lipschitz:`), else it is found by intervals.
        slope: Option<ExprId>,
        /// The region outside which the field need not be known, if it is bounded.
        region: Bounds,
    },
    /// A polygon in the plane: its corners, in order.
    Polygon {
        /// The corners.
        points: Vec<[ExprId; 2]>,
    },
    /// Two or more shapes into one by a row of [`sdfc_vm::row::Category::Combine`], from left to
    /// right.
    Combine {
        /// The row; it takes two values.
        op: Op,
        /// The operands.
        children: Vec<ShapeId>,
        /// The row's parameters, prepared.
        parameters: Vec<ExprId>,
    },
    /// The child in a frame of its own: it is evaluated at `matrix · p`, and its distance is
    /// multiplied by `scale`.
    Frame {
        /// The child.
        child: ShapeId,
        /// From the outer to the inner point: rows of three factors and a shift.
        matrix: [ExprId; 12],
        /// What a distance in the inner frame is worth outside: 1 for rigid motions, the factor of
        /// a uniform scale, the smallest factor of one by axes.
        scale: ExprId,
    },
    /// The union of the child's copies in the cells of a grid.
    Repeat {
        /// [`Op::Repeat`] or [`Op::RepeatLimited`].
        op: Op,
        /// The child, whose cell is that around the origin.
        child: ShapeId,
        /// The row's parameters, prepared.
        parameters: Vec<ExprId>,
        /// Which other copies may be the nearest one of a point, along each axis.
        others: [Others; 3],
    },
    /// The union of the child's copies in the sectors of a full turn.
    Polar {
        /// [`Op::Polar`] or [`Op::PolarPlane`].
        op: Op,
        /// The child, whose sector is that around the phase.
        child: ShapeId,
        /// The row's parameters, prepared.
        parameters: Vec<ExprId>,
        /// Which other copies may be the nearest one of a point.
        others: Others,
    },
    /// The child evaluated at another point, by a row that gives a point.
    Domain {
        /// The row.
        op: Op,
        /// The child.
        child: ShapeId,
        /// The row's parameters, prepared.
        parameters: Vec<ExprId>,
    },
    /// The child evaluated at a point that the scene computes: three numbers of point stage.
    Warp {
        /// The child.
        child: ShapeId,
        /// The point.
        point: Triple,
    },
    /// The child's distance changed by a row of one value (`offset`, `shell`, …); a row that also
    /// reads the point reads the one outside the child.
    Distance {
        /// The row.
        op: Op,
        /// The child.
        child: ShapeId,
        /// The row's parameters, prepared.
        parameters: Vec<ExprId>,
    },
    /// The child with a number of point stage added to its distance.
    Displace {
        /// The child.
        child: ShapeId,
        /// The number.
        amount: ExprId,
    },
    /// The child in a material, whatever materials it had before.
    Painted {
        /// The child.
        child: ShapeId,
        /// The material.
        material: MaterialId,
    },
    /// No shape at all; it is in no combination (the elaborator drops it there), only alone.
    Nothing,
}

/// The copies of a repetition that may be nearer to a point than the copy of its own cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Others {
    /// The number of cells on the side that the point is nearer to.
    pub near: u8,
    /// The number of cells on the other side.
    pub far: u8,
}

/// The value of no shape at all: farther than anything that a ray can meet.
pub(crate) const NOWHERE: f64 = 1e9;
/// The value of a polygon before its first edge: a distance longer than any in a scene.
pub(crate) const NO_EDGE: f64 = 1e30;

/// The row that leads to another copy of a repetition by `op`.
pub(crate) fn neighbour(op: Op) -> Op {
    match op {
        Op::Repeat => Op::RepeatNeighbour,
        Op::RepeatLimited => Op::RepeatLimitedNeighbour,
        Op::Polar => Op::PolarNeighbour,
        Op::PolarPlane => Op::PolarPlaneNeighbour,
        _ => unreachable!("`{}` makes no copies", op.row().name),
    }
}

/// The cells of a grid whose copies are evaluated, those along x first.
pub(crate) fn grid_cells(others: &[Others; 3]) -> impl Iterator<Item = [f64; 3]> {
    let [x, y, z] = *others;
    let rows = z.cells().flat_map(move |z| y.cells().map(move |y| [y, z]));
    rows.flat_map(move |[y, z]| x.cells().map(move |x| [x, y, z]))
}

impl Others {
    /// The cells whose copies are evaluated, the own one first; positive on the nearer side.
    pub fn cells(self) -> impl Iterator<Item = f64> {
        let near = (1..=self.near).map(f64::from);
        let far = (1..=self.far).map(|cell| -f64::from(cell));
        std::iter::once(0.0).chain(near).chain(far)
    }
}

/// The operands of a kind, by reference to it: `$none` of those without any, `$one` makes a slice of one.
macro_rules! operands {
    ($kind:expr, $none:expr, $one:path) => {
        match $kind {
            ShapeKind::Primitive { .. }
            | ShapeKind::Field { .. }
            | ShapeKind::Polygon { .. }
            | ShapeKind::Nothing => $none,
            ShapeKind::Combine { children, .. } => children,
            ShapeKind::Frame { child, .. }
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Warp { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. }
            | ShapeKind::Painted { child, .. } => $one(child),
        }
    };
}

/// The shapes that a shape is made of.
pub(crate) fn children(kind: &ShapeKind) -> &[ShapeId] {
    operands!(kind, &[], std::slice::from_ref)
}

/// The same, to be changed.
pub(crate) fn children_mut(kind: &mut ShapeKind) -> &mut [ShapeId] {
    operands!(kind, &mut [], std::slice::from_mut)
}

/// A material. Its numbers may be of normal stage: they then read the local point and the normal
/// in the frame of the shape that was painted.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name; empty for colours given in place.
    pub name: String,
    /// The share of light it reflects diffusely, or specularly if metallic: linear red, green, blue.
    pub albedo: Triple,
    /// From 0, a mirror, to 1, chalk.
    pub roughness: ExprId,
    /// From 0, a dielectric, to 1, a metal.
    pub metallic: ExprId,
    /// The light it gives off: linear red, green, blue.
    pub emission: Triple,
    /// A height by which the surface seems displaced when it is lit.
    pub bump: Option<ExprId>,
}

/// A camera. All numbers are uniform.
pub type Camera = settings::Camera<ExprId>;

/// How wide a camera sees.
pub type Lens = settings::Lens<ExprId>;

/// A light. All numbers are uniform.
pub type Light = settings::Light<ExprId>;

/// Where light comes from.
pub type LightSource = settings::LightSource<ExprId>;

/// How a light's shadow is drawn.
pub type Shadow = settings::Shadow<ExprId>;

/// What is seen where nothing is hit, and what light comes from everywhere. All numbers are uniform.
pub type Sky = settings::Sky<ExprId>;

/// How a scene is drawn.
pub type Render = settings::Render<ExprId>;

/// A condition on a uniform number.
#[derive(Clone, Debug)]
pub struct Check {
    /// It must not be below zero.
    pub value: ExprId,
    /// Whether zero itself is forbidden too.
    pub strict: bool,
    /// What is wrong otherwise, as a diagnostic says it.
    pub message: String,
    /// Where it comes from.
    pub span: Span,
}
