//! Damaged variants of valid texts and files.

use crate::random::Random;
use crate::seeds::{CLAUSES, FILES, TEXTS};
use sdfc_compiler::elaborate::function_docs;
use sdfc_vm::file::with_header;
use std::sync::LazyLock;

/// Text fragments inserted at random positions.
const FRAGMENTS: &[&str] = &[
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
    "|",
    "&",
    "-",
    "|[",
    "-[",
    "&[",
    "..",
    "..=",
    "=>",
    "+",
    "*",
    "/",
    "%",
    "!",
    "&&",
    "||",
    "<",
    "fn",
    "fn(p) => ",
    "let ",
    "if ",
    " else ",
    "for ",
    " in ",
    "blend",
    "blend(0.1) {",
    "param ",
    "part ",
    "import ",
    "material ",
    "#12",
    "#ff8800",
    "\"",
    "\"std/fasteners\"",
    "/*",
    "*/",
    "//",
    "///",
    "7furlongs",
    "deg",
    "mm",
    "s",
    "time",
    "p",
    "p.x",
    "n.y",
    "X",
    "[1, 2, 3]",
    "X * 3",
    "true",
    "pi",
    "ä",
    "é́",
    "名",
    "😀",
    "\u{feff}",
    "\u{202e}",
    "\u{0}",
    "\u{7f}",
    "^",
    "?",
    "\\",
    "'",
    "\n",
    "\r\n",
    "\r",
    "\t",
    "\u{a0}",
    "@",
    "$",
    "~",
    "sphere(1)",
    "nothing()",
    "everything()",
    "circle(1)",
    "noise(p)",
    "_x",
    "print(1)",
    "len([])",
];

/// Numbers at the limits of what is allowed.
const EDGE_NUMBERS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e-3",
    "1e-9",
    "1e-30",
    "1e-45",
    "1e-320",
    "255",
    "256",
    "300",
    "1000",
    "4096",
    "65535",
    "65537",
    "99999",
    "100000",
    "100001",
    "16777217",
    "4294967296",
    "1e9",
    "1e18",
    "1.1e18",
    "1e30",
    "3.4e38",
    "3.5e38",
    "1e308",
    "1e309",
    "1e9999",
    "9223372036854775808",
    "0.1e",
    "1_000",
    ".5",
    "5.",
    "0x10",
    "90deg",
    "1turn",
    "1e30deg",
    "1mm",
    "2in",
    "0s",
    "1e300turn",
    "(1/3)",
    "(0/0)",
    "(-1)",
];

/// Method calls appended to expressions.
const METHODS: &[&str] = &[
    ".translate(0.1, 0, 0)",
    ".translate(1e18, 0, 0)",
    ".rotate(30deg, [0, 0, 0])",
    ".rotate(1e9deg, Y)",
    ".scale(1e-30)",
    ".scale(-1)",
    ".scale(0)",
    ".scale(1, 1e9, 1e-9)",
    ".mirror(X)",
    ".reflect([0, 0, 0])",
    ".repeat(0.1)",
    ".repeat(1e-30)",
    ".repeat([1, 0, 1])",
    ".repeat(1, count: 100000)",
    ".polar(1)",
    ".polar(100000)",
    ".twist(1turn)",
    ".twist(1e9turn)",
    ".bend(80deg)",
    ".elongate([1, 0, 1e9])",
    ".shell(0.1)",
    ".shell(1e-30)",
    ".offset(-5)",
    ".offset(1e18)",
    ".displace(fn(p) => 0.1 * noise(p * 9))",
    ".displace(fn(p) => p.x / p.y)",
    ".displace(fn(p) => 1e18 * sin(1e18 * p.x))",
    ".warp(fn(p) => p.yzx)",
    ".warp(fn(p) => p * p)",
    ".warp(fn(p) => p / length(p))",
    ".extrude(1)",
    ".revolve()",
    ".revolve(offset: 1e9)",
    ".slice(X)",
    ".section(Z)",
    ".taper(0.5)",
    ".shear(xy: 1e9)",
    ".color(#ff0000)",
    ".color(fn(p) => p)",
    ".hide()",
    ".only()",
    ".ghost()",
    ".scatter(cell: 0.5)",
];

