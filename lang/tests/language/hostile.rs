//! Texts that nobody would write: nothing panics, nothing hangs, everything is said.

use super::scenes::SCENES;
use super::{Random, read, tree};
use sdfc_lang::ast::{ExprKind, MAX_DEPTH};
use sdfc_lang::{MAX_SOURCE_BYTES, dump, print};

#[test]
fn mutated_scenes_are_read_or_refused() {
    let mut random = Random(0xbadc0de);
    let pieces = [
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
    let mut good = 0;
    for round in 0..20_000 {
        let (_, scene) = SCENES[round % SCENES.len()];
        let mut text = scene.to_owned();
        for _ in 0..1 + random.below(4) {
            let at = text.floor_char_boundary(random.below(text.len() + 1));
            match random.below(4) {
                0 => text.insert_str(at, pieces[random.below(pieces.len())]),
                1 => {
                    let end = text.ceil_char_boundary((at + random.below(12)).min(text.len()));
                    text.replace_range(at..end, "");
                }
                2 => {
                    let end = text.ceil_char_boundary((at + random.below(40)).min(text.len()));
                    let copy = text[at..end].to_owned();
                    let to = text.floor_char_boundary(random.below(text.len() + 1));
                    text.insert_str(to, &copy);
                }
                _ => {
                    let end = text.ceil_char_boundary((at + 1).min(text.len()));
                    text.replace_range(at..end, pieces[random.below(pieces.len())]);
                }
            }
        }
        let (tree, said) = read(&text);
        assert_eq!(tree.is_none(), said.contains("error["), "{text}\n{said}");
        if let Some(file) = tree {
            good += 1;
            let printed = print(&file);
            let (again, said) = read(&printed);
            let again = again.unwrap_or_else(|| panic!("{said}\n{text}\n{printed}"));
            assert_eq!(print(&again), printed, "{text}");
        }
    }
    assert!(
        good > 1000,
        "only {good} mutations were good: too few to say anything"
    );
}

#[test]
fn a_text_of_random_bytes_is_refused() {
    let mut random = Random(1);
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..random.below(80))
            .map(|_| random.below(256) as u8)
            .collect();
        read(&String::from_utf8_lossy(&bytes));
    }
}

/// The depth at which each kind of nesting is refused, and that it is said so.
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
            let (tree, said) = read(&text);
            match tree {
                Some(file) => {
                    assert!(depth <= MAX_DEPTH as usize, "{open}");
                    dump(&file);
                    print(&file);
                }
                None => assert!(said.contains("E0109"), "{open}: {said}"),
            }
            assert!(said.matches("error[").count() < 2, "{said}");
        }
        let unclosed = open.repeat(10_000);
        assert!(read(&unclosed).0.is_none(), "{open}");
    }
}

#[test]
fn long_chains_are_flat() {
    let operands: Vec<_> = (0..10_000).map(|i| format!("sphere({i})")).collect();
    for operator in [" | ", " & ", " + ", " |[0.1] ", " && "] {
        let file = tree(&operands.join(operator));
        let ExprKind::Chain(chain) = &file.result.as_ref().unwrap().kind else {
            panic!("{operator} makes no chain");
        };
        assert_eq!(chain.rest.len(), 9_999);
        assert_eq!(print(&tree(&print(&file))), print(&file));
    }
    let methods = format!("x{}", ".f(1)".repeat(100_000));
    let file = tree(&methods);
    let ExprKind::Postfix(postfix) = &file.result.as_ref().unwrap().kind else {
        panic!("methods make no chain");
    };
    assert_eq!(postfix.suffixes.len(), 100_000);

    let ladder = format!(
        "{} {{ 0 }}",
        "if a { 1 } else".to_owned() + &" if a { 1 } else".repeat(9_999)
    );
    assert!(tree(&ladder).result.is_some());
    let mixed = vec!["a"; 80_000].join(" * b + c - ");
    assert!(tree(&mixed).result.is_some());
}

#[test]
fn a_text_that_is_too_large_is_refused_with_both_numbers() {
    let text = "a|".repeat(MAX_SOURCE_BYTES / 2 + 1);
    let (tree, said) = read(&text);
    assert!(tree.is_none());
    assert!(
        said.contains("9961474") && said.contains("9961472"),
        "{said}"
    );
}

/// Each of these is a quarter of a megabyte of the same mistake.
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
        assert!(read(&text).0.is_none(), "{piece}");
    }
}
