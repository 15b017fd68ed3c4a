//! Damage: texts and files that were right, and what becomes of them.

use crate::random::Random;
use crate::seeds::{CLAUSES, FILES, TEXTS};
use sdfc_compiler::elaborate::reference;
use sdfc_vm::file::sealed;
use std::sync::LazyLock;

/// What is put where it does not belong.
const PIECES: &[&str] = &[
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

/// Numbers at which something ends.
const NUMBERS: &[&str] = &[
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

/// What is hung onto what stands there.
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

/// The names of all that the language has.
static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| reference().into_iter().map(|entry| entry.name).collect());

/// A scene's text, damaged a little, or made large in one way.
pub fn text(seed: u64) -> String {
    let mut r = Random::new(seed);
    if r.chance(2) {
        return large(&mut r);
    }
    let mut words: Vec<String> = words(&r.pick(&TEXTS)).map(str::to_owned).collect();
    if r.chance(60) {
        // What may well still be a scene.
        strain(&mut r, &mut words);
    } else {
        for _ in 0..1 + r.below(4) {
            harm(&mut r, &mut words);
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

/// A text cut into words, numbers, spaces and single signs.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let in_word = |c: char| c.is_alphanumeric() || c == '_';
        let in_number = |c: char| c.is_alphanumeric() || c == '.' || c == '_';
        let is_part: &dyn Fn(char) -> bool = match first {
            c if c.is_ascii_digit() => &in_number,
            c if in_word(c) => &in_word,
            c if c.is_whitespace() => &char::is_whitespace,
            _ => &|_| false,
        };
        let end = rest[first.len_utf8()..].find(|c| !is_part(c));
        let end = end.map_or(rest.len(), |end| end + first.len_utf8());
        let (word, after) = rest.split_at(end);
        rest = after;
        Some(word)
    })
}

/// Where a word stands for which something holds, if chance finds one.
fn place(r: &mut Random, words: &[String], of: impl Fn(&str) -> bool) -> usize {
    let at = r.below(words.len());
    let behind = words[at..].iter().position(|word| of(word));
    behind.map_or(at, |behind| at + behind)
}

/// Whether a word is a number, or begins as one.
fn is_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit())
}

/// Whether a word is a name.
fn is_name(word: &str) -> bool {
    word.starts_with(char::is_alphabetic)
}

/// Changes numbers, or hangs a method onto a call.
fn strain(r: &mut Random, words: &mut Vec<String>) {
    for _ in 0..1 + r.below(2) {
        let at = place(r, words, is_number);
        match r.below(6) {
            _ if !is_number(&words[at]) => {}
            0 => words[at] = r.pick(NUMBERS).to_owned(),
            1 => {
                let count = r.below(200);
                words[at] = count.to_string();
            }
            2 => words[at].insert(0, '-'),
            3 => words[at].push_str("e-3"),
            4 => words[at].push('5'),
            _ => words[at] = format!("({} * 1.7)", words[at]),
        }
    }
    if r.chance(30) {
        let at = place(r, words, |word| word == ")");
        words.insert(at + 1, r.pick(METHODS).to_owned());
    }
}

/// Does one kind of damage.
fn harm(r: &mut Random, words: &mut Vec<String>) {
    if words.is_empty() {
        words.push(r.pick(PIECES).to_owned());
        return;
    }
    match r.below(12) {
        0..=2 => {
            let at = place(r, words, is_number);
            words[at] = r.pick(NUMBERS).to_owned();
        }
        3 => {
            let at = place(r, words, is_name);
            words[at] = r.pick(&NAMES).to_owned();
        }
        4 => {
            let range = r.range(words.len(), 12);
            words.drain(range);
        }
        5 => {
            let range = r.range(words.len(), 40);
            let copy = words[range].to_vec();
            let to = r.below(words.len() + 1);
            words.splice(to..to, copy);
        }
        6 => {
            let (a, b) = (place(r, words, is_name), place(r, words, is_name));
            words.swap(a, b);
        }
        7 => {
            let at = r.below(words.len());
            words[at] = r.pick(PIECES).to_owned();
        }
        8 => {
            let at = r.below(words.len() + 1);
            words.insert(at, r.pick(PIECES).to_owned());
        }
        9 => {
            let at = place(r, words, |word| word == ")");
            words.insert(at + 1, r.pick(METHODS).to_owned());
        }
        10 => {
            // The statements of another scene, or a part of one.
            let other: Vec<String> = self::words(&r.pick(&TEXTS)).map(str::to_owned).collect();
            let from = place(r, &other, |word| word == ";");
            let length = r.below(60);
            let to = place(r, words, |word| word == ";") + 1;
            let piece = other[from..].iter().skip(1).take(length).cloned();
            words.splice(to..to, piece);
        }
        _ => {
            let other: Vec<String> = self::words(&r.pick(&TEXTS)).map(str::to_owned).collect();
            let from = place(r, &other, |word| word == ";");
            words.truncate(place(r, words, |word| word == ";"));
            words.extend_from_slice(&other[from..]);
        }
    }
}