/// Names of all items of the language.
static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    function_docs()
        .into_iter()
        .map(|entry| entry.name)
        .collect()
});

/// Returns a scene's text with light damage, or a text that is oversized in one way.
pub fn text(seed: u64) -> String {
    let mut r = Random::new(seed);
    if r.chance(2) {
        return oversized_text(&mut r);
    }
    let mut words: Vec<String> = words(&r.pick(&TEXTS)).map(str::to_owned).collect();
    if r.chance(60) {
        // The result may still be a valid scene.
        mutate_plausibly(&mut r, &mut words);
    } else {
        for _ in 0..1 + r.below(4) {
            damage_words(&mut r, &mut words);
        }
    }
    let mut text = words.concat();
    match r.below(60) {
        0 => text = text.replace('\n', "\r\n"),
        1 => text.insert(0, '\u{feff}'),
        2 => text = text.replace('\n', "\r"),
        3 => text.truncate(text.floor_char_boundary(r.below(text.len() + 1))),
        4 => text = text.replace(' ', "\t"),
        _ => {}
    }
    text
}

/// Splits a text into words, numbers, spaces and single characters.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let mut remaining = text;
    std::iter::from_fn(move || {
        let first_char = remaining.chars().next()?;
        let in_word = |c: char| c.is_alphanumeric() || c == '_';
        let in_number = |c: char| c.is_alphanumeric() || c == '.' || c == '_';
        let is_in_token: &dyn Fn(char) -> bool = match first_char {
            c if c.is_ascii_digit() => &in_number,
            c if in_word(c) => &in_word,
            c if c.is_whitespace() => &char::is_whitespace,
            _ => &|_| false,
        };
        let end = remaining[first_char.len_utf8()..].find(|c| !is_in_token(c));
        let end = end.map_or(remaining.len(), |end| end + first_char.len_utf8());
        let (word, after) = remaining.split_at(end);
        remaining = after;
        Some(word)
    })
}

/// Returns the index of a random word that satisfies a predicate.
///
/// If no word after the random start satisfies it, the start is returned.
fn find_word(r: &mut Random, words: &[String], matches: impl Fn(&str) -> bool) -> usize {
    let start = r.below(words.len());
    let offset = words[start..].iter().position(|word| matches(word));
    offset.map_or(start, |offset| start + offset)
}

/// Reports whether a word is a number, or begins with a digit.
fn is_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit())
}

/// Reports whether a word is a name.
fn is_name(word: &str) -> bool {
    word.starts_with(char::is_alphabetic)
}

/// Changes numbers, or appends a method to a call.
fn mutate_plausibly(r: &mut Random, words: &mut Vec<String>) {
    for _ in 0..1 + r.below(2) {
        let index = find_word(r, words, is_number);
        match r.below(6) {
            _ if !is_number(&words[index]) => {}
            0 => words[index] = r.pick(EDGE_NUMBERS).to_owned(),
            1 => {
                let count = r.below(200);
                words[index] = count.to_string();
            }
            2 => words[index].insert(0, '-'),
            3 => words[index].push_str("e-3"),
            4 => words[index].push('5'),
            _ => words[index] = format!("({} * 1.7)", words[index]),
        }
    }
    if r.chance(30) {
        let index = find_word(r, words, |word| word == ")");
        words.insert(index + 1, r.pick(METHODS).to_owned());
    }
}

