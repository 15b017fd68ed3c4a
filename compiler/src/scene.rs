//! The scene: the meaning of the text, with names, types and compile-time loops resolved.
//!
//! Invariants of every scene: each shape's operands are before it in [`Scene::shapes`]; the parameters
//! of shapes are constant or uniform. Expressions of point stage occur only where this file says so,
//! and refer to the point in the local frame of their shape. Numbers are in scene units, radians,
//! seconds and linear colour.

use crate::expression::{ExprId, Expressions};
use sdfc_lang::Span;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::settings;
pub use sdfc_vm::settings::{Animation, Normals, Occlusion, ParamKind, Tonemap};
use sdfc_vm::table::Op;

/// A shape of the scene, by its index in [`Scene::shapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeId(pub u32);

/// A material of the scene, by its index in [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Three numbers: a point, a vector or a linear colour.
pub type ExprTriple = [ExprId; 3];

/// A complete scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Numbers of all shapes, materials and settings.
    pub expressions: Expressions,
    /// Parameters, structural ones too, in the order of the text.
    pub params: Vec<SceneParam>,
    /// All shapes, operands before their users.
    pub shapes: Vec<Shape>,
    /// Shape that is drawn: the final expression, or the union of all parts.
    pub root: Option<ShapeId>,
    /// Shapes that `part` defines, by name.
    pub parts: Vec<(String, ShapeId)>,
    /// Materials; the first is the default one.
    pub materials: Vec<Material>,
    /// Cameras; never empty, since a scene without one gets one that frames its bounds, marked
    /// `auto_framed`.
    pub cameras: Vec<SceneCamera>,
    /// Lights; a scene without any gets a key and a fill light.
    pub lights: Vec<SceneLight>,
    /// Background, which also lights surfaces.
    pub sky: SceneSky,
    /// Settings of the `render` block, or their defaults.
    pub render: SceneRender,
    /// Animation, if there is one.
    pub animation: Option<Animation>,
    /// Conditions on uniform numbers, to be checked after every change of a live parameter.
    pub checks: Vec<SceneCheck>,
    /// Set if the scene is a 2-D shape (`shape2`), drawn face on.
    pub is_2d: bool,
    /// Set if z is the axis that points up (`scene { up: z }`).
    pub z_up: bool,
    /// Millimetres per scene unit (`scene { units: mm }`).
    pub unit_mm: f64,
    /// Output of `print`.
    pub printed: Vec<String>,
}

impl Scene {
    /// Adds a new shape, with the name and the text of another one.
    pub(crate) fn derived(&mut self, like: ShapeId, kind: ShapeKind) -> ShapeId {
        let shape = self.shapes[like.0 as usize].clone();
        self.shapes.push(Shape { kind, ..shape });
        ShapeId(self.shapes.len() as u32 - 1)
    }
}

/// Borrowed view of a scene, or of the part of it that exists so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneRef<'s> {
    pub(crate) shapes: &'s [Shape],
    pub(crate) expressions: &'s Expressions,
    pub(crate) params: &'s [SceneParam],
    pub(crate) animation: Option<Animation>,
}

impl<'s> From<&'s Scene> for SceneRef<'s> {
    fn from(scene: &'s Scene) -> Self {
        Self {
            shapes: &scene.shapes,
            expressions: &scene.expressions,
            params: &scene.params,
            animation: scene.animation,
        }
    }
}

/// A parameter.
#[derive(Clone, Debug)]
pub struct SceneParam {
    /// Name in the text, by which it is set from outside.
    pub name: String,
    /// Text of its `///`.
    pub doc: String,
    /// Kind of its value.
    pub kind: ParamKind,
    /// Current value: one number, three for a colour (linear), or as many as a vector has.
    pub value: Vec<f64>,
    /// Value in the text.
    pub default: Vec<f64>,
    /// Smallest and largest allowed value, in the units of `value`.
    pub range: Option<(f64, f64)>,
    /// Set if the largest value itself is allowed.
    pub inclusive: bool,
    /// Distance between two values of a slider.
    pub step: Option<f64>,
    /// Set if it determines the structure: then a change requires a new program.
    pub structural: bool,
    /// Place of its declaration in the text.
    pub span: Span,
}

