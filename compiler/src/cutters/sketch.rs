//! Polygons whose edges are moved outwards, while the edges beside them are prolonged.
//!
//! The addition of an edge is a triangle or a trapezoid. It may meet no other edge, so the polygon stays simple, and the
//! new one is the union of the old one and the trapezoid.

use super::room::Part;
use super::section::{Section, corners};
use super::{Cut, Lengthening, Rows, SAME, Step, TOUCHING, scale};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;

/// The most corners of a polygon whose edges are moved.
const MOST_CORNERS: usize = 200;
/// The most edges of a polygon that are tried, the longest ones.
const MOST_EDGES: usize = 24;

type Point = [f64; 2];

/// An edge that can be moved outwards.
struct Edge {
    ends: [Point; 2],
    /// The direction outwards, of length one.
    normal: Point,
    /// The way of each end per unit outwards.
    ways: [Point; 2],
    /// The length at which both ends meet, if they do.
    tip: f64,
}

impl Edge {
    /// An edge of a simple polygon that turns to the left, between edges that lead outwards at both its ends.
    fn new(points: &[Point], at: usize) -> Option<Self> {
        let count = points.len();
        let [before, a, b, after] = [count - 1, 0, 1, 2].map(|step| points[(at + step) % count]);
        let along = minus(b, a);
        let length = along[0].hypot(along[1]);
        let normal = [along[1] / length, -along[0] / length];
        let way = |from: Point, to: Point| {
            let side = minus(to, from);
            let rise = dot(side, normal);
            let is_steep = rise > 1e-3 * side[0].hypot(side[1]);
            is_steep.then(|| side.map(|v| v / rise))
        };
        let ways = [way(before, a)?, way(after, b)?];
        let narrowing = dot(minus(ways[0], ways[1]), along) / length;
        let tip = if narrowing > 1e-12 {
            length / narrowing
        } else {
            f64::INFINITY
        };
        Some(Self {
            ends: [a, b],
            normal,
            ways,
            tip,
        })
    }

    /// Both ends, farther out by a length.
    fn moved(&self, by: f64) -> [Point; 2] {
        let moved = |end: Point, way: Point| [end[0] + way[0] * by, end[1] + way[1] * by];
        let [a, b] = [0, 1].map(|i| moved(self.ends[i], self.ways[i]));
        // One point, whatever rounding says.
        if by >= self.tip { [a, a] } else { [a, b] }
    }

    /// The map from the frame of the edge, with x outwards and y along it, to that of the polygon.
    fn frame(&self) -> Rows {
        let (n, at) = (self.normal, self.ends[0]);
        let mut rows = SAME;
        rows[0] = [n[0], -n[1], 0.0, at[0]];
        rows[1] = [n[1], n[0], 0.0, at[1]];
        rows
    }

    /// The place of a point along the edge.
    fn along(&self, p: Point) -> f64 {
        let p = minus(p, self.ends[0]);
        p[1] * self.normal[0] - p[0] * self.normal[1]
    }

    /// The box of points in the frame of the edge, up to a length outwards from another.
    fn bounds(&self, points: &[Point], [from, to]: [f64; 2]) -> Bounds {
        let places = points.iter().map(|&p| self.along(p));
        Bounds {
            min: [
                from,
                places.clone().fold(f64::INFINITY, f64::min),
                f64::NEG_INFINITY,
            ],
            max: [to, places.fold(f64::NEG_INFINITY, f64::max), f64::INFINITY],
        }
    }
}

impl Lengthening<'_> {
    /// Moves edges of a polygon outwards where that is possible.
    pub(super) fn wider(&mut self, id: ShapeId, path: &[Step], cut: &Cut) -> ShapeId {
        let out = cut.size / scale(path);
        let points = corners(self.scene, id).filter(|points| points.len() <= MOST_CORNERS);
        let Some(mut points) = points.and_then(|points| tidy(&points)) else {
            return id;
        };
        if !out.is_finite() || out <= 0.0 {
            return id;
        }
        let mut current = id;
        for ends in longest_edges(&points) {
            let Some(at) = (0..points.len()).find(|&at| lies_on(&points, at, ends)) else {
                continue;
            };
            let Some(edge) = Edge::new(&points, at) else {
                continue;
            };
            if self.edge_stands_out(current, &points, &edge, out, (path, cut)) {
                continue;
            }
            let mut found = None;
            self.fraction(|this, fraction| {
                let by = (out * fraction).min(edge.tip);
                let Some(new) = with_edge(&points, at, edge.moved(by)) else {
                    return false;
                };
                let shapes = this.scene.shapes.len();
                let candidate = this.polygon(id, &new);
                let far = edge.moved(by);
                let section = |points: [Point; 2]| Section {
                    points: points.map(|[x, y]| [x, y, 0.0]).to_vec(),
                    is_round: false,
                    is_plane: true,
                };
                let part = Part {
                    id: candidate,
                    is_straight: false,
                    reach: 0.0,
                    axis: 0,
                    frame: edge.frame(),
                    sections: Some([section(edge.ends), section(far)]),
                };
                let added = edge.bounds(&[edge.ends, far].concat(), [0.0, by]);
                let is_free = this.is_free(&part, &added, path, cut);
                match is_free {
                    true => found = Some((new, candidate)),
                    false => this.scene.shapes.truncate(shapes),
                }
                is_free
            });
            if let Some(new) = found {
                (points, current) = new;
            }
        }
        current
    }

    /// Reports whether an edge stands out as far as it would be moved.
    fn edge_stands_out(
        &mut self,
        id: ShapeId,
        points: &[Point],
        edge: &Edge,
        out: f64,
        (path, cut): (&[Step], &Cut),
    ) -> bool {
        let depth = |&p: &Point| -dot(minus(p, edge.ends[0]), edge.normal);
        if points.iter().map(depth).fold(0.0, f64::max) <= out {
            return false;
        }
        let part = Part {
            id,
            is_straight: false,
            reach: 0.0,
            axis: 0,
            frame: edge.frame(),
            sections: None,
        };
        self.is_free(&part, &edge.bounds(points, [-out, 0.0]), path, cut)
    }

    /// A polygon, with the name and the text of another one.
    fn polygon(&mut self, like: ShapeId, points: &[Point]) -> ShapeId {
        let expressions = &mut self.scene.expressions;
        let corner = |p: &Point| p.map(|v| expressions.constant(v));
        let points = points.iter().map(corner).collect();
        self.scene.derived(like, ShapeKind::Polygon { points })
    }
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Twice the area of a triangle, positive if it turns to the left.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    let (u, v) = (minus(b, a), minus(c, a));
    u[0] * v[1] - u[1] * v[0]
}

