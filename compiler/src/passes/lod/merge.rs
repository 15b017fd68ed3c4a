//! What looks like a box becomes one: operands of a union that together differ from the box around
//! them by less than a pixel or so.
//!
//! Each point of the box is within the error of what it replaces, so outside of it their values differ
//! by no more, where they change no faster than the point moves; inside the box is deeper than what
//! it replaces, which is why nothing is replaced that something is taken away with. Operands of a hard
//! union are merged wherever they stand in it, by cutting the whole along its longest side until what
//! is left differs little enough.

use super::probe::slack;
use super::reach::{Reach, Runs, reaches};
use super::{Sight, in_world};
use crate::graph::{Graph, Node, NodeId, Number};
use crate::passes::bounding::operands::{Chain, Operands};
use crate::passes::bounding::volumes::Volumes;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// A box takes about this much, in instructions; less is not replaced by one.
const BOX: f64 = 1.5;
/// Values within this share of distances are some.
const EXACT: f64 = 1e-3;
/// What is longer than so many times the limit is no box of its own.
const LONGEST: f64 = 1000.0;

/// A graph with boxes in it.
pub(super) struct Merged {
    pub(super) graph: Graph,
    /// How many operands were replaced, and by how many boxes.
    pub(super) shapes: usize,
    pub(super) boxes: usize,
    /// The largest error in pixels.
    pub(super) pixels: f64,
}

/// A paint: its constants, and the channels that are computed.
type Paint = ([Number; 12], Vec<(u8, NodeId)>);

/// An operand that may be replaced.
#[derive(Clone)]
struct Leaf {
    /// Its place among the operands.
    at: usize,
    bounds: Bounds,
    /// How far the points of its box are from it at most.
    slack: f64,
    band: f64,
    work: f64,
}

/// An operand of a union as it is to be.
enum Piece {
    Kept(NodeId),
    Boxed(Bounds, Option<Paint>),
}

/// The graph with boxes for what is smaller than so many pixels.
pub(super) fn merge(graph: &Graph, sight: &Sight, limit: f64) -> Merged {
    let volumes = Volumes::of(graph);
    let reaches = reaches(graph, &volumes, &Runs::of(graph));
    let mut merger = Merger {
        graph,
        sight,
        limit,
        operands: Operands::of(graph),
        paints: paints(graph),
        uses: graph.uses(),
        volumes,
        reaches,
        covered: vec![false; graph.len()],
        shapes: 0,
        boxes: 0,
        pixels: 0.0,
    };
    let mut unions: HashMap<NodeId, Vec<Piece>> = HashMap::new();
    let mut single: HashMap<NodeId, Piece> = HashMap::new();
    // Outer ones first: what is replaced as a whole needs nothing within.
    for chain in merger.operands.chains(true).into_iter().rev() {
        if merger.covered[chain.root.0 as usize] || chain.sign < 0.0 {
            continue;
        }
        if chain.is_free {
            if let Some(pieces) = merger.union(&chain) {
                unions.insert(chain.root, pieces);
            }
        } else {
            single.extend(merger.blended(&chain));
        }
    }
    let mut moved = vec![NodeId::default(); graph.len()];
    let merged = super::super::rebuilt(graph, |to, id, node| {
        let new = match (unions.get(&id), single.get(&id)) {
            (Some(pieces), _) => {
                let parts = pieces.iter().map(|piece| added(to, piece, &moved));
                let parts: Vec<NodeId> = parts.collect();
                let joined = parts.into_iter().reduce(|a, b| {
                    to.add(Node::Apply {
                        op: Op::Union,
                        point: None,
                        values: vec![a, b],
                        parameters: Vec::new(),
                    })
                });
                joined.unwrap_or_else(|| to.add(node))
            }
            (None, Some(piece)) => added(to, piece, &moved),
            (None, None) => to.add(node),
        };
        moved[id.0 as usize] = new;
        new
    });
    Merged {
        // Without what is now unread.
        graph: super::super::rebuilt(&merged, |to, _, node| to.add(node)),
        shapes: merger.shapes,
        boxes: merger.boxes,
        pixels: merger.pixels,
    }
}