/// Applies one kind of damage.
fn damage_words(r: &mut Random, words: &mut Vec<String>) {
    if words.is_empty() {
        words.push(r.pick(FRAGMENTS).to_owned());
        return;
    }
    match r.below(12) {
        0..=2 => {
            let index = find_word(r, words, is_number);
            words[index] = r.pick(EDGE_NUMBERS).to_owned();
        }
        3 => {
            let index = find_word(r, words, is_name);
            words[index] = r.pick(&NAMES).to_owned();
        }
        4 => {
            let range = r.range(words.len(), 12);
            words.drain(range);
        }
        5 => {
            let range = r.range(words.len(), 40);
            let copy = words[range].to_vec();
            let target = r.below(words.len() + 1);
            words.splice(target..target, copy);
        }
        6 => {
            let (a, b) = (find_word(r, words, is_name), find_word(r, words, is_name));
            words.swap(a, b);
        }
        7 => {
            let index = r.below(words.len());
            words[index] = r.pick(FRAGMENTS).to_owned();
        }
        8 => {
            let index = r.below(words.len() + 1);
            words.insert(index, r.pick(FRAGMENTS).to_owned());
        }
        9 => {
            let index = find_word(r, words, |word| word == ")");
            words.insert(index + 1, r.pick(METHODS).to_owned());
        }
        10 => {
            // Inserts some statements of another scene.
            let other: Vec<String> = self::words(&r.pick(&TEXTS)).map(str::to_owned).collect();
            let source = find_word(r, &other, |word| word == ";");
            let length = r.below(60);
            let target = find_word(r, words, |word| word == ";") + 1;
            let piece = other[source..].iter().skip(1).take(length).cloned();
            words.splice(target..target, piece);
        }
        _ => {
            let other: Vec<String> = self::words(&r.pick(&TEXTS)).map(str::to_owned).collect();
            let source = find_word(r, &other, |word| word == ";");
            words.truncate(find_word(r, words, |word| word == ";"));
            words.extend_from_slice(&other[source..]);
        }
    }
}

/// Returns a text with one construct nested or repeated up to 100,000 times.
fn oversized_text(r: &mut Random) -> String {
    let depth = r.pick(&[
        1_usize, 7, 60, 199, 200, 201, 450, 1000, 5000, 20_000, 100_000,
    ]);
    let nested: &[[&str; 3]] = &[
        ["(", "sphere(1)", ")"],
        ["[", "sphere(1)", "]"],
        ["-", "1", ""],
        ["!", "true", ""],
        ["union(", "sphere(1)", ")"],
        ["abs(", "1", ")"],
        ["if true { ", "sphere(1)", " } else { box(1) }"],
        ["for i in 0..1 { ", "sphere(1)", " }"],
        ["fn(p) => ", "p", ""],
        ["blend(0.1) { ", "sphere(1)", " }"],
        ["sphere(1) |[0.1] (", "box(1)", ")"],
        ["sphere(1) - (", "box(1)", ")"],
        ["field(fn(p) => ", "p.x", ")"],
        ["sphere(1).displace(fn(p) => ", "0.01", ")"],
        ["/* ", "", " */ sphere(1)"],
    ];
    let chained: &[[&str; 3]] = &[
        ["sphere(1)", ".translate(0.1, 0, 0)", ""],
        ["sphere(1)", ".rotate(20deg, [1, 2, 3])", ""],
        ["sphere(1)", ".scale(1.01)", ""],
        ["sphere(0.1)", ".repeat(1, count: 3)", ""],
        ["sphere(1)", ".mirror(X).translate(0.1, 0, 0)", ""],
        ["sphere(1)", ".twist(1deg)", ""],
        ["sphere(1)", ".offset(0.01).shell(0.1)", ""],
        ["sphere(1)", ".displace(fn(p) => 0.001 * sin(p.x))", ""],
        ["sphere(1)", ".warp(fn(p) => p.yzx)", ""],
        ["sphere(1)", " | box(0.9).translate(0.3, 0, 0)", ""],
        ["sphere(1)", " |[0.1] box(0.9)", ""],
        ["sphere(1)", " - box(0.9)", ""],
        ["field(fn(p) => p.x", " + sin(p.y * 1.1)", ")"],
        ["field(fn(p) => p.x", " * p.y", ", within: 1)"],
        ["sphere(1", " + 1", ")"],
        ["let a = 1;\n", "let a = a + a;\n", "sphere(a)"],
        ["let a = [1];\n", "let a = [a, a];\n", "print(a); sphere(1)"],
        [
            "let a = sphere(1);\n",
            "let a = a | a.translate(1, 0, 0);\n",
            "a",
        ],
        ["fn f(x) = x;\n", "let f = fn(x) => f(x);\n", "sphere(f(1))"],
        ["", "param x = 1;\n", "sphere(x)"],
        ["", "light { dir: X }\n", "sphere(1)"],
        ["", "x ", ""],
        ["", "sphere(1) ", ""],
    ];
    if r.chance(50) {
        let [open, middle, close] = r.pick(nested);
        format!("{}{middle}{}", open.repeat(depth), close.repeat(depth))
    } else {
        let [start, link, last] = r.pick(chained);
        format!("{start}{}{last}", link.repeat(depth))
    }
}

