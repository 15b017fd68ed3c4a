//! What can be seen, with its names, and the controls of what has some: the plane of a slice, the
//! other engine of a difference.

use super::desk::Desk;
use super::side::{choice, grid};
use super::theme;
use crate::painter::{Show, SliceAt};
use crate::seeing::slice::Front;
use crate::session::{Event, Session};
use eframe::egui::{self, Slider, Ui};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::Mode;

/// Something that can be seen, but for its controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Mode(Mode),
    Slice,
    Slopes,
    SliceSlopes,
    Cells,
    Objects,
    Difference,
}

/// All kinds, with their names and what they mean.
pub(super) const KINDS: [(Kind, &str, &str); 15] = [
    (Kind::Mode(Mode::Shaded), "shaded", "the lit scene"),
    (
        Kind::Mode(Mode::Albedo),
        "albedo",
        "the share of light that surfaces reflect",
    ),
    (
        Kind::Mode(Mode::Normal),
        "normals",
        "the direction surfaces face: red, green and blue for x, y and z",
    ),
    (
        Kind::Mode(Mode::Depth),
        "depth",
        "the distance along the ray: near white, far black",
    ),
    (
        Kind::Mode(Mode::Steps),
        "steps",
        "how often the field was evaluated along the ray, as a heat map",
    ),
    (
        Kind::Mode(Mode::Edges),
        "edges",
        "lines where depth, direction or material jump",
    ),
    (
        Kind::Mode(Mode::Id),
        "materials",
        "a colour for each material",
    ),
    (
        Kind::Mode(Mode::Mask),
        "mask",
        "white where the scene is, black elsewhere",
    ),
    (
        Kind::Objects,
        "objects",
        "a colour for each shape in the text; a click marks one",
    ),
    (
        Kind::Slice,
        "slice",
        "the field on a plane in the scene, with lines of equal distance",
    ),
    (
        Kind::Mode(Mode::Distance),
        "field",
        "the field on a plane through what the camera looks at, across the view",
    ),
    (
        Kind::Slopes,
        "slopes",
        "where the field is steeper on surfaces than its bound, and where it is much flatter",
    ),
    (
        Kind::SliceSlopes,
        "slice slopes",
        "the same on a plane in the scene",
    ),
    (
        Kind::Cells,
        "cells",
        "how long the program is in the cells that surfaces lie in",
    ),
    (
        Kind::Difference,
        "difference",
        "how the picture of another engine differs",
    ),
];

impl Kind {
    /// The kind of what is seen.
    pub(super) fn of(show: Show) -> Self {
        match show {
            Show::Mode(mode) => Self::Mode(mode),
            Show::Slice(_) => Self::Slice,
            Show::Slopes => Self::Slopes,
            Show::SliceSlopes(_) => Self::SliceSlopes,
            Show::Cells => Self::Cells,
            Show::Objects => Self::Objects,
            Show::Difference(_) => Self::Difference,
        }
    }

    /// All of it, with its controls as they are.
    pub(super) fn show(self, desk: &Desk, session: &Session) -> Show {
        let slice = desk.slice.unwrap_or_else(|| first_slice(session));
        match self {
            Self::Mode(mode) => Show::Mode(mode),
            Self::Slice => Show::Slice(slice),
            Self::Slopes => Show::Slopes,
            Self::SliceSlopes => Show::SliceSlopes(slice),
            Self::Cells => Show::Cells,
            Self::Objects => Show::Objects,
            Self::Difference => {
                let others = others(session);
                let wanted = desk.other.filter(|other| others.contains(other));
                Show::Difference(wanted.unwrap_or(others[0]))
            }
        }
    }
}

/// The plane that a slice begins with: through the middle, across the way that z or depth goes.
fn first_slice(session: &Session) -> SliceAt {
    let (least, most) = reach(session, 2);
    SliceAt {
        axis: 2,
        at: (least + most) / 2.0,
        front: Front::Ghost,
    }
}

