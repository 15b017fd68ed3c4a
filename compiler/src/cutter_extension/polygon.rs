//! Polygons whose edges are moved outwards. Adjacent edges are prolonged if they lead straight outwards or apart. Else new
//! edges lead straight outwards, and the ends of the old edge become corners.
//!
//! The extension of an edge is a rectangle or a trapezoid. It may meet no other edge, so the polygon stays
//! simple, and the new polygon is the union of the old one and the extension.

use super::free_space::GrowingPart;
use super::section::{Section, corners};
use super::{AffineRows, CutContext, CutterExtension, IDENTITY, PathStep, TOUCH_TOLERANCE, scale};
use crate::scene::{ShapeId, ShapeKind};
use glam::DVec2;
use sdfc_vm::bounds::Bounds;

/// Maximum number of corners of a polygon whose edges are moved.
const MAX_CORNERS: usize = 200;
/// Maximum number of edges of a polygon that are tried, the longest first.
const MAX_EDGES: usize = 24;

/// An edge that can be moved outwards.
struct Edge {
    ends: [DVec2; 2],
    /// Outward unit normal.
    normal: DVec2,
    /// Displacement of each end per unit outwards.
    end_directions: [DVec2; 2],
    /// Set if the ends stay corners.
    keeps_ends: bool,
}

impl Edge {
    /// Returns an edge of a simple counterclockwise polygon.
    fn new(points: &[DVec2], index: usize) -> Self {
        let count = points.len();
        let [previous, a, b, following] =
            [count - 1, 0, 1, 2].map(|step| points[(index + step) % count]);
        let edge = b - a;
        let length = edge.x.hypot(edge.y);
        let normal = DVec2::new(edge.y / length, -edge.x / length);
        let direction = |from: DVec2, to: DVec2| {
            let delta = to - from;
            let rise = delta.dot(normal);
            let is_outward = rise > 1e-3 * delta.x.hypot(delta.y);
            is_outward.then(|| delta / rise)
        };
        let prolonged = direction(previous, a).zip(direction(following, b));
        // The walls of an opening must not come closer to each other outside of the body.
        let is_open = |(first, second): &(DVec2, DVec2)| {
            let [first, second] = [first, second].map(|it| it.dot(edge) / length);
            first < 1e-12 && second > -1e-12
        };
        let prolonged = prolonged.filter(is_open);
        Self {
            ends: [a, b],
            normal,
            end_directions: prolonged.map_or([normal; 2], |(first, second)| [first, second]),
            keeps_ends: prolonged.is_none(),
        }
    }

    /// Returns both ends, moved outwards by a distance.
    fn moved_ends(&self, distance: f64) -> [DVec2; 2] {
        [0, 1].map(|i| self.ends[i] + self.end_directions[i] * distance)
    }

    /// Returns the map from the frame of the edge, with x outwards and y along it, to that of the polygon.
    fn placement(&self) -> AffineRows {
        let (n, origin) = (self.normal, self.ends[0]);
        let mut rows = IDENTITY;
        rows[0] = [n.x, -n.y, 0.0, origin.x];
        rows[1] = [n.y, n.x, 0.0, origin.y];
        rows
    }

    /// Returns the coordinate of a point along the edge, from its first end.
    fn coordinate_along(&self, p: DVec2) -> f64 {
        self.normal.perp_dot(p - self.ends[0])
    }

    /// Returns the bounding box of points in the frame of the edge, between two distances outwards.
    fn bounds(&self, points: &[DVec2], [from, to]: [f64; 2]) -> Bounds {
        let positions = points.iter().map(|&p| self.coordinate_along(p));
        Bounds {
            min: [
                from,
                positions.clone().fold(f64::INFINITY, f64::min),
                f64::NEG_INFINITY,
            ],
            max: [
                to,
                positions.fold(f64::NEG_INFINITY, f64::max),
                f64::INFINITY,
            ],
        }
    }
}

