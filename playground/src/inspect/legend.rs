//! Legends of the engines' own modes: what the colours of a picture stand for, with units.

use super::ink::bytes;
use sdfc_runtime::render::{Image, Mode};
use sdfc_shaders::views;
use sdfc_vm::vector::V3;
use std::collections::BTreeMap;

/// Colours with the texts that explain them.
pub type Legend = Vec<([u8; 4], String)>;

/// Number of depths in a legend.
const DEPTHS: usize = 5;
/// Maximum number of materials in a legend.
const MAX_MATERIALS: usize = 16;

/// Returns the legend of a mode; empty if its colours are those of light. `rgba` are the bytes of the
/// picture, `materials` the names by number.
pub fn for_mode(mode: Mode, image: &Image, rgba: &[u8], materials: &[String]) -> Legend {
    let named = |color, text: &str| (color, text.to_owned());
    match mode {
        Mode::Depth => depths(image, rgba),
        Mode::Normal => axes(),
        Mode::Id => shown_materials(image, rgba, materials),
        Mode::Albedo => vec![
            named([0, 0, 0, 255], "no light is reflected"),
            named([255; 4], "all light is reflected"),
        ],
        Mode::Mask => vec![
            named([255; 4], "the scene"),
            named([0, 0, 0, 255], "nothing"),
        ],
        Mode::Shaded | Mode::Steps | Mode::Edges | Mode::Distance => Vec::new(),
    }
}

/// Returns depths from the nearest to the farthest one, in the colours of the picture.
fn depths(image: &Image, rgba: &[u8]) -> Legend {
    let mut hits: Vec<(f32, [u8; 4])> = image
        .depth
        .iter()
        .zip(rgba.as_chunks().0)
        .filter(|(depth, _)| depth.is_finite())
        .map(|(depth, color)| (*depth, *color))
        .collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some((near, _)), Some((far, _))) = (hits.first(), hits.last()) else {
        return Vec::new();
    };
    let step = (far - near) / (DEPTHS - 1) as f32;
    let count = if step > 0.0 { DEPTHS } else { 1 };
    let entries = (0..count).map(|i| {
        let depth = near + step * i as f32;
        let index = hits.partition_point(|(other, _)| *other < depth);
        let (depth, color) = hits[index.min(hits.len() - 1)];
        (color, format!("{depth:.3} units from the camera"))
    });
    let mut legend: Legend = entries.collect();
    // Several entries are the same surface where depths have gaps.
    legend.dedup();
    legend
}

/// Returns the colours of the six directions along the axes.
fn axes() -> Legend {
    let directions = [
        (V3::new(1.0, 0.0, 0.0), "+x"),
        (V3::new(-1.0, 0.0, 0.0), "-x"),
        (V3::new(0.0, 1.0, 0.0), "+y"),
        (V3::new(0.0, -1.0, 0.0), "-y"),
        (V3::new(0.0, 0.0, 1.0), "+z"),
        (V3::new(0.0, 0.0, -1.0), "-z"),
    ];
    let entry = |(direction, name): (V3<f32>, &str)| {
        let color = bytes(views::direction_color::<f32>(direction));
        (color, format!("faces {name}"))
    };
    directions.map(entry).into()
}

/// Returns the materials of a picture by name, in its colours.
fn shown_materials(image: &Image, rgba: &[u8], materials: &[String]) -> Legend {
    let mut shown = BTreeMap::new();
    let pixels = image.depth.iter().zip(&image.id).zip(rgba.as_chunks().0);
    for ((_, id), color) in pixels.filter(|((depth, _), _)| depth.is_finite()) {
        shown.entry(*id).or_insert(*color);
    }
    let entry = |(id, color): (&u32, &[u8; 4])| {
        let name = materials.get(*id as usize).filter(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("material {id}, without a name"), Clone::clone);
        (*color, name)
    };
    let mut legend: Legend = shown.iter().take(MAX_MATERIALS).map(entry).collect();
    if shown.len() > MAX_MATERIALS {
        let text = format!("and {} more materials", shown.len() - MAX_MATERIALS);
        legend.push(([0; 4], text));
    }
    legend
}

/// Returns the colours of the field's signs on a slice with this distance between lines.
pub fn signs(spacing: f32) -> Legend {
    // A quarter of a spacing lies between the lines.
    let color = |field: f32| bytes(views::distance_color::<f32>(field, spacing, spacing * 1e-3));
    vec![
        (color(-0.25 * spacing), "negative: inside".to_owned()),
        (color(0.25 * spacing), "positive: outside".to_owned()),
    ]
}
