//! Pixels of a screen in Xvfb's file (the X window dump format): a header of big-endian 32-bit numbers, a
//! colour table, then the rows.

use std::collections::HashSet;

/// A colour: red, green and blue.
pub(crate) type Color = [u8; 3];

/// A screenshot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Screen {
    width: usize,
    pixels: Vec<Color>,
}

/// A rectangle: left and upper edge, and the exclusive right and lower edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenRect {
    pub(crate) from: [usize; 2],
    pub(crate) to: [usize; 2],
}

impl Screen {
    /// Decodes the bytes of Xvfb's file.
    pub(crate) fn from_xwd(bytes: &[u8]) -> Self {
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

    /// Returns the number of distinct colours.
    pub(crate) fn colors(&self) -> usize {
        self.pixels.iter().collect::<HashSet<_>>().len()
    }

    fn inside(&self, area: ScreenRect) -> impl Iterator<Item = ([usize; 2], Color)> {
        let [x0, y0] = area.from;
        let [x1, y1] = area.to;
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| ([x, y], self.at([x, y]))))
    }

    /// Counts the pixels of an area that match.
    pub(crate) fn count(&self, area: ScreenRect, is: impl Fn(Color) -> bool) -> usize {
        self.inside(area).filter(|(_, color)| is(*color)).count()
    }

    /// Returns the positions of the pixels of an area that match.
    pub(crate) fn positions(
        &self,
        area: ScreenRect,
        is: impl Fn(Color) -> bool,
    ) -> Vec<[usize; 2]> {
        let matching = self.inside(area).filter(|(_, color)| is(*color));
        matching.map(|(position, _)| position).collect()
    }

    /// Counts the pixels of an area that differ from another screen's.
    pub(crate) fn differs(&self, other: &Self, area: ScreenRect) -> usize {
        let pairs = self.inside(area).zip(other.inside(area));
        pairs.filter(|(a, b)| a != b).count()
    }

    /// Returns red, green, blue and alpha of all pixels.
    pub(crate) fn rgba(&self) -> Vec<u8> {
        let pixels = self.pixels.iter();
        pixels.flat_map(|&[r, g, b]| [r, g, b, 255]).collect()
    }
}
