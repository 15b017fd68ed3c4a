//! Invariants of every row.

use crate::fixture::{Random, is_math};
use sdfc_vm::row::{ArgumentKind, BoundsRule, Category, Output, SetOperation, SlopeRule, align};
use sdfc_vm::table::{Op, ROWS, prepare};
use std::collections::HashSet;

#[test]
fn names_are_unique_and_found_again() {
    let mut names = HashSet::new();
    for (i, row) in ROWS.iter().enumerate() {
        assert!(names.insert(row.name), "{} twice", row.name);
        assert_eq!(row.op as usize, i);
        assert_eq!(Op::from_name(row.name), Some(row.op));
        assert_eq!(Op::from_code(i as u8), Some(row.op));
        let fits = row
            .name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        assert!(fits, "{}", row.name);
        assert!(
            row.doc.ends_with(".\n") && row.doc.len() > 10,
            "{}: {}",
            row.name,
            row.doc
        );
    }
    assert_eq!(Op::from_name("no such name"), None);
}

/// The documentation of a row mentions every argument of its built-in, by its name in a call.
#[test]
fn every_argument_is_explained() {
    for row in ROWS {
        let Some(language) = row.facts.language else {
            continue;
        };
        for argument in language.arguments {
            let implied = match argument.kind {
                // Described in words where it is unambiguous.
                ArgumentKind::Vec3 | ArgumentKind::Vec2 => false,
                _ => {
                    row.parameters.iter().any(|p| p.name == argument.name)
                        && language.arguments.len() == 1
                }
            };
            let named = row.doc.contains(&format!("`{}`", argument.name));
            let earlier = ROWS.iter().any(|other| {
                other.op < row.op
                    && other
                        .facts
                        .language
                        .is_some_and(|l| l.name == language.name)
                    && other.doc.contains(&format!("`{}`", argument.name))
            });
            assert!(
                named || implied || earlier,
                "{}: {}",
                row.name,
                argument.name
            );
        }
    }
}

#[test]
fn rows_that_share_a_word_differ_in_their_arguments() {
    for row in ROWS {
        let Some(language) = row.facts.language else {
            continue;
        };
        for other in &ROWS[row.op as usize + 1..] {
            let Some(second) = other.facts.language else {
                continue;
            };
            let flat = |category| category == Category::Shape2;
            if language.name == second.name
                && flat(row.facts.category) == flat(other.facts.category)
            {
                let names =
                    |l: &[sdfc_vm::row::Argument]| -> Vec<_> { l.iter().map(|a| a.name).collect() };
                let plane = row.op == Op::Polar && other.op == Op::PolarPlane;
                assert!(
                    plane || names(language.arguments) != names(second.arguments),
                    "{}",
                    row.name
                );
            }
        }
    }
}

#[test]
fn parameters_lie_where_a_kernel_reads_them() {
    for row in ROWS {
        let mut at = 0;
        for (parameter, offset) in row.parameters.iter().zip(row.offsets()) {
            let width = parameter.ty.width();
            assert_eq!(offset, align(at, width), "{}", row.name);
            assert!(
                offset % 4 + width <= 4,
                "{}: {} straddles",
                row.name,
                parameter.name
            );
            at = offset + width;
        }
        assert_eq!(row.parameter_width(), at);
    }
}

/// The prepared numbers are those that the body reads: equally many, all finite.
#[test]
fn arguments_become_parameters() {
    for row in ROWS {
        let mut random = Random::for_case(90, row.name);
        let expected: usize = row.parameters.iter().map(|p| p.ty.width()).sum();
        for _ in 0..20 {
            let arguments = random.arguments(row.op);
            let parameters = prepare::<f64>(row.op, &arguments);
            assert_eq!(parameters.len(), expected, "{} of {arguments:?}", row.name);
            assert!(parameters.iter().all(|v| v.is_finite()), "{}", row.name);
        }
    }
}

#[test]
fn facts_fit_the_kind_of_row() {
    for row in ROWS {
        let facts = &row.facts;
        let name = row.name;
        assert!(
            !facts.source.is_empty() || is_math(row.op),
            "{name}: source"
        );
        match facts.category {
            Category::Shape3 | Category::Shape2 => {
                assert!(facts.language.is_some(), "{name}: no word");
                assert!(
                    matches!(
                        facts.slope,
                        SlopeRule::Constant(_) | SlopeRule::FromParams(_)
                    ),
                    "{name}: slope"
                );
                assert_eq!((row.output, row.arity()), (Output::Value, 0), "{name}");
            }
            Category::Combine => assert_eq!(row.arity(), 2, "{name}"),
            Category::Domain => {
                let is_map = matches!(facts.slope, SlopeRule::Fold | SlopeRule::PointMap(_));
                assert!(is_map, "{name}: stretch");
                assert!(matches!(facts.bounds, BoundsRule::Map(_)), "{name}: bounds");
                assert_eq!(row.output, Output::Point, "{name}");
            }
            Category::Distance => {
                assert_eq!((row.output, row.arity()), (Output::Value, 1), "{name}")
            }
            Category::Dimension | Category::Math | Category::Internal => {}
        }
        if let Some(blend) = facts.blend {
            assert_eq!(facts.category, Category::Combine, "{name}");
            let union = facts.set == Some(SetOperation::Union);
            let subtraction = facts.set == Some(SetOperation::Subtraction);
            assert_eq!(blend.sign, if union { 1.0 } else { -1.0 }, "{name}");
            assert_eq!(blend.negate_second, subtraction, "{name}");
        }
        let word = facts.set.map(|set| match set {
            SetOperation::Union => "union",
            SetOperation::Intersection => "intersection",
            SetOperation::Subtraction => "subtraction",
        });
        let words = ["union", "intersection", "subtraction"];
        let said = words.into_iter().find(|word| name.ends_with(word));
        assert_eq!(word, said, "{name}");
        assert!(row.arity() <= 3, "{name}");
    }
}
