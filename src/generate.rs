//! Scenes of any number of primitives, to see how cost grows with it: the output of `sdfc gen`.
//!
//! A family of scenes ([`Family`]) fills the same part of the picture for any number of primitives: more of
//! them are smaller. Every primitive is in the text with its own numbers, as in a modelled scene, so that
//! parsing, compiling and editing can be measured, too. The same options give the same text.

mod boxes;
mod city;
mod molecule;
mod random;
mod spheres;

use std::f64::consts::PI;
use std::fmt::Write;

/// Family of generated scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Family {
    /// Spheres that fill a sphere.
    Spheres,
    /// Rounded, rotated boxes that fill a ring.
    Boxes,
    /// Towers of several forms on a grid of streets.
    City,
    /// Atoms and the bonds between them.
    Molecule,
}

/// Options of a generated scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GenerateOptions {
    /// Number of primitives besides the ground below them; at least one.
    pub(crate) count: u32,
    /// Seed: another one gives another scene of the same family.
    pub(crate) seed: u64,
    /// Thickness of the smooth union of neighbours, as a fraction of a primitive's size; 0 for a hard union.
    pub(crate) blend: f64,
}

/// The parts of a scene of a family.
struct Draft {
    /// Camera, lights, sky and the material of the floor.
    settings: &'static str,
    /// The functions that primitives may call: each begins with `fn`, its name and `(`.
    functions: &'static [&'static str],
    /// The materials: a name and its colour.
    palette: &'static [(&'static str, &'static str)],
    /// The primitives.
    primitives: Vec<Primitive>,
    /// Typical size of a primitive.
    size: f64,
    /// The ground.
    ground: String,
}

/// A positioned primitive.
struct Primitive {
    /// Index of its material in the palette.
    material: usize,
    /// Its expression.
    text: String,
}

/// Returns the text of a scene.
pub(crate) fn scene(family: Family, options: &GenerateOptions) -> String {
    let draft = match family {
        Family::Spheres => spheres::draft(options),
        Family::Boxes => boxes::draft(options),
        Family::City => city::draft(options),
        Family::Molecule => molecule::draft(options),
    };
    assert_eq!(draft.primitives.len(), options.count as usize);
    let mut text = format!("// {}\n{}", title(family, options), draft.settings);
    for function in functions(&draft) {
        let _ = writeln!(text, "{function}");
    }
    text.push('\n');
    let groups = groups(&draft, &mut text);
    let thickness = options.blend * draft.size;
    let smooth = match thickness > 0.0 {
        true => format!(", smooth: {}", number(thickness, thickness)),
        false => String::new(),
    };
    let unions: Vec<String> = groups
        .iter()
        .map(|name| format!("union({name}_parts{smooth}).material({name})"))
        .collect();
    let shape = match unions.as_slice() {
        [union] => union.clone(),
        several => format!("union([{}]{smooth})", several.join(", ")),
    };
    let _ = write!(text, "\n{shape} | {}.material(floor)\n", draft.ground);
    text
}

/// Returns the command that generates this scene.
fn title(family: Family, options: &GenerateOptions) -> String {
    let name = match family {
        Family::Spheres => "spheres",
        Family::Boxes => "boxes",
        Family::City => "city",
        Family::Molecule => "molecule",
    };
    let GenerateOptions { count, seed, blend } = options;
    format!("sdfc gen {name} --count {count} --seed {seed} --blend {blend}")
}

/// Returns the used functions.
fn functions(draft: &Draft) -> impl Iterator<Item = &'static str> {
    draft.functions.iter().copied().filter(|function| {
        let call = function.trim_start_matches("fn ");
        let call = &call[..=call.find('(').unwrap_or(0)];
        let mut texts = draft.primitives.iter().map(|primitive| &primitive.text);
        texts.any(|text| text.starts_with(call))
    })
}

/// Writes the used materials, and the primitives of each as a list; returns their names.
fn groups(draft: &Draft, text: &mut String) -> Vec<&'static str> {
    let mut used = Vec::new();
    for (index, (name, color)) in draft.palette.iter().enumerate() {
        let members = draft.primitives.iter().filter(|p| p.material == index);
        let members: Vec<&str> = members.map(|member| member.text.as_str()).collect();
        if members.is_empty() {
            continue;
        }
        let _ = writeln!(text, "material {name} {{ color: {color}, roughness: 0.5 }}");
        let _ = writeln!(text, "let {name}_parts = [");
        for member in members {
            let _ = writeln!(text, "    {member},");
        }
        text.push_str("];\n");
        used.push(*name);
    }
    used
}

/// Returns the distance between neighbours if `count` primitives fill a volume evenly.
fn spacing(volume: f64, count: u32) -> f64 {
    (volume / f64::from(count)).cbrt()
}

/// Returns the volume of a sphere.
fn sphere_volume(radius: f64) -> f64 {
    4.0 / 3.0 * PI * radius.powi(3)
}

/// Formats a number with the digits that are visible at this size.
fn number(value: f64, size: f64) -> String {
    let digits = (2.5 - size.log10()).ceil().clamp(2.0, 12.0) as usize;
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}
