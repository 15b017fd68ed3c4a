//! Random calls of the solids and 2-D shapes of the table.
//!
//! A row states the kinds of its arguments, from which valid numbers follow. Of arguments that depend on each
//! other, the later one is kept small enough for the earlier ones.

use super::numbers::{degrees, direction, length, length_or_zero, rounding, vector};
use crate::random::Random;
use sdfc_vm::row::{Argument, ArgumentKind, Category, Exactness};
use sdfc_vm::table::{Op, ROWS, Row};

/// Rows whose second radius may exceed the first one; without an entry it does not.
const RADII_IN_ANY_ORDER: [Op; 2] = [Op::RoundCone, Op::Star];
/// Rows whose angle may exceed half a turn; without an entry it does not.
const MORE_THAN_HALF_A_TURN: [Op; 1] = [Op::CappedTorus];
/// Number of numbers that are enough for the parameters of every row.
const MAX_PARAMETERS: usize = 16;

/// Kind of a row's shapes, as random shapes use them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ShapeClass {
    /// Finite solids with exact distances.
    ExactSolid,
    /// Infinite solids with exact distances.
    UnboundedSolid,
    /// Solids with bounds of their distance, finite or not.
    BoundSolid {
        /// Set if they are finite.
        is_finite: bool,
    },
    /// 2-D shapes with exact distances.
    ExactShape2d,
}

impl ShapeClass {
    /// Returns the class of a row, or `None` for rows that are no shapes.
    pub(super) fn from_row(row: &Row) -> Option<Self> {
        let is_exact = row.facts.exactness == Exactness::Exact;
        let bounds = row.facts.bounds.shape_bounds(&[0.5; MAX_PARAMETERS]);
        let is_finite = bounds.is_some_and(|bounds| bounds.is_finite());
        match row.facts.category {
            Category::Shape3 if !is_exact => Some(Self::BoundSolid { is_finite }),
            Category::Shape3 if is_finite => Some(Self::ExactSolid),
            Category::Shape3 => Some(Self::UnboundedSolid),
            Category::Shape2 if is_exact => Some(Self::ExactShape2d),
            _ => None,
        }
    }
}

/// Returns the rows of a class.
pub(super) fn rows(class: ShapeClass) -> Vec<&'static Row> {
    ROWS.iter()
        .filter(|row| ShapeClass::from_row(row) == Some(class))
        .collect()
}

/// Returns a call that creates a shape of a row, with random arguments.
pub(super) fn call(r: &mut Random, row: &Row) -> String {
    let Some(language) = row.facts.language else {
        panic!("`{}` is no word of the language", row.name);
    };
    let mut arguments = CallArguments {
        op: row.op,
        has_points: has_kind(row, &[ArgumentKind::Vec3, ArgumentKind::Vec2]),
        has_angle: has_kind(row, &[ArgumentKind::Angle]),
        is_slanted: has_kind(row, &[ArgumentKind::RadiusOrZero]),
        first_radius: None,
        min_half: f64::INFINITY,
    };
    let written: Vec<String> = language
        .arguments
        .iter()
        .map(|argument| format!("{}: {}", argument.name, arguments.next(r, argument)))
        .collect();
    format!("{}({})", language.name, written.join(", "))
}

/// Reports whether a row has an argument of one of these kinds.
fn has_kind(row: &Row, kinds: &[ArgumentKind]) -> bool {
    row.facts.language.is_some_and(|language| {
        language
            .arguments
            .iter()
            .any(|argument| kinds.contains(&argument.kind))
    })
}

/// State of a call whose arguments are written one after another.
struct CallArguments {
    op: Op,
    /// Set if the row has points among its arguments, so that the shape extends from its radius on.
    has_points: bool,
    has_angle: bool,
    /// Set if a side slants, so that less rounding fits than the extents suggest.
    is_slanted: bool,
    first_radius: Option<f64>,
    /// Smallest half extent that the arguments so far give.
    min_half: f64,
}

