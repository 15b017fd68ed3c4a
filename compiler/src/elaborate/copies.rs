//! Copies of shapes by folding space: mirrors, grids and rings. They cost no more than one copy.

use super::Elaborator;
use super::bound::{Bound, short};
use super::evaluate::Outcome;
use super::value::Value;
use crate::bounds::inverse;
use crate::expression::ExprId;
use crate::scene::{Others, ShapeId, ShapeKind};
use crate::symbolic::Symbolic;
use crate::symmetry::Symmetries;
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
        let counts = bound.given(2).then(|| bound.vector(2));
        let places = self.places(child, &spacing);
        // The cell is that around the middle of the shape, and the whole is moved back.
        let boxes = places.iter().map(|place| place.bounds);
        let whole = boxes.fold(Bounds::EMPTY, |whole, b| whole.hull(&b));
        let middle: [f64; 3] = std::array::from_fn(|axis| {
            let middle = whole.centre()[axis];
            if steps[axis] != 0.0 && middle.is_finite() {
                middle
            } else {
                0.0
            }
        });
        let centred = self.moved(child, middle.map(|v| -v), span);
        let mut others = [Others::default(); 3];
        for axis in (0..3).filter(|&axis| steps[axis] != 0.0) {
            let single = |counts: [ExprId; 3]| self.graph.as_constant(counts[axis]) == Some(1.0);
            if counts.is_some_and(single) {
                continue;
            }
            let reach = places.iter().map(|place| {
                let reach = (middle[axis] - place.bounds.min[axis])
                    .max(place.bounds.max[axis] - middle[axis]);
                reach / place.numbers[axis].abs()
            });
            let reach = reach.fold(0.0, f64::max);
            let symmetries = Symmetries {
                shapes: &self.shapes,
                expressions: &self.graph,
            };
            let is_even = symmetries.mirrored(centred, axis, 0.0);
            match other_cells(reach, is_even) {
                Some(found) => others[axis] = found,
                None => {
                    self.report_a_wide_copy(&bound, axis, reach);
                    return Ok(Value::Poison);
                }
            }
        }
        let copies: usize = others.iter().map(|others| others.cells().count()).product();
        if copies > MAX_COPIES {
            let message = format!(
                "the copies of this shape overlap so far that {copies} of them would be looked at \
                 for each point, and {MAX_COPIES} are allowed"
            );
            let help = "make the spacing larger, or the shape smaller";
            self.report(Diagnostic::error(codes::E0411, bound.span_of(1), message).help(help));
            return Ok(Value::Poison);
        }
        let plane = self.shapes[child.0 as usize].plane;
        let (op, arguments) = match counts {
            Some(counts) => (Op::RepeatLimited, [spacing, counts].concat()),
            None => (Op::Repeat, spacing.to_vec()),
        };
        let parameters = self.prepared(op, &arguments);
        let repeated = ShapeKind::Repeat {
            op,
            child: centred,
            parameters,
            others,
        };
        let repeated = self.add(repeated, plane, span);
        Ok(Value::Shape(self.moved(repeated, middle, span)))
    }

    /// Reports a shape that reaches over more cells than can be looked at.
    fn report_a_wide_copy(&mut self, bound: &Bound<'a>, axis: usize, reach: f64) {
        let letter = ["x", "y", "z"][axis];
        let message = match reach.is_finite() {
            true => format!(
                "the shape is {} times as long along {letter} as its cell, and {MAX_REACH} times is the most",
                short((200.0 * reach).round() / 100.0)
            ),
            false => format!("the shape is endless along {letter}, so it has no copies there"),
        };
        let mut diagnostic = Diagnostic::error(codes::E0411, bound.span_of(1), message);
        if bound.span_of(0).file == bound.span.file {
            diagnostic = diagnostic.label(bound.span_of(0), "this shape");
        }
        self.report(diagnostic.help(match reach.is_finite() {
            true => "make the spacing larger, or the shape smaller",
            false => "cut it to its cell first: `(shape & box(…)).repeat(…)`",
        }));
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
        let others = self.other_sectors(child, bound.number(1), phase);
        let op = if plane { Op::PolarPlane } else { Op::Polar };
        let parameters = self.prepared(op, &[bound.number(1), phase]);
        let kind = ShapeKind::Polar {
            op,
            child,
            parameters,
            others,
        };
        let copies = self.add(kind, plane, bound.span);
        Ok(Value::Shape(if plane {
            copies
        } else {
            self.upright(copies, span)
        }))
    }

    /// The copies in other sectors that may be nearer to a point than that of its own.
    fn other_sectors(&mut self, child: ShapeId, count: ExprId, phase: ExprId) -> Others {
        let (count, direction) = (self.present(count), self.present(phase));
        let plane = self.shapes[child.0 as usize].plane;
        let symmetries = Symmetries {
            shapes: &self.shapes,
            expressions: &self.graph,
        };
        if symmetries.is_round(child) {
            return Others::default();
        }
        let (sideways_axis, along_axis) = if plane { (1, 0) } else { (2, 0) };
        // The plane through the axis and the middle of the sector, where that is one of the frame's.
        let is_even = match self.graph.as_constant(phase) {
            Some(0.0) => symmetries.mirrored(child, sideways_axis, 0.0),
            Some(angle) if (angle.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-12 => {
                symmetries.mirrored(child, along_axis, 0.0)
            }
            _ => false,
        };
        let mut reach = 0.0_f64;
        for piece in self.places_of_pieces(child) {
            reach = reach.max(sideways(&piece, sideways_axis, direction));
        }
        let all = Others {
            near: (count.max(1.0) as u32 - 1).min(u8::MAX.into()) as u8,
            far: 0,
        };
        let sector = std::f64::consts::TAU / count.max(1.0);
        match other_cells(reach / sector, is_even) {
            Some(others)
                if u32::from(others.near) + u32::from(others.far) < u32::from(all.near) =>
            {
                others
            }
            _ => all,
        }
    }

    /// The boxes of the pieces of a shape, at all values of the parameters that are tried; those that are
    /// round about the axis are left out, since they look the same in every sector.
    fn places_of_pieces(&mut self, child: ShapeId) -> Vec<Bounds> {
        if self.is_constant_shape(child) {
            return self.pieces(child, true);
        }
        let places = self.places(child, &[]);
        places.into_iter().map(|place| place.bounds).collect()
    }

    /// The boxes of the shapes that a shape is a union of, without those that are round about the axis if
    /// that is still the axis of the copies (`on_axis`).
    fn pieces(&mut self, id: ShapeId, on_axis: bool) -> Vec<Bounds> {
        const MOST: usize = 256;
        // Of what is a union of far more, the pieces would only be gathered to be thrown away.
        if self.occurrences[id.0 as usize] as usize > 16 * MOST {
            return vec![self.bounds_of(id)];
        }
        let symmetries = Symmetries {
            shapes: &self.shapes,
            expressions: &self.graph,
        };
        if on_axis && symmetries.is_round(id) {
            return Vec::new();
        }
        let mut pieces = Vec::new();
        match self.shapes[id.0 as usize].kind.clone() {
            ShapeKind::Painted { child, .. } => pieces = self.pieces(child, on_axis),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } if children.len() <= MOST => {
                for child in children {
                    pieces.extend(self.pieces(child, on_axis));
                }
            }
            ShapeKind::Frame { child, matrix, .. } => {
                let numbers = matrix.map(|id| self.present(id));
                if let Some(rows) = inverse(&numbers) {
                    let inner = self.pieces(child, false);
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

/// How far what fills a box reaches sideways of a direction, as an angle seen from the axis: half a turn
/// where the axis runs through the box.
fn sideways(piece: &Bounds, across: usize, direction: f64) -> f64 {
    let (low, high) = (
        [piece.min[0], piece.min[across]],
        [piece.max[0], piece.max[across]],
    );
    if piece.is_empty() {
        return 0.0;
    }
    let holds_axis = (0..2).all(|i| low[i] <= 0.0 && high[i] >= 0.0);
    if holds_axis || !low.iter().chain(&high).all(|v| v.is_finite()) {
        return std::f64::consts::PI;
    }
    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
    let (s, c) = direction.sin_cos();
    let turned = corners.map(|[x, y]| [x * c + y * s, y * c - x * s]);
    // A box beside the axis that crosses the opposite direction reaches all the way.
    let behind = (0..4).any(|i| {
        let (a, b) = (turned[i], turned[(i + 1) % 4]);
        a[1] * b[1] <= 0.0 && a[0] * b[1].abs() + b[0] * a[1].abs() <= 0.0
    });
    if behind {
        return std::f64::consts::PI;
    }
    let angles = turned.map(|[x, y]| y.atan2(x).abs());
    angles.into_iter().fold(0.0, f64::max)
}

/// The most copies of a repetition that are evaluated for a point.
const MAX_COPIES: usize = 125;
/// The greatest size of a copy, in cells.
const MAX_REACH: f64 = 8.0;

/// The copies that may be nearer to a point than that of its own cell, for a shape that reaches so many
/// cells from the middle of its own; `None` where there are too many.
///
/// A copy farther on is never nearer than the one before it unless that reaches past the point: with `reach`
/// of half a cell or less, the own copy and the nearer neighbour are enough. The mirror image of a
/// neighbour in the wall between both is the own copy, if it is even; then that alone is enough.
fn other_cells(reach: f64, is_even: bool) -> Option<Others> {
    if is_even && reach <= 0.5 * (1.0 + 1e-9) {
        return Some(Others::default());
    }
    if reach.is_nan() || reach > MAX_REACH / 2.0 {
        return None;
    }
    let cells = |v: f64| ((v - 1e-9).ceil() - 1.0).max(0.0) as u8;
    Some(Others {
        near: cells(1.5 + reach),
        far: cells(0.5 + reach),
    })
}
