//! Facts that rows of one kind have in common.

use crate::row::{
    BoundsRule, Category, Continuity, DefinedFor, Exactness, Flat, OpFacts, SetOperation, SlopeRule,
};

/// Facts common to the solids; each adds its bounds and its source.
pub(super) const SOLID: OpFacts = OpFacts {
    category: Category::Shape3,
    language: None,
    exactness: Exactness::Exact,
    slope: SlopeRule::Constant(1.0),
    continuity: Continuity::Continuous,
    defined_for: DefinedFor::All,
    bounds: BoundsRule::Infinite,
    set: None,
    blend: None,
    is_commutative: false,
    uses_only_signs: false,
    reads_lattice: false,
    flats: &[],
    is_convex: false,
    axis_of_revolution: None,
    has_equal_axes: false,
    source: "",
};
/// Index of the axis about which solids are built.
pub(super) const Y_AXIS: usize = 1;
/// Index of the axis across the plane of 2-D shapes.
pub(super) const Z_AXIS: usize = 2;
/// Returns a pair of flat faces across an axis, given the index of the parameter that is its half distance.
pub(super) const fn flat(axis: usize, half: usize) -> Flat {
    Flat { axis, half }
}
/// Facts common to the 2-D shapes.
pub(super) const PLANE: OpFacts = OpFacts {
    category: Category::Shape2,
    ..SOLID
};
/// Facts common to the conversions between plane and space.
pub(super) const DIMENSION: OpFacts = OpFacts {
    category: Category::Dimension,
    slope: SlopeRule::MaxOfOperandsOrOne,
    ..SOLID
};
/// Facts common to the combinations.
pub(super) const COMBINE: OpFacts = OpFacts {
    category: Category::Combine,
    exactness: Exactness::Bound,
    slope: SlopeRule::MaxOfOperands(1.0),
    ..SOLID
};
/// Facts common to the unions.
pub(super) const UNION: OpFacts = OpFacts {
    set: Some(SetOperation::Union),
    ..COMBINE
};
/// Facts common to the intersections.
pub(super) const INTERSECTION: OpFacts = OpFacts {
    set: Some(SetOperation::Intersection),
    bounds: BoundsRule::Intersection,
    ..COMBINE
};
/// Facts common to the subtractions.
pub(super) const SUBTRACTION: OpFacts = OpFacts {
    set: Some(SetOperation::Subtraction),
    bounds: BoundsRule::FirstOperand,
    ..COMBINE
};
/// Facts common to the maps of the point, most of which only fold or move space.
pub(super) const DOMAIN: OpFacts = OpFacts {
    category: Category::Domain,
    slope: SlopeRule::Fold,
    ..SOLID
};
/// Facts common to the changes of the distance.
pub(super) const DISTANCE: OpFacts = OpFacts {
    category: Category::Distance,
    slope: SlopeRule::MaxOfOperands(1.0),
    bounds: BoundsRule::FirstOperand,
    ..SOLID
};
/// Facts common to arithmetic.
pub(super) const MATH: OpFacts = OpFacts {
    category: Category::Math,
    exactness: Exactness::Unknown,
    slope: SlopeRule::Unbounded,
    ..SOLID
};
/// Facts common to arithmetic that jumps.
pub(super) const JUMP: OpFacts = OpFacts {
    continuity: Continuity::Jumps,
    ..MATH
};
/// Facts common to arithmetic with poles.
pub(super) const POLE: OpFacts = OpFacts {
    continuity: Continuity::HasPoles,
    ..MATH
};
/// Facts common to arithmetic of numbers that must not be negative.
pub(super) const NOT_NEGATIVE: OpFacts = OpFacts {
    defined_for: DefinedFor::NotNegative,
    ..MATH
};
/// Facts common to arc functions of numbers from −1 to 1.
pub(super) const UP_TO_ONE: OpFacts = OpFacts {
    defined_for: DefinedFor::UpToOne,
    ..MATH
};
/// Facts common to noise.
pub(super) const LATTICE: OpFacts = OpFacts {
    reads_lattice: true,
    ..MATH
};
