//! Placement of comments.
//!
//! Some nodes have elements that may be on separate lines: files, blocks, bodies, lists, arguments, parameters, and
//! chains of operators and of methods. A comment between two such elements stays there. It is printed after
//! the previous element if it was on that line, else before the next one or before the closing bracket. Any
//! other comment moves in front of the innermost element around it.
//!
//! Slots are byte positions in the parsed tree. They are the start of the element after the comment, the
//! end of the one before it, or the closing bracket.

use crate::ast::*;
use crate::span::Span;
use std::collections::BTreeMap;

/// Comments of a file, by the position at which they are printed.
pub(super) struct Comments<'a> {
    slots: BTreeMap<u32, CommentSlot<'a>>,
}

#[derive(Default)]
struct CommentSlot<'a> {
    leading: Vec<PlacedComment<'a>>,
    trailing: Vec<PlacedComment<'a>>,
    dangling: Vec<PlacedComment<'a>>,
}

/// A comment with its position.
#[derive(Clone, Copy)]
pub(super) struct PlacedComment<'a> {
    comment: &'a Comment,
    /// Position before which blank lines are looked up.
    pub(super) start: u32,
    /// Position after which blank lines are looked up.
    pub(super) end: u32,
    moved: bool,
}

impl PlacedComment<'_> {
    /// Returns the text to print.
    ///
    /// A moved `///` would document another element, so it becomes an ordinary comment.
    pub(super) fn text(&self) -> String {
        match (self.moved, self.comment.kind) {
            (true, CommentKind::Doc) => self.comment.text[1..].to_owned(),
            (false, CommentKind::Doc) | (_, CommentKind::Line | CommentKind::Block) => {
                self.comment.text.clone()
            }
        }
    }
}

impl<'a> Comments<'a> {
    /// Places all comments.
    pub(super) fn new(file: &'a File) -> Self {
        let mut placer = CommentPlacer {
            lines: &file.trivia.lines,
            slots: BTreeMap::new(),
        };
        let comments: Vec<_> = file.trivia.comments.iter().collect();
        placer.node(NodeRef::File(file), &comments, 0);
        Self {
            slots: placer.slots,
        }
    }

    /// Reports whether a comment is printed inside a node.
    pub(super) fn has_inside(&self, span: Span) -> bool {
        span.start + 1 < span.end && self.slots.range(span.start + 1..span.end).next().is_some()
    }

    /// Reports whether a comment is printed between an element and the next.
    pub(super) fn has_between(&self, end: u32, start: u32) -> bool {
        let trails = |slot: &CommentSlot<'_>| !slot.trailing.is_empty();
        let leads = |slot: &CommentSlot<'_>| !slot.leading.is_empty();
        self.slots.get(&end).is_some_and(trails) || self.slots.get(&start).is_some_and(leads)
    }

    /// Returns the comments before the element that starts at a position.
    pub(super) fn leading(&self, start: u32) -> Vec<PlacedComment<'a>> {
        self.slot(start)
            .map_or(Vec::new(), |slot| slot.leading.clone())
    }

    /// Returns the comments after the element that ends at a position.
    pub(super) fn trailing(&self, end: u32) -> Vec<PlacedComment<'a>> {
        self.slot(end)
            .map_or(Vec::new(), |slot| slot.trailing.clone())
    }

    /// Returns the comments before the closing bracket at a position.
    pub(super) fn dangling(&self, closer: u32) -> Vec<PlacedComment<'a>> {
        self.slot(closer)
            .map_or(Vec::new(), |slot| slot.dangling.clone())
    }

    fn slot(&self, position: u32) -> Option<&CommentSlot<'a>> {
        self.slots.get(&position)
    }
}

