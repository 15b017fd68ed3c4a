//! The label of the engine that drew the picture.

use crate::renderer::ViewMode;
use crate::session::{EngineChoice, Session};
use sdfc_runtime::engine::EngineKind;

/// Names the engine that drew the picture, and the chosen one if it is another.
pub(super) fn drawn_by(session: &Session, engine: EngineKind) -> String {
    let compared = match session.facts().map(|facts| facts.show) {
        Some(ViewMode::Difference(other)) => format!("drawn by {engine} and {other}"),
        _ => format!("drawn by {engine}"),
    };
    match session.engine_choice() {
        EngineChoice::Only(chosen) if chosen != engine => match session.preparing() {
            Some(preparing) if preparing == chosen => {
                format!("{compared} until {chosen} is compiled")
            }
            _ => format!("{compared} instead of {chosen}"),
        },
        _ => compared,
    }
}
