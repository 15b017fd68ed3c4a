//! `render { size: …, aa: … }` and `animate { duration: …, fps: … }`

use super::FieldRequirement;
use crate::elaborate::Elaborator;
use crate::elaborate::arguments::word;
use crate::elaborate::constness::Demand;
use crate::elaborate::diagnose::{nearest, suggest};
use crate::elaborate::numbers::{Form, components};
use crate::elaborate::value::{Abort, Env};
use crate::expression::Stage;
use crate::scene::{Animation, Normals, Occlusion, SceneRender, Tonemap};
use sdfc_lang::ast::{Block, Field};
use sdfc_lang::{Diagnostic, codes};

impl<'a> Elaborator<'a> {
    pub(super) fn render_block(&mut self, env: &Env<'a>, block: &'a Block) -> Result<(), Abort> {
        let mut render = match self.render.take() {
            Some(render) => {
                let message = "there are two `render` blocks";
                self.report(Diagnostic::error(codes::E0214, block.kind.span, message));
                render
            }
            None => self.default_render(),
        };
        if let Some(field) = self.find_field(block, "size")
            && let Some(size) = self.size_field(env, field)?
        {
            render.size = size;
        }
        render.aa = self
            .count_field(env, block, "aa", 1..=8)?
            .unwrap_or(render.aa);
        render.steps = self
            .count_field(env, block, "steps", 1..=10_000)?
            .unwrap_or(render.steps);
        for name in ["far", "reach"] {
            let Some(id) = self.number_field(env, block, name, Stage::Uniform, 1e18)? else {
                continue;
            };
            let what = format!("`{name}` of a render");
            let span = self
                .find_field(block, name)
                .map_or(block.kind.span, |f| f.value.span);
            let Some(value) = self.demand(id, &Demand::new(&what, span)) else {
                continue;
            };
            if value == 0.0 {
                let message = format!("{what} is larger than 0");
                self.report(Diagnostic::error(codes::E0401, span, message));
            }
            match name {
                "far" => render.far = Some(value),
                _ => render.occlusion_reach = Some(value),
            }
        }
        if let Some(exposure) =
            self.number_field(env, block, "exposure", Stage::Uniform, f64::INFINITY)?
        {
            render.exposure = exposure;
        }
        if let Some(field) = self.find_field(block, "occlusion") {
            render.occlusion = match word(&field.value).map(|word| word.name.as_str()) {
                Some("off") => Occlusion::Off,
                Some("five_tap") => Occlusion::FiveTap,
                _ => {
                    let what = "`occlusion` (off, five_tap, or a number of samples)";
                    let requirement = FieldRequirement {
                        subject: what,
                        max_stage: Stage::Uniform,
                    };
                    let numbers = self.field_numbers(env, field, Form::Scalar, requirement)?;
                    let samples = match numbers {
                        Some([id, ..]) => {
                            self.integer_in_range(what, id, 1..=256, field.value.span)
                        }
                        None => None,
                    };
                    samples.map_or(render.occlusion, Occlusion::Multi)
                }
            };
        }
        let normals = [
            ("exact", Normals::Exact),
            ("forward", Normals::Forward),
            ("central", Normals::Central),
            ("reverse", Normals::Reverse),
            ("tetrahedron", Normals::Tetrahedron),
            ("wide", Normals::Wide),
        ];
        render.normals = self
            .word_field(block, "normals", &normals)
            .unwrap_or(render.normals);
        let tonemaps = [
            ("none", Tonemap::None),
            ("reinhard", Tonemap::Reinhard),
            ("aces", Tonemap::Aces),
        ];
        render.tonemap = self
            .word_field(block, "tonemap", &tonemaps)
            .unwrap_or(render.tonemap);
        self.render = Some(render);
        Ok(())
    }

    fn word_field<T: Copy>(
        &mut self,
        block: &'a Block,
        name: &str,
        words: &[(&str, T)],
    ) -> Option<T> {
        let field = self.find_field(block, name)?;
        let written = word(&field.value).map(|word| word.name.as_str());
        let entry = written.and_then(|written| words.iter().find(|(word, _)| *word == written));
        if entry.is_none() {
            let names = words.iter().map(|(word, _)| *word).collect::<Vec<_>>();
            let message = format!("`{name}` is one of {}", names.join(", "));
            let diagnostic = Diagnostic::error(codes::E0301, field.value.span, message);
            let suggestion = written.and_then(|written| nearest(written, names));
            self.report(suggest(diagnostic, field.value.span, suggestion));
        }
        entry.map(|(_, value)| *value)
    }

    fn size_field(&mut self, env: &Env<'a>, field: &'a Field) -> Result<Option<[u32; 2]>, Abort> {
        let value = self.eval(env, &field.value)?;
        let Some((Form::Vector(2), [width, height, ..])) = components(&value) else {
            self.report_wrong(
                &value,
                "`size` is a width and a height, `[1280, 720]`",
                field.value.span,
            );
            return Ok(None);
        };
        let what = "`size` of a render";
        let width = self.integer_in_range(what, width.id, 1..=16_384, field.value.span);
        let height = self.integer_in_range(what, height.id, 1..=16_384, field.value.span);
        Ok(width.zip(height).map(|(width, height)| [width, height]))
    }

    /// Returns the settings of a scene without a `render` block.
    pub(crate) fn default_render(&mut self) -> SceneRender {
        SceneRender {
            size: [960, 540],
            aa: 2,
            steps: 3072,
            far: None,
            occlusion: Occlusion::FiveTap,
            occlusion_reach: None,
            normals: Normals::Exact,
            tonemap: Tonemap::Aces,
            exposure: self.expressions.constant(1.0),
        }
    }

    pub(super) fn animate(&mut self, env: &Env<'a>, block: &'a Block) -> Result<(), Abort> {
        if self.animation.is_some() {
            let message = "there are two `animate` blocks";
            self.report(Diagnostic::error(codes::E0214, block.kind.span, message));
            return Ok(());
        }
        let mut animation = Animation {
            duration: 4.0,
            fps: 30.0,
            repeats: false,
        };
        for (name, slot) in [
            ("duration", &mut animation.duration),
            ("fps", &mut animation.fps),
        ] {
            let Some(id) = self.number_field(env, block, name, Stage::Uniform, 1e6)? else {
                continue;
            };
            let what = format!("`{name}` of an animation");
            let span = self
                .find_field(block, name)
                .map_or(block.kind.span, |f| f.value.span);
            let Some(value) = self.demand(id, &Demand::new(&what, span)) else {
                continue;
            };
            if value == 0.0 {
                let message = format!("{what} is larger than 0");
                self.report(Diagnostic::error(codes::E0401, span, message));
            }
            *slot = value;
        }
        if let Some(field) = self.find_field(block, "loop") {
            let value = self.eval(env, &field.value)?;
            if let Some(id) = self.condition(value, field.value.span) {
                let demand = Demand::new("`loop` of an animation", field.value.span);
                animation.repeats = self.demand(id, &demand).is_some_and(|v| v != 0.0);
            }
        }
        self.animation = Some(animation);
        Ok(())
    }
}