/// Reference to a node of the tree.
#[derive(Clone, Copy)]
enum NodeRef<'a> {
    File(&'a File),
    Item(&'a Item),
    Field(&'a Field),
    Body(&'a Body),
    Statement(&'a Statement),
    Expr(&'a Expr),
    Arg(&'a Arg),
    Params(&'a [FnParam], Span),
    Param(&'a FnParam),
    Suffix(&'a Suffix),
    Link(&'a ChainLink),
}

/// Layout of the parts of a node.
#[derive(Clone, Copy, PartialEq)]
enum PartLayout {
    /// Always on one line with the tokens between them.
    Fixed,
    /// Elements between brackets, with the position of the closing one.
    Elements { closer: u32 },
    /// Elements, the first of which starts where the node starts.
    Chain,
}

impl<'a> NodeRef<'a> {
    fn span(self) -> Span {
        match self {
            NodeRef::File(file) => file.span,
            NodeRef::Item(item) => item.span,
            NodeRef::Field(field) => field.span,
            NodeRef::Body(body) => body.span,
            NodeRef::Statement(statement) => statement.span,
            NodeRef::Expr(expr) => expr.span,
            NodeRef::Arg(arg) => arg.span,
            NodeRef::Params(_, span) => span,
            NodeRef::Param(param) => param.span,
            NodeRef::Suffix(suffix) => suffix.span,
            NodeRef::Link(link) => link.op_span.to(link.operand.span),
        }
    }

    fn parts(self) -> (Vec<NodeRef<'a>>, PartLayout) {
        match self {
            NodeRef::File(file) => {
                let items = file.items.iter().map(NodeRef::Item);
                let closer = file.span.end;
                let parts = items.chain(file.result.iter().map(NodeRef::Expr)).collect();
                (parts, PartLayout::Elements { closer })
            }
            NodeRef::Item(item) => match &item.kind {
                ItemKind::Block(block) => {
                    let closer = item.span.end - 1;
                    let parts = block.fields.iter().map(NodeRef::Field).collect();
                    (parts, PartLayout::Elements { closer })
                }
                ItemKind::Fn(function) => {
                    let params = NodeRef::Params(&function.params, function.params_span);
                    (
                        vec![params, NodeRef::Body(&function.body)],
                        PartLayout::Fixed,
                    )
                }
                ItemKind::Param(_)
                | ItemKind::Let(_)
                | ItemKind::Part(_)
                | ItemKind::Import(_)
                | ItemKind::Expr(_) => {
                    let mut parts = Vec::new();
                    item.for_each_child(&mut |expr| parts.push(NodeRef::Expr(expr)));
                    (parts, PartLayout::Fixed)
                }
            },
            NodeRef::Field(field) => (vec![NodeRef::Expr(&field.value)], PartLayout::Fixed),
            NodeRef::Body(body) => {
                let statements = body.statements.iter().map(NodeRef::Statement);
                let parts = statements.chain([NodeRef::Expr(&body.result)]).collect();
                let closer = body.span.end.saturating_sub(1);
                match body.braced {
                    true => (parts, PartLayout::Elements { closer }),
                    false => (parts, PartLayout::Fixed),
                }
            }
            NodeRef::Statement(statement) => match &statement.kind {
                StatementKind::Let(binding) => {
                    (vec![NodeRef::Expr(&binding.value)], PartLayout::Fixed)
                }
                StatementKind::Expr(value) => (vec![NodeRef::Expr(value)], PartLayout::Fixed),
            },
            NodeRef::Arg(arg) => (vec![NodeRef::Expr(&arg.value)], PartLayout::Fixed),
            NodeRef::Params(params, span) => {
                let closer = span.end - 1;
                let parts = params.iter().map(NodeRef::Param).collect();
                (parts, PartLayout::Elements { closer })
            }
            NodeRef::Param(param) => {
                let default = param.default.iter();
                (default.map(NodeRef::Expr).collect(), PartLayout::Fixed)
            }
            NodeRef::Suffix(suffix) => match &suffix.args {
                None => (Vec::new(), PartLayout::Fixed),
                Some(args) => elements(&args.args, args.span),
            },
            NodeRef::Link(link) => {
                let blend = link.blend.iter().flat_map(|blend| &blend.args);
                let parts = blend.map(NodeRef::Arg);
                let parts = parts.chain([NodeRef::Expr(&link.operand)]).collect();
                (parts, PartLayout::Fixed)
            }
            NodeRef::Expr(expr) => expr_parts(expr),
        }
    }
}

fn expr_parts(expr: &Expr) -> (Vec<NodeRef<'_>>, PartLayout) {
    match &expr.kind {
        ExprKind::Number(_)
        | ExprKind::Color(_)
        | ExprKind::Text(_)
        | ExprKind::Bool(_)
        | ExprKind::Path(_)
        | ExprKind::Paren(_)
        | ExprKind::Unary(_)
        | ExprKind::Range(_) => {
            let mut parts = Vec::new();
            expr.for_each_child(&mut |part| parts.push(NodeRef::Expr(part)));
            (parts, PartLayout::Fixed)
        }
        ExprKind::List(items) => {
            let closer = expr.span.end - 1;
            let parts = items.iter().map(NodeRef::Expr).collect();
            (parts, PartLayout::Elements { closer })
        }
        ExprKind::Call(call) => elements(&call.args, call.args_span),
        ExprKind::Postfix(postfix) => {
            let suffixes = postfix.suffixes.iter().map(NodeRef::Suffix);
            let base = [NodeRef::Expr(&postfix.base)];
            (
                base.into_iter().chain(suffixes).collect(),
                PartLayout::Chain,
            )
        }
        ExprKind::Chain(chain) => {
            let links = chain.links.iter().map(NodeRef::Link);
            let first = [NodeRef::Expr(&chain.first)];
            (first.into_iter().chain(links).collect(), PartLayout::Chain)
        }
        ExprKind::If(branch) => {
            let arms = branch.arms.iter();
            let mut parts: Vec<_> = arms
                .flat_map(|arm| [NodeRef::Expr(&arm.condition), NodeRef::Body(&arm.body)])
                .collect();
            parts.push(NodeRef::Body(&branch.else_body));
            (parts, PartLayout::Fixed)
        }
        ExprKind::For(each) => {
            let parts = vec![NodeRef::Expr(&each.range), NodeRef::Body(&each.body)];
            (parts, PartLayout::Fixed)
        }
        ExprKind::BlendScope(scope) => {
            let mut parts: Vec<_> = scope.blend.args.iter().map(NodeRef::Arg).collect();
            parts.push(NodeRef::Body(&scope.body));
            (parts, PartLayout::Fixed)
        }
        ExprKind::Lambda(lambda) => {
            let params = NodeRef::Params(&lambda.params, lambda.params_span);
            (vec![params, NodeRef::Body(&lambda.body)], PartLayout::Fixed)
        }
    }
}

fn elements(args: &[Arg], span: Span) -> (Vec<NodeRef<'_>>, PartLayout) {
    let closer = span.end - 1;
    let parts = args.iter().map(NodeRef::Arg).collect();
    (parts, PartLayout::Elements { closer })
}

struct CommentPlacer<'a> {
    lines: &'a [u32],
    slots: BTreeMap<u32, CommentSlot<'a>>,
}

impl<'a> CommentPlacer<'a> {
    /// Places the comments inside a node.
    ///
    /// Comments that cannot stay there move before the element that starts at `fallback`.
    fn node(&mut self, node: NodeRef<'a>, mut comments: &[&'a Comment], fallback: u32) {
        if comments.is_empty() {
            return;
        }
        let (parts, layout) = node.parts();
        let mut previous: Option<Span> = None;
        for (index, part) in parts.iter().enumerate() {
            let span = part.span();
            let split = comments.partition_point(|comment| comment.span.start < span.start);
            let (outside, following) = comments.split_at(split);
            for comment in outside {
                self.between(comment, previous, Some(span), layout, fallback);
            }
            let split = following.partition_point(|comment| comment.span.start < span.end);
            let (inside, following) = following.split_at(split);
            let fallback = match layout {
                PartLayout::Fixed => fallback,
                PartLayout::Chain if index == 0 => fallback,
                PartLayout::Chain | PartLayout::Elements { .. } => span.start,
            };
            self.node(*part, inside, fallback);
            comments = following;
            previous = Some(span);
        }
        for comment in comments {
            self.between(comment, previous, None, layout, fallback);
        }
    }

    fn between(
        &mut self,
        comment: &'a Comment,
        previous: Option<Span>,
        next: Option<Span>,
        layout: PartLayout,
        fallback: u32,
    ) {
        let stays = PlacedComment {
            comment,
            start: comment.span.start,
            end: comment.span.end,
            moved: false,
        };
        let same_line =
            previous.filter(|previous| self.line(previous.end) == self.line(stays.start));
        match (layout, same_line, next) {
            (PartLayout::Elements { .. } | PartLayout::Chain, Some(previous), _) => {
                self.slot(previous.end).trailing.push(stays);
            }
            (PartLayout::Elements { .. } | PartLayout::Chain, None, Some(next)) => {
                self.slot(next.start).leading.push(stays);
            }
            (PartLayout::Elements { closer }, None, None) => self.slot(closer).dangling.push(stays),
            (PartLayout::Fixed, _, _) | (PartLayout::Chain, None, None) => {
                let moved = PlacedComment {
                    start: fallback,
                    end: fallback,
                    moved: true,
                    ..stays
                };
                self.slot(fallback).leading.push(moved);
            }
        }
    }

    fn slot(&mut self, position: u32) -> &mut CommentSlot<'a> {
        self.slots.entry(position).or_default()
    }

    fn line(&self, position: u32) -> usize {
        self.lines.partition_point(|start| *start <= position)
    }
}
