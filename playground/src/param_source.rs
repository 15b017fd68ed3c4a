//! Notation of param values in the scene text, and edits that replace them.
//!
//! A value keeps the author's unit and form: `60mm` becomes `72mm`, `#3aa6ff` another screen colour. The
//! surrounding text is unchanged.

use sdfc_compiler::scene::Scene;
use sdfc_lang::ast::{self, Expr, ExprKind, ItemKind, Unit};
use sdfc_lang::{FileId, Sources, Span, parse};
use sdfc_shaders::tone;
use sdfc_vm::settings::ParamKind;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The unit of a param's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitScale {
    /// The unit as the text writes it.
    pub unit: Unit,
    /// Size of the unit in scene units, radians or seconds.
    pub factor: f64,
}

/// Scale of bare numbers.
const NO_UNIT: UnitScale = UnitScale {
    unit: Unit::None,
    factor: 1.0,
};

/// Location and notation of a param's value.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamSource {
    /// Source range of the value.
    pub span: Span,
    /// Unit of the numbers.
    pub unit: UnitScale,
    /// Millimetres per scene unit.
    pub unit_mm: f64,
    /// True if the value is written as a screen colour, `#3aa6ff`.
    hex: bool,
}

/// Returns the notation of each param of a scene, in order; `None` if its declaration is not found.
pub fn param_sources(scene: &Scene, sources: &Sources) -> Vec<Option<ParamSource>> {
    let mut files: HashMap<FileId, Option<ast::File>> = HashMap::new();
    scene
        .params
        .iter()
        .map(|param| {
            let file_id = param.span.file;
            let syntax = files
                .entry(file_id)
                .or_insert_with(|| parse(sources, file_id).0);
            let declaration = syntax
                .as_ref()?
                .items
                .iter()
                .find_map(|item| match &item.kind {
                    ItemKind::Param(declaration) if declaration.name.span == param.span => {
                        Some(declaration)
                    }
                    _ => None,
                })?;
            let range = declaration.range.as_ref().zip(param.range);
            // A zero does not determine the size of its unit; an end of the range may.
            let literals = [
                Some((&declaration.value, param.default.first().copied())),
                range.map(|(range, values)| (&range.end, Some(values.1))),
                range.map(|(range, values)| (&range.start, Some(values.0))),
            ];
            let unit = literals
                .into_iter()
                .flatten()
                .find_map(|(expr, value)| unit_scale(expr, value?))
                .unwrap_or(NO_UNIT);
            Some(ParamSource {
                span: declaration.value.span,
                unit,
                unit_mm: scene.unit_mm,
                hex: matches!(declaration.value.kind, ExprKind::Color(_)),
            })
        })
        .collect()
}

/// Returns the unit of a literal that has this value in scene units.
fn unit_scale(expr: &Expr, value: f64) -> Option<UnitScale> {
    let (number, sign) = match &expr.kind {
        ExprKind::Number(number) => (number, 1.0),
        ExprKind::Unary(unary) => match &unary.operand.kind {
            ExprKind::Number(number) => (number, -1.0),
            _ => return None,
        },
        ExprKind::List(items) => return unit_scale(items.first()?, value),
        ExprKind::Paren(inner) => return unit_scale(inner, value),
        _ => return None,
    };
    let size = sign * number.value.to_f64();
    let factor = match number.unit {
        Unit::None => 1.0,
        _ if size == 0.0 || value == 0.0 => return None,
        _ => value / size,
    };
    (factor.is_finite() && factor > 0.0).then_some(UnitScale {
        unit: number.unit,
        factor,
    })
}

/// Formats a value in the notation of the language.
pub fn text(kind: ParamKind, value: &[f64], source: Option<&ParamSource>) -> String {
    let unit = source.map_or(NO_UNIT, |source| source.unit);
    let unit = match (kind, unit.unit) {
        (ParamKind::Angle, Unit::None) => UnitScale {
            unit: Unit::Deg,
            factor: 1_f64.to_radians(),
        },
        (ParamKind::Time, Unit::None) => UnitScale {
            unit: Unit::S,
            factor: 1.0,
        },
        _ => unit,
    };
    let number = |value: &f64| format_number(kind, value / unit.factor, unit.unit);
    match (kind, value) {
        (ParamKind::Bool, [value]) => (*value != 0.0).to_string(),
        (ParamKind::Color, [r, g, b]) => {
            let bytes = srgb([*r, *g, *b]);
            let [x, y, z] = bytes.map(|byte| format!("{byte:02x}"));
            if source.is_none_or(|source| source.hex) {
                format!("#{x}{y}{z}")
            } else {
                let [r, g, b] = [r, g, b].map(|v| format_short(*v));
                format!("rgb({r}, {g}, {b})")
            }
        }
        (_, [value]) => number(value),
        (_, values) => {
            let texts: Vec<String> = values.iter().map(number).collect();
            format!("[{}]", texts.join(", "))
        }
    }
}

