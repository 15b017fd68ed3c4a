//! `light { dir: …, color: …, shadow: … }` and `sky { top: …, horizon: … }`

use crate::elaborate::Elaborator;
use crate::elaborate::diagnose::{nearest, suggest};
use crate::elaborate::dialects::field_of_dialects;
use crate::elaborate::value::{Abort, Env, Value};
use crate::expression::Stage;
use crate::scene::{SceneLight, SceneLightSource, SceneShadow, SceneSky};
use sdfc_lang::ast::{Block, ExprKind, Field};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    pub(super) fn light(&mut self, env: &Env<'a>, block: &'a Block) -> Result<(), Abort> {
        let name = self.block_name(block);
        let dir = self.vector_field(env, block, "dir")?;
        let position = self.vector_field(env, block, "at")?;
        let color = self.color_field(env, block, "color", Stage::Uniform)?;
        let intensity =
            self.number_field(env, block, "intensity", Stage::Uniform, f64::INFINITY)?;
        let shadow = match self.find_field(block, "shadow") {
            Some(field) => self.shadow(env, field)?,
            None => Some(SceneShadow::Soft(self.expressions.constant(0.03))),
        };
        let has_both =
            self.find_field(block, "dir").is_some() && self.find_field(block, "at").is_some();
        let has_neither =
            self.find_field(block, "dir").is_none() && self.find_field(block, "at").is_none();
        // A word of another dialect is an error of its own.
        let is_misnamed = block
            .fields
            .iter()
            .any(|field| field_of_dialects("light", &field.name.name).is_some());
        if has_neither && is_misnamed {
            return Ok(());
        }
        if has_both || has_neither {
            let message = "a light comes from a direction, `dir`, or from a place, `at`";
            let label = if has_both {
                "this has both"
            } else {
                "this has neither"
            };
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).primary(label));
            return Ok(());
        }
        let source = match (dir, position) {
            (Some(dir), _) => {
                let span = self
                    .find_field(block, "dir")
                    .map_or(block.kind.span, |f| f.value.span);
                let Some(unit) = self.unit_vector("`dir` of a light", &dir, span) else {
                    return Ok(());
                };
                SceneLightSource::Directional([unit[0], unit[1], unit[2]])
            }
            (None, Some(position)) => SceneLightSource::Point(position),
            (None, None) => return Ok(()),
        };
        let constant_one = self.expressions.constant(1.0);
        let intensity = intensity.unwrap_or_else(|| self.expressions.constant(3.0));
        let Some(shadow) = shadow else { return Ok(()) };
        let color = color.unwrap_or([constant_one; 3]);
        self.lights.push(SceneLight {
            name,
            source,
            color,
            intensity,
            shadow,
        });
        Ok(())
    }

    /// Evaluates the shadow of a light: `none`, `hard`, `soft`, `soft(0.03)`, `plain(0.03)` or `sized(0.03)`.
    fn shadow(&mut self, env: &Env<'a>, field: &'a Field) -> Result<Option<SceneShadow>, Abort> {
        let words = ["none", "hard", "plain", "soft", "sized"];
        let span = field.value.span;
        let (name, arg) = match &field.value.kind {
            ExprKind::Path(path) => (path.as_ident(), None),
            ExprKind::Call(call) => (call.callee.as_ident(), call.args.first()),
            _ => (None, None),
        };
        let name = name.map(|name| name.name.as_str());
        let Some(kind) = name.filter(|name| words.contains(name)) else {
            let message = "a shadow is none, hard, plain(width), soft(width) or sized(width)";
            let diagnostic = Diagnostic::error(codes::E0301, span, message);
            let suggestion = name.and_then(|name| nearest(name, words));
            let position = match &field.value.kind {
                ExprKind::Call(call) => call.callee.span,
                _ => span,
            };
            self.report(suggest(diagnostic, position, suggestion));
            return Ok(None);
        };
        let width = match arg {
            Some(arg) => {
                let Value::Number(number) = self.eval(env, &arg.value)? else {
                    let message = "the width of a shadow is a number";
                    self.report(Diagnostic::error(codes::E0301, arg.span, message));
                    return Ok(None);
                };
                let stage = self.expressions.stage(number.id);
                if stage > Stage::Uniform {
                    self.report_too_late("the width of a shadow", stage, arg.span);
                    return Ok(None);
                }
                if self
                    .check_above("the width of a shadow", number.id, true, arg.span)
                    .is_none()
                {
                    return Ok(None);
                }
                number.id
            }
            None => self.expressions.constant(0.03),
        };
        Ok(Some(match kind {
            "none" => SceneShadow::None,
            "hard" => SceneShadow::Hard,
            "plain" => SceneShadow::Plain(width),
            "soft" => SceneShadow::Soft(width),
            _ => SceneShadow::Sized(width),
        }))
    }

    pub(super) fn sky_block(&mut self, env: &Env<'a>, block: &'a Block) -> Result<(), Abort> {
        if self.sky.is_some() {
            let message = "there are two skies";
            self.report(Diagnostic::error(codes::E0214, block.kind.span, message));
            return Ok(());
        }
        let default = self.default_sky();
        let stage = Stage::Uniform;
        let top = self.color_field(env, block, "top", stage)?;
        let horizon = self.color_field(env, block, "horizon", stage)?;
        let ground = self.color_field(env, block, "ground", stage)?;
        let ambient = self.number_field(env, block, "ambient", stage, f64::INFINITY)?;
        let fog = self.number_field(env, block, "fog", stage, f64::INFINITY)?;
        let horizon = horizon.or(top).unwrap_or(default.horizon);
        let ground_fraction = self.expressions.constant(0.35);
        let darkened = horizon.map(|id| self.op(Op::Mul, &[id, ground_fraction]));
        self.sky = Some(SceneSky {
            top: top.unwrap_or(horizon),
            horizon,
            ground: ground.unwrap_or(darkened),
            ambient: ambient.unwrap_or(default.ambient),
            fog: fog.filter(|&id| self.expressions.as_constant(id) != Some(0.0)),
        });
        Ok(())
    }

    /// Returns the sky of a scene without one: a clear day, a little hazy.
    pub(crate) fn default_sky(&mut self) -> SceneSky {
        SceneSky {
            top: self.srgb([0x6f, 0x97, 0xcf, 255]),
            horizon: self.srgb([0xe3, 0xea, 0xf2, 255]),
            ground: self.srgb([0x7c, 0x78, 0x72, 255]),
            ambient: self.expressions.constant(1.0),
            fog: None,
        }
    }

    /// Returns the lights of a scene without any: a warm one with a soft shadow, and a dim cool one from the other
    /// side.
    pub(crate) fn default_lights(&mut self) -> Vec<SceneLight> {
        let z_up = self.z_up;
        let light =
            |e: &mut Self, [x, y, z]: [f64; 3], color: [u8; 4], strength: f64, soft: bool| {
                let length = (x * x + y * y + z * z).sqrt();
                let dir = if z_up { [x, -z, y] } else { [x, y, z] };
                SceneLight {
                    name: String::new(),
                    source: SceneLightSource::Directional(
                        dir.map(|v| e.expressions.constant(v / length)),
                    ),
                    color: e.srgb(color),
                    intensity: e.expressions.constant(strength),
                    shadow: match soft {
                        true => SceneShadow::Soft(e.expressions.constant(0.04)),
                        false => SceneShadow::None,
                    },
                }
            };
        vec![
            light(self, [-0.55, 0.9, 0.65], [0xff, 0xf0, 0xdc, 255], 3.2, true),
            light(self, [0.8, 0.35, -0.4], [0xc4, 0xd8, 0xff, 255], 0.5, false),
        ]
    }
}
