//! Blocks: `camera`, `light`, `material`, `sky`, `render`, `animate`, `scene` and `record`, with
//! their fields and defaults.

mod camera;
mod light;
mod render;

use super::Elaborator;
use super::bound::short;
use super::calls::word;
use super::diagnose::{nearest, suggest, unknown_name};
use super::evaluate::{Halt, Here};
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{Quantity, Record, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{Material, Triple};
use sdfc_lang::ast::{self, Block, Field};
use sdfc_lang::{Diagnostic, Span, codes};
use std::rc::Rc;

/// Every kind of block with its fields; a record has any.
pub(crate) const KINDS: [(&str, &[&str]); 8] = [
    ("scene", &["units", "up"]),
    ("camera", &["from", "look", "up", "fov", "height"]),
    ("light", &["dir", "at", "color", "intensity", "shadow"]),
    (
        "material",
        &["color", "roughness", "metallic", "emission", "bump"],
    ),
    ("sky", &["top", "horizon", "ground", "ambient", "fog"]),
    (
        "render",
        &[
            "size",
            "aa",
            "steps",
            "far",
            "occlusion",
            "reach",
            "normals",
            "tonemap",
            "exposure",
        ],
    ),
    ("animate", &["duration", "fps", "loop"]),
    ("record", &[]),
];

/// The fields whose value may be a word of its own, by kind of block and name.
pub(crate) const WORD_FIELDS: [(&str, &str); 6] = [
    ("scene", "units"),
    ("scene", "up"),
    ("light", "shadow"),
    ("render", "occlusion"),
    ("render", "normals"),
    ("render", "tonemap"),
];

/// What a field may be.
#[derive(Clone, Copy)]
struct Wanted<'w> {
    /// In a sentence: "`fov` of a camera".
    what: &'w str,
    /// The latest stage at which it may be known.
    stage: Stage,
}