/// Converts a linear colour to sRGB bytes.
fn srgb([r, g, b]: [f64; 3]) -> [u8; 3] {
    let color = tone::encode::<f32>(V3::new(r as f32, g as f32, b as f32));
    [color.x, color.y, color.z].map(|channel| tone::to_byte(channel) as u8)
}

/// Formats a number with its unit. Only integer params are written without a decimal point, so that the
/// type of the literal is kept.
fn format_number(kind: ParamKind, value: f64, unit: Unit) -> String {
    let mut digits = format_short(value);
    let is_integer = !digits.contains(['.', 'e']);
    if is_integer && kind != ParamKind::Int && unit == Unit::None {
        digits.push_str(".0");
    }
    digits + unit.suffix()
}

/// Formats a number with at most seven digits, the precision of `f32`. Dividing by the size of a unit
/// leaves spurious digits.
fn format_short(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    format!("{rounded}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_compiler::elaborate::{Options, elaborate};

    const SCENE: &str = "/// How blended.
param goo = 0.35 in 0.0..1.0;
param count = 6 in 1..=24;
param tint: color = #3aa6ff;
param dark: color = rgb(0.1, 0.2, 0.3);
param width = 60mm in 30mm..120mm by 1mm;
param turn = 0deg in -90deg..=90deg;
param low = -2 in -4..4;
param on = true;
param shift: vec3 = [0.0, 1.5, 2];
sphere(width).rotate(turn, Y).translate(shift)
";

    fn scene() -> (Scene, Sources) {
        let mut sources = Sources::new();
        let syntax = sources.add("a.sdf", SCENE);
        let (scene, found) = elaborate(&mut sources, syntax, &Options::default());
        let errors: Vec<_> = found.iter().map(|found| &found.message).collect();
        (scene.unwrap_or_else(|| panic!("{errors:?}")), sources)
    }

    #[test]
    fn values_are_written_as_their_author_did() {
        let (scene, sources) = scene();
        let source = param_sources(&scene, &sources);
        let text_of = |name: &str, value: &[f64]| {
            let index = scene.params.iter().position(|param| param.name == name);
            let index = index.unwrap();
            text(scene.params[index].kind, value, source[index].as_ref())
        };
        let default = |name: &str| {
            let param = scene.params.iter().find(|param| param.name == name);
            text_of(name, &param.unwrap().default)
        };
        for (name, as_in_the_text) in [
            ("goo", "0.35"),
            ("count", "6"),
            ("tint", "#3aa6ff"),
            ("dark", "rgb(0.1, 0.2, 0.3)"),
            ("width", "60mm"),
            ("turn", "0deg"),
            ("low", "-2"),
            ("on", "true"),
            ("shift", "[0.0, 1.5, 2.0]"),
        ] {
            assert_eq!(default(name), as_in_the_text, "{name}");
        }
        let width = scene.params.iter().find(|param| param.name == "width");
        let millimetre = width.unwrap().default[0] / 60.0;
        assert_eq!(text_of("width", &[72.5 * millimetre]), "72.5mm");
        assert_eq!(text_of("turn", &[-std::f64::consts::FRAC_PI_4]), "-45deg");
        assert_eq!(text_of("goo", &[1.0]), "1.0");
        assert_eq!(text_of("tint", &[1.0, 0.0, 0.0]), "#ff0000");
        assert_eq!(text_of("on", &[0.0]), "false");
    }

    #[test]
    fn each_value_is_found_where_it_stands() {
        let (scene, sources) = scene();
        for (param, source) in scene.params.iter().zip(param_sources(&scene, &sources)) {
            let source = source.unwrap();
            let value = sources.slice(source.span);
            let line = SCENE
                .lines()
                .find(|line| line.starts_with(&format!("param {}", param.name)));
            assert!(line.unwrap().contains(value), "{}: {value}", param.name);
        }
    }
}
