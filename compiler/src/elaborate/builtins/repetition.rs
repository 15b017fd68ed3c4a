//! Copies of shapes by folding space: mirrors, grids and rings. The cost does not grow with their
//! number.

use crate::analysis::bounds::inverse;
use crate::analysis::symmetry::Symmetries;
use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::display::format_short;
use crate::elaborate::value::{EvalResult, Value};
use crate::expression::ExprId;
use crate::scene::{NeighbourCells, ShapeId, ShapeKind};
use crate::symbolic::Symbolic;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::ops::affine::{self, Affine};
use sdfc_vm::real::lit;
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// Evaluates `mirror(shape, axes)`: shows the half on the positive side of a plane on both sides. Along axes,
    /// this is a fold of coordinates; for any other plane, the shape is reflected into a frame and back.
    pub(crate) fn mirror(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        let axes = bound.vector(1);
        let what = "the plane of a mirror";
        let offset = Symbolic(bound.number(2));
        let constants = axes.map(|id| self.expressions.as_constant(id));
        let flags = constants.map(|c| c.is_some_and(|c| c == 0.0 || c == 1.0));
        let is_at_origin = self.expressions.as_constant(bound.number(2)) == Some(0.0);
        if constants.iter().all(|c| *c == Some(0.0)) {
            let message = format!("{what} is the zero vector, which has no direction");
            self.report(Diagnostic::error(codes::E0405, bound.span_at(1), message));
            return Ok(Value::Poison);
        }
        if flags.iter().all(|f| *f) && is_at_origin {
            let mirrored_axes = (0..3).filter(|&axis| constants[axis] == Some(1.0));
            for axis in mirrored_axes {
                self.warn_hidden_by_mirror(&bound, child, axis);
            }
            return Ok(Value::Shape(self.add_mirror(child, axes, span)));
        }
        let Some(normal) = self.unit_vector(what, &axes, bound.span_at(1)) else {
            return Ok(Value::Poison);
        };
        let normal = [normal[0], normal[1], normal[2]].map(Symbolic);
        // The reflection that swaps the normal and the x axis is its own inverse.
        let constant_normal = normal.map(|n| self.expressions.as_constant(n.0));
        let is_x = constant_normal == [Some(1.0), Some(0.0), Some(0.0)];
        let swap = move || -> Affine<Symbolic> {
            if is_x {
                return affine::identity();
            }
            let i = lit::<Symbolic>(1.0);
            affine::reflect([normal[0] - i, normal[1], normal[2]], lit(0.0))
        };
        let shift = move |distance: Symbolic| {
            let o = lit::<Symbolic>(0.0);
            affine::translate([distance, o, o])
        };
        // Maps into a frame whose x axis is the normal and whose origin lies on the plane.
        let inner = self.add_frame(child, span, || {
            let to_plane = affine::compose(&swap(), &shift(-offset));
            (to_plane, lit(1.0))
        });
        self.warn_hidden_by_mirror(&bound, inner, 0);
        let (i, zero) = (
            self.expressions.constant(1.0),
            self.expressions.constant(0.0),
        );
        let add_mirror = self.add_mirror(inner, [i, zero, zero], span);
        let id = self.add_frame(add_mirror, span, || {
            (affine::compose(&shift(offset), &swap()), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// Warns if a shape extends farther on the hidden side of a mirror than on the shown side.
    /// `shape` is in the frame of the mirror, whose normal is `axis`.
    fn warn_hidden_by_mirror(&mut self, bound: &BoundArgs<'a>, shape: ShapeId, axis: usize) {
        let bounds = self.bounds_of(shape);
        let (extent_behind, extent_before) = (-bounds.min[axis], bounds.max[axis]);
        if bounds.is_empty()
            || extent_behind.is_infinite()
            || extent_behind <= extent_before + 1e-6 * extent_behind
        {
            return;
        }
        let message = match extent_before > 0.0 {
            true => "this mirror leaves out most of the shape, which is behind its plane",
            false => "this mirror shows nothing: all of the shape is behind its plane",
        };
        let mut diagnostic = Diagnostic::warning(codes::W0404, bound.span_at(1), message);
        if bound.span_at(0).file == bound.span.file {
            diagnostic = diagnostic.label(bound.span_at(0), "this shape");
        }
        let help = "it shows the side that the vector points to; a vector the other way shows the other side";
        self.report(diagnostic.help(help));
    }

    fn add_mirror(&mut self, child: ShapeId, axes: [ExprId; 3], span: Span) -> ShapeId {
        if self.is_nothing(child) {
            return child;
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let parameters = self.prepare_parameters(Op::Mirror, &axes);
        self.add(
            ShapeKind::Domain {
                op: Op::Mirror,
                child,
                parameters,
            },
            is_2d,
            span,
        )
    }

    /// Evaluates `repeat(shape, spacing, count)`: copies on a grid, which is infinite without a count.
    pub(crate) fn repeat(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let spacing = bound.vector(1);
        let steps = spacing.map(|id| self.current_value(id));
        if steps.iter().all(|step| *step == 0.0) {
            let message = "a repetition needs a spacing along at least one axis";
            self.report(Diagnostic::error(codes::E0401, bound.span_at(1), message));
            return Ok(Value::Poison);
        }
        let counts = bound.is_given(2).then(|| bound.vector(2));
        let samples = self.sample_bounds(child, &spacing);
        // The cell is centred at the shape; the result is translated back.
        let boxes = samples.iter().map(|sample| sample.bounds);
        let hull = boxes.fold(Bounds::EMPTY, |hull, b| hull.hull(&b));
        let centre: [f64; 3] = std::array::from_fn(|axis| {
            let centre = hull.centre()[axis];
            if steps[axis] != 0.0 && centre.is_finite() {
                centre
            } else {
                0.0
            }
        });
        let centred = self.add_translation(child, centre.map(|v| -v), span);
        let mut others = [NeighbourCells::default(); 3];
        for axis in (0..3).filter(|&axis| steps[axis] != 0.0) {
            let single =
                |counts: [ExprId; 3]| self.expressions.as_constant(counts[axis]) == Some(1.0);
            if counts.is_some_and(single) {
                continue;
            }
            let extent = samples.iter().map(|sample| {
                let extent = (centre[axis] - sample.bounds.min[axis])
                    .max(sample.bounds.max[axis] - centre[axis]);
                extent / sample.numbers[axis].abs()
            });
            let extent = extent.fold(0.0, f64::max);
            let symmetries = Symmetries {
                shapes: &self.shapes,
                expressions: &self.expressions,
            };
            let is_even = symmetries.is_mirror_symmetric(centred, axis, 0.0);
            match other_cells(extent, is_even) {
                Some(axis_others) => others[axis] = axis_others,
                None => {
                    self.report_wide_copy(&bound, axis, extent);
                    return Ok(Value::Poison);
                }
            }
        }
        let copies: usize = others.iter().map(|others| others.cells().count()).product();
        if copies > MAX_COPIES {
            let message = format!(
                "the copies of this shape overlap so far that {copies} of them would be evaluated \
                 for each point, and at most {MAX_COPIES} are allowed"
            );
            let help = "make the spacing larger, or the shape smaller";
            self.report(Diagnostic::error(codes::E0411, bound.span_at(1), message).help(help));
            return Ok(Value::Poison);
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let (op, arguments) = match counts {
            Some(counts) => (Op::RepeatLimited, [spacing, counts].concat()),
            None => (Op::Repeat, spacing.to_vec()),
        };
        let parameters = self.prepare_parameters(op, &arguments);
        let repeated = ShapeKind::Repeat {
            op,
            child: centred,
            parameters,
            others,
        };
        let repeated = self.add(repeated, is_2d, span);
        Ok(Value::Shape(self.add_translation(repeated, centre, span)))
    }

    /// Reports a shape that extends over too many cells.
    fn report_wide_copy(&mut self, bound: &BoundArgs<'a>, axis: usize, extent: f64) {
        let letter = ["x", "y", "z"][axis];
        let message = match extent.is_finite() {
            true => format!(
                "the shape is {} times as long along {letter} as its cell, and at most {MAX_COPY_CELLS} times is allowed",
                format_short((200.0 * extent).round() / 100.0)
            ),
            false => format!("the shape is infinite along {letter}, so it has no copies there"),
        };
        let mut diagnostic = Diagnostic::error(codes::E0411, bound.span_at(1), message);
        if bound.span_at(0).file == bound.span.file {
            diagnostic = diagnostic.label(bound.span_at(0), "this shape");
        }
        self.report(diagnostic.help(match extent.is_finite() {
            true => "make the spacing larger, or the shape smaller",
            false => "cut it to its cell first: `(shape & box(…)).repeat(…)`",
        }));
    }

    /// Translates a shape by constants.
    pub(crate) fn add_translation(
        &mut self,
        child: ShapeId,
        offset: [f64; 3],
        span: Span,
    ) -> ShapeId {
        self.add_frame(child, span, || {
            (affine::translate(offset.map(lit)), lit(1.0))
        })
    }

    /// Evaluates `polar(shape, n, phase)`: copies about the up axis, or in the plane for a 2-D shape, turned by
    /// `phase`.
    pub(crate) fn polar(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let child = if is_2d {
            child
        } else {
            self.rotated_to_y_up(child, span)
        };
        // The first sector contains the original shape.
        let bounds = self.bounds_of(child);
        let centre = bounds.centre();
        let lateral = if is_2d { centre[1] } else { centre[2] };
        let direction = lateral.atan2(centre[0]);
        let direction = if !bounds.is_empty() && direction.is_finite() {
            direction
        } else {
            0.0
        };
        let others = self.other_sectors(child, bound.number(1), direction);
        let direction = self.expressions.constant(direction);
        let op = if is_2d { Op::PolarPlane } else { Op::Polar };
        let parameters = self.prepare_parameters(op, &[bound.number(1), direction]);
        let kind = ShapeKind::Polar {
            op,
            child,
            parameters,
            others,
        };
        let copies = self.add(kind, is_2d, bound.span);
        let copies = if is_2d {
            copies
        } else {
            self.rotated_to_scene_up(copies, span)
        };
        Ok(Value::Shape(match bound.is_given(2) {
            true => self.rotated_about_up(copies, bound.number(2), span),
            false => copies,
        }))
    }

    /// Copies in other sectors that may be nearer to a point than the copy in the point's own
    /// sector. `direction` is that of the shape, an angle in radians.
    fn other_sectors(&mut self, child: ShapeId, count: ExprId, direction: f64) -> NeighbourCells {
        let count = self.current_value(count);
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let symmetries = Symmetries {
            shapes: &self.shapes,
            expressions: &self.expressions,
        };
        if symmetries.is_round(child) {
            return NeighbourCells::default();
        }
        let (lateral_axis, radial_axis) = if is_2d { (1, 0) } else { (2, 0) };
        // The symmetry is tested only if the middle plane of the sector is a coordinate plane of
        // the frame.
        let is_even = if direction == 0.0 {
            symmetries.is_mirror_symmetric(child, lateral_axis, 0.0)
        } else if (direction.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-12 {
            symmetries.is_mirror_symmetric(child, radial_axis, 0.0)
        } else {
            false
        };
        let mut max_angle = 0.0_f64;
        for piece in self.sampled_piece_bounds(child) {
            max_angle = max_angle.max(max_angle_from(&piece, lateral_axis, direction));
        }
        let all_others = NeighbourCells {
            near: (count.max(1.0) as u32 - 1).min(u8::MAX.into()) as u8,
            far: 0,
        };
        let sector = std::f64::consts::TAU / count.max(1.0);
        match other_cells(max_angle / sector, is_even) {
            Some(others)
                if u32::from(others.near) + u32::from(others.far) < u32::from(all_others.near) =>
            {
                others
            }
            _ => all_others,
        }
    }

    /// Returns the boxes of the pieces of a shape, at all sampled values of the parameters. Pieces that are
    /// rotationally symmetric about the axis are left out, since they are equal in every sector.
    fn sampled_piece_bounds(&mut self, child: ShapeId) -> Vec<Bounds> {
        if self.is_constant_shape(child) {
            return self.union_piece_bounds(child, true);
        }
        let samples = self.sample_bounds(child, &[]);
        samples.into_iter().map(|sample| sample.bounds).collect()
    }

    /// Returns the boxes of the operands of a union, without operands that are rotationally symmetric about the
    /// axis. `on_axis` is true if the shape's own axis is still the axis of the copies.
    fn union_piece_bounds(&mut self, id: ShapeId, on_axis: bool) -> Vec<Bounds> {
        const MAX_PIECES: usize = 256;
        // For unions of many more shapes, collecting the pieces would be wasted work.
        if self.occurrences[id.0 as usize] as usize > 16 * MAX_PIECES {
            return vec![self.bounds_of(id)];
        }
        let symmetries = Symmetries {
            shapes: &self.shapes,
            expressions: &self.expressions,
        };
        if on_axis && symmetries.is_round(id) {
            return Vec::new();
        }
        let mut pieces = Vec::new();
        match self.shapes[id.0 as usize].kind.clone() {
            ShapeKind::Painted { child, .. } => pieces = self.union_piece_bounds(child, on_axis),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } if children.len() <= MAX_PIECES => {
                for child in children {
                    pieces.extend(self.union_piece_bounds(child, on_axis));
                }
            }
            ShapeKind::Frame { child, matrix, .. } => {
                let numbers = matrix.map(|id| self.current_value(id));
                if let Some(rows) = inverse(&numbers) {
                    let inner = self.union_piece_bounds(child, false);
                    pieces = inner.iter().map(|piece| piece.mapped(&rows)).collect();
                }
            }
            _ => {}
        }
        if pieces.is_empty() || pieces.len() > MAX_PIECES {
            pieces = vec![self.bounds_of(id)];
        }
        pieces
    }
}

/// Returns the maximum angle in radians, seen from the axis, between a direction and the points of a box. It is π
/// if the axis intersects the box.
fn max_angle_from(piece: &Bounds, lateral_axis: usize, direction: f64) -> f64 {
    let (low, high) = (
        [piece.min[0], piece.min[lateral_axis]],
        [piece.max[0], piece.max[lateral_axis]],
    );
    if piece.is_empty() {
        return 0.0;
    }
    let contains_axis = (0..2).all(|i| low[i] <= 0.0 && high[i] >= 0.0);
    if contains_axis || !low.iter().chain(&high).all(|v| v.is_finite()) {
        return std::f64::consts::PI;
    }
    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
    let (s, c) = direction.sin_cos();
    let rotated = corners.map(|[x, y]| [x * c + y * s, y * c - x * s]);
    // A box beside the axis that crosses the opposite direction extends to the full angle.
    let crosses_opposite = (0..4).any(|i| {
        let (a, b) = (rotated[i], rotated[(i + 1) % 4]);
        a[1] * b[1] <= 0.0 && a[0] * b[1].abs() + b[0] * a[1].abs() <= 0.0
    });
    if crosses_opposite {
        return std::f64::consts::PI;
    }
    let angles = rotated.map(|[x, y]| y.atan2(x).abs());
    angles.into_iter().fold(0.0, f64::max)
}

/// Maximum number of copies of a repetition that are evaluated per point.
const MAX_COPIES: usize = 125;
/// Maximum size of a copy, in cells.
const MAX_COPY_CELLS: f64 = 8.0;

/// Copies that may be nearer to a point than the copy in its own cell. `extent` is the distance
/// that the shape extends from the centre of its cell, in cells. `None` if there are too many
/// copies.
///
/// A farther copy is never nearer than the one before it, unless that one extends past the point.
/// With `extent` ≤ 1/2, the own copy and the nearer neighbour suffice. If the shape is symmetric,
/// its neighbour is its mirror image in the wall between both cells; then the own copy alone
/// suffices.
fn other_cells(extent: f64, is_even: bool) -> Option<NeighbourCells> {
    if is_even && extent <= 0.5 * (1.0 + 1e-9) {
        return Some(NeighbourCells::default());
    }
    if extent.is_nan() || extent > MAX_COPY_CELLS / 2.0 {
        return None;
    }
    let cells = |v: f64| ((v - 1e-9).ceil() - 1.0).max(0.0) as u8;
    Some(NeighbourCells {
        near: cells(1.5 + extent),
        far: cells(0.5 + extent),
    })
}