impl CutterExtension<'_> {
    /// Moves edges of a polygon outwards where possible.
    pub(super) fn extend_polygon_edges(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        let max_step = cut.size / scale(path);
        let points = corners(self.scene, id).filter(|points| points.len() <= MAX_CORNERS);
        let Some(mut points) = points.and_then(|points| simplified_corners(&points)) else {
            return id;
        };
        if !max_step.is_finite() || max_step <= 0.0 {
            return id;
        }
        let mut current = id;
        for ends in longest_edges(&points) {
            let Some(index) = (0..points.len()).find(|&index| contains_edge(&points, index, ends))
            else {
                continue;
            };
            let edge = Edge::new(&points, index);
            if self.edge_protrudes(current, &points, &edge, max_step, (path, cut)) {
                continue;
            }
            let mut accepted = None;
            self.largest_fraction(cut, |this, fraction| {
                let distance = max_step * fraction;
                let moved = edge.moved_ends(distance);
                let Some(new) = with_moved_edge(&points, index, moved, edge.keeps_ends) else {
                    return false;
                };
                let candidate = this.add_polygon(id, &new);
                let section = |points: [DVec2; 2]| Section {
                    points: points.map(|p| p.extend(0.0)).to_vec(),
                    is_round: false,
                    is_2d: true,
                };
                let part = GrowingPart {
                    id: candidate,
                    is_straight: false,
                    blend_radius: 0.0,
                    axis: 0,
                    placement: edge.placement(),
                    sections: Some([section(edge.ends), section(moved)]),
                };
                let added = edge.bounds(&[edge.ends, moved].concat(), [0.0, distance]);
                let is_free = this.is_free(&part, &added, path, cut);
                if is_free {
                    accepted = Some((new, candidate));
                }
                is_free
            });
            if let Some(new) = accepted {
                (points, current) = new;
            }
        }
        current
    }

    /// Reports whether an edge already protrudes by the full distance.
    fn edge_protrudes(
        &mut self,
        id: ShapeId,
        points: &[DVec2],
        edge: &Edge,
        max_step: f64,
        (path, cut): (&[PathStep], &CutContext),
    ) -> bool {
        let depth = |&p: &DVec2| -(p - edge.ends[0]).dot(edge.normal);
        if points.iter().map(depth).fold(0.0, f64::max) <= max_step {
            return false;
        }
        let part = GrowingPart {
            id,
            is_straight: false,
            blend_radius: 0.0,
            axis: 0,
            placement: edge.placement(),
            sections: None,
        };
        self.is_free(&part, &edge.bounds(points, [-max_step, 0.0]), path, cut)
    }

    /// Adds a polygon, with the name and the span of another shape.
    pub(super) fn add_polygon(&mut self, like: ShapeId, points: &[DVec2]) -> ShapeId {
        let expressions = &mut self.scene.expressions;
        let corner = |p: &DVec2| p.to_array().map(|v| expressions.constant(v));
        let points = points.iter().map(corner).collect();
        self.scene.derived(like, ShapeKind::Polygon { points })
    }
}

/// Returns twice the signed area of a triangle, positive if counterclockwise.
fn signed_double_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Returns at most `MAX_EDGES` edges of a polygon, the longest first.
fn longest_edges(points: &[DVec2]) -> Vec<[DVec2; 2]> {
    let count = points.len();
    let mut edges: Vec<[DVec2; 2]> = (0..count)
        .map(|index| [points[index], points[(index + 1) % count]])
        .collect();
    let length = |[a, b]: &[DVec2; 2]| (*b - *a).dot(*b - *a);
    edges.sort_by(|a, b| length(b).total_cmp(&length(a)));
    edges.truncate(MAX_EDGES);
    edges
}

/// Reports whether an edge of a polygon contains another one, along which it may have been prolonged.
fn contains_edge(points: &[DVec2], index: usize, [a, b]: [DVec2; 2]) -> bool {
    let (c, d) = (points[index], points[(index + 1) % points.len()]);
    let size = max_coordinate(&[a, b, c, d]);
    let tolerance = TOUCH_TOLERANCE * size * size;
    let is_line = signed_double_area(a, b, c).abs() <= tolerance
        && signed_double_area(a, b, d).abs() <= tolerance;
    // An edge is only prolonged before it is moved itself.
    let ends = [a, b].map(|p| (p - a).dot(d - c));
    let own_ends = [c, d].map(|p| (p - a).dot(d - c));
    is_line
        && own_ends[0] <= ends[0].min(ends[1]) + tolerance
        && own_ends[1] >= ends[0].max(ends[1]) - tolerance
}

