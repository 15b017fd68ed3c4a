//! `render { size: …, aa: … }` and `animate { duration: …, fps: … }`

use super::Wanted;
use crate::elaborate::Elaborator;
use crate::elaborate::calls::word;
use crate::elaborate::diagnose::{nearest, suggest};
use crate::elaborate::evaluate::{Halt, Here};
use crate::elaborate::numbers::{Form, parts};
use crate::elaborate::stage::Demand;
use crate::expression::Stage;
use crate::scene::{Animation, Normals, Occlusion, Render, Tonemap};
use sdfc_lang::ast::{Block, Field};
use sdfc_lang::{Diagnostic, codes};

impl<'a> Elaborator<'a> {
    pub(super) fn render_block(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
        let mut render = match self.render.take() {
            Some(render) => {
                let message = "there are two `render` blocks";
                self.report(Diagnostic::error(codes::E0214, block.kind.span, message));
                render
            }
            None => self.default_render(),
        };
        if let Some(field) = self.given(block, "size")
            && let Some(size) = self.size(here, field)?
        {
            render.size = size;
        }
        render.aa = self
            .count_field(here, block, "aa", 1..=8)?
            .unwrap_or(render.aa);
        render.steps = self
            .count_field(here, block, "steps", 1..=10_000)?
            .unwrap_or(render.steps);
        for name in ["far", "reach"] {
            let Some(id) = self.number_field(here, block, name, Stage::Uniform, 1e18)? else {
                continue;
            };
            let what = format!("`{name}` of a render");
            let span = self
                .given(block, name)
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
            self.number_field(here, block, "exposure", Stage::Uniform, f64::INFINITY)?
        {
            render.exposure = exposure;
        }
        if let Some(field) = self.given(block, "occlusion") {
            render.occlusion = match word(&field.value).map(|word| word.name.as_str()) {
                Some("off") => Occlusion::Off,
                Some("five_tap") => Occlusion::FiveTap,
                _ => {
                    let what = "`occlusion` (off, five_tap, or a number of samples)";
                    let wanted = Wanted {
                        what,
                        stage: Stage::Uniform,
                    };
                    let numbers = self.field_numbers(here, field, Form::Scalar, wanted)?;
                    let samples = match numbers {
                        Some([id, ..]) => self.count(what, id, 1..=256, field.value.span),
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
            .one_of(block, "normals", &normals)
            .unwrap_or(render.normals);
        let tonemaps = [
            ("none", Tonemap::None),
            ("reinhard", Tonemap::Reinhard),
            ("aces", Tonemap::Aces),
        ];
        render.tonemap = self
            .one_of(block, "tonemap", &tonemaps)
            .unwrap_or(render.tonemap);
        self.render = Some(render);
        Ok(())
    }

    fn one_of<T: Copy>(&mut self, block: &'a Block, name: &str, words: &[(&str, T)]) -> Option<T> {
        let field = self.given(block, name)?;
        let given = word(&field.value).map(|word| word.name.as_str());
        let found = given.and_then(|given| words.iter().find(|(word, _)| *word == given));
        if found.is_none() {
            let all = words.iter().map(|(word, _)| *word).collect::<Vec<_>>();
            let message = format!("`{name}` is one of {}", all.join(", "));
            let diagnostic = Diagnostic::error(codes::E0301, field.value.span, message);
            let near = given.and_then(|given| nearest(given, all));
            self.report(suggest(diagnostic, field.value.span, near));
        }
        found.map(|(_, value)| *value)
    }

    fn size(&mut self, here: &Here<'a>, field: &'a Field) -> Result<Option<[u32; 2]>, Halt> {
        let value = self.eval(here, &field.value)?;
        let Some((Form::Vector(2), [width, height, ..])) = parts(&value) else {
            self.wrong(
                &value,
                "`size` is a width and a height, `[1280, 720]`",
                field.value.span,
            );
            return Ok(None);
        };
        let what = "`size` of a render";
        let width = self.count(what, width.id, 1..=16_384, field.value.span);
        let height = self.count(what, height.id, 1..=16_384, field.value.span);
        Ok(width.zip(height).map(|(width, height)| [width, height]))
    }

    /// How a scene is drawn that does not say.
    pub(crate) fn default_render(&mut self) -> Render {
        Render {
            size: [960, 540],
            aa: 2,
            steps: 3072,
            far: None,
            occlusion: Occlusion::FiveTap,
            occlusion_reach: None,
            normals: Normals::Exact,
            tonemap: Tonemap::Aces,
            exposure: self.graph.constant(1.0),
        }
    }

    pub(super) fn animate(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
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
            let Some(id) = self.number_field(here, block, name, Stage::Uniform, 1e6)? else {
                continue;
            };
            let what = format!("`{name}` of an animation");
            let span = self
                .given(block, name)
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
        if let Some(field) = self.given(block, "loop") {
            let value = self.eval(here, &field.value)?;
            if let Some(id) = self.condition(value, field.value.span) {
                let demand = Demand::new("`loop` of an animation", field.value.span);
                animation.repeats = self.demand(id, &demand).is_some_and(|v| v != 0.0);
            }
        }
        self.animation = Some(animation);
        Ok(())
    }
}
