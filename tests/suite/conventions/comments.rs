//! The house voice, as far as it can be counted: see CONTRIBUTING.md.

use super::documents::documents;
use super::{CRATES, all_sources, sources_of};
use std::path::Path;

/// Words with which no doc comment begins.
const OPENERS: [&str; 8] = [
    "What", "How", "Whether", "Where", "Which", "Who", "That", "The same",
];
/// Phrases of the project's former dialect, which no comment and no document contains.
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

/// Maximum number of words of a sentence, up to its full stop.
const MAX_SENTENCE_WORDS: usize = 25;

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

/// The text of a line that holds nothing but a comment.
fn comment_line(line: &str) -> Option<&str> {
    let text = line.trim_start().strip_prefix("//")?;
    Some(text.strip_prefix(['/', '!']).unwrap_or(text).trim())
}

/// Reports whether a comment's line begins an item of a list.
fn is_list_item(text: &str) -> bool {
    let (marker, _) = text.split_once(' ').unwrap_or_default();
    let number = marker.strip_suffix('.').unwrap_or_default();
    matches!(marker, "-" | "*") || number.parse::<u32>().is_ok()
}

/// The paragraphs and list items of the comments of a file, with the numbers of their first lines. Tables,
/// headings and blocks of code are left out.
fn paragraphs(source: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let (mut is_code, mut is_within) = (false, false);
    for (index, line) in source.lines().enumerate() {
        let Some(text) = comment_line(line) else {
            (is_code, is_within) = (false, false);
            continue;
        };
        let is_fence = text.starts_with("```");
        is_code ^= is_fence;
        if is_code || is_fence || text.is_empty() || text.starts_with(['|', '#']) {
            is_within = false;
            continue;
        }
        match found.last_mut() {
            Some((_, paragraph)) if is_within && !is_list_item(text) => {
                paragraph.push(' ');
                paragraph.push_str(text);
            }
            _ => found.push((index + 1, text.to_owned())),
        }
        is_within = true;
    }
    found
}

/// Replaces each code span by one word.
fn without_code_spans(paragraph: &str) -> String {
    let parts = paragraph.split('`').enumerate();
    let parts = parts.map(|(index, part)| if index % 2 == 1 { "code" } else { part });
    parts.collect()
}

/// Reports whether a word ends a sentence, perhaps within parentheses or quotation marks.
fn ends_sentence(word: &str) -> bool {
    word.trim_end_matches([')', '"']).ends_with(['.', '?', '!'])
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

/// Returns the former phrases in a file: `lines` holds the part of each line to read, if there is one.
fn former_phrases<'t>(path: &Path, lines: impl Iterator<Item = Option<&'t str>>) -> Vec<String> {
    let mut found = Vec::new();
    for (index, text) in lines.enumerate() {
        let Some(text) = text else { continue };
        for phrase in FORMER_PHRASES {
            if text.contains(phrase) {
                let path = path.display();
                found.push(format!("{path}:{}: `{phrase}` in {text}", index + 1));
            }
        }
    }
    found
}

#[test]
fn comments_and_documents_keep_to_the_glossary() {
    let mut sources = all_sources();
    // This file has to name the phrases.
    sources.retain(|source| source.path.as_os_str() != file!());
    for extension in ["wgsl", "lalrpop"] {
        let of_crates = CRATES
            .iter()
            .flat_map(|(_, folder)| sources_of(folder, extension));
        let before = sources.len();
        sources.extend(of_crates);
        assert!(sources.len() > before, "no file ends with .{extension}");
    }
    let mut wrong: Vec<String> = sources
        .iter()
        .flat_map(|source| former_phrases(&source.path, source.text.lines().map(comment_text)))
        .collect();
    for document in documents() {
        wrong.extend(former_phrases(
            &document.path,
            document.text.lines().map(Some),
        ));
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn sentences_of_comments_are_short() {
    let mut wrong = Vec::new();
    for source in all_sources() {
        for (line, paragraph) in paragraphs(&source.text) {
            let paragraph = without_code_spans(&paragraph);
            let words: Vec<&str> = paragraph.split_whitespace().collect();
            for sentence in words.split_inclusive(|word| ends_sentence(word)) {
                let is_word = |word: &&&str| word.contains(char::is_alphanumeric);
                let count = sentence.iter().filter(is_word).count();
                if count > MAX_SENTENCE_WORDS {
                    let (path, sentence) = (source.path.display(), sentence.join(" "));
                    wrong.push(format!("{path}:{line}: {count} words: {sentence}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}
