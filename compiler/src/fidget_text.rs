//! `.vm` files: the plain text of Fidget and libfive, with one clause per line: `_name operation
//! operands`.
//!
//! The last clause is the result, negative inside. A file that does not read `var-z` is a 2-D shape. The part of space
//! that is shown follows from the values (`region.rs`).

pub(crate) mod clauses;
mod region;
mod truth;
pub(crate) mod write;

use crate::analysis::definedness::outside_where_undefined;
use crate::analysis::param_ranges::ParamRanges;
use crate::elaborate::{NoFiles, Options, elaborate, format_short};
use crate::expression::{ExprId, Expressions};
use crate::scene::{Scene, SceneRef, Shape, ShapeId, ShapeKind};
use clauses::read_clauses;
use region::{ShownRegion, shown_region};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use sdfc_vm::table::Op;

/// Parses the text of Fidget to a scene.
pub fn parse_fidget_text(sources: &Sources, file: FileId) -> (Option<Scene>, Vec<Diagnostic>) {
    // The language defines the default settings of a scene.
    let mut template = Sources::new();
    let sphere = template.add("template", "sphere(1)".to_owned());
    let options = Options {
        overrides: Vec::new(),
        time: 0.0,
        loader: &NoFiles,
    };
    let (Some(mut scene), _) = elaborate(&mut template, sphere, &options) else {
        unreachable!("the template is a scene");
    };
    let field = match read_clauses(sources, file, &mut scene.expressions) {
        Ok(field) => field,
        Err(errors) => return (None, errors),
    };
    let ranges = ParamRanges::for_scene(SceneRef::from(&scene));
    let value = outside_where_undefined(&mut scene.expressions, field.value, &ranges);
    let is_2d = field.is_2d;
    let shown = shown_region(&scene.expressions, value, is_2d);
    let value = cut_to(&shown, value, &mut scene.expressions);
    let kind = ShapeKind::Field {
        value,
        slope: None,
        region: shown.bounds,
    };
    scene.shapes = vec![Shape {
        kind,
        is_2d,
        name: String::new(),
        span: field.span,
    }];
    scene.root = Some(ShapeId(0));
    scene.is_2d = is_2d;
    if is_2d {
        scene.render.size = [1024, 1024];
    }
    (
        Some(scene),
        cut_warning(&shown, field.span).into_iter().collect(),
    )
}

/// Returns a field that is cut where the solid continues beyond the shown region.
fn cut_to(shown: &ShownRegion, value: ExprId, expressions: &mut Expressions) -> ExprId {
    let axes = (0..3).filter(|&axis| shown.is_cut[axis]);
    axes.fold(value, |value, axis| {
        let coordinate = expressions.coordinate(axis as u8);
        let low = expressions.constant(shown.bounds.min[axis]);
        let high = expressions.constant(shown.bounds.max[axis]);
        let below = expressions.call(Op::Sub, &[low, coordinate]);
        let above = expressions.call(Op::Sub, &[coordinate, high]);
        let outside = expressions.call(Op::Intersection, &[below, above]);
        expressions.call(Op::Intersection, &[value, outside])
    })
}

/// Reports a solid that is cut, since it continues beyond the shown region.
fn cut_warning(shown: &ShownRegion, span: Span) -> Option<Diagnostic> {
    let axes = (0..3).filter(|&axis| shown.is_cut[axis]);
    let parts: Vec<String> = axes
        .map(|axis| {
            let ends = [shown.bounds.min[axis], shown.bounds.max[axis]];
            // Added to zero, no end is a negative zero.
            let [low, high] = ends.map(|end| format_short(end + 0.0));
            format!("{} from {low} to {high}", ["x", "y", "z"][axis])
        })
        .collect();
    (!parts.is_empty()).then(|| {
        Diagnostic::warning(codes::W0503, span, "the solid has no end that was found")
            .primary(format!("it is shown in a box: {}", parts.join(", ")))
            .help("`import \"this.vm\" as model;` in a scene has all of it: `model & box(40)`")
    })
}

#[cfg(test)]
mod tests {
    use super::region::field;
    use super::*;
    use sdfc_vm::bounds::Bounds;

