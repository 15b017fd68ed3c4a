//! Where each comment goes.
//!
//! Some nodes have elements that may stand on lines of their own: files, blocks, bodies, lists,
//! arguments, chains of operators and of methods. A comment between two of their elements stays
//! there: behind the element before it if it stood on that line, else in front of the one after it,
//! or in front of the closing bracket. A comment in any other place moves in front of the innermost
//! element around it.
//!
//! Places are byte positions of the tree that was parsed: the start of the element after the
//! comment, the end of the one before it, or the closing bracket.

use crate::ast::*;
use crate::span::Span;
use std::collections::BTreeMap;

/// Every comment of a file under the place where it is to be printed.
pub(super) struct Comments<'a> {
    places: BTreeMap<u32, Place<'a>>,
}

#[derive(Default)]
struct Place<'a> {
    leading: Vec<Placed<'a>>,
    trailing: Vec<Placed<'a>>,
    dangling: Vec<Placed<'a>>,
}

/// A comment at its place.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    comment: &'a Comment,
    /// Where to look for blank lines before it.
    pub(super) start: u32,
    /// Where to look for blank lines behind it.
    pub(super) end: u32,
    moved: bool,
}

impl Placed<'_> {
    /// The text to print. A `///` that has moved would document what it now stands before, so it
    /// becomes an ordinary comment.
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
    /// Finds the place of every comment.
    pub(super) fn place(file: &'a File) -> Self {
        let mut placing = Placing {
            lines: &file.trivia.lines,
            places: BTreeMap::new(),
        };
        let comments: Vec<_> = file.trivia.comments.iter().collect();
        placing.node(Node::File(file), &comments, 0);
        Self {
            places: placing.places,
        }
    }

    /// Whether a comment is to be printed inside of a node.
    pub(super) fn any_inside(&self, span: Span) -> bool {
        span.start + 1 < span.end && self.places.range(span.start + 1..span.end).next().is_some()
    }

    /// Whether a comment is to be printed between an element and the next.
    pub(super) fn any_between(&self, end: u32, start: u32) -> bool {
        let trails = |place: &Place<'_>| !place.trailing.is_empty();
        let leads = |place: &Place<'_>| !place.leading.is_empty();
        self.places.get(&end).is_some_and(trails) || self.places.get(&start).is_some_and(leads)
    }

    /// The comments in front of the element that starts at a position.
    pub(super) fn leading(&self, start: u32) -> Vec<Placed<'a>> {
        self.at(start).map_or(Vec::new(), |at| at.leading.clone())
    }

    /// The comments behind the element that ends at a position.
    pub(super) fn trailing(&self, end: u32) -> Vec<Placed<'a>> {
        self.at(end).map_or(Vec::new(), |at| at.trailing.clone())
    }

    /// The comments in front of the closing bracket at a position.
    pub(super) fn dangling(&self, closer: u32) -> Vec<Placed<'a>> {
        self.at(closer).map_or(Vec::new(), |at| at.dangling.clone())
    }

    fn at(&self, position: u32) -> Option<&Place<'a>> {
        self.places.get(&position)
    }
}

