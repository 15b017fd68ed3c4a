//! The canonical text: it has the same meaning, and printing is idempotent.

use super::scenes::SCENES;
use super::{XorShift, parse_valid};
use sdfc_lang::ast::{File, Item};
use sdfc_lang::{dump, print};

/// Returns the listing without docs, which may have moved with their comment.
fn listing_without_docs(file: &File) -> String {
    let undocumented = |item: &Item| Item {
        docs: None,
        ..item.clone()
    };
    dump(&File {
        items: file.items.iter().map(undocumented).collect(),
        ..file.clone()
    })
}

fn check_round_trip(text: &str) {
    let original = parse_valid(text);
    let printed = print(&original);
    let reparsed = parse_valid(&printed);
    assert_eq!(
        listing_without_docs(&original),
        listing_without_docs(&reparsed),
        "the meaning of\n{text}\n{printed}"
    );
    assert_eq!(
        printed,
        print(&reparsed),
        "printing is not settled for\n{text}"
    );
    for comment in &original.trivia.comments {
        let text = comment.text.trim_matches('/');
        assert!(printed.contains(text), "{text:?} is lost in\n{printed}");
    }
    assert_eq!(
        original.trivia.comments.len(),
        reparsed.trivia.comments.len()
    );
}

#[test]
fn scenes_look_like_this() {
    for (name, text) in SCENES {
        check_round_trip(text);
        insta::assert_snapshot!(format!("text_of_{name}"), print(&parse_valid(text)));
    }
}

#[test]
fn long_lines_are_broken_and_comments_stay() {
    let text = "// the head\n\n\nfn f( a,b=[1,2] ) { // opens
  let x=a+b; // x

  /* y */ let y = x;
  y // the value
  // the end
}
let list = [ 1, // one
  2.50, .5 /* half */, -[3] ];
let shape = sphere(radius_of_the_first_one).translate(1, 2, 3).rotate(90deg, X).color(#F80).material(m);
let wide = first_operand_of_the_chain + second_operand_of_the_chain * third_operand - fourth_operand_of_it;
let call = some_function(first_argument_of_the_call, second: 1.0, third: fn(p) => { let q = p; q });
if a { // why
 b } else { c } | // joined
 d
// last";
    check_round_trip(text);
    insta::assert_snapshot!(print(&parse_valid(text)));
}

/// Comments in all positions where they are allowed.
#[test]
fn comments_among_parameters_stay() {
    let text = "\
fn f(
    x: float, // the first
    // the second
    y = 1,
) = x + y;
let g = fn(
    p, /* in space */
    q,
) => p + q;
sphere(f(1) + g(1, 2))
";
    assert_eq!(print(&parse_valid(text)), text);
}

#[test]
fn comments_anywhere_survive() {
    let mut random = XorShift(0x5df);
    let kinds = [
        "// a",
        "/// b",
        "/* c */",
        "/* d\n e */",
        "\n// f\n",
        "\n\n/* g */\n\n",
    ];
    for round in 0..1200 {
        let (_, scene) = SCENES[round % SCENES.len()];
        // Between tokens: next to a space, a comma or a bracket.
        let in_comments: Vec<_> = parse_valid(scene)
            .trivia
            .comments
            .iter()
            .map(|c| c.span.start as usize..c.span.end as usize)
            .collect();
        let gaps: Vec<_> = scene
            .char_indices()
            .filter(|(index, c)| {
                let free = !in_comments.iter().any(|comment| comment.contains(index));
                let in_text = scene[..*index].bytes().filter(|b| *b == b'"').count() % 2 == 1;
                free && !in_text && matches!(c, ' ' | ',' | '(' | ')' | ';' | '}')
            })
            .map(|(index, _)| index)
            .collect();
        let mut text = scene.to_owned();
        for number in 0..1 + random.below(3) {
            let index = gaps[random.below(gaps.len())];
            let kind = kinds[random.below(kinds.len())];
            let end = match kind.starts_with("//") {
                true => "\n",
                false => "",
            };
            let comment = kind.replacen(' ', &format!(" {number}"), 1);
            // An earlier insertion moves later gaps, so only the unchanged front is used.
            if text[..index] == scene[..index] {
                text.insert_str(index, &format!(" {comment}{end}"));
            }
        }
        check_round_trip(&text);
    }
}
