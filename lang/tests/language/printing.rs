//! The canonical text: it means the same, and printing it again changes nothing.

use super::scenes::SCENES;
use super::{Random, tree};
use sdfc_lang::ast::{File, Item};
use sdfc_lang::{dump, print};

/// The listing without docs, which may have moved with their comment.
fn meaning(file: &File) -> String {
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
    let first = tree(text);
    let printed = print(&first);
    let second = tree(&printed);
    assert_eq!(
        meaning(&first),
        meaning(&second),
        "the meaning of\n{text}\n{printed}"
    );
    assert_eq!(
        printed,
        print(&second),
        "printing is not settled for\n{text}"
    );
    for comment in &first.trivia.comments {
        let text = comment.text.trim_matches('/');
        assert!(printed.contains(text), "{text:?} is lost in\n{printed}");
    }
    assert_eq!(first.trivia.comments.len(), second.trivia.comments.len());
}

#[test]
fn scenes_look_like_this() {
    for (name, text) in SCENES {
        check_round_trip(text);
        insta::assert_snapshot!(format!("text_of_{name}"), print(&tree(text)));
    }
}

#[test]
fn what_is_long_is_broken_and_comments_stay() {
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
    insta::assert_snapshot!(print(&tree(text)));
}

/// Comments in every place where one may stand.
#[test]
fn comments_anywhere_survive() {
    let mut random = Random(0x5df);
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
        // Between words: next to a space, a comma or a bracket.
        let in_comments: Vec<_> = tree(scene)
            .trivia
            .comments
            .iter()
            .map(|c| c.span.start as usize..c.span.end as usize)
            .collect();
        let gaps: Vec<_> = scene
            .char_indices()
            .filter(|(at, c)| {
                let free = !in_comments.iter().any(|comment| comment.contains(at));
                let in_text = scene[..*at].bytes().filter(|b| *b == b'"').count() % 2 == 1;
                free && !in_text && matches!(c, ' ' | ',' | '(' | ')' | ';' | '}')
            })
            .map(|(at, _)| at)
            .collect();
        let mut text = scene.to_owned();
        for number in 0..1 + random.below(3) {
            let at = gaps[random.below(gaps.len())];
            let kind = kinds[random.below(kinds.len())];
            let end = match kind.starts_with("//") {
                true => "\n",
                false => "",
            };
            let comment = kind.replacen(' ', &format!(" {number}"), 1);
            // An earlier insertion moves later gaps: insert only into the untouched front.
            if text[..at] == scene[..at] {
                text.insert_str(at, &format!(" {comment}{end}"));
            }
        }
        check_round_trip(&text);
    }
}