/// A shape: a solid, or a 2-D shape in the xy plane.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Definition, which refers to other shapes by their indices.
    pub kind: ShapeKind,
    /// Set for a 2-D shape.
    pub is_2d: bool,
    /// Name in the text, for readable listings; empty if none.
    pub name: String,
    /// Text that made it.
    pub span: Span,
}

/// Definition of a shape.
#[derive(Clone, Debug)]
pub enum ShapeKind {
    /// A row of shapes, with its parameters already prepared (`table::prepare`), without gaps.
    Primitive {
        /// Row of [`sdfc_vm::row::Category::Shape3`] or [`sdfc_vm::row::Category::Shape2`].
        op: Op,
        /// Numbers of its parameters.
        parameters: Vec<ExprId>,
    },
    /// A raw field: a number of point stage.
    Field {
        /// Value: negative inside.
        value: ExprId,
        /// Slope bound that the scene declares (`lipschitz:`); without it, intervals find one.
        slope: Option<ExprId>,
        /// Region outside of which the field need not be known, if it is bounded.
        region: Bounds,
    },
    /// A polygon in the plane.
    Polygon {
        /// Corners, in order.
        points: Vec<[ExprId; 2]>,
    },
    /// Combination of two or more shapes by a row of [`sdfc_vm::row::Category::Combine`], from left to
    /// right.
    Combine {
        /// Row of two values.
        op: Op,
        /// Operands, at least two, all 2-D shapes or all solids.
        children: Vec<ShapeId>,
        /// Prepared parameters of the row.
        parameters: Vec<ExprId>,
    },
    /// The child in an affine frame: it is evaluated at `matrix · p`, and its distance is multiplied by
    /// `scale`.
    Frame {
        /// Shape that it applies to.
        child: ShapeId,
        /// Map from the outer to the inner point: rows of three factors and a shift.
        matrix: [ExprId; 12],
        /// Outer length of a unit of distance in the inner frame: 1 for rigid motions, else the factor of the
        /// scale. Of a scale along axes it is the smallest factor.
        scale: ExprId,
    },
    /// The union of the child's copies in the cells of a grid.
    Repeat {
        /// [`Op::Repeat`] or [`Op::RepeatLimited`].
        op: Op,
        /// Child, whose cell is that around the origin.
        child: ShapeId,
        /// Prepared parameters of the row.
        parameters: Vec<ExprId>,
        /// Other copies that may be the nearest one to a point, along each axis.
        others: [NeighbourCells; 3],
    },
    /// The union of the child's copies in the sectors of a full turn.
    Polar {
        /// [`Op::Polar`] or [`Op::PolarPlane`].
        op: Op,
        /// Child, whose sector is that around the phase.
        child: ShapeId,
        /// Prepared parameters of the row.
        parameters: Vec<ExprId>,
        /// Other copies that may be the nearest one to a point.
        others: NeighbourCells,
    },
    /// The child evaluated at another point, by a row that returns a point.
    Domain {
        /// Row that maps the point, or changes the distance.
        op: Op,
        /// Shape that it applies to.
        child: ShapeId,
        /// Prepared parameters of the row.
        parameters: Vec<ExprId>,
    },
    /// The child evaluated at a point that the scene computes: three numbers of point stage.
    Warp {
        /// Shape that it applies to.
        child: ShapeId,
        /// Point at which the child is evaluated, in the same frame.
        point: ExprTriple,
    },
    /// The child's distance changed by a row of one value (`offset`, `shell`, …). A row that also reads
    /// the point reads the one outside the child.
    Distance {
        /// Row that maps the point, or changes the distance.
        op: Op,
        /// Shape that it applies to.
        child: ShapeId,
        /// Prepared parameters of the row.
        parameters: Vec<ExprId>,
    },
    /// The child with a number of point stage added to its distance.
    Displace {
        /// Shape that it applies to.
        child: ShapeId,
        /// Added amount, in the units of the child's distance.
        amount: ExprId,
    },
    /// The child in a material, whatever materials it had before.
    Painted {
        /// Shape that it applies to.
        child: ShapeId,
        /// Index of the material in the scene.
        material: MaterialId,
    },
    /// No shape at all; it occurs only alone, since the elaborator removes it from combinations.
    Nothing,
}

