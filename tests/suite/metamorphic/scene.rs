//! Scenes as trees, and equivalent texts of them.

use sdfc_trials::random::Random;
use std::fmt::Write as _;

/// A shape of a scene.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A shape given by its text.
    Solid(String),
    /// A raw field: a value at `p`, a slope bound, and whether the scene states that bound.
    Field {
        value: String,
        slope: Option<f64>,
        is_stated: bool,
    },
    /// A hard union.
    Union(Vec<Shape>),
    /// Two shapes and the operator between them. `reads_values` marks a blend, which depends on more than
    /// the sign.
    Pair {
        pair: Box<[Shape; 2]>,
        operator: String,
        reads_values: bool,
    },
    /// A method on a shape. `reads_values` marks a method that depends on more than the sign, such as
    /// `offset`.
    Call {
        child: Box<Shape>,
        method: String,
        reads_values: bool,
    },
}

/// Parts of a scene, in a hard union.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) parts: Vec<Shape>,
    /// Seed that selects the shapes to rewrite.
    pub(super) seed: u64,
}

/// A light.
#[derive(Clone, Debug)]
pub(super) struct SceneLight {
    pub(super) position: [f64; 3],
    pub(super) is_point: bool,
    pub(super) color: String,
    pub(super) intensity: f64,
    pub(super) shadow: &'static str,
}

/// Camera, lights, sky and settings of a scene.
#[derive(Clone, Debug)]
pub(super) struct Head {
    pub(super) from: [f64; 3],
    pub(super) look: [f64; 3],
    pub(super) fov: f64,
    pub(super) lights: Vec<SceneLight>,
    pub(super) fog: Option<f64>,
    pub(super) ambient: f64,
    pub(super) occlusion: &'static str,
    pub(super) tonemap: &'static str,
    /// Radius of occlusion.
    pub(super) reach: f64,
}

/// An equivalent notation of a scene; all give the same picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rewrite {
    /// The original scene.
    Plain,
    /// Values of raw fields are multiplied by a constant, where only their sign matters.
    Multiplied(f64),
    /// Stated slope bounds are multiplied by this factor.
    Stated(f64),
    /// Unions are bracketed from the right.
    Bracketed,
    /// Shapes are translated away and back.
    Moved,
    /// Shapes are rotated by four right angles.
    Turned,
    /// Shapes are scaled and scaled back.
    Resized,
    /// Shapes become complements of complements.
    Complemented,
    /// The whole scene is scaled by this factor, with its camera and lights.
    World(f64),
    /// The whole scene is translated, with its camera and lights.
    Shifted,
    /// The whole scene is rotated about its up axis, with its camera and lights.
    Rotated,
}

/// Translation of [`Rewrite::Shifted`].
const SHIFT_OFFSET: [f64; 3] = [6.0, 2.5, -3.0];
/// Percentage of shapes that are rewritten.
const PERCENT_REWRITTEN: usize = 40;

impl Shape {
    /// Applies a method that depends only on the sign.
    pub(super) fn then(self, method: String) -> Self {
        let child = Box::new(self);
        let reads_values = false;
        Self::Call {
            child,
            method,
            reads_values,
        }
    }

    /// Applies a method that depends on values.
    pub(super) fn valued(self, method: String) -> Self {
        let child = Box::new(self);
        let reads_values = true;
        Self::Call {
            child,
            method,
            reads_values,
        }
    }

    /// Combines two shapes by a set operation that depends only on signs.
    pub(super) fn pair(pair: [Self; 2], operator: String) -> Self {
        Self::Pair {
            pair: Box::new(pair),
            operator,
            reads_values: false,
        }
    }

    /// Combines two shapes by a blend.
    pub(super) fn blend(pair: [Self; 2], operator: String) -> Self {
        Self::Pair {
            pair: Box::new(pair),
            operator,
            reads_values: true,
        }
    }

    /// Writes the shape. `is_read` states that its values matter.
    fn write(&self, to: &mut String, rewrite: Rewrite, is_read: bool, r: &mut Random) {
        match self {
            Self::Solid(text) => to.push_str(text),
            Self::Field {
                value,
                slope,
                is_stated,
            } => write_field(
                to,
                value,
                slope.map(|slope| (slope, *is_stated)),
                rewrite,
                is_read,
            ),
            Self::Union(parts) => write_union(to, parts, rewrite, is_read, r),
            Self::Pair {
                pair,
                operator,
                reads_values,
            } => {
                let is_read = is_read || *reads_values;
                to.push('(');
                pair[0].write(to, rewrite, is_read, r);
                _ = write!(to, " {operator} ");
                pair[1].write(to, rewrite, is_read, r);
                to.push(')');
            }
            Self::Call {
                child,
                method,
                reads_values,
            } => {
                child.write(to, rewrite, is_read || *reads_values, r);
                _ = write!(to, ".{method}");
            }
        }
        if r.chance(PERCENT_REWRITTEN) {
            to.push_str(match rewrite {
                Rewrite::Moved => ".translate(0.5, -1.25, 2).translate(-0.5, 1.25, -2)",
                Rewrite::Turned => {
                    ".rotate(90deg, X).rotate(90deg, X).rotate(90deg, X).rotate(90deg, X)"
                }
                Rewrite::Resized => ".scale(4).scale(0.25)",
                Rewrite::Complemented => ".complement().complement()",
                _ => "",
            });
        }
    }
}

