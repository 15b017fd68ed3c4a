//! Set operators, and blends of their operands.

use crate::expression::ExprId;
use sdfc_lang::Span;

/// A set operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SetOperator {
    /// `|`
    Union,
    /// `&`
    Intersection,
    /// `-`
    Subtraction,
}

/// Kind of transition between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BlendKind {
    Quadratic,
    Cubic,
    Circular,
    Exponential,
    Distance,
    Chamfer,
    Fillet,
    Stairs,
}

impl BlendKind {
    /// Words of the language for each kind; the preferred word comes first.
    const WORDS: [(&'static str, BlendKind); 9] = [
        ("quadratic", BlendKind::Quadratic),
        ("smooth", BlendKind::Quadratic),
        ("cubic", BlendKind::Cubic),
        ("circular", BlendKind::Circular),
        ("exponential", BlendKind::Exponential),
        ("distance", BlendKind::Distance),
        ("chamfer", BlendKind::Chamfer),
        ("fillet", BlendKind::Fillet),
        ("stairs", BlendKind::Stairs),
    ];

    /// Returns the kind with this name; `None` for other words.
    pub(crate) fn from_word(word: &str) -> Option<Self> {
        Self::WORDS
            .iter()
            .find(|(name, _)| *name == word)
            .map(|(_, kind)| *kind)
    }

    /// Returns the names of the kinds, as a scene writes them.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        Self::WORDS.iter().map(|(name, _)| *name)
    }
}

/// A blend: `[0.2]`, `[chamfer, 0.3]`, `[stairs, 0.4, n: 4]`.
#[derive(Clone, Debug)]
pub(crate) struct BlendSpec {
    /// Profile of the blend.
    pub(crate) kind: BlendKind,
    /// Thickness of a smooth blend, radius of the other kinds.
    pub(crate) amount: ExprId,
    /// Number of stairs.
    pub(crate) steps: Option<ExprId>,
    /// Source span.
    pub(crate) span: Span,
}