/// Copies of a repetition that may be nearer to a point than the copy of its own cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NeighbourCells {
    /// Number of cells on the side that the point is nearer to.
    pub near: u8,
    /// Number of cells on the other side.
    pub far: u8,
}

/// Value of the empty shape: farther than anything that a ray can meet.
pub(crate) const NO_SURFACE_DISTANCE: f64 = 1e9;
/// Value of a polygon before its first edge: a distance longer than any in a scene.
pub(crate) const NO_EDGE: f64 = 1e30;

/// Returns the row that maps to another copy of a repetition by `op`.
pub(crate) fn neighbour(op: Op) -> Op {
    match op {
        Op::Repeat => Op::RepeatNeighbour,
        Op::RepeatLimited => Op::RepeatLimitedNeighbour,
        Op::Polar => Op::PolarNeighbour,
        Op::PolarPlane => Op::PolarPlaneNeighbour,
        _ => unreachable!("`{}` makes no copies", op.row().name),
    }
}

/// Returns the cells of a grid whose copies are evaluated, those along x first.
pub(crate) fn grid_cells(others: &[NeighbourCells; 3]) -> impl Iterator<Item = [f64; 3]> {
    let [x, y, z] = *others;
    let rows = z.cells().flat_map(move |z| y.cells().map(move |y| [y, z]));
    rows.flat_map(move |[y, z]| x.cells().map(move |x| [x, y, z]))
}

impl NeighbourCells {
    /// Returns the cells whose copies are evaluated, starting with the point's own cell; positive on
    /// the nearer side.
    pub fn cells(self) -> impl Iterator<Item = f64> {
        let near_cells = (1..=self.near).map(f64::from);
        let far_cells = (1..=self.far).map(|cell| -f64::from(cell));
        std::iter::once(0.0).chain(near_cells).chain(far_cells)
    }
}

/// Matches a kind, by reference, to its operands: `$none` for kinds without any; `$one` makes a slice
/// of one.
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

/// Returns the operands of a shape.
pub(crate) fn children(kind: &ShapeKind) -> &[ShapeId] {
    operands!(kind, &[], std::slice::from_ref)
}

/// Returns the operands of a shape, mutably.
pub(crate) fn children_mut(kind: &mut ShapeKind) -> &mut [ShapeId] {
    operands!(kind, &mut [], std::slice::from_mut)
}

/// A material. Its numbers may be of normal stage: they then read the local point and the normal in the
/// frame of the painted shape.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name; empty for inline colours.
    pub name: String,
    /// Fraction of light that it reflects diffusely, or specularly if metallic: linear red, green,
    /// blue.
    pub albedo: ExprTriple,
    /// From 0, a mirror, to 1, chalk.
    pub roughness: ExprId,
    /// From 0, a dielectric, to 1, a metal.
    pub metallic: ExprId,
    /// Emitted light: linear red, green, blue.
    pub emission: ExprTriple,
    /// Height by which the surface appears displaced in lighting.
    pub bump: Option<ExprId>,
}

impl Material {
    /// Returns its numbers in the order of the channels.
    pub fn channel_numbers(&self) -> [ExprId; 8] {
        let ([r, g, b], [er, eg, eb]) = (self.albedo, self.emission);
        [r, g, b, self.roughness, er, eg, eb, self.metallic]
    }
}

/// A camera. All numbers are uniform.
pub type SceneCamera = settings::Camera<ExprId>;

/// Projection of a camera.
pub type SceneLens = settings::Lens<ExprId>;

/// A light. All numbers are uniform.
pub type SceneLight = settings::Light<ExprId>;

/// Position or direction of a light.
pub type SceneLightSource = settings::LightSource<ExprId>;

/// Kind of a light's shadow.
pub type SceneShadow = settings::Shadow<ExprId>;

/// Background, and light from all directions. All numbers are uniform.
pub type SceneSky = settings::Sky<ExprId>;

/// Render settings of a scene.
pub type SceneRender = settings::Render<ExprId>;

/// A condition on a uniform number.
#[derive(Clone, Debug)]
pub struct SceneCheck {
    /// Number that must not be negative.
    pub value: ExprId,
    /// Set if zero is forbidden too.
    pub strict: bool,
    /// Message of the diagnostic if the condition fails.
    pub message: String,
    /// Place in the text that the diagnostic marks.
    pub span: Span,
}
