//! The scene for measurements of sdfc by itself.
//!
//! A smooth union of rounded boxes fills a sphere, on a floor, with one light and its shadow.

use crate::model::BoxUnion;

const SCENE_SETTINGS: &str = "\
camera { from: [1.5, 1.1, 2.9], look: [0, -0.06, 0], fov: 38deg }
light { dir: [-0.6, 1, 0.5], intensity: 3, shadow: soft(0.04) }
render { aa: 1 }
material clay { color: #d4703c }
material floor { color: #b9b4ab }
";

/// Returns the text of the scene.
pub(super) fn text(boxes: &BoxUnion) -> String {
    format!(
        "{SCENE_SETTINGS}{}    .material(clay) | cylinder(r: 2, h: 0.1).translate(0, -1, 0).material(floor)\n",
        boxes.text()
    )
}

/// Returns the text with a live parameter, the thickness of the last blend.
pub(super) fn with_param(boxes: &BoxUnion) -> String {
    let floor = "cylinder(r: 2, h: 0.1).translate(0, -1, 0)";
    format!(
        "{SCENE_SETTINGS}param goo = 0.1 in 0.0..1.0;\n{}    .material(clay) |[goo] {floor}.material(floor)\n",
        boxes.text()
    )
}
