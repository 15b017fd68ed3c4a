//! Solids and 2-D shapes as distances with parameters.

use super::influence_box::InfluenceBox;
use super::point::Point;
use sdfc_vm::apply::{OpResult, apply_numbers};
use sdfc_vm::row::{Category, Exactness, SlopeRule};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Distance of a shape as a function of its parameters and the point.
pub(super) type DistanceFn = fn(&[f64], Point) -> f64;

/// Source of a shape's distance.
#[derive(Clone, Copy, Debug)]
pub(super) enum LeafDistance {
    /// Function of the oracle's own.
    Own(DistanceFn),
    /// Body of the row. A test of the crate `vm` compares it with the definition of its inside.
    Body(Op),
}

/// A solid or a 2-D shape, given by a distance and parameters.
#[derive(Clone, Debug)]
pub(super) struct LeafShape {
    /// Signed distance.
    pub(super) distance: LeafDistance,
    /// Values of its parameters.
    pub(super) parameters: Vec<f64>,
    /// Influence box.
    pub(super) bounds: InfluenceBox,
    /// Bound of the slope of its value.
    pub(super) slope_bound: f64,
}

impl LeafShape {
    /// Returns the signed distance at a point.
    pub(super) fn value(&self, p: Point) -> f64 {
        match self.distance {
            LeafDistance::Own(distance) => distance(&self.parameters, p),
            LeafDistance::Body(op) => {
                let [x, y, z] = p;
                match apply_numbers::<f64>(op, V3 { x, y, z }, [0.0; 3], &self.parameters) {
                    OpResult::Value(value) => value,
                    OpResult::Point(_) => f64::NAN,
                }
            }
        }
    }
}

/// Returns the shape of a row by its body, for rows without a distance of the oracle's own; `None` for rows
/// that are no shapes.
pub(super) fn shape_by_body(op: Op, k: &[f64]) -> Option<LeafShape> {
    let row = op.row();
    let facts = &row.facts;
    if !matches!(facts.category, Category::Shape3 | Category::Shape2) {
        return None;
    }
    let width = row.parameters.iter().map(|p| p.ty.width()).sum();
    let parameters = k[..width].to_vec();
    let bounds = match (facts.bounds.shape_bounds(&parameters), facts.exactness) {
        (Some(bounds), Exactness::Exact | Exactness::ExactOutside) => InfluenceBox {
            low: bounds.min,
            high: bounds.max,
            distance_ratio: 1.0,
        },
        _ => InfluenceBox::ALL_SPACE,
    };
    let slope_bound = match facts.slope {
        SlopeRule::Constant(bound) => bound,
        SlopeRule::FromParams(bound) => bound(&parameters),
        _ => f64::INFINITY,
    };
    Some(LeafShape {
        distance: LeafDistance::Body(op),
        parameters,
        bounds,
        slope_bound,
    })
}

#[cfg(test)]
mod tests {
    use super::super::build::leaf_shape;
    use super::*;

    #[test]
    fn bodies_stand_in_for_distances_of_the_oracles_own() {
        let numbers = [0.75, 0.5, 0.25];
        for op in [Op::Sphere, Op::Cuboid, Op::Octahedron, Op::Circle] {
            let own = leaf_shape(op, &numbers).unwrap();
            let body = shape_by_body(op, &numbers).unwrap();
            assert!(matches!(own.distance, LeafDistance::Own(_)), "{op:?}");
            assert_eq!(
                (own.bounds.low, own.bounds.high),
                (body.bounds.low, body.bounds.high)
            );
            for p in [[0.1, 0.2, -0.3], [1.0, -2.0, 0.5], [-0.25, 0.0, 4.0]] {
                assert!(
                    (own.value(p) - body.value(p)).abs() < 1e-12,
                    "{op:?} at {p:?}"
                );
            }
        }
        assert!(shape_by_body(Op::Add, &numbers).is_none());
    }
}