/// The node of a piece.
fn added(to: &mut Graph, piece: &Piece, moved: &[NodeId]) -> NodeId {
    let (bounds, paint) = match piece {
        Piece::Kept(id) => return moved[id.0 as usize],
        Piece::Boxed(bounds, paint) => (bounds, paint),
    };
    let constant = |v: f64| Number::Constant(v as f32);
    let world = to.add(Node::World);
    let point = to.add(Node::Moved {
        point: world,
        by: bounds.centre().map(|v| constant(-v)),
    });
    let half = |i: usize| constant((bounds.max[i] - bounds.min[i]) / 2.0);
    let value = to.add(Node::Apply {
        op: Op::Cuboid,
        point: Some(point),
        values: Vec::new(),
        parameters: (0..3).map(half).collect(),
    });
    let Some((constants, channels)) = paint else {
        return value;
    };
    let channels = channels.iter().map(|&(c, id)| (c, moved[id.0 as usize]));
    let channels = channels.collect();
    to.add(Node::Paint {
        value,
        constants: *constants,
        channels,
    })
}

struct Merger<'g> {
    graph: &'g Graph,
    sight: &'g Sight,
    limit: f64,
    operands: Operands<'g>,
    volumes: Volumes<'g>,
    reaches: Vec<Reach>,
    paints: Vec<Option<Option<Paint>>>,
    uses: Vec<u32>,
    /// What belongs to something that is replaced.
    covered: Vec<bool>,
    shapes: usize,
    boxes: usize,
    pixels: f64,
}

impl Merger<'_> {
    /// The operands of a hard union with what is small in boxes; nothing if none is.
    fn union(&mut self, chain: &Chain) -> Option<Vec<Piece>> {
        // Only what has the same paint is merged.
        let mut painted: Vec<(Option<Paint>, Vec<Leaf>)> = Vec::new();
        for at in 0..chain.operands.len() {
            let Some((leaf, paint)) = self.leaf(&chain.operands, at) else {
                continue;
            };
            match painted.iter_mut().find(|(known, _)| *known == paint) {
                Some((_, leaves)) => leaves.push(leaf),
                None => painted.push((paint, vec![leaf])),
            }
        }
        let mut pieces: Vec<Option<Piece>> = Vec::new();
        pieces.extend(chain.operands.iter().map(|&id| Some(Piece::Kept(id))));
        let mut boxed = false;
        for (paint, leaves) in painted {
            let mut pending = vec![leaves];
            while let Some(mut leaves) = pending.pop() {
                let Some(hull) = self.whole(&leaves) else {
                    if leaves.len() > 1 {
                        let half = leaves.len() / 2;
                        sort_along_longest_side(&mut leaves);
                        pending.push(leaves.split_off(half));
                        pending.push(leaves);
                    }
                    continue;
                };
                boxed = true;
                // The box stands where the first of them stood.
                let first = leaves.iter().map(|leaf| leaf.at).min();
                for leaf in &leaves {
                    let is_first = Some(leaf.at) == first;
                    let piece = is_first.then(|| Piece::Boxed(hull, paint.clone()));
                    pieces[leaf.at] = piece;
                    self.cover(chain.operands[leaf.at]);
                }
                self.count(&leaves, &hull);
            }
        }
        boxed.then(|| pieces.into_iter().flatten().collect())
    }

    /// Operands of a smooth union that are replaced one by one.
    fn blended(&mut self, chain: &Chain) -> Vec<(NodeId, Piece)> {
        let all: Vec<NodeId> = chain.first.iter().chain(&chain.operands).copied().collect();
        let mut replaced = Vec::new();
        for (at, &id) in all.iter().enumerate() {
            if self.uses[id.0 as usize] != 1 {
                continue;
            }
            let Some((leaf, paint)) = self.leaf(&all, at) else {
                continue;
            };
            let leaves = [leaf];
            if let Some(hull) = self.whole(&leaves) {
                replaced.push((id, Piece::Boxed(hull, paint)));
                self.cover(id);
                self.count(&leaves, &hull);
            }
        }
        replaced
    }

    /// An operand that may be replaced, and its paint.
    fn leaf(&self, operands: &[NodeId], at: usize) -> Option<(Leaf, Option<Paint>)> {
        let id = operands[at];
        let paint = self.paints[id.0 as usize].clone()?;
        let (bounds, rate) = in_world(self.graph, &self.volumes, id)?;
        let Reach {
            gain,
            band,
            is_turned,
        } = self.reaches[id.0 as usize];
        let is_distance = (rate - 1.0).abs() < EXACT && (gain - 1.0).abs() < EXACT;
        if !is_distance || is_turned || !bounds.is_finite() || !band.is_finite() {
            return None;
        }
        // What is far too long to be a box needs no look at its inside.
        let least = self.in_pixels(bounds.half_diagonal(), &bounds, band);
        if least > LONGEST * self.limit {
            return None;
        }
        let leaf = Leaf {
            at,
            bounds,
            slack: slack(self.graph, id, &bounds)?,
            band,
            work: self.operands.closed(id, None).work,
        };
        (self.error(std::slice::from_ref(&leaf), &bounds) <= self.limit).then_some((leaf, paint))
    }

    /// The box for these, if they are to have one.
    fn whole(&self, leaves: &[Leaf]) -> Option<Bounds> {
        let hull = leaves
            .iter()
            .fold(Bounds::EMPTY, |hull, leaf| hull.hull(&leaf.bounds));
        let work: f64 = leaves.iter().map(|leaf| leaf.work).sum();
        let pays = leaves.len() > 1 || work > BOX;
        (pays && self.error(leaves, &hull) <= self.limit).then_some(hull)
    }

    /// How many pixels the points of a box are from what it holds at most: from that of it which is
    /// nearest to the farthest corner.
    fn error(&self, leaves: &[Leaf], hull: &Bounds) -> f64 {
        let ways = leaves
            .iter()
            .map(|leaf| farthest(hull, &leaf.bounds) + leaf.slack);
        self.in_pixels(ways.fold(f64::INFINITY, f64::min), hull, widest(leaves))
    }

    /// How many pixels a length is at a box, or as near to it as it matters.
    fn in_pixels(&self, length: f64, bounds: &Bounds, band: f64) -> f64 {
        let footprint = (self.sight).footprint(self.sight.distance(&bounds.grown(band)));
        match footprint > 0.0 {
            true => length / footprint,
            false => f64::INFINITY,
        }
    }

    fn count(&mut self, leaves: &[Leaf], hull: &Bounds) {
        self.shapes += leaves.len();
        self.boxes += 1;
        self.pixels = self.pixels.max(self.error(leaves, hull));
    }

    /// Marks all that is within a node.
    fn cover(&mut self, id: NodeId) {
        let mut pending = vec![id];
        while let Some(id) = pending.pop() {
            if !std::mem::replace(&mut self.covered[id.0 as usize], true) {
                pending.extend(self.graph.get(id).inputs());
            }
        }
    }
}

