//! Values of flags by their names.

use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Returns a parser of the names in a list.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    list: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let names = list.iter().map(|(name, _)| *name);
    PossibleValuesParser::new(names).try_map(|word| {
        let entry = list.iter().find(|(name, _)| *name == word);
        entry.map(|(_, value)| *value).ok_or("an unknown name")
    })
}