/// Returns the largest coordinate, in magnitude; 0 for no points.
fn max_coordinate(points: &[DVec2]) -> f64 {
    points
        .iter()
        .flat_map(|p| p.to_array())
        .fold(0.0, |max: f64, v| max.max(v.abs()))
}

/// Returns the corners of a simple polygon in counterclockwise order, without corners in the middle of a straight
/// side. `None` if the polygon is degenerate or intersects itself.
fn simplified_corners(points: &[DVec2]) -> Option<Vec<DVec2>> {
    let tolerance = TOUCH_TOLERANCE * max_coordinate(points).powi(2);
    let mut kept: Vec<DVec2> = Vec::with_capacity(points.len());
    for (index, &p) in points.iter().enumerate() {
        let previous = kept.last().copied().unwrap_or(points[points.len() - 1]);
        let next = points[(index + 1) % points.len()];
        let is_corner = signed_double_area(previous, p, next).abs() > tolerance
            || (p - previous).dot(next - p) < 0.0;
        if is_corner {
            kept.push(p);
        }
    }
    let fan =
        (2..kept.len()).map(|index| signed_double_area(kept[0], kept[index - 1], kept[index]));
    let area: f64 = fan.sum();
    if kept.len() < 3 || area.abs() <= tolerance {
        return None;
    }
    if area < 0.0 {
        kept.reverse();
    }
    is_simple(&kept).then_some(kept)
}

/// Moves an edge of a polygon, if it stays simple. Its old ends remain corners if `keeps_ends` is set.
fn with_moved_edge(
    points: &[DVec2],
    index: usize,
    [a, b]: [DVec2; 2],
    keeps_ends: bool,
) -> Option<Vec<DVec2>> {
    let count = points.len();
    let mut new = points.to_vec();
    match keeps_ends {
        true => {
            new.splice(index + 1..index + 1, [a, b]);
        }
        false => (new[index], new[(index + 1) % count]) = (a, b),
    }
    is_simple(&new).then_some(new)
}

/// Reports whether no two edges of a polygon meet except at common corners.
fn is_simple(points: &[DVec2]) -> bool {
    let count = points.len();
    let end = |index: usize| points[(index + 1) % count];
    let is_apart = |i: usize, j: usize| {
        let is_next = j == i + 1 || i == 0 && j + 1 == count;
        is_next || !segments_meet([points[i], end(i)], [points[j], end(j)])
    };
    let is_turning = |index: usize| {
        let (a, b, c) = (points[index], end(index), end((index + 1) % count));
        signed_double_area(a, b, c) != 0.0 || (b - a).dot(c - b) > 0.0
    };
    count >= 3
        && (0..count).all(is_turning)
        && (0..count).all(|i| (i + 1..count).all(|j| is_apart(i, j)))
}

/// Reports whether two segments meet or nearly touch.
fn segments_meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let tolerance = TOUCH_TOLERANCE * max_coordinate(&[a, b, c, d]).powi(2);
    let is_on_one_side = |[a, b]: [DVec2; 2], [c, d]: [DVec2; 2]| {
        let (first, second) = (signed_double_area(a, b, c), signed_double_area(a, b, d));
        first.min(second) > tolerance || first.max(second) < -tolerance
    };
    let are_boxes_disjoint = (0..2).any(|i| {
        let tolerance = TOUCH_TOLERANCE * max_coordinate(&[a, b, c, d]);
        a[i].max(b[i]) < c[i].min(d[i]) - tolerance || c[i].max(d[i]) < a[i].min(b[i]) - tolerance
    });
    !(are_boxes_disjoint || is_on_one_side([a, b], [c, d]) || is_on_one_side([c, d], [a, b]))
}