/// The distance of a box's farthest point from another one: that of a corner, since distances from
/// something convex have no maximum between.
fn farthest(hull: &Bounds, from: &Bounds) -> f64 {
    let gap = |i: usize| (from.min[i] - hull.min[i]).max(hull.max[i] - from.max[i]);
    (0..3).map(|i| gap(i).max(0.0).powi(2)).sum::<f64>().sqrt()
}

fn widest(leaves: &[Leaf]) -> f64 {
    leaves.iter().map(|leaf| leaf.band).fold(0.0, f64::max)
}

/// Puts leaves in the order of their middles along the longest side of the box around all middles.
fn sort_along_longest_side(leaves: &mut [Leaf]) {
    let middles = leaves.iter().fold(Bounds::EMPTY, |all, leaf| {
        all.including(leaf.bounds.centre())
    });
    let side = |axis: usize| middles.max[axis] - middles.min[axis];
    let axis = (1..3).fold(
        0,
        |best, axis| {
            if side(axis) > side(best) { axis } else { best }
        },
    );
    leaves.sort_by(|a, b| a.bounds.centre()[axis].total_cmp(&b.bounds.centre()[axis]));
}

/// The paint of each value, if it is the same all over; within, none for what is unpainted.
fn paints(graph: &Graph) -> Vec<Option<Option<Paint>>> {
    let mut paints: Vec<Option<Option<Paint>>> = Vec::with_capacity(graph.len());
    for (_, node) in graph.nodes() {
        let paint = match node {
            Node::Paint {
                constants,
                channels,
                ..
            } => Some(Some((*constants, channels.clone()))),
            Node::Apply { values, .. } => {
                let mut all = values.iter().map(|value| &paints[value.0 as usize]);
                let first = all.next().cloned().unwrap_or(Some(None));
                first.filter(|first| all.all(|other| other.as_ref() == Some(first)))
            }
            _ => Some(None),
        };
        paints.push(paint);
    }
    paints
}
