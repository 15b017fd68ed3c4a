//! The selector of view modes, with the controls of the slice plane and of the compared engine.

use super::number_box;
use super::state::WindowState;
use super::theme;
use super::widgets::{choice_button, grid};
use crate::inspect::slice::FrontSurfaces;
use crate::param_input::evaluate;
use crate::renderer::{SlicePlane, ViewMode};
use crate::session::{Event, Session};
use eframe::egui::{self, Slider, Ui};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::Mode;
use sdfc_vm::settings::ParamKind;

/// A view mode without its controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ViewKind {
    Mode(Mode),
    Slice,
    Slopes,
    SliceSlopes,
    Cells,
    Objects,
    Difference,
}

/// All view kinds with names and descriptions.
pub(super) const VIEW_KINDS: [(ViewKind, &str, &str); 15] = [
    (ViewKind::Mode(Mode::Shaded), "shaded", "the lit scene"),
    (
        ViewKind::Mode(Mode::Albedo),
        "albedo",
        "the fraction of light that surfaces reflect",
    ),
    (
        ViewKind::Mode(Mode::Normal),
        "normals",
        "the direction surfaces face: red, green and blue for x, y and z",
    ),
    (
        ViewKind::Mode(Mode::Depth),
        "depth",
        "the distance along the ray: near white, far black",
    ),
    (
        ViewKind::Mode(Mode::Steps),
        "steps",
        "the number of evaluations along the ray, as a heat map",
    ),
    (
        ViewKind::Mode(Mode::Edges),
        "edges",
        "lines where depth, direction or material change abruptly",
    ),
    (
        ViewKind::Mode(Mode::Id),
        "materials",
        "a color for each material",
    ),
    (
        ViewKind::Mode(Mode::Mask),
        "mask",
        "white where the scene is, black elsewhere",
    ),
    (
        ViewKind::Objects,
        "objects",
        "a color for each shape in the text; a click marks one",
    ),
    (
        ViewKind::Slice,
        "slice",
        "the field on a plane in the scene, with lines of equal distance",
    ),
    (
        ViewKind::Mode(Mode::Distance),
        "field",
        "the field on a plane through the camera's target, across the view",
    ),
    (
        ViewKind::Slopes,
        "slopes",
        "the slope of the field on surfaces: above its bound, or far below it",
    ),
    (
        ViewKind::SliceSlopes,
        "slice slopes",
        "the slope of the field on a plane in the scene",
    ),
    (
        ViewKind::Cells,
        "cells",
        "the length of the program in the cells of surfaces",
    ),
    (
        ViewKind::Difference,
        "difference",
        "the difference from the picture of another engine",
    ),
];

impl ViewKind {
    /// Returns the kind of a view mode.
    pub(super) fn from_view_mode(show: ViewMode) -> Self {
        match show {
            ViewMode::Mode(mode) => Self::Mode(mode),
            ViewMode::Slice(_) => Self::Slice,
            ViewMode::Slopes => Self::Slopes,
            ViewMode::SliceSlopes(_) => Self::SliceSlopes,
            ViewMode::Cells => Self::Cells,
            ViewMode::Objects => Self::Objects,
            ViewMode::Difference(_) => Self::Difference,
        }
    }

    /// Returns the view mode with the current settings of its controls.
    pub(super) fn show(self, state: &WindowState, session: &Session) -> ViewMode {
        let slice = state.slice.unwrap_or_else(|| first_slice(session));
        match self {
            Self::Mode(mode) => ViewMode::Mode(mode),
            Self::Slice => ViewMode::Slice(slice),
            Self::Slopes => ViewMode::Slopes,
            Self::SliceSlopes => ViewMode::SliceSlopes(slice),
            Self::Cells => ViewMode::Cells,
            Self::Objects => ViewMode::Objects,
            Self::Difference => {
                let others = other_engines(session);
                let chosen = state.other.filter(|other| others.contains(other));
                ViewMode::Difference(chosen.unwrap_or(others[0]))
            }
        }
    }
}

/// Returns the initial slice plane: through the centre, across z.
fn first_slice(session: &Session) -> SlicePlane {
    let (min, max) = coordinate_range(session, 2);
    SlicePlane {
        axis: 2,
        coordinate: (min + max) / 2.0,
        front: FrontSurfaces::Ghost,
    }
}

/// Returns the coordinate range of a slice plane along an axis: the scene's bounds plus a tenth. If they are
/// infinite, it is the camera's distance around the look-at point.
fn coordinate_range(session: &Session, axis: usize) -> (f64, f64) {
    let side = session.bounds().map(|b| (b.min[axis], b.max[axis]));
    if let Some((min, max)) = side.filter(|(a, b)| a.is_finite() && b.is_finite() && a < b) {
        let margin = 0.1 * (max - min);
        return (min - margin, max + margin);
    }
    let Some(camera) = session.camera() else {
        return (-1.0, 1.0);
    };
    let (look, distance) = (camera.view().look[axis], camera.distance());
    (look - distance, look + distance)
}