/// Returns damaged clauses.
pub fn clauses(seed: u64) -> String {
    let mut r = Random::new(seed);
    if r.chance(2) {
        let (operation, count) = (r.pick(&["add", "mul", "min", "pow", "mod"]), r.below(9000));
        let line = |i: usize| format!("_{} {operation} _{i} _{}\n", i + 1, i / 2);
        return (0..count)
            .map(line)
            .fold("_0 var-x\n".to_owned(), |lines, line| lines + &line);
    }
    let mut words: Vec<String> = words(r.pick(CLAUSES)).map(str::to_owned).collect();
    const WORDS: &[&str] = &[
        "var-x",
        "var-z",
        "const",
        "add",
        "max",
        "sqrt",
        "recip",
        "compare",
        "ln",
        "atan2",
        "_0",
        "_1",
        "_99999",
        "x",
        "nan",
        "inf",
        "-1e39",
        "1e-45",
        "#",
        "\n",
        " ",
        "\u{0}",
        "ä",
        "\r\n",
        "\u{feff}",
        "-",
        "\t",
        "1e999",
        "const nan",
        "mod",
    ];
    if r.chance(50) {
        // Another number or operand. The result may still be valid clauses.
        let index = find_word(&mut r, &words, |word| {
            word.starts_with(|c: char| c == '_' || c.is_ascii_digit())
        });
        words[index] = r
            .pick(&[
                "_0", "_1", "_2", "_3", "0", "1", "2.5", "1e30", "1e-40", "3e38",
            ])
            .to_owned();
        return words.concat();
    }
    for _ in 0..1 + r.below(3) {
        if words.is_empty() {
            break;
        }
        let index = r.below(words.len());
        match r.below(5) {
            0 => words[index] = r.pick(WORDS).to_owned(),
            1 => words.insert(index, r.pick(WORDS).to_owned()),
            2 => {
                let range = r.range(words.len(), 6);
                words.drain(range);
            }
            3 => {
                let range = r.range(words.len(), 30);
                let copy = words[range].to_vec();
                words.splice(index..index, copy);
            }
            _ => {
                let other = r.below(words.len());
                words.swap(index, other);
            }
        }
    }
    words.concat()
}

/// Number of words before a file's sections.
const HEADER_WORDS: usize = 5;

/// Returns the bytes of a compiled scene with damage, mostly with a valid header.
pub fn file(seed: u64) -> Vec<u8> {
    let mut r = Random::new(seed);
    let bytes = r.pick(&FILES);
    if r.chance(10) {
        return damage_bytes(&mut r, bytes);
    }
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0[HEADER_WORDS..]
        .iter()
        .map(|&bytes| u32::from_le_bytes(bytes))
        .collect();
    for _ in 0..1 + r.below(3) {
        damage_file_words(&mut r, &mut words);
    }
    with_header(&words)
}

