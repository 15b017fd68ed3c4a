//! Adversarial texts: nothing panics or hangs, and every mistake is reported.

use super::scenes::SCENES;
use super::{XorShift, parse_and_render, parse_valid};
use sdfc_lang::ast::{ExprKind, MAX_DEPTH};
use sdfc_lang::{MAX_SOURCE_BYTES, dump, print};

#[test]
fn mutated_scenes_are_read_or_refused() {
    let mut random = XorShift(0xbadc0de);
    let fragments = [
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        ";",
        ",",
        ":",
        "::",
        "=",
        "==",
        "|[",
        "-[",
        "-",
        "|",
        "..",
        "=>",
        "fn",
        "let ",
        "if ",
        "else ",
        "for ",
        " in ",
        "blend",
        "#12",
        "\"",
        "/*",
        "//",
        "///",
        "1e9999",
        "7furlongs",
        "ä",
        "\u{0}",
        "^",
        "?",
        "\\",
        "'",
        "\n",
        "param ",
        "@",
    ];
    let mut valid_count = 0;
    for round in 0..20_000 {
        let (_, scene) = SCENES[round % SCENES.len()];
        let mut text = scene.to_owned();
        for _ in 0..1 + random.below(4) {
            let start = text.floor_char_boundary(random.below(text.len() + 1));
            match random.below(4) {
                0 => text.insert_str(start, fragments[random.below(fragments.len())]),
                1 => {
                    let end = text.ceil_char_boundary((start + random.below(12)).min(text.len()));
                    text.replace_range(start..end, "");
                }
                2 => {
                    let end = text.ceil_char_boundary((start + random.below(40)).min(text.len()));
                    let copy = text[start..end].to_owned();
                    let target = text.floor_char_boundary(random.below(text.len() + 1));
                    text.insert_str(target, &copy);
                }
                _ => {
                    let end = text.ceil_char_boundary((start + 1).min(text.len()));
                    text.replace_range(start..end, fragments[random.below(fragments.len())]);
                }
            }
        }
        let (tree, messages) = parse_and_render(&text);
        assert_eq!(
            tree.is_none(),
            messages.contains("error["),
            "{text}\n{messages}"
        );
        if let Some(file) = tree {
            valid_count += 1;
            let printed = print(&file);
            let (reparsed, messages) = parse_and_render(&printed);
            let reparsed = reparsed.unwrap_or_else(|| panic!("{messages}\n{text}\n{printed}"));
            assert_eq!(print(&reparsed), printed, "{text}");
        }
    }
    assert!(
        valid_count > 1000,
        "only {valid_count} mutations were good: too few to say anything"
    );
}

#[test]
fn a_text_of_random_bytes_is_refused() {
    let mut random = XorShift(1);
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..random.below(80))
            .map(|_| random.below(256) as u8)
            .collect();
        parse_and_render(&String::from_utf8_lossy(&bytes));
    }
}

/// Each kind of nesting is refused from a certain depth on, with a message.
#[test]
fn deep_nesting_is_refused_wherever_it_comes_from() {
    let kinds = [
        ("(", "1", ")"),
        ("[", "1", "]"),
        ("f(", "1", ")"),
        ("x.f(", "1", ")"),
        ("-", "1", ""),
        ("!", "1", ""),
        ("fn(p) => ", "1", ""),
        ("if a { ", "1", " } else { 1 }"),
        ("if ", "a", " { 1 } else { 1 }"),
        ("for i in ", "a", " { 1 }"),
        ("for i in a { ", "1", " }"),
        ("blend(1) { ", "1", " }"),
        ("a |[", "1", "] b"),
        ("a || b && c < d | e & f + g * (", "1", ")"),
    ];
    for (open, middle, close) in kinds {
        for depth in [100_usize, 10_000] {
            let text = format!("{}{middle}{}", open.repeat(depth), close.repeat(depth));
            let (tree, messages) = parse_and_render(&text);
            match tree {
                Some(file) => {
                    assert!(depth <= MAX_DEPTH as usize, "{open}");
                    dump(&file);
                    print(&file);
                }
                None => assert!(messages.contains("E0109"), "{open}: {messages}"),
            }
            assert!(messages.matches("error[").count() < 2, "{messages}");
        }
        let unclosed = open.repeat(10_000);
        assert!(parse_and_render(&unclosed).0.is_none(), "{open}");
    }
}

#[test]
fn long_chains_are_flat() {
    let operands: Vec<_> = (0..10_000).map(|i| format!("sphere({i})")).collect();
    for operator in [" | ", " & ", " + ", " |[0.1] ", " && "] {
        let file = parse_valid(&operands.join(operator));
        let ExprKind::Chain(chain) = &file.result.as_ref().unwrap().kind else {
            panic!("{operator} makes no chain");
        };
        assert_eq!(chain.links.len(), 9_999);
        assert_eq!(print(&parse_valid(&print(&file))), print(&file));
    }
    let methods = format!("x{}", ".f(1)".repeat(100_000));
    let file = parse_valid(&methods);
    let ExprKind::Postfix(postfix) = &file.result.as_ref().unwrap().kind else {
        panic!("methods make no chain");
    };
    assert_eq!(postfix.suffixes.len(), 100_000);

    let ladder = format!(
        "{} {{ 0 }}",
        "if a { 1 } else".to_owned() + &" if a { 1 } else".repeat(9_999)
    );
    assert!(parse_valid(&ladder).result.is_some());
    let mixed = vec!["a"; 80_000].join(" * b + c - ");
    assert!(parse_valid(&mixed).result.is_some());
}

#[test]
fn a_text_that_is_too_large_is_refused_with_both_numbers() {
    let text = "a|".repeat(MAX_SOURCE_BYTES / 2 + 1);
    let (tree, messages) = parse_and_render(&text);
    assert!(tree.is_none());
    assert!(
        messages.contains("9961474") && messages.contains("9961472"),
        "{messages}"
    );
}

/// Each text is a quarter of the maximum size, full of one mistake.
#[test]
fn endless_mistakes_end() {
    for piece in [
        "(",
        ")",
        "{",
        "}",
        "[",
        "a b ",
        "; ",
        "let ",
        "let a = ;\n",
        "^",
        "? ",
        "\"",
        "'",
        "@ ",
        "-",
        "-[",
        "f(a = ",
        "fn f() { let x = 1\n",
        "a { b ",
        "camera { a b, ",
        "1 1 ",
        "\n\"\n",
        "/*",
        "ä",
        "param x\n",
        "f(;",
        "[1, 2);",
        "{ let }",
    ] {
        let text = piece.repeat(MAX_SOURCE_BYTES / 4 / piece.len());
        assert!(parse_and_render(&text).0.is_none(), "{piece}");
    }
}