/// The longest edges of a polygon, those first.
fn longest_edges(points: &[Point]) -> Vec<[Point; 2]> {
    let count = points.len();
    let mut edges: Vec<[Point; 2]> = (0..count)
        .map(|at| [points[at], points[(at + 1) % count]])
        .collect();
    let length = |[a, b]: &[Point; 2]| dot(minus(*b, *a), minus(*b, *a));
    edges.sort_by(|a, b| length(b).total_cmp(&length(a)));
    edges.truncate(MOST_EDGES);
    edges
}

/// Reports whether an edge of a polygon, whose ends may have been moved along it, is on the line of another one.
fn lies_on(points: &[Point], at: usize, [a, b]: [Point; 2]) -> bool {
    let (c, d) = (points[at], points[(at + 1) % points.len()]);
    let size = reach(&[a, b, c, d]);
    let least = TOUCHING * size * size;
    let is_line = turn(a, b, c).abs() <= least && turn(a, b, d).abs() <= least;
    // An edge is only prolonged before it is moved itself.
    let ends = [a, b].map(|p| dot(minus(p, a), minus(d, c)));
    let own = [c, d].map(|p| dot(minus(p, a), minus(d, c)));
    is_line && own[0] <= ends[0].min(ends[1]) + least && own[1] >= ends[0].max(ends[1]) - least
}

/// The largest of coordinates.
fn reach(points: &[Point]) -> f64 {
    points
        .iter()
        .flatten()
        .fold(0.0, |most: f64, v| most.max(v.abs()))
}

/// The corners of a simple polygon, turning to the left, without those in the middle of a straight side.
fn tidy(points: &[Point]) -> Option<Vec<Point>> {
    let least = TOUCHING * reach(points).powi(2);
    let mut left: Vec<Point> = Vec::with_capacity(points.len());
    for (at, &p) in points.iter().enumerate() {
        let before = left.last().copied().unwrap_or(points[points.len() - 1]);
        let after = points[(at + 1) % points.len()];
        let is_corner =
            turn(before, p, after).abs() > least || dot(minus(p, before), minus(after, p)) < 0.0;
        if is_corner {
            left.push(p);
        }
    }
    let fan = (2..left.len()).map(|at| turn(left[0], left[at - 1], left[at]));
    let area: f64 = fan.sum();
    if left.len() < 3 || area.abs() <= least {
        return None;
    }
    if area < 0.0 {
        left.reverse();
    }
    is_simple(&left).then_some(left)
}

/// A polygon with an edge moved, if it stays simple: one that became a point is one corner.
fn with_edge(points: &[Point], at: usize, [a, b]: [Point; 2]) -> Option<Vec<Point>> {
    let count = points.len();
    let mut new = points.to_vec();
    (new[at], new[(at + 1) % count]) = (a, b);
    if a == b {
        new.remove(at);
    }
    is_simple(&new).then_some(new)
}

/// Reports whether no two edges of a polygon meet but at the corner between them.
fn is_simple(points: &[Point]) -> bool {
    let count = points.len();
    let end = |at: usize| points[(at + 1) % count];
    let is_apart = |i: usize, j: usize| {
        let is_next = j == i + 1 || i == 0 && j + 1 == count;
        is_next || !meet([points[i], end(i)], [points[j], end(j)])
    };
    let is_turning = |at: usize| {
        let (a, b, c) = (points[at], end(at), end((at + 1) % count));
        turn(a, b, c) != 0.0 || dot(minus(b, a), minus(c, b)) > 0.0
    };
    count >= 3
        && (0..count).all(is_turning)
        && (0..count).all(|i| (i + 1..count).all(|j| is_apart(i, j)))
}

/// Reports whether two pieces of lines meet, or all but touch.
fn meet([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let least = TOUCHING * reach(&[a, b, c, d]).powi(2);
    let is_beside = |[a, b]: [Point; 2], [c, d]: [Point; 2]| {
        let (first, second) = (turn(a, b, c), turn(a, b, d));
        first.min(second) > least || first.max(second) < -least
    };
    let is_box_apart = (0..2).any(|i| {
        let least = TOUCHING * reach(&[a, b, c, d]);
        a[i].max(b[i]) < c[i].min(d[i]) - least || c[i].max(d[i]) < a[i].min(b[i]) - least
    });
    !(is_box_apart || is_beside([a, b], [c, d]) || is_beside([c, d], [a, b]))
}
