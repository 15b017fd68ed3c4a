//! `light { dir: …, color: …, shadow: … }` and `sky { top: …, horizon: … }`

use crate::elaborate::Elaborator;
use crate::elaborate::diagnose::{nearest, suggest};
use crate::elaborate::evaluate::{Halt, Here};
use crate::elaborate::value::Value;
use crate::expression::Stage;
use crate::scene::{Light, LightSource, Shadow, Sky};
use sdfc_lang::ast::{Block, ExprKind, Field};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    pub(super) fn light(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
        let name = self.block_name(block);
        let dir = self.vector_field(here, block, "dir")?;
        let at = self.vector_field(here, block, "at")?;
        let color = self.color_field(here, block, "color", Stage::Uniform)?;
        let intensity =
            self.number_field(here, block, "intensity", Stage::Uniform, f64::INFINITY)?;
        let shadow = match self.given(block, "shadow") {
            Some(field) => self.shadow(here, field)?,
            None => Some(Shadow::Soft(self.graph.constant(0.03))),
        };
        let both = self.given(block, "dir").is_some() && self.given(block, "at").is_some();
        let neither = self.given(block, "dir").is_none() && self.given(block, "at").is_none();
        if both || neither {
            let message = "a light comes from a direction, `dir`, or from a place, `at`";
            let label = if both {
                "this has both"
            } else {
                "this has neither"
            };
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).primary(label));
            return Ok(());
        }
        let source = match (dir, at) {
            (Some(dir), _) => {
                let span = self
                    .given(block, "dir")
                    .map_or(block.kind.span, |f| f.value.span);
                let Some(unit) = self.direction("`dir` of a light", &dir, span) else {
                    return Ok(());
                };
                LightSource::Directional([unit[0], unit[1], unit[2]])
            }
            (None, Some(at)) => LightSource::Point(at),
            (None, None) => return Ok(()),
        };
        let one = self.graph.constant(1.0);
        let intensity = intensity.unwrap_or_else(|| self.graph.constant(3.0));
        let Some(shadow) = shadow else { return Ok(()) };
        let color = color.unwrap_or([one; 3]);
        self.lights.push(Light {
            name,
            source,
            color,
            intensity,
            shadow,
        });
        Ok(())
    }

    /// `none`, `hard`, `soft`, `soft(0.03)`, `plain(0.03)` or `sized(0.03)`
    fn shadow(&mut self, here: &Here<'a>, field: &'a Field) -> Result<Option<Shadow>, Halt> {
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
            let near = name.and_then(|name| nearest(name, words));
            let at = match &field.value.kind {
                ExprKind::Call(call) => call.callee.span,
                _ => span,
            };
            self.report(suggest(diagnostic, at, near));
            return Ok(None);
        };
        let width = match arg {
            Some(arg) => {
                let Value::Number(number) = self.eval(here, &arg.value)? else {
                    let message = "the width of a shadow is a number";
                    self.report(Diagnostic::error(codes::E0301, arg.span, message));
                    return Ok(None);
                };
                let stage = self.graph.stage(number.id);
                if stage > Stage::Uniform {
                    self.report_late("the width of a shadow", stage, arg.span);
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
            None => self.graph.constant(0.03),
        };
        Ok(Some(match kind {
            "none" => Shadow::None,
            "hard" => Shadow::Hard,
            "plain" => Shadow::Plain(width),
            "soft" => Shadow::Soft(width),
            _ => Shadow::Sized(width),
        }))
    }

    pub(super) fn sky_block(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
        if self.sky.is_some() {
            let message = "there are two skies";
            self.report(Diagnostic::error(codes::E0214, block.kind.span, message));
            return Ok(());
        }
        let default = self.default_sky();
        let stage = Stage::Uniform;
        let top = self.color_field(here, block, "top", stage)?;
        let horizon = self.color_field(here, block, "horizon", stage)?;
        let ground = self.color_field(here, block, "ground", stage)?;
        let ambient = self.number_field(here, block, "ambient", stage, f64::INFINITY)?;
        let fog = self.number_field(here, block, "fog", stage, f64::INFINITY)?;
        let horizon = horizon.or(top).unwrap_or(default.horizon);
        let share = self.graph.constant(0.35);
        let dim = horizon.map(|id| self.op(Op::Mul, &[id, share]));
        self.sky = Some(Sky {
            top: top.unwrap_or(horizon),
            horizon,
            ground: ground.unwrap_or(dim),
            ambient: ambient.unwrap_or(default.ambient),
            fog: fog.filter(|&id| self.graph.as_constant(id) != Some(0.0)),
        });
        Ok(())
    }

    /// The sky of a scene without one: a clear day, a little hazy.
    pub(crate) fn default_sky(&mut self) -> Sky {
        Sky {
            top: self.srgb([0x6f, 0x97, 0xcf, 255]),
            horizon: self.srgb([0xe3, 0xea, 0xf2, 255]),
            ground: self.srgb([0x7c, 0x78, 0x72, 255]),
            ambient: self.graph.constant(1.0),
            fog: None,
        }
    }

    /// The lights of a scene without any: a warm one with a soft shadow, and a dim cool one from
    /// the other side.
    pub(crate) fn default_lights(&mut self) -> Vec<Light> {
        let z_up = self.z_up;
        let light =
            |e: &mut Self, [x, y, z]: [f64; 3], color: [u8; 4], strength: f64, soft: bool| {
                let length = (x * x + y * y + z * z).sqrt();
                let dir = if z_up { [x, -z, y] } else { [x, y, z] };
                Light {
                    name: String::new(),
                    source: LightSource::Directional(dir.map(|v| e.graph.constant(v / length))),
                    color: e.srgb(color),
                    intensity: e.graph.constant(strength),
                    shadow: match soft {
                        true => Shadow::Soft(e.graph.constant(0.04)),
                        false => Shadow::None,
                    },
                }
            };
        vec![
            light(self, [-0.55, 0.9, 0.65], [0xff, 0xf0, 0xdc, 255], 3.2, true),
            light(self, [0.8, 0.35, -0.4], [0xc4, 0xd8, 0xff, 255], 0.5, false),
        ]
    }
}
