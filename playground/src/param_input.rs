//! Numbers typed for params: expressions of the language with units, such as `9cm` or `2 * 30mm`.

use crate::param_source::ParamSource;
use sdfc_compiler::elaborate::{Options, elaborate};
use sdfc_compiler::scene::Scene;
use sdfc_lang::ast::Unit;
use sdfc_lang::{Diagnostic, Sources};
use sdfc_vm::settings::ParamKind;

/// Millimetres per scene unit of a scene without a `scene` block.
const DEFAULT_UNIT_MM: f64 = 1000.0;

/// Evaluates a typed expression. Bare numbers are multiples of `factor`; the result is in scene units,
/// radians or seconds.
///
/// # Errors
///
/// A message if the text is not a number of the param's quantity.
pub fn evaluate(
    text: &str,
    kind: ParamKind,
    factor: f64,
    source: Option<&ParamSource>,
) -> Result<f64, String> {
    let text = text.trim();
    let (typed_kind, value) = typed_value(text)?;
    let unit_mm = source.map_or(DEFAULT_UNIT_MM, |source| source.unit_mm);
    let scale = match typed_kind {
        ParamKind::Float | ParamKind::Int => factor,
        typed_kind if typed_kind != quantity(kind, source) => {
            let [typed, required] = [typed_kind, quantity(kind, source)].map(noun);
            return Err(format!("`{text}` is {typed}, and the param is {required}"));
        }
        ParamKind::Length => DEFAULT_UNIT_MM / unit_mm,
        _ => 1.0,
    };
    let value = value * scale;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("`{text}` is not finite"))
    }
}

/// Evaluates an expression in metres, radians or seconds.
fn typed_value(text: &str) -> Result<(ParamKind, f64), String> {
    let not_a_number = || format!("`{text}` is not a number");
    if text.contains([';', '\n']) {
        return Err(not_a_number());
    }
    let mut sources = Sources::new();
    let file = sources.add("typed", format!("param typed = {text};\nsphere(1)\n"));
    let (scene, diagnostics) = elaborate(&mut sources, file, &Options::default());
    let Some(scene) = scene else {
        let error = diagnostics.iter().find(|found| found.is_error());
        let reason = error.map_or("", |error: &Diagnostic| error.message.as_str());
        return Err(format!("{}: {reason}", not_a_number()));
    };
    match scene.params.as_slice() {
        [param] if is_number(param.kind) => Ok((param.kind, only_number(&scene))),
        _ => Err(not_a_number()),
    }
}

fn only_number(scene: &Scene) -> f64 {
    let values = scene.params.first().and_then(|param| param.default.first());
    values.copied().unwrap_or(f64::NAN)
}

fn is_number(kind: ParamKind) -> bool {
    use ParamKind::{Angle, Float, Int, Length, Time};
    matches!(kind, Float | Int | Length | Angle | Time)
}

/// Returns the quantity of a param: that of its kind, or of the unit in its text.
fn quantity(kind: ParamKind, source: Option<&ParamSource>) -> ParamKind {
    let unit = source.map_or(Unit::None, |source| source.unit.unit);
    match (kind, unit) {
        (ParamKind::Length | ParamKind::Angle | ParamKind::Time, _) | (_, Unit::None) => kind,
        (_, Unit::Deg | Unit::Turn | Unit::Rad) => ParamKind::Angle,
        (_, Unit::S | Unit::Ms) => ParamKind::Time,
        (_, Unit::Mm | Unit::Cm | Unit::M | Unit::In) => ParamKind::Length,
    }
}

fn noun(kind: ParamKind) -> &'static str {
    match kind {
        ParamKind::Length => "a length",
        ParamKind::Angle => "an angle",
        ParamKind::Time => "a time",
        _ => "a plain number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::param_source::param_sources;

    /// Evaluates a text typed for the only param of a scene; the result is in the author's unit.
    fn typed(scene_text: &str, text: &str) -> Result<f64, String> {
        let mut sources = Sources::new();
        let file = sources.add("a.sdf", scene_text);
        let (scene, _) = elaborate(&mut sources, file, &Options::default());
        let scene = scene.expect("a scene");
        let source = param_sources(&scene, &sources).remove(0).expect("its text");
        let factor = source.unit.factor;
        let value = evaluate(text, scene.params[0].kind, factor, Some(&source))?;
        Ok((value / factor * 1e9).round() / 1e9)
    }

    #[test]
    fn typed_numbers_have_units_and_operators() {
        let width = "param width = 60mm in 30mm..120mm;\nsphere(width)\n";
        assert_eq!(typed(width, "72"), Ok(72.0));
        assert_eq!(typed(width, " 9cm "), Ok(90.0));
        assert_eq!(typed(width, "2 * 30mm + 1cm"), Ok(70.0));
        assert_eq!(typed(width, "(1 + 2) * 20"), Ok(60.0));
        let inches = format!("scene {{ units: inch }}\n{width}");
        assert_eq!(typed(&inches, "2in"), Ok(50.8));
        let turn = "param turn = 45deg;\nbox(1).rotate(turn, Y)\n";
        assert_eq!(typed(turn, "0.5turn"), Ok(180.0));
        assert_eq!(typed(turn, "-30"), Ok(-30.0));
    }

    #[test]
    fn other_texts_are_refused_with_a_reason() {
        let width = "param width = 60mm;\nsphere(width)\n";
        for (text, reason) in [
            ("9deg", "`9deg` is an angle, and the param is a length"),
            ("", "`` is not a number"),
            ("9 cm cm", "`9 cm cm` is not a number"),
            ("true", "`true` is not a number"),
            ("1; sphere(2)", "`1; sphere(2)` is not a number"),
        ] {
            let problem = typed(width, text).expect_err(text);
            assert!(problem.starts_with(reason), "{problem}");
        }
        let plain = "param r = 1.0;\nsphere(r)\n";
        let problem = typed(plain, "9cm").expect_err("a length");
        assert_eq!(
            problem,
            "`9cm` is a length, and the param is a plain number"
        );
    }
}