impl CallArguments {
    /// Returns the next argument as text.
    fn next(&mut self, r: &mut Random, argument: &Argument) -> String {
        use ArgumentKind as A;
        let mut lengths = |min: f64| -> Vec<f64> {
            let count = argument.kind.width();
            (0..count).map(|_| length(r, min, 0.875)).collect()
        };
        match argument.kind {
            A::Size3 | A::Size2 => {
                let sizes = lengths(0.125);
                self.limit(sizes.iter().copied().fold(f64::INFINITY, f64::min) / 2.0);
                format!("{sizes:?}")
            }
            A::Radii3 => format!("{:?}", lengths(0.25)),
            A::Lengths3 => format!("{:?}", lengths(0.0)),
            A::Counts3 => format!("{:?}", [0; 3].map(|_| 1 + r.below(3))),
            A::Radius => self.radius(r).to_string(),
            A::RadiusOrZero => {
                // At most one of two radii may be zero.
                let radius = match self.first_radius {
                    None => length(r, 0.125, 0.875),
                    Some(_) => length_or_zero(r, 0.75),
                };
                if self.first_radius.is_none() {
                    self.first_radius = Some(radius);
                    self.limit(radius);
                }
                radius.to_string()
            }
            A::Length if argument.name == "thickness" && self.min_half.is_finite() => {
                (self.min_half * [0.25, 0.5][r.below(2)]).to_string()
            }
            A::Length => {
                let length = length(r, 0.125, 0.875);
                self.limit(length / 2.0);
                length.to_string()
            }
            A::LengthOrZero if argument.name == "round" => {
                let share = if self.is_slanted { 0.125 } else { 1.0 };
                rounding(r, self.min_half * share).to_string()
            }
            A::LengthOrZero => length_or_zero(r, 0.875).to_string(),
            A::Offset => length(r, -0.5, 0.5).to_string(),
            A::Vec3 => format!("{:?}", vector(r, 0.5)),
            A::Vec2 => {
                let [x, y, _] = vector(r, 0.5);
                format!("[{x}, {y}]")
            }
            A::Direction => format!("{:?}", direction(r)),
            A::Angle => {
                let max = match MORE_THAN_HALF_A_TURN.contains(&self.op) {
                    true => 359,
                    false => 180,
                };
                format!("{}deg", degrees(r, 2, max))
            }
            A::Number => length(r, 0.0, 1.0).to_string(),
            A::Count => (2 + r.below(7)).to_string(),
        }
    }

    /// Returns a radius: the first one at will, a later one at most as large.
    fn radius(&mut self, r: &mut Random) -> f64 {
        let mut radius = length(r, 0.125, 0.875);
        if self.has_points {
            radius /= 2.0;
        }
        match self.first_radius {
            None => {
                self.first_radius = Some(radius);
                self.limit(radius);
            }
            Some(_) if RADII_IN_ANY_ORDER.contains(&self.op) => {}
            // The ends of an arc must not meet.
            Some(first) if self.has_angle => radius = radius.min(first) / 2.0,
            Some(first) => radius = radius.min(first),
        }
        radius
    }

    fn limit(&mut self, half: f64) {
        self.min_half = self.min_half.min(half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_compiler::elaborate::{Options, elaborate};
    use sdfc_compiler::scene::ShapeKind;
    use sdfc_lang::Sources;

    #[test]
    fn each_shape_of_the_table_is_called_with_valid_arguments() {
        let mut r = Random::new(1);
        for row in ROWS {
            if !matches!(row.facts.category, Category::Shape3 | Category::Shape2) {
                continue;
            }
            let class = ShapeClass::from_row(row);
            let is_tried = class.is_some_and(|class| rows(class).iter().any(|r| r.op == row.op));
            assert!(
                is_tried,
                "`{}` needs a class in trials/src/shapes/rows.rs",
                row.name
            );
            for _ in 0..40 {
                let text = call(&mut r, row);
                let mut sources = Sources::new();
                let file = sources.add("text", text.clone());
                let (scene, diagnostics) = elaborate(&mut sources, file, &Options::default());
                let scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
                let is_own = scene.shapes.iter().any(
                    |shape| matches!(shape.kind, ShapeKind::Primitive { op, .. } if op == row.op),
                );
                assert!(is_own, "{text} is no `{}`", row.name);
            }
        }
    }

    #[test]
    fn classes_follow_from_the_facts_of_rows() {
        let class = |op: Op| ShapeClass::from_row(op.row());
        assert_eq!(class(Op::Sphere), Some(ShapeClass::ExactSolid));
        assert_eq!(class(Op::Slab), Some(ShapeClass::UnboundedSolid));
        let is_finite = true;
        assert_eq!(
            class(Op::BoxFrame),
            Some(ShapeClass::BoundSolid { is_finite })
        );
        let is_finite = false;
        assert_eq!(
            class(Op::Gyroid),
            Some(ShapeClass::BoundSolid { is_finite })
        );
        assert_eq!(class(Op::Star), Some(ShapeClass::ExactShape2d));
        assert_eq!(class(Op::Union), None);
    }
}