/// Changes bytes anywhere, the header included.
fn damage_bytes(r: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..1 + r.below(3) {
        match r.below(4) {
            0 => bytes.truncate(r.below(bytes.len() + 1)),
            1 => bytes.extend(std::iter::repeat_n(r.bits() as u8, r.below(9))),
            2 => {
                let range = r.range(bytes.len(), 16);
                bytes.drain(range);
            }
            _ if bytes.is_empty() => {}
            _ => {
                let index = r.below(bytes.len());
                bytes[index] ^= 1 << r.below(8);
            }
        }
    }
    bytes
}

/// Returns the kinds and ranges of words of a file's sections.
fn sections(words: &[u32]) -> Vec<(u32, std::ops::Range<usize>)> {
    let (mut sections, mut index) = (Vec::new(), 0);
    while let [kind, length, ..] = words[index.min(words.len())..] {
        let end = (index + 2).saturating_add(length as usize).min(words.len());
        sections.push((kind, index + 2..end));
        index = end;
    }
    sections
}

/// Changes words of a file's sections, one field of an instruction, or a whole section.
fn damage_file_words(r: &mut Random, words: &mut Vec<u32>) {
    let sections = sections(words);
    if words.is_empty() || sections.is_empty() {
        words.push(r.bits() as u32);
        return;
    }
    let (kind, range) = r.pick(&sections);
    let index = if range.is_empty() {
        0
    } else {
        range.start + r.below(range.len())
    };
    let is_code = kind == 1 || kind == 5;
    match r.below(10) {
        0..=2 if is_code && range.len() >= 4 => {
            // A field of an instruction's first word: the first bit and the number of bits.
            const FIELDS: &[(u32, u32)] = &[
                (0, 8),
                (8, 3),
                (11, 1),
                (12, 2),
                (14, 2),
                (16, 5),
                (21, 2),
                (23, 1),
                (24, 8),
            ];
            let first_word = range.start + r.below(range.len() / 4) * 4;
            let (shift, bits) = r.pick(FIELDS);
            let mask = ((1_u32 << bits) - 1) << shift;
            words[first_word] = words[first_word] & !mask | (r.bits() as u32) << shift & mask;
        }
        3 | 4 if is_code && range.len() >= 8 => {
            // Inserts or replaces an instruction by a copy of another, or removes it.
            let count = range.len() / 4;
            let [source, target] = [0; 2].map(|_| range.start + r.below(count) * 4);
            let copy = words[source..source + 4].to_vec();
            let length = words[range.start - 1];
            match r.below(3) {
                0 => {
                    words.splice(target..target, copy);
                    words[range.start - 1] = length + 4;
                }
                1 => {
                    words.splice(target..target + 4, copy);
                }
                _ => {
                    words.drain(target..target + 4);
                    words[range.start - 1] = length - 4;
                }
            }
        }
        5 => words[index] = r.below(40) as u32,
        6 => {
            const EDGE_FLOATS: &[f32] = &[
                0.0,
                -0.0,
                1.0,
                -1.0,
                1e-45,
                1e-38,
                1e-20,
                1e18,
                3e38,
                -3e38,
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                0.5,
                1e9,
                16_777_216.0,
            ];
            words[index] = r.pick(EDGE_FLOATS).to_bits();
        }
        7 => {
            // Replaces a section by that of another file.
            let other = &FILES[r.below(FILES.len())];
            let other: Vec<u32> = other.as_chunks::<4>().0[HEADER_WORDS..]
                .iter()
                .map(|&bytes| u32::from_le_bytes(bytes))
                .collect();
            let other_sections = self::sections(&other);
            let matching = other_sections
                .iter()
                .find(|(other_kind, _)| *other_kind == kind);
            if let Some((_, source)) = matching {
                words[range.start - 1] = source.len() as u32;
                words.splice(range, other[source.clone()].to_vec());
            }
        }
        8 if kind == 9 => {
            // Changes a byte of the settings, which are bytes instead of words.
            words[index] ^= (r.below(256) as u32) << (8 * r.below(4));
        }
        _ => words[index] ^= 1 << r.below(32),
    }
}