    /// Returns the value of the last clause of a text at a point, also where the solid is not shown.
    fn value(text: &str, point: [f64; 3]) -> f64 {
        let mut sources = Sources::new();
        let file = sources.add("part.vm", text);
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        let mut scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        let ranges = ParamRanges::for_scene(SceneRef::from(&scene));
        let Ok(clauses) = read_clauses(&sources, file, &mut scene.expressions) else {
            panic!("{text}: no field");
        };
        let value = outside_where_undefined(&mut scene.expressions, clauses.value, &ranges);
        let (min, max) = (point, point);
        let range = field(&scene.expressions, value).eval(&Bounds { min, max }, &[]);
        (range.lo + range.hi) / 2.0
    }

    /// Returns the region in which a text is shown.
    fn region(text: &str) -> Bounds {
        let mut sources = Sources::new();
        let file = sources.add("part.vm", text);
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        let scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        let ShapeKind::Field { region, .. } = scene.shapes[0].kind else {
            panic!("{text}: no field");
        };
        region
    }

    #[test]
    fn regions_contain_what_is_finite() {
        let squares = "x var-x\ny var-y\nz var-z\na square x\nb square y\nc square z\n";
        let disc = |r: f64| format!("{squares}p add a b\nq sqrt p\nr const {r}\nd sub q r\n");
        let ball = |r: f64, at: f64| {
            format!(
                "{squares}t const {at}\nm sub x t\nn square m\no add n b\np add o c\nq sqrt p\nr const {r}\nd sub q r\n"
            )
        };
        for (text, min, max) in [
            (ball(0.5, 0.0), [-1.0; 3], [1.0; 3]),
            (ball(3.0, 0.0), [-3.0; 3], [3.0; 3]),
            (ball(0.5, 300.0), [299.5, -0.5, -0.5], [300.5, 0.5, 0.5]),
            (ball(50.0, -20.0), [-70.0, -50.0, -50.0], [30.0, 50.0, 50.0]),
            // Infinite along z.
            (disc(3.0), [-3.0; 3], [3.0; 3]),
        ] {
            let bounds = region(&text);
            for axis in 0..3 {
                let [low, high] = [bounds.min[axis], bounds.max[axis]];
                let slack = 0.1 * (max[axis] - min[axis]);
                assert!((low - min[axis]).abs() <= slack, "{text}: {bounds:?}");
                assert!((high - max[axis]).abs() <= slack, "{text}: {bounds:?}");
                assert!(low <= min[axis] && max[axis] <= high, "{text}: {bounds:?}");
            }
        }
        let plane =
            region("x var-x\ny var-y\na square x\nb square y\nc add a b\nd const 9\ne sub c d\n");
        assert!(plane.min[2] == f64::NEG_INFINITY && plane.max[0] < 3.3);
    }

    #[test]
    fn solids_without_an_end_are_cut_and_reported() {
        for (text, cut) in [
            (
                "a sin x\nb sin y\nc sin z\nd add a b\ne add d c\n",
                Some("x from -1 to 1, y from -1 to 1, z from -1 to 1"),
            ),
            (
                "a square x\nb square y\nc add a b\nr const 9\nd sub c r\ne add d z\nf sub d z\ng max e f\n",
                None,
            ),
            (
                "a square x\nb square y\nc add a b\nd const 9\ne sub c d\nf mul z e\ng max e f\n",
                Some("z from -3 to 3"),
            ),
        ] {
            let text = format!("x var-x\ny var-y\nz var-z\n{text}");
            let mut sources = Sources::new();
            let file = sources.add("part.vm", text.as_str());
            let (scene, diagnostics) = parse_fidget_text(&sources, file);
            assert!(scene.is_some(), "{text}");
            let label = diagnostics.first().map(|warning| warning.label.as_str());
            let expected = cut.map(|cut| format!("it is shown in a box: {cut}"));
            assert_eq!(label, expected.as_deref(), "{text}");
        }
    }

