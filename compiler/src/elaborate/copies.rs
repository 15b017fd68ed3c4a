//! Copies of shapes by folding space: mirrors, grids and rings. They cost no more than one copy.

use super::Elaborator;
use super::bound::{Bound, short};
use super::evaluate::Outcome;
use super::motion::Place;
use super::symbolic::Symbolic;
use super::value::Value;
use crate::bounds::inverse;
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::ops::affine::{self, Affine};
use sdfc_vm::real::lit;
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// `mirror(shape, axes)`: what lies on the positive side of a plane, on both sides. Along axes
    /// that is a fold of coordinates; any other plane is turned there and back.
    pub(crate) fn mirror(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        let axes = bound.vector(1);
        let what = "the plane of a mirror";
        let at = Symbolic(bound.number(2));
        let constants = axes.map(|id| self.graph.as_constant(id));
        let flags = constants.map(|c| c.is_some_and(|c| c == 0.0 || c == 1.0));
        let is_still = self.graph.as_constant(bound.number(2)) == Some(0.0);
        if constants.iter().all(|c| *c == Some(0.0)) {
            let message = format!("{what} is the zero vector, which has no direction");
            self.report(Diagnostic::error(codes::E0405, bound.span_of(1), message));
            return Ok(Value::Poison);
        }
        if flags.iter().all(|f| *f) && is_still {
            let mirrored = (0..3).filter(|&axis| constants[axis] == Some(1.0));
            for axis in mirrored {
                self.warn_of_what_a_mirror_hides(&bound, child, axis);
            }
            return Ok(Value::Shape(self.folded(child, axes, span)));
        }
        let Some(normal) = self.direction(what, &axes, bound.span_of(1)) else {
            return Ok(Value::Poison);
        };
        let normal = [normal[0], normal[1], normal[2]].map(Symbolic);
        // The reflection that swaps the normal and the x axis is its own inverse.
        let known = normal.map(|n| self.graph.as_constant(n.0));
        let is_x = known == [Some(1.0), Some(0.0), Some(0.0)];
        let swap = move || -> Affine<Symbolic> {
            if is_x {
                return affine::identity();
            }
            let one = lit::<Symbolic>(1.0);
            affine::reflect([normal[0] - one, normal[1], normal[2]], lit(0.0))
        };
        let shift = move |by: Symbolic| {
            let o = lit::<Symbolic>(0.0);
            affine::translate([by, o, o])
        };
        // Into a frame whose x axis is the normal and whose origin lies on the plane.
        let inner = self.framed(child, span, || {
            let back = affine::compose(&swap(), &shift(-at));
            (back, lit(1.0))
        });
        self.warn_of_what_a_mirror_hides(&bound, inner, 0);
        let (one, zero) = (self.graph.constant(1.0), self.graph.constant(0.0));
        let folded = self.folded(inner, [one, zero, zero], span);
        let id = self.framed(folded, span, || {
            (affine::compose(&shift(at), &swap()), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// Warns of a shape that lies on the side of a mirror that is not shown, or more there than on
    /// the other. `shape` stands in the mirror's frame, which is across `axis`.
    fn warn_of_what_a_mirror_hides(&mut self, bound: &Bound<'a>, shape: ShapeId, axis: usize) {
        let bounds = self.bounds_of(shape);
        let (behind, before) = (-bounds.min[axis], bounds.max[axis]);
        if bounds.is_empty() || behind.is_infinite() || behind <= before + 1e-6 * behind {
            return;
        }
        let message = match before > 0.0 {
            true => "this mirror leaves out most of the shape, which is behind its plane",
            false => "this mirror shows nothing: all of the shape is behind its plane",
        };
        let mut diagnostic = Diagnostic::warning(codes::W0404, bound.span_of(1), message);
        if bound.span_of(0).file == bound.span.file {
            diagnostic = diagnostic.label(bound.span_of(0), "this shape");
        }
        let help = "it shows the side that the vector points to; a vector the other way shows the other side";
        self.report(diagnostic.help(help));
    }

    fn folded(&mut self, child: ShapeId, axes: [ExprId; 3], span: Span) -> ShapeId {
        if self.is_nothing(child) {
            return child;
        }
        let plane = self.shapes[child.0 as usize].plane;
        let parameters = self.prepared(Op::Mirror, &axes);
        self.add(
            ShapeKind::Domain {
                op: Op::Mirror,
                child,
                parameters,
            },
            plane,
            span,
        )
    }

    /// `repeat(shape, spacing, count)`
    pub(crate) fn repeat(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let spacing = bound.vector(1);
        let steps = spacing.map(|id| self.present(id));
        if steps.iter().all(|step| *step == 0.0) {
            let message = "a repetition needs a spacing along at least one axis";
            self.report(Diagnostic::error(codes::E0401, bound.span_of(1), message));
            return Ok(Value::Poison);
        }
        let is_fixed = self.is_constant_shape(child);
        let places = self.places(child, &spacing);
        let Some(middle) = self.middle_of_cell(&bound, &places, steps) else {
            return Ok(Value::Poison);
        };
        // A copy that stands off the middle of its cell is brought there, and the whole moved back.
        let counts = bound.given(2).then(|| bound.vector(2));
        let centred = self.moved(child, middle.map(|v| -v), span);
        let repeated = match is_fixed {
            true => {
                let bounds = places[0].bounds;
                self.repeated_box(centred, &bounds, middle, spacing, counts, span)
            }
            false => self.repeated_all(centred, steps, spacing, counts, span),
        };
        Ok(repeated.map_or(Value::Poison, |id| {
            Value::Shape(self.moved(id, middle, span))
        }))
    }

    /// What is to be the middle of the cells of a repetition: the origin if the shape stays in the
    /// cell around it, else the middle of the shape. Reports shapes that are larger than their cells
    /// and warns of those that may come to be, or leave them.
    fn middle_of_cell(
        &mut self,
        bound: &Bound<'a>,
        places: &[Place],
        steps: [f64; 3],
    ) -> Option<[f64; 3]> {
        let spans = (bound.span_of(0), bound.span_of(1));
        let about = |diagnostic: Diagnostic| {
            let is_near = spans.0.file == bound.span.file;
            let diagnostic = if is_near {
                diagnostic.label(spans.0, "this shape")
            } else {
                diagnostic
            };
            diagnostic.help("make the spacing larger, or the shape smaller")
        };
        let mut middle = [0.0; 3];
        for axis in (0..3).filter(|&axis| steps[axis] != 0.0) {
            let letter = ["x", "y", "z"][axis];
            let cell = |p: &Place| p.numbers[axis].abs() * (1.0 + 1e-9);
            let size = |b: &Bounds| b.max[axis] - b.min[axis];
            let too_large = |p: &&Place| !p.bounds.is_empty() && size(&p.bounds) > cell(p);
            if let Some(place) = places.iter().find(too_large) {
                let (size, cell) = (extent(size(&place.bounds)), short(place.numbers[axis]));
                let what = format!("the shape is {size} along {letter}, and its cell only {cell}");
                if place.when.is_empty() {
                    let message = format!("{what}: it would be cut");
                    self.report(about(Diagnostic::error(codes::E0411, spans.1, message)));
                    return None;
                }
                let message = format!("{} {what}: it is cut there", place.when);
                self.report(about(Diagnostic::warning(codes::W0403, spans.1, message)));
                continue;
            }
            let leaves = |p: &Place, middle: f64| {
                let half = cell(p) / 2.0;
                p.bounds.min[axis] < middle - half || p.bounds.max[axis] > middle + half
            };
            let boxes = places.iter().map(|p| p.bounds);
            let whole = boxes.fold(Bounds::EMPTY, |whole, b| whole.hull(&b));
            if !size(&whole).is_finite() || !places.iter().any(|p| leaves(p, 0.0)) {
                continue;
            }
            middle[axis] = whole.centre()[axis];
            if let Some(place) = places.iter().find(|p| leaves(p, middle[axis])) {
                let (way, cell) = (short(size(&whole)), short(place.numbers[axis]));
                let message = format!(
                    "the shape moves within {way} along {letter}, and its cell is only {cell}: it is \
                     cut where it leaves the cell"
                );
                self.report(about(Diagnostic::warning(codes::W0403, spans.1, message)));
            }
        }
        Some(middle)
    }

    /// A repetition of a shape whose box is known: the copy of the point's own cell, and no farther
    /// than the boxes of the copies next to it.
    fn repeated_box(
        &mut self,
        child: ShapeId,
        bounds: &Bounds,
        middle: [f64; 3],
        spacing: [ExprId; 3],
        counts: Option<[ExprId; 3]>,
        span: Span,
    ) -> Option<ShapeId> {
        let mut guard: Vec<ExprId> = Vec::new();
        for corner in [bounds.min, bounds.max] {
            let shifted = [0, 1, 2].map(|i| (corner[i] - middle[i]).clamp(-1e18, 1e18));
            guard.extend(shifted.map(|v| self.graph.constant(v)));
        }
        guard.extend(spacing);
        let plane = self.shapes[child.0 as usize].plane;
        let domain = |op, child, parameters| ShapeKind::Domain {
            op,
            child,
            parameters,
        };
        let distance = |op, child, parameters| ShapeKind::Distance {
            op,
            child,
            parameters,
        };
        Some(match counts {
            Some(counts) => {
                let arguments: Vec<ExprId> = spacing.into_iter().chain(counts).collect();
                let parameters = self.prepared(Op::RepeatLimited, &arguments);
                let folded = self.add(domain(Op::RepeatLimited, child, parameters), plane, span);
                guard.extend(counts);
                let parameters = self.prepared(Op::RepeatLimitedGuard, &guard);
                self.add(
                    distance(Op::RepeatLimitedGuard, folded, parameters),
                    plane,
                    span,
                )
            }
            None => {
                let parameters = self.prepared(Op::RepeatGuard, &guard);
                let guarded = self.add(distance(Op::RepeatGuard, child, parameters), plane, span);
                let parameters = self.prepared(Op::Repeat, &spacing);
                self.add(domain(Op::Repeat, guarded, parameters), plane, span)
            }
        })
    }

    /// A repetition of a shape that moves or changes: the copy of the point's own cell and, along
    /// each axis, that of the cell the point is nearer to. Two, four or eight times the work, and
    /// exact wherever the shape is in its cell.
    fn repeated_all(
        &mut self,
        child: ShapeId,
        steps: [f64; 3],
        spacing: [ExprId; 3],
        counts: Option<[ExprId; 3]>,
        span: Span,
    ) -> Option<ShapeId> {
        let plane = self.shapes[child.0 as usize].plane;
        let (op, grid) = match counts {
            Some(counts) => (Op::RepeatLimitedNeighbour, [spacing, counts].concat()),
            None => (Op::RepeatNeighbour, spacing.to_vec()),
        };
        let single = |id| self.graph.as_constant(id) == Some(1.0);
        let axes: Vec<usize> = (0..3)
            .filter(|&axis| steps[axis] != 0.0)
            .filter(|&axis| counts.is_none_or(|counts| !single(counts[axis])))
            .collect();
        let mut copies = Vec::with_capacity(1 << axes.len());
        for subset in 0..1_u32 << axes.len() {
            let mut which = [0.0; 3];
            for (bit, &axis) in axes.iter().enumerate() {
                which[axis] = f64::from(subset >> bit & 1);
            }
            let which = which.map(|v| self.graph.constant(v));
            let arguments: Vec<ExprId> = grid.iter().copied().chain(which).collect();
            let parameters = self.prepared(op, &arguments);
            let kind = ShapeKind::Domain {
                op,
                child,
                parameters,
            };
            copies.push(self.add(kind, plane, span));
        }
        self.combined(Op::Union, Vec::new(), copies, span)
    }

    /// A shape moved by constants.
    pub(crate) fn moved(&mut self, child: ShapeId, by: [f64; 3], span: Span) -> ShapeId {
        self.framed(child, span, || (affine::translate(by.map(lit)), lit(1.0)))
    }

    /// `polar(shape, n)`: copies about the axis that points up, or in the plane for a figure.
    pub(crate) fn polar(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let child = if plane {
            child
        } else {
            self.lying(child, span)
        };
        // The first sector is the one in which the shape stands.
        let phase = match bound.given(2) {
            true => bound.number(2),
            false => {
                let bounds = self.bounds_of(child);
                let centre = bounds.centre();
                let across = if plane { centre[1] } else { centre[2] };
                let direction = if bounds.is_empty() {
                    0.0
                } else {
                    across.atan2(centre[0])
                };
                self.graph.constant(if direction.is_finite() {
                    direction
                } else {
                    0.0
                })
            }
        };
        self.warn_of_a_narrow_sector(&bound, child, phase);
        let rows = match plane {
            true => [Op::PolarPlane, Op::PolarPlaneNeighbour],
            false => [Op::Polar, Op::PolarNeighbour],
        };
        let arguments = [bound.number(1), phase];
        let copies = rows.map(|op| {
            let parameters = self.prepared(op, &arguments);
            self.add(
                ShapeKind::Domain {
                    op,
                    child,
                    parameters,
                },
                plane,
                span,
            )
        });
        let Some(both) = self.combined(Op::Union, Vec::new(), copies.to_vec(), span) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Shape(if plane {
            both
        } else {
            self.upright(both, span)
        }))
    }

    /// Warns of a shape that reaches so far out of its sector that it would be cut. At each point
    /// the copies of the point's sector and of the next one are looked at, so a shape may be twice
    /// as wide as its sector if it reaches as far to both sides, and may not if it does not.
    fn warn_of_a_narrow_sector(&mut self, bound: &Bound<'a>, child: ShapeId, phase: ExprId) {
        let (count, phase) = (self.present(bound.number(1)), self.present(phase));
        // Of two copies, both are looked at.
        if count < 3.0 {
            return;
        }
        let sector = std::f64::consts::TAU / count;
        let across = if self.shapes[child.0 as usize].plane {
            1
        } else {
            2
        };
        let (mut left, mut right) = (0.0_f64, 0.0_f64);
        for piece in self.pieces(child) {
            let [to_left, to_right] = sideways(&piece, across, phase);
            (left, right) = (left.max(to_left), right.max(to_right));
        }
        let (least, most) = (left.min(right), left.max(right));
        if most <= sector * (1.0 + 1e-9) && (most <= sector * 0.501 || least > most / 2.0) {
            return;
        }
        let degrees = |angle: f64| short((angle.to_degrees() * 10.0).round() / 10.0);
        let message = format!(
            "the shape reaches {}deg sideways, and its sector is {}deg wide: its copies are cut",
            degrees(most),
            degrees(sector)
        );
        let mut diagnostic = Diagnostic::warning(codes::W0403, bound.span_of(1), message);
        if bound.span_of(0).file == bound.span.file {
            diagnostic = diagnostic.label(bound.span_of(0), "this shape");
        }
        let help = if bound.given(2) {
            "`phase` is the direction of the shape; perhaps it is another"
        } else {
            "make fewer copies or a smaller shape, or write the copies down as a list"
        };
        self.report(diagnostic.help(help));
    }

    /// The boxes of the shapes that a shape is a union of.
    fn pieces(&mut self, id: ShapeId) -> Vec<Bounds> {
        const MOST: usize = 256;
        // Of what is a union of far more, the pieces would only be gathered to be thrown away.
        if self.occurrences[id.0 as usize] as usize > 16 * MOST {
            return vec![self.bounds_of(id)];
        }
        let mut pieces = Vec::new();
        match self.shapes[id.0 as usize].kind.clone() {
            ShapeKind::Painted { child, .. } => pieces = self.pieces(child),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } if children.len() <= MOST => {
                for child in children {
                    pieces.extend(self.pieces(child));
                }
            }
            ShapeKind::Frame { child, matrix, .. } => {
                let numbers = matrix.map(|id| self.present(id));
                if let Some(rows) = inverse(&numbers) {
                    let inner = self.pieces(child);
                    pieces = inner.iter().map(|piece| piece.mapped(&rows)).collect();
                }
            }
            _ => {}
        }
        if pieces.is_empty() || pieces.len() > MOST {
            pieces = vec![self.bounds_of(id)];
        }
        pieces
    }
}

/// How far what fills a box reaches to the left and to the right of a direction, as angles seen
/// from the axis: it touches every side of its box somewhere, and so reaches at least as far as the
/// nearest point of each. What is around the axis and as wide as deep is taken to be round, and a
/// little that is behind the axis does not count: other copies are there too.
fn sideways(piece: &Bounds, across: usize, direction: f64) -> [f64; 2] {
    let (low, high) = (
        [piece.min[0], piece.min[across]],
        [piece.max[0], piece.max[across]],
    );
    let is_round = [high[0], -low[1], high[1]].map(|v| (v + low[0]).abs() <= 1e-6 * v.abs());
    let ends = low.into_iter().chain(high);
    if piece.is_empty() || is_round == [true; 3] || !ends.clone().all(f64::is_finite) {
        return [0.0; 2];
    }
    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
    let turned = |[x, y]: [f64; 2]| {
        let (s, c) = direction.sin_cos();
        [x * c + y * s, y * c - x * s]
    };
    let corners = corners.map(turned);
    let farthest = corners.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
    let mut reach = [0.0_f64; 2];
    for (at, a) in corners.iter().enumerate() {
        let b = corners[(at + 1) % 4];
        let (from, to) = (a[1].atan2(a[0]), b[1].atan2(b[0]));
        // The side may cross the direction itself, in front of the axis or behind it.
        let crosses_in_front = a[1] * b[1] <= 0.0 && a[0] * b[1].abs() + b[0] * a[1].abs() > 0.0;
        let is_near = distance_to(*a, b) < 0.15 * farthest;
        if !crosses_in_front && !is_near {
            let side = usize::from(from + to < 0.0);
            reach[side] = reach[side].max(from.abs().min(to.abs()));
        }
    }
    reach
}

/// The distance of the origin from a segment.
fn distance_to(a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = (along[0] * along[0] + along[1] * along[1]).max(f64::MIN_POSITIVE);
    let share = (-(a[0] * along[0] + a[1] * along[1]) / length).clamp(0.0, 1.0);
    (a[0] + share * along[0]).hypot(a[1] + share * along[1])
}

/// An extent of a shape, which may be endless.
fn extent(size: f64) -> String {
    if size.is_finite() {
        format!("{} long", short(size))
    } else {
        "endless".to_owned()
    }
}