/// A text that is too much of one thing.
fn large(r: &mut Random) -> String {
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
        let [first, link, last] = r.pick(chained);
        format!("{first}{}{last}", link.repeat(depth))
    }
}

/// Clauses, damaged.
pub fn clauses(seed: u64) -> String {
    let mut r = Random::new(seed);
    if r.chance(2) {
        let (operation, count) = (r.pick(&["add", "mul", "min", "pow", "mod"]), r.below(9000));
        let line = |i: usize| format!("_{} {operation} _{i} _{}\n", i + 1, i / 2);
        return (0..count)
            .map(line)
            .fold("_0 var-x\n".to_owned(), |all, line| all + &line);
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
        // Another number or operand, or the same words once more, which may well still be clauses.
        let at = place(&mut r, &words, |word| {
            word.starts_with(|c: char| c == '_' || c.is_ascii_digit())
        });
        words[at] = r
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
        let at = r.below(words.len());
        match r.below(5) {
            0 => words[at] = r.pick(WORDS).to_owned(),
            1 => words.insert(at, r.pick(WORDS).to_owned()),
            2 => {
                let range = r.range(words.len(), 6);
                words.drain(range);
            }
            3 => {
                let range = r.range(words.len(), 30);
                let copy = words[range].to_vec();
                words.splice(at..at, copy);
            }
            _ => {
                let other = r.below(words.len());
                words.swap(at, other);
            }
        }
    }
    words.concat()
}

/// The words in front of a file's sections.
const HEADER: usize = 5;

/// The bytes of a compiled scene, damaged; most of them with a header that fits.
pub fn file(seed: u64) -> Vec<u8> {
    let mut r = Random::new(seed);
    let bytes = r.pick(&FILES);
    if r.chance(10) {
        return spoiled(&mut r, bytes);
    }
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0[HEADER..]
        .iter()
        .map(|&bytes| u32::from_le_bytes(bytes))
        .collect();
    for _ in 0..1 + r.below(3) {
        harm_words(&mut r, &mut words);
    }
    sealed(&words)
}

/// Bytes changed anywhere, and left so.
fn spoiled(r: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
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
                let at = r.below(bytes.len());
                bytes[at] ^= 1 << r.below(8);
            }
        }
    }
    bytes
}

/// Where the sections of a file lie: their kinds and words.
fn sections(words: &[u32]) -> Vec<(u32, std::ops::Range<usize>)> {
    let (mut found, mut at) = (Vec::new(), 0);
    while let [kind, length, ..] = words[at.min(words.len())..] {
        let end = (at + 2).saturating_add(length as usize).min(words.len());
        found.push((kind, at + 2..end));
        at = end;
    }
    found
}

/// Changes words of a file's sections, one field of an instruction, or a whole section.
fn harm_words(r: &mut Random, words: &mut Vec<u32>) {
    let sections = sections(words);
    if words.is_empty() || sections.is_empty() {
        words.push(r.bits() as u32);
        return;
    }
    let (kind, range) = r.pick(&sections);
    let at = if range.is_empty() {
        0
    } else {
        range.start + r.below(range.len())
    };
    let is_code = kind == 1 || kind == 5;
    match r.below(10) {
        0..=2 if is_code && range.len() >= 4 => {
            // A field of the first word, or a place in the pool.
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
            let first = range.start + r.below(range.len() / 4) * 4;
            let (from, bits) = r.pick(FIELDS);
            let mask = ((1_u32 << bits) - 1) << from;
            words[first] = words[first] & !mask | (r.bits() as u32) << from & mask;
        }
        3 | 4 if is_code && range.len() >= 8 => {
            // An instruction from elsewhere, put in or in place of one, or left out.
            let count = range.len() / 4;
            let [from, to] = [0; 2].map(|_| range.start + r.below(count) * 4);
            let copy = words[from..from + 4].to_vec();
            let length = words[range.start - 1];
            match r.below(3) {
                0 => {
                    words.splice(to..to, copy);
                    words[range.start - 1] = length + 4;
                }
                1 => {
                    words.splice(to..to + 4, copy);
                }
                _ => {
                    words.drain(to..to + 4);
                    words[range.start - 1] = length - 4;
                }
            }
        }
        5 => words[at] = r.below(40) as u32,
        6 => {
            const NUMBERS: &[f32] = &[
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
            words[at] = r.pick(NUMBERS).to_bits();
        }
        7 => {
            // A section of another file.
            let other = &FILES[r.below(FILES.len())];
            let other: Vec<u32> = other.as_chunks::<4>().0[HEADER..]
                .iter()
                .map(|&bytes| u32::from_le_bytes(bytes))
                .collect();
            let theirs = self::sections(&other);
            let same = theirs.iter().find(|(theirs, _)| *theirs == kind);
            if let Some((_, from)) = same {
                words[range.start - 1] = from.len() as u32;
                words.splice(range, other[from.clone()].to_vec());
            }
        }
        8 if kind == 9 => {
            // A byte of the settings, which are not words.
            words[at] ^= (r.below(256) as u32) << (8 * r.below(4));
        }
        _ => words[at] ^= 1 << r.below(32),
    }
}
