//! The scene that sdfc is measured on by itself: a smooth union of rounded boxes that fill a ball,
//! on a floor, with one light and its shadow.

use crate::model::Boxes;

const SETTINGS: &str = "\
camera { from: [1.5, 1.1, 2.9], look: [0, -0.06, 0], fov: 38deg }
light { dir: [-0.6, 1, 0.5], intensity: 3, shadow: soft(0.04) }
render { aa: 1 }
material clay { color: #d4703c }
material floor { color: #b9b4ab }
";

/// Its text.
pub(super) fn text(boxes: &Boxes) -> String {
    format!(
        "{SETTINGS}{}    .material(clay) | cylinder(r: 2, h: 0.1).translate(0, -1, 0).material(floor)\n",
        boxes.text()
    )
}

/// The same with a live param, the thickness of the last blend.
pub(super) fn with_param(boxes: &Boxes) -> String {
    let floor = "cylinder(r: 2, h: 0.1).translate(0, -1, 0)";
    format!(
        "{SETTINGS}param goo = 0.1 in 0.0..1.0;\n{}    .material(clay) |[goo] {floor}.material(floor)\n",
        boxes.text()
    )
}