/// A part of the tree that has parts.
#[derive(Clone, Copy)]
enum Node<'a> {
    File(&'a File),
    Item(&'a Item),
    Field(&'a Field),
    Body(&'a Body),
    Statement(&'a Statement),
    Expr(&'a Expr),
    Arg(&'a Arg),
    Suffix(&'a Suffix),
    Link(&'a Link),
}

/// What the parts of a node are to each other.
#[derive(Clone, Copy, PartialEq)]
enum Layout {
    /// Always on one line with what is between them.
    Fixed,
    /// Elements between brackets, the closing one at a position.
    Elements { closer: u32 },
    /// Elements, the first of which starts where the node starts.
    Chain,
}

impl<'a> Node<'a> {
    fn span(self) -> Span {
        match self {
            Node::File(file) => file.span,
            Node::Item(item) => item.span,
            Node::Field(field) => field.span,
            Node::Body(body) => body.span,
            Node::Statement(statement) => statement.span,
            Node::Expr(expr) => expr.span,
            Node::Arg(arg) => arg.span,
            Node::Suffix(suffix) => suffix.span,
            Node::Link(link) => link.op_span.to(link.operand.span),
        }
    }

    fn parts(self) -> (Vec<Node<'a>>, Layout) {
        match self {
            Node::File(file) => {
                let items = file.items.iter().map(Node::Item);
                let closer = file.span.end;
                let parts = items.chain(file.result.iter().map(Node::Expr)).collect();
                (parts, Layout::Elements { closer })
            }
            Node::Item(item) => match &item.kind {
                ItemKind::Block(block) => {
                    let closer = item.span.end - 1;
                    let parts = block.fields.iter().map(Node::Field).collect();
                    (parts, Layout::Elements { closer })
                }
                ItemKind::Fn(function) => {
                    let mut parts = defaults(&function.params);
                    parts.push(Node::Body(&function.body));
                    (parts, Layout::Fixed)
                }
                ItemKind::Param(_)
                | ItemKind::Let(_)
                | ItemKind::Part(_)
                | ItemKind::Import(_)
                | ItemKind::Expr(_) => {
                    let mut parts = Vec::new();
                    item.for_each_child(&mut |expr| parts.push(Node::Expr(expr)));
                    (parts, Layout::Fixed)
                }
            },
            Node::Field(field) => (vec![Node::Expr(&field.value)], Layout::Fixed),
            Node::Body(body) => {
                let statements = body.statements.iter().map(Node::Statement);
                let parts = statements.chain([Node::Expr(&body.result)]).collect();
                let closer = body.span.end.saturating_sub(1);
                match body.braced {
                    true => (parts, Layout::Elements { closer }),
                    false => (parts, Layout::Fixed),
                }
            }
            Node::Statement(statement) => match &statement.kind {
                StatementKind::Let(binding) => (vec![Node::Expr(&binding.value)], Layout::Fixed),
                StatementKind::Expr(value) => (vec![Node::Expr(value)], Layout::Fixed),
            },
            Node::Arg(arg) => (vec![Node::Expr(&arg.value)], Layout::Fixed),
            Node::Suffix(suffix) => match &suffix.args {
                None => (Vec::new(), Layout::Fixed),
                Some(args) => elements(&args.args, args.span),
            },
            Node::Link(link) => {
                let blend = link.blend.iter().flat_map(|blend| &blend.args);
                let parts = blend.map(Node::Arg);
                let parts = parts.chain([Node::Expr(&link.operand)]).collect();
                (parts, Layout::Fixed)
            }
            Node::Expr(expr) => parts_of(expr),
        }
    }
}

fn parts_of(expr: &Expr) -> (Vec<Node<'_>>, Layout) {
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
            expr.for_each_child(&mut |part| parts.push(Node::Expr(part)));
            (parts, Layout::Fixed)
        }
        ExprKind::List(items) => {
            let closer = expr.span.end - 1;
            let parts = items.iter().map(Node::Expr).collect();
            (parts, Layout::Elements { closer })
        }
        ExprKind::Call(call) => elements(&call.args, call.args_span),
        ExprKind::Postfix(postfix) => {
            let suffixes = postfix.suffixes.iter().map(Node::Suffix);
            let base = [Node::Expr(&postfix.base)];
            (base.into_iter().chain(suffixes).collect(), Layout::Chain)
        }
        ExprKind::Chain(chain) => {
            let links = chain.rest.iter().map(Node::Link);
            let first = [Node::Expr(&chain.first)];
            (first.into_iter().chain(links).collect(), Layout::Chain)
        }
        ExprKind::If(branch) => {
            let arms = branch.arms.iter();
            let mut parts: Vec<_> = arms
                .flat_map(|arm| [Node::Expr(&arm.condition), Node::Body(&arm.body)])
                .collect();
            parts.push(Node::Body(&branch.otherwise));
            (parts, Layout::Fixed)
        }
        ExprKind::For(each) => {
            let parts = vec![Node::Expr(&each.range), Node::Body(&each.body)];
            (parts, Layout::Fixed)
        }
        ExprKind::BlendScope(scope) => {
            let mut parts: Vec<_> = scope.blend.args.iter().map(Node::Arg).collect();
            parts.push(Node::Body(&scope.body));
            (parts, Layout::Fixed)
        }
        ExprKind::Lambda(lambda) => {
            let mut parts = defaults(&lambda.params);
            parts.push(Node::Body(&lambda.body));
            (parts, Layout::Fixed)
        }
    }
}

fn elements(args: &[Arg], span: Span) -> (Vec<Node<'_>>, Layout) {
    let closer = span.end - 1;
    let parts = args.iter().map(Node::Arg).collect();
    (parts, Layout::Elements { closer })
}

fn defaults(params: &[FnParam]) -> Vec<Node<'_>> {
    let defaults = params.iter().flat_map(|param| &param.default);
    defaults.map(Node::Expr).collect()
}

struct Placing<'a> {
    lines: &'a [u32],
    places: BTreeMap<u32, Place<'a>>,
}

impl<'a> Placing<'a> {
    /// Places comments that stand inside of a node. Those that cannot stay there go in front of the
    /// element that starts at `around`.
    fn node(&mut self, node: Node<'a>, mut comments: &[&'a Comment], around: u32) {
        if comments.is_empty() {
            return;
        }
        let (parts, layout) = node.parts();
        let mut before: Option<Span> = None;
        for (at, part) in parts.iter().enumerate() {
            let span = part.span();
            let split = comments.partition_point(|comment| comment.span.start < span.start);
            let (outside, rest) = comments.split_at(split);
            for comment in outside {
                self.between(comment, before, Some(span), layout, around);
            }
            let split = rest.partition_point(|comment| comment.span.start < span.end);
            let (inside, rest) = rest.split_at(split);
            let around = match layout {
                Layout::Fixed => around,
                Layout::Chain if at == 0 => around,
                Layout::Chain | Layout::Elements { .. } => span.start,
            };
            self.node(*part, inside, around);
            comments = rest;
            before = Some(span);
        }
        for comment in comments {
            self.between(comment, before, None, layout, around);
        }
    }

    fn between(
        &mut self,
        comment: &'a Comment,
        before: Option<Span>,
        after: Option<Span>,
        layout: Layout,
        around: u32,
    ) {
        let stays = Placed {
            comment,
            start: comment.span.start,
            end: comment.span.end,
            moved: false,
        };
        let behind = before.filter(|before| self.line(before.end) == self.line(stays.start));
        match (layout, behind, after) {
            (Layout::Elements { .. } | Layout::Chain, Some(before), _) => {
                self.at(before.end).trailing.push(stays);
            }
            (Layout::Elements { .. } | Layout::Chain, None, Some(after)) => {
                self.at(after.start).leading.push(stays);
            }
            (Layout::Elements { closer }, None, None) => self.at(closer).dangling.push(stays),
            (Layout::Fixed, _, _) | (Layout::Chain, None, None) => {
                let moved = Placed {
                    start: around,
                    end: around,
                    moved: true,
                    ..stays
                };
                self.at(around).leading.push(moved);
            }
        }
    }

    fn at(&mut self, position: u32) -> &mut Place<'a> {
        self.places.entry(position).or_default()
    }

    fn line(&self, position: u32) -> usize {
        self.lines.partition_point(|start| *start <= position)
    }
}
