//! The house voice, as far as it can be counted: see CONTRIBUTING.md.

use super::all_sources;

/// Words with which no doc comment begins.
const OPENERS: [&str; 8] = [
    "What", "How", "Whether", "Where", "Which", "Who", "That", "The same",
];
/// Phrases of the project's former dialect, which no comment contains.
const FORMER_PHRASES: [&str; 13] = [
    "so many",
    "next to nothing",
    "how steep",
    "as steep as",
    "is none of",
    "are none of",
    "is told",
    "are told",
    "is asked",
    "are asked",
    "the eye",
    "said once",
    "a share of",
];

/// The text of a doc comment's line.
fn doc_text(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let text = line.strip_prefix("///").or(line.strip_prefix("//!"))?;
    (!text.starts_with('/')).then_some(text.trim_start())
}

/// The text of any comment's line.
fn comment_text(line: &str) -> Option<&str> {
    line.split_once("//").map(|(_, text)| text)
}

/// Reports whether a text begins with a word or phrase.
fn begins_with(text: &str, opener: &str) -> bool {
    text.strip_prefix(opener)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric()))
}

#[test]
fn doc_comments_begin_with_a_noun_or_a_verb() {
    let mut wrong = Vec::new();
    for source in all_sources() {
        let mut is_within = false;
        for (index, line) in source.text.lines().enumerate() {
            let text = doc_text(line);
            if let Some(text) = text.filter(|_| !is_within)
                && OPENERS.iter().any(|opener| begins_with(text, opener))
            {
                wrong.push(format!("{}:{}: {text}", source.path.display(), index + 1));
            }
            is_within = text.is_some();
        }
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn comments_keep_to_the_glossary() {
    let mut wrong = Vec::new();
    // This file has to name the phrases.
    let own = file!();
    for source in all_sources() {
        if source.path.as_os_str() == own {
            continue;
        }
        for (index, line) in source.text.lines().enumerate() {
            let Some(text) = comment_text(line) else {
                continue;
            };
            for phrase in FORMER_PHRASES {
                if text.contains(phrase) {
                    let path = source.path.display();
                    wrong.push(format!("{path}:{}: `{phrase}` in {text}", index + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}