    /// Truth is "not zero", and remainders are never negative.
    #[test]
    fn operations_have_the_values_that_fidget_defines() {
        for (operation, x, y, expected) in [
            ("and", 2.0, -1.5, -1.5),
            ("and", -0.5, 3.0, 3.0),
            ("and", 3.0, 0.0, 0.0),
            ("or", 2.0, -1.5, 2.0),
            ("or", -0.5, 3.0, -0.5),
            ("mod", 0.5, -0.7, 0.5),
            ("mod", -0.5, -0.7, 0.2),
            ("mod", -0.5, 0.7, 0.2),
            ("mod", 5.5, 2.0, 1.5),
            ("compare", 1.0, 2.0, -1.0),
            ("compare", 2.0, 2.0, 0.0),
            ("compare", 3.0, 2.0, 1.0),
            ("atan2", 1.0, -1.0, 2.356_194_490_192_345),
            ("pow", 2.0, 3.0, 8.0),
        ] {
            let text = format!("_0 var-x\n_1 var-y\n_2 {operation} _0 _1\n");
            let result = value(&text, [x, y, 0.0]);
            assert!(
                (result - expected).abs() < 1e-12,
                "{operation} {x} {y}: {result}"
            );
        }
        // An operand that is zero in a part of space.
        for (clause, x, y, expected) in [
            ("and m y", -1.0, 3.0, 0.0),
            ("and m y", 2.0, 3.0, 3.0),
            ("or m y", -1.0, 3.0, 3.0),
            ("or m y", 2.0, 3.0, 2.0),
            ("not m", -1.0, 3.0, 1.0),
            ("not m", 2.0, 3.0, 0.0),
        ] {
            let text = format!("x var-x\ny var-y\nz const 0\nm max x z\nr {clause}\n");
            assert_eq!(value(&text, [x, y, 0.0]), expected, "{clause}: {x} {y}");
        }
        // A selection.
        for x in [-2.0, 2.0] {
            let text = "x var-x\ny var-y\no const 1\nc compare x o\nz const 0\nm max c z\n\
                        a and m y\nn not m\nb and n x\nr or a b\n";
            let expected = if x > 1.0 { 5.0 } else { x };
            assert_eq!(value(text, [x, 5.0, 0.0]), expected, "{x}");
        }
        for (exponent, x, expected) in [
            (2, -0.5, 0.25),
            (3, -2.0, -8.0),
            (-1, -4.0, -0.25),
            (0, -4.0, 1.0),
            (20, -1.5, 1.5_f64.powi(20)),
            (17, -1.5, -1.5_f64.powi(17)),
            (-18, -1.5, 1.5_f64.powi(-18)),
        ] {
            let text = format!("_0 var-x\n_1 const {exponent}\n_2 pow _0 _1\n");
            let result = value(&text, [x, 0.0, 0.0]);
            let error = (result - expected).abs() / expected.abs();
            assert!(error < 1e-12, "{x} to the {exponent}: {result}");
        }
        for (operation, x, expected) in [
            ("not", 0.3, 0.0),
            ("not", -2.0, 0.0),
            ("recip", 4.0, 0.25),
            ("round", 1.4, 1.0),
            ("round", -1.6, -2.0),
            ("ceil", -1.6, -1.0),
            ("floor", -1.6, -2.0),
        ] {
            let text = format!("_0 var-x\n_1 {operation} _0\n");
            let result = value(&text, [x, 0.0, 0.0]);
            assert!(
                (result - expected).abs() < 1e-12,
                "{operation} {x}: {result}"
            );
        }
    }

    #[test]
    fn points_without_a_value_are_outside() {
        for (clauses, x, expected) in [
            ("a sqrt x", 4.0, 2.0),
            ("a sqrt x", -4.0, 1e9),
            ("b const -4\na sqrt b", 0.0, 1e9),
            ("b const -4\nc ln b\na sub x c", 0.0, 1e9),
            ("b const 0\na div b b", 0.0, 1e9),
            ("b const 0\na mod x b", 1.0, 1e9),
            ("b const 0.5\na pow x b", -1.0, 1e9),
            ("b const 2\na asin b", 0.0, 1e9),
            ("b asin x\nc neg b\na min x c", 1.5, 1e9),
            // A disjunction that its first operand decides.
            ("b sqrt x\nc const 3\na or c b", -1.0, 3.0),
            ("b sqrt x\nc const 0\na or c b", -1.0, 1e9),
        ] {
            let text = format!("x var-x\n{clauses}\nr add a a\nh const 0.5\nd mul r h\n");
            let result = value(&text, [x, 0.0, 0.0]);
            assert!((result / expected - 1.0).abs() < 1e-12, "{text}: {result}");
        }
    }
}