/// Returns the engines that the current one can be compared with.
fn other_engines(session: &Session) -> Vec<EngineKind> {
    let current_engine = session.facts().map(|facts| facts.engine);
    let is_available = |kind: &EngineKind| match kind {
        EngineKind::Cpu | EngineKind::Reference => true,
        EngineKind::Interp | EngineKind::Wgsl => session.devices().gpu,
    };
    EngineKind::ALL
        .into_iter()
        .filter(|kind| is_available(kind) && Some(*kind) != current_engine)
        .collect()
}

/// Shows all view kinds and the controls of the selected one.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    state: &mut WindowState,
    events: &mut Vec<Event>,
) {
    let current_kind = ViewKind::from_view_mode(session.show());
    ui.label(theme::heading("SHOWN"));
    ui.scope(|ui| {
        grid(
            ui,
            2,
            &VIEW_KINDS,
            |ui, (kind, name, description), width| {
                let button = choice_button(ui, name, *kind == current_kind, width);
                if button.on_hover_text(*description).clicked() {
                    events.push(Event::Show(kind.show(state, session)));
                }
            },
        );
    });
    match session.show() {
        ViewMode::Slice(slice_plane) | ViewMode::SliceSlopes(slice_plane) => {
            if let Some(changed) = plane(ui, session, slice_plane) {
                state.slice = Some(changed);
                events.push(Event::Show(current_kind.show(state, session)));
            }
        }
        ViewMode::Difference(other) => {
            ui.add_space(2.0);
            ui.scope(|ui| {
                grid(ui, 3, &other_engines(session), |ui, kind, width| {
                    if choice_button(ui, kind.name(), *kind == other, width).clicked() {
                        state.other = Some(*kind);
                        events.push(Event::Show(ViewMode::Difference(*kind)));
                    }
                });
            });
        }
        ViewMode::Mode(_) | ViewMode::Slopes | ViewMode::Cells | ViewMode::Objects => {}
    }
}

/// Shows the controls of the slice plane; returns the plane if it was moved.
fn plane(ui: &mut Ui, session: &Session, slice_plane: SlicePlane) -> Option<SlicePlane> {
    let mut moved = slice_plane;
    ui.add_space(2.0);
    ui.scope(|ui| {
        let axes = [(0, "across x"), (1, "y"), (2, "z")];
        grid(ui, 3, &axes, |ui, (axis, name), width| {
            if choice_button(ui, name, *axis == slice_plane.axis, width).clicked()
                && *axis != slice_plane.axis
            {
                let (min, max) = coordinate_range(session, *axis);
                moved.axis = *axis;
                moved.coordinate = (min + max) / 2.0;
            }
        });
    });
    let (min, max) = coordinate_range(session, moved.axis);
    let mut coordinate = moved.coordinate;
    let is_restored = number_box::is_escaped(ui.ctx());
    ui.spacing_mut().slider_width = (ui.available_width() - 66.0).max(40.0);
    let slider = Slider::new(&mut coordinate, min..=max)
        .smart_aim(false)
        .max_decimals(3)
        .update_while_editing(false)
        .custom_parser(|text| match is_restored {
            true => Some(slice_plane.coordinate),
            false => evaluate(text, ParamKind::Float, 1.0, None).ok(),
        })
        .clamping(egui::SliderClamping::Never);
    if ui.add(slider).changed() {
        moved.coordinate = coordinate;
    }
    let mut is_ghost = slice_plane.front == FrontSurfaces::Ghost;
    if ui.checkbox(&mut is_ghost, "see through surfaces").changed() {
        moved.front = if is_ghost {
            FrontSurfaces::Ghost
        } else {
            FrontSurfaces::Opaque
        };
    }
    (moved != slice_plane).then_some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_in_the_list_once() {
        for (index, (kind, name, _)) in VIEW_KINDS.iter().enumerate() {
            let is_duplicate = VIEW_KINDS[..index]
                .iter()
                .any(|(other, other_name, _)| other == kind || other_name == name);
            assert!(!is_duplicate, "{name}");
        }
        let all = [
            ViewMode::default(),
            ViewMode::Mode(Mode::Mask),
            ViewMode::Slopes,
            ViewMode::Cells,
            ViewMode::Objects,
            ViewMode::Difference(EngineKind::Wgsl),
        ];
        for show in all {
            assert!(
                VIEW_KINDS
                    .iter()
                    .any(|(kind, ..)| *kind == ViewKind::from_view_mode(show))
            );
        }
    }
}