impl<'a> Elaborator<'a> {
    /// A block of a file. In an imported file only materials and records count.
    pub(crate) fn block(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
    ) -> Result<Option<Value<'a>>, Halt> {
        let kind = block.kind.name.as_str();
        let Some((_, fields)) = KINDS.iter().find(|(name, _)| *name == kind) else {
            let known = KINDS.iter().map(|(name, _)| *name);
            let diagnostic =
                unknown_name(codes::E0207, "block", kind, block.kind.span, known.clone());
            let all = known.collect::<Vec<_>>().join(", ");
            self.report(match diagnostic.fixes.is_empty() {
                true => diagnostic.help(format!("the blocks are {all}")),
                false => diagnostic,
            });
            return Ok(None);
        };
        if kind == "record" {
            return self.record(here, block).map(Some);
        }
        self.check_fields(block, fields);
        if kind == "material" {
            return self.material_block(here, block).map(Some);
        }
        if here.module != self.root() {
            return Ok(None);
        }
        match kind {
            "camera" => self.camera(here, block)?,
            "light" => self.light(here, block)?,
            "sky" => self.sky_block(here, block)?,
            "render" => self.render_block(here, block)?,
            "animate" => self.animate(here, block)?,
            // What `scene` says was read before all else.
            _ => {}
        }
        Ok(None)
    }

    fn check_fields(&mut self, block: &Block, known: &[&str]) {
        for (at, field) in block.fields.iter().enumerate() {
            let name = field.name.name.as_str();
            let kind = block.kind.name.as_str();
            if !known.contains(&name) {
                let message = format!("a {kind} has no `{name}`");
                let diagnostic = Diagnostic::error(codes::E0208, field.name.span, message);
                let near = nearest(name, known.iter().copied());
                let diagnostic = match near {
                    Some(_) => suggest(diagnostic, field.name.span, near),
                    None => diagnostic.help(format!("its fields are {}", known.join(", "))),
                };
                self.report(diagnostic);
            } else if let Some(first) = block.fields[..at]
                .iter()
                .find(|other| other.name.name == field.name.name)
            {
                let message = format!("`{name}` is given twice");
                let diagnostic = Diagnostic::error(codes::E0206, field.name.span, message);
                self.report(diagnostic.label(first.name.span, "the first one"));
            }
        }
    }

    fn record(&mut self, here: &Here<'a>, block: &'a Block) -> Result<Value<'a>, Halt> {
        let Some(name) = &block.name else {
            let message = "a record needs a name";
            let example = "write `record size { width: 2, height: 1 }`";
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).help(example));
            return Ok(Value::Poison);
        };
        let mut fields = Vec::with_capacity(block.fields.len());
        for field in &block.fields {
            fields.push((field.name.name.as_str(), self.eval(here, &field.value)?));
        }
        Ok(Value::Record(Rc::new(Record {
            name: &name.name,
            fields,
        })))
    }

    /// What the `scene` block of a file says, read before everything else.
    pub(crate) fn scene_block(&mut self, block: &'a Block) {
        let one_of = |e: &mut Self, field: &'a Field, allowed: &[&str]| -> Option<usize> {
            let given = word(&field.value).map(|word| word.name.as_str());
            let found = given.and_then(|given| allowed.iter().position(|a| *a == given));
            if found.is_none() {
                let all = allowed.join(", ");
                let message = format!("`{}` is one of {all}", field.name.name);
                let diagnostic = Diagnostic::error(codes::E0301, field.value.span, message);
                let near = given.and_then(|given| nearest(given, allowed.iter().copied()));
                e.report(suggest(diagnostic, field.value.span, near));
            }
            found
        };
        for field in &block.fields {
            match field.name.name.as_str() {
                "units" => {
                    // `in` is a reserved word.
                    if let Some(at) = one_of(self, field, &["mm", "cm", "m", "inch"]) {
                        self.unit = [1.0, 10.0, 1000.0, 25.4][at];
                    }
                }
                "up" => {
                    if let Some(at) = one_of(self, field, &["y", "z"]) {
                        self.z_up = at == 1;
                    }
                }
                _ => {}
            }
        }
    }

    fn given(&self, block: &'a Block, name: &str) -> Option<&'a Field> {
        block.fields.iter().find(|field| field.name.name == name)
    }

    /// The numbers of a field: one, or three.
    fn field_numbers(
        &mut self,
        here: &Here<'a>,
        field: &'a Field,
        form: Form,
        wanted: Wanted<'_>,
    ) -> Result<Option<[ExprId; 3]>, Halt> {
        let span = field.value.span;
        let mut value = self.eval(here, &field.value)?;
        if wanted.stage > Stage::Uniform {
            value = self.surface_value(value, span)?;
        }
        let numbers = match (form, parts(&value)) {
            (Form::Color, Some((Form::Color | Form::Vector(3), numbers)))
            | (Form::Vector(3), Some((Form::Vector(3), numbers)))
            | (Form::Scalar, Some((Form::Scalar, numbers))) => numbers,
            _ => {
                let noun = match form {
                    Form::Scalar => "a number",
                    Form::Vector(_) => "a vec3",
                    Form::Color => "a color",
                };
                self.wrong(&value, &format!("{} is {noun}", wanted.what), span);
                return Ok(None);
            }
        };
        let ids = [numbers[0].id, numbers[1].id, numbers[2].id];
        for (id, number) in ids.iter().zip(numbers).take(form.len()) {
            let stage = self.graph.stage(*id);
            if stage > wanted.stage {
                self.report_late(wanted.what, stage, span);
                return Ok(None);
            }
            if number.quantity == Quantity::Angle {
                let message = format!("{} is not an angle", wanted.what);
                self.report(Diagnostic::error(codes::E0303, span, message));
                return Ok(None);
            }
            if self.finite(*id, span).is_none() {
                return Ok(None);
            }
        }
        Ok(Some(ids))
    }

    fn vector_field(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
        name: &str,
    ) -> Result<Option<Triple>, Halt> {
        let Some(field) = self.given(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let wanted = Wanted {
            what: &what,
            stage: Stage::Uniform,
        };
        self.field_numbers(here, field, Form::Vector(3), wanted)
    }

    fn color_field(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
        name: &str,
        stage: Stage,
    ) -> Result<Option<Triple>, Halt> {
        let Some(field) = self.given(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        self.field_numbers(here, field, Form::Color, Wanted { what: &what, stage })
    }

    /// A number that must not be negative, nor above a limit.
    fn number_field(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
        name: &str,
        stage: Stage,
        limit: f64,
    ) -> Result<Option<ExprId>, Halt> {
        let Some(field) = self.given(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let wanted = Wanted { what: &what, stage };
        let Some([id, ..]) = self.field_numbers(here, field, Form::Scalar, wanted)? else {
            return Ok(None);
        };
        if self.is_uniform(id) {
            let now = self.present(id);
            if !(0.0..=limit).contains(&now) {
                let range = match limit.is_finite() {
                    true => format!("from 0 to {limit}"),
                    false => "0 or larger".to_owned(),
                };
                let message = format!("{what} is {range}, and this is {}", short(now));
                self.report(Diagnostic::error(codes::E0401, field.value.span, message));
                return Ok(None);
            }
        }
        Ok(Some(id))
    }

    /// A whole number that is known while compiling.
    fn count_field(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
        name: &str,
        range: std::ops::RangeInclusive<u32>,
    ) -> Result<Option<u32>, Halt> {
        let Some(field) = self.given(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let wanted = Wanted {
            what: &what,
            stage: Stage::Uniform,
        };
        match self.field_numbers(here, field, Form::Scalar, wanted)? {
            Some([id, ..]) => Ok(self.count(&what, id, range, field.value.span)),
            None => Ok(None),
        }
    }

    fn count(
        &mut self,
        what: &str,
        id: ExprId,
        range: std::ops::RangeInclusive<u32>,
        span: Span,
    ) -> Option<u32> {
        let value = self.demand(id, &Demand::new(what, span))?;
        let (low, high) = (f64::from(*range.start()), f64::from(*range.end()));
        if !(low..=high).contains(&value) || value.fract() != 0.0 {
            let value = short(value);
            let message =
                format!("{what} is a whole number from {low} to {high}, and this is {value}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        Some(value as u32)
    }

    fn angle_field(
        &mut self,
        here: &Here<'a>,
        block: &'a Block,
        name: &str,
    ) -> Result<Option<ExprId>, Halt> {
        let Some(field) = self.given(block, name) else {
            return Ok(None);
        };
        let value = self.eval(here, &field.value)?;
        match value {
            Value::Number(number) => {
                Ok(self.angle(name, number, field.value.span, field.name.span))
            }
            other => {
                let wanted = format!("`{name}` of a {} is an angle", block.kind.name);
                self.wrong(&other, &wanted, field.value.span);
                Ok(None)
            }
        }
    }

    fn material_block(&mut self, here: &Here<'a>, block: &'a Block) -> Result<Value<'a>, Halt> {
        let Some(name) = &block.name else {
            let message = "a material needs a name";
            let example = "write `material stone { color: #8a8a8a }`";
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).help(example));
            return Ok(Value::Poison);
        };
        let stage = Stage::Normal;
        let errors = self.reports.error_count();
        let default = self.materials[0].clone();
        let albedo = self.color_field(here, block, "color", stage)?;
        let roughness = self.number_field(here, block, "roughness", stage, 1.0)?;
        let metallic = self.number_field(here, block, "metallic", stage, 1.0)?;
        let emission = self.color_field(here, block, "emission", stage)?;
        let bump = match self.given(block, "bump") {
            Some(field) => {
                let wanted = Wanted {
                    what: "`bump` of a material",
                    stage: Stage::Point,
                };
                let numbers = self.field_numbers(here, field, Form::Scalar, wanted)?;
                numbers.map(|[height, ..]| height)
            }
            None => None,
        };
        if self.reports.error_count() > errors {
            return Ok(Value::Poison);
        }
        Ok(Value::Material(self.material(Material {
            name: name.name.clone(),
            albedo: albedo.unwrap_or(default.albedo),
            roughness: roughness.unwrap_or(default.roughness),
            metallic: metallic.unwrap_or(default.metallic),
            emission: emission.unwrap_or(default.emission),
            bump,
        })))
    }

    fn block_name(&self, block: &ast::Block) -> String {
        block
            .name
            .as_ref()
            .map_or_else(String::new, |name| name.name.clone())
    }
}