/// Writes a raw field. A slope bound comes with whether the original scene states it.
fn write_field(
    to: &mut String,
    value: &str,
    slope: Option<(f64, bool)>,
    rewrite: Rewrite,
    is_read: bool,
) {
    let (factor, times) = match rewrite {
        Rewrite::Multiplied(factor) if !is_read => (Some(factor), factor),
        Rewrite::Stated(times) => (None, times),
        _ => (None, 1.0),
    };
    _ = match factor {
        Some(factor) => write!(to, "field(fn(p) => {factor} * ({value})"),
        None => write!(to, "field(fn(p) => {value}"),
    };
    match slope {
        Some((slope, is_stated)) if is_stated || matches!(rewrite, Rewrite::Stated(_)) => {
            _ = write!(to, ", lipschitz: {})", slope * times);
        }
        _ => to.push(')'),
    }
}

/// Writes a hard union, bracketed from the left as `union` does, or from the right.
fn write_union(to: &mut String, parts: &[Shape], rewrite: Rewrite, is_read: bool, r: &mut Random) {
    let is_bracketed = rewrite == Rewrite::Bracketed;
    to.push_str(if is_bracketed { "(" } else { "union([" });
    for (index, part) in parts.iter().enumerate() {
        let is_last = index + 1 == parts.len();
        if is_bracketed && !is_last {
            to.push('(');
        }
        part.write(to, rewrite, is_read, r);
        to.push_str(match (is_bracketed, is_last) {
            (true, false) => " | ",
            (false, false) => ",\n  ",
            _ => "",
        });
    }
    if is_bracketed {
        to.push_str(&")".repeat(parts.len()));
    } else {
        to.push_str("])");
    }
}

/// Formats a vector.
fn vector(v: [f64; 3]) -> String {
    format!("[{}, {}, {}]", v[0], v[1], v[2])
}

impl Rewrite {
    /// Returns the scale of the whole scene.
    pub(super) fn scale(self) -> f64 {
        match self {
            Self::World(scale) => scale,
            _ => 1.0,
        }
    }

    /// Transforms a point of the scene.
    fn transform_point(self, p: [f64; 3]) -> [f64; 3] {
        match self {
            Self::World(scale) => p.map(|v| v * scale),
            Self::Shifted => std::array::from_fn(|i| p[i] + SHIFT_OFFSET[i]),
            Self::Rotated => self.direction(p),
            _ => p,
        }
    }

    fn direction(self, v: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Rotated => [v[2], v[1], -v[0]],
            _ => v,
        }
    }

    /// Returns the method applied to the whole scene.
    fn scene_method(self) -> String {
        match self {
            Self::World(scale) => format!(".scale({scale})"),
            Self::Shifted => format!(".translate({})", vector(SHIFT_OFFSET)),
            Self::Rotated => ".rotate(90deg, Y)".to_owned(),
            _ => String::new(),
        }
    }
}

impl Head {
    /// Reports whether lights are sampled at points of their rims.
    pub(super) fn has_rims(&self) -> bool {
        self.lights
            .iter()
            .any(|light| light.shadow.starts_with("sized"))
    }

    fn write(&self, to: &mut String, rewrite: Rewrite) {
        let scale = rewrite.scale();
        let (from, look) = (
            rewrite.transform_point(self.from),
            rewrite.transform_point(self.look),
        );
        _ = writeln!(
            to,
            "camera {{ from: {}, look: {}, fov: {}deg }}",
            vector(from),
            vector(look),
            self.fov
        );
        for (index, light) in self.lights.iter().enumerate() {
            let (word, position, intensity) = if light.is_point {
                let position = rewrite.transform_point(light.position);
                ("at", position, light.intensity * scale * scale)
            } else {
                ("dir", rewrite.direction(light.position), light.intensity)
            };
            _ = writeln!(
                to,
                "light l{index} {{ {word}: {}, color: {}, intensity: {intensity}, shadow: {} }}",
                vector(position),
                light.color,
                light.shadow
            );
        }
        let fog = self.fog.map(|fog| format!(", fog: {}", fog / scale));
        _ = writeln!(
            to,
            "sky {{ ambient: {}{} }}",
            self.ambient,
            fog.unwrap_or_default()
        );
        _ = writeln!(
            to,
            "render {{ occlusion: {}, tonemap: {}, reach: {}, far: {} }}",
            self.occlusion,
            self.tonemap,
            self.reach * scale,
            60.0 * scale
        );
        to.push_str("material metal { color: #c0a060, roughness: 0.3, metallic: 0.8 }\n");
    }
}

/// Returns the text of a scene.
pub(super) fn text(head: &Head, body: &Body, rewrite: Rewrite) -> String {
    let mut text = String::new();
    head.write(&mut text, rewrite);
    let mut r = Random::new(body.seed);
    write_union(&mut text, &body.parts, rewrite, false, &mut r);
    text.push_str(&rewrite.scene_method());
    text.push('\n');
    text
}
