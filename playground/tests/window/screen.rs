//! Pixels of a screen, as Xvfb keeps them in its file: a head of numbers of four bytes, the larger
//! ones first, then a list of colours, then the rows.

use std::collections::HashSet;

/// A colour: red, green and blue.
pub(crate) type Color = [u8; 3];

/// A screen at a moment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Screen {
    width: usize,
    pixels: Vec<Color>,
}

/// A rectangle: its left and upper edge, and those behind the last column and row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) from: [usize; 2],
    pub(crate) to: [usize; 2],
}

impl Screen {
    /// The screen in the bytes of Xvfb's file.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let number = |at: usize| {
            let bytes = bytes[4 * at..4 * at + 4].try_into().expect("four bytes");
            u32::from_be_bytes(bytes) as usize
        };
        let (head, width, height) = (number(0), number(4), number(5));
        let (bits, row, colors) = (number(11), number(12), number(19));
        assert_eq!(bits, 32, "bits of a pixel");
        let start = head + 12 * colors;
        let rows = bytes[start..].chunks_exact(row).take(height);
        // Blue comes first.
        let pixels = rows
            .flat_map(|row| row.chunks_exact(4).take(width))
            .map(|p| [p[2], p[1], p[0]])
            .collect();
        Self { width, pixels }
    }

    pub(crate) fn at(&self, [x, y]: [usize; 2]) -> Color {
        self.pixels[y * self.width + x]
    }

    /// How many colours there are.
    pub(crate) fn colors(&self) -> usize {
        self.pixels.iter().collect::<HashSet<_>>().len()
    }

    fn inside(&self, part: Part) -> impl Iterator<Item = ([usize; 2], Color)> {
        let [x0, y0] = part.from;
        let [x1, y1] = part.to;
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| ([x, y], self.at([x, y]))))
    }

    /// How many pixels of a part are so.
    pub(crate) fn count(&self, part: Part, is: impl Fn(Color) -> bool) -> usize {
        self.inside(part).filter(|(_, color)| is(*color)).count()
    }

    /// Where pixels of a part are so.
    pub(crate) fn places(&self, part: Part, is: impl Fn(Color) -> bool) -> Vec<[usize; 2]> {
        let found = self.inside(part).filter(|(_, color)| is(*color));
        found.map(|(place, _)| place).collect()
    }

    /// How many pixels of a part differ from another screen's.
    pub(crate) fn differs(&self, other: &Self, part: Part) -> usize {
        let pairs = self.inside(part).zip(other.inside(part));
        pairs.filter(|(a, b)| a != b).count()
    }

    /// Red, green, blue and alpha.
    pub(crate) fn rgba(&self) -> Vec<u8> {
        let all = self.pixels.iter();
        all.flat_map(|&[r, g, b]| [r, g, b, 255]).collect()
    }
}
