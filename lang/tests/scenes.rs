//! The six scenes of the language's description.

use sdfc_lang::{Diagnostics, Sources, Style, parse};

const SCENES: [&str; 6] = [
    "one_expression",
    "metaballs",
    "bracket",
    "landscape",
    "gyroid",
    "cog",
];

#[test]
fn all_parse() {
    for name in SCENES {
        let path = format!("{}/tests/scenes/{name}.sdf", env!("CARGO_MANIFEST_DIR"));
        let mut sources = Sources::new();
        let file = sources.add(
            format!("{name}.sdf"),
            std::fs::read_to_string(path).unwrap(),
        );
        let (tree, found) = parse(&sources, file);
        let found: Diagnostics = found.into_iter().collect();
        eprintln!("{}", found.render(&sources, Style::Plain));
        assert!(tree.is_some());
    }
}
