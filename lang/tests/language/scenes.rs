//! The six scenes of the language's description, with their trees.

use super::{parse_and_render, parse_valid};
use sdfc_lang::{Span, ast::*, dump};

/// Name and text of each scene.
pub(crate) const SCENES: [(&str, &str); 6] = [
    (
        "one_expression",
        include_str!("../scenes/one_expression.sdf"),
    ),
    ("metaballs", include_str!("../scenes/metaballs.sdf")),
    ("bracket", include_str!("../scenes/bracket.sdf")),
    ("landscape", include_str!("../scenes/landscape.sdf")),
    ("gyroid", include_str!("../scenes/gyroid.sdf")),
    ("cog", include_str!("../scenes/cog.sdf")),
];

#[test]
fn scenes_have_these_trees() {
    for (name, text) in SCENES {
        insta::assert_snapshot!(format!("tree_of_{name}"), dump(&parse_valid(text)));
    }
}

#[test]
fn only_mixed_precedence_is_reported_for_scenes() {
    for (name, text) in SCENES {
        let (_, messages) = parse_and_render(text);
        let codes: Vec<_> = messages.lines().filter(|line| line.contains('[')).collect();
        let warned = messages.contains("W0101");
        assert_eq!(warned, name == "one_expression", "{name}: {codes:?}");
        assert!(!messages.contains("error["), "{messages}");
    }
}

#[test]
fn every_node_lies_where_it_was_written() {
    for (_, text) in SCENES {
        let file = parse_valid(text);
        let slice = |span: Span| &text[span.start as usize..span.end as usize];
        for item in &file.items {
            assert!(
                slice(item.span).ends_with([';', '}']),
                "{}",
                slice(item.span)
            );
        }
        file.for_each_child(&mut |expr| check_spans(expr, file.span, &slice));
    }
}

fn check_spans<'t>(expr: &Expr, parent: Span, slice: &dyn Fn(Span) -> &'t str) {
    assert!(parent.contains(expr.span), "{expr:?}");
    let text = slice(expr.span);
    match &expr.kind {
        ExprKind::Path(path) => assert_eq!(path.to_string(), text),
        ExprKind::List(_) => assert!(text.starts_with('[') && text.ends_with(']')),
        ExprKind::Paren(_) => assert!(text.starts_with('(') && text.ends_with(')')),
        ExprKind::Call(call) => {
            assert!(slice(call.args_span).starts_with('(') && text.ends_with(')'));
        }
        ExprKind::Postfix(postfix) => {
            for suffix in &postfix.suffixes {
                assert_eq!(slice(suffix.name.span), suffix.name.name);
                assert!(slice(suffix.span).starts_with('.'));
            }
        }
        ExprKind::Chain(chain) => {
            for link in &chain.links {
                assert_eq!(slice(link.op_span), link.op.symbol());
                assert!(link.blend.iter().all(|b| slice(b.span).ends_with(']')));
            }
        }
        ExprKind::Lambda(_) => assert!(text.starts_with("fn(")),
        ExprKind::If(_) => assert!(text.starts_with("if ") && text.ends_with('}')),
        ExprKind::For(_) => assert!(text.starts_with("for ") && text.ends_with('}')),
        ExprKind::BlendScope(_) => assert!(text.starts_with("blend(")),
        ExprKind::Number(_)
        | ExprKind::Color(_)
        | ExprKind::Text(_)
        | ExprKind::Bool(_)
        | ExprKind::Unary(_)
        | ExprKind::Range(_) => {}
    }
    expr.for_each_child(&mut |child| check_spans(child, expr.span, slice));
}

#[test]
fn precedence_and_blends() {
    insta::assert_snapshot!(dump(&parse_valid(
        "let a = -x.y * 2 + 1 - z % 3;
         let b = !p && q || a < b + 1 && 0 <= c;
         let c = (u | v & w -[chamfer, 0.3] x) |[stairs, 0.4, n: 4] y &[0.1] z;
         let d = 1..n + 1;
         let e = fn(p: vec3, k = 2) => { let q = p; -[q.x, -1] };
         let l = p-[1, 0]-[q.x, 2] |[0.2] (u-[chamfer, 0.1] !v) -[stairs, 0.1, n: 2] [w, x];
         blend(0.2, kernel: cubic) { a | if c { u } else if d { v } else { w } }"
    )));
}

#[test]
fn docs_belong_to_the_next_item() {
    let file = parse_valid("/// one\n///   two\n// no\nlet a = 1; /// b's\nlet b = 2;\nlet c = 3;");
    let docs: Vec<_> = file.items.iter().map(|item| item.docs.as_deref()).collect();
    assert_eq!(docs, [Some("one\n  two"), Some("b's"), None]);
}