/// From where to where a slice can be moved along an axis: the scene's bounds and a tenth more, or what
/// the camera looks at and as much around it.
fn reach(session: &Session, axis: usize) -> (f64, f64) {
    let side = session.bounds().map(|b| (b.min[axis], b.max[axis]));
    if let Some((least, most)) = side.filter(|(a, b)| a.is_finite() && b.is_finite() && a < b) {
        let more = 0.1 * (most - least);
        return (least - more, most + more);
    }
    let Some(camera) = session.camera() else {
        return (-1.0, 1.0);
    };
    let (look, way) = (camera.view().look[axis], camera.distance());
    (look - way, look + way)
}

/// The engines that the one that draws can be compared with.
fn others(session: &Session) -> Vec<EngineKind> {
    let draws = session.facts().map(|facts| facts.engine);
    let runs = |kind: &EngineKind| match kind {
        EngineKind::Cpu | EngineKind::Reference => true,
        EngineKind::Interp | EngineKind::Wgsl => session.devices().gpu,
    };
    EngineKind::ALL
        .into_iter()
        .filter(|kind| runs(kind) && Some(*kind) != draws)
        .collect()
}

/// Shows all kinds, and the controls of the one that is seen.
pub(super) fn show(ui: &mut Ui, session: &Session, desk: &mut Desk, events: &mut Vec<Event>) {
    let seen = Kind::of(session.show());
    ui.label(theme::heading("SHOWN"));
    ui.scope(|ui| {
        grid(ui, 2, &KINDS, |ui, (kind, name, says), width| {
            let button = choice(ui, name, *kind == seen, width);
            if button.on_hover_text(*says).clicked() {
                events.push(Event::Show(kind.show(desk, session)));
            }
        });
    });
    match session.show() {
        Show::Slice(at) | Show::SliceSlopes(at) => {
            if let Some(changed) = plane(ui, session, at) {
                desk.slice = Some(changed);
                events.push(Event::Show(seen.show(desk, session)));
            }
        }
        Show::Difference(other) => {
            ui.add_space(2.0);
            ui.scope(|ui| {
                grid(ui, 3, &others(session), |ui, kind, width| {
                    if choice(ui, kind.name(), *kind == other, width).clicked() {
                        desk.other = Some(*kind);
                        events.push(Event::Show(Show::Difference(*kind)));
                    }
                });
            });
        }
        Show::Mode(_) | Show::Slopes | Show::Cells | Show::Objects => {}
    }
}

/// The controls of a slice's plane; the plane, if they moved it.
fn plane(ui: &mut Ui, session: &Session, at: SliceAt) -> Option<SliceAt> {
    let mut now = at;
    ui.add_space(2.0);
    ui.scope(|ui| {
        let axes = [(0, "across x"), (1, "y"), (2, "z")];
        grid(ui, 3, &axes, |ui, (axis, name), width| {
            if choice(ui, name, *axis == at.axis, width).clicked() && *axis != at.axis {
                let (least, most) = reach(session, *axis);
                now.axis = *axis;
                now.at = (least + most) / 2.0;
            }
        });
    });
    let (least, most) = reach(session, now.axis);
    let mut place = now.at;
    ui.spacing_mut().slider_width = (ui.available_width() - 66.0).max(40.0);
    let slider = Slider::new(&mut place, least..=most)
        .smart_aim(false)
        .max_decimals(3)
        .clamping(egui::SliderClamping::Never);
    if ui.add(slider).changed() {
        now.at = place;
    }
    let mut through = at.front == Front::Ghost;
    if ui.checkbox(&mut through, "see through surfaces").changed() {
        now.front = if through { Front::Ghost } else { Front::Hides };
    }
    (now != at).then_some(now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_in_the_list_once() {
        for (at, (kind, name, _)) in KINDS.iter().enumerate() {
            let again = KINDS[..at]
                .iter()
                .any(|(other, other_name, _)| other == kind || other_name == name);
            assert!(!again, "{name}");
        }
        let all = [
            Show::default(),
            Show::Mode(Mode::Mask),
            Show::Slopes,
            Show::Cells,
            Show::Objects,
            Show::Difference(EngineKind::Wgsl),
        ];
        for show in all {
            assert!(KINDS.iter().any(|(kind, ..)| *kind == Kind::of(show)));
        }
    }
}
