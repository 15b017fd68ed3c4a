//! Blocks: `camera`, `light`, `material`, `sky`, `render`, `animate`, `scene` and `record`, with
//! their fields and defaults.

mod camera;
mod light;
mod render;

use super::Elaborator;
use super::arguments::word;
use super::constness::Demand;
use super::diagnose::{nearest, suggest, unknown_name};
use super::dialects::field_of_dialects;
use super::display::format_short;
use super::numbers::{Form, components};
use super::value::{Abort, Env, Quantity, Record, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{ExprTriple, Material};
use sdfc_lang::ast::{self, Block, Field};
use sdfc_lang::{Diagnostic, Span, codes};
use std::rc::Rc;

/// Kinds of blocks with their fields. A record may have any field.
pub(crate) const BLOCK_KINDS: [(&str, &[&str]); 8] = [
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

/// Fields whose value may be a bare word, by kind of block and name.
pub(crate) const WORD_FIELDS: [(&str, &str); 6] = [
    ("scene", "units"),
    ("scene", "up"),
    ("light", "shadow"),
    ("render", "occlusion"),
    ("render", "normals"),
    ("render", "tonemap"),
];

/// Requirements on the value of a field.
#[derive(Clone, Copy)]
struct FieldRequirement<'w> {
    /// The field as a subject of a sentence: "`fov` of a camera".
    subject: &'w str,
    /// The latest stage that the value may depend on.
    max_stage: Stage,
}

impl<'a> Elaborator<'a> {
    /// Evaluates a block. In an imported file, only materials and records have an effect.
    pub(crate) fn block(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
    ) -> Result<Option<Value<'a>>, Abort> {
        let kind = block.kind.name.as_str();
        let Some((_, fields)) = BLOCK_KINDS.iter().find(|(name, _)| *name == kind) else {
            let names = BLOCK_KINDS.iter().map(|(name, _)| *name);
            let diagnostic =
                unknown_name(codes::E0207, "block", kind, block.kind.span, names.clone());
            let list = names.collect::<Vec<_>>().join(", ");
            self.report(match diagnostic.fixes.is_empty() {
                true => diagnostic.help(format!("the blocks are {list}")),
                false => diagnostic,
            });
            return Ok(None);
        };
        if kind == "record" {
            return self.record(env, block).map(Some);
        }
        self.check_fields(block, fields);
        if kind == "material" {
            return self.material_block(env, block).map(Some);
        }
        if env.module != self.root() {
            return Ok(None);
        }
        match kind {
            "camera" => self.camera(env, block)?,
            "light" => self.light(env, block)?,
            "sky" => self.sky_block(env, block)?,
            "render" => self.render_block(env, block)?,
            "animate" => self.animate(env, block)?,
            // The `scene` block was evaluated before all items.
            _ => {}
        }
        Ok(None)
    }

    fn check_fields(&mut self, block: &Block, allowed: &[&str]) {
        for (index, field) in block.fields.iter().enumerate() {
            let name = field.name.name.as_str();
            let kind = block.kind.name.as_str();
            if !allowed.contains(&name) {
                let message = format!("`{kind}` has no field `{name}`");
                let diagnostic = Diagnostic::error(codes::E0208, field.name.span, message);
                let span = field.name.span;
                let suggestion = nearest(name, allowed.iter().copied());
                let diagnostic = match (field_of_dialects(kind, name), suggestion) {
                    (Some((Some(replacement), text)), _) => diagnostic.fix(span, replacement, text),
                    (Some((None, text)), _) => diagnostic.help(text),
                    (None, Some(_)) => suggest(diagnostic, span, suggestion),
                    (None, None) => {
                        diagnostic.help(format!("its fields are {}", allowed.join(", ")))
                    }
                };
                self.report(diagnostic);
            } else if let Some(first) = block.fields[..index]
                .iter()
                .find(|other| other.name.name == field.name.name)
            {
                let message = format!("`{name}` is given twice");
                let diagnostic = Diagnostic::error(codes::E0206, field.name.span, message);
                self.report(diagnostic.label(first.name.span, "the first one"));
            }
        }
    }

    fn record(&mut self, env: &Env<'a>, block: &'a Block) -> Result<Value<'a>, Abort> {
        let Some(name) = &block.name else {
            let message = "a record needs a name";
            let example = "write `record size { width: 2, height: 1 }`";
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).help(example));
            return Ok(Value::Poison);
        };
        let mut fields = Vec::with_capacity(block.fields.len());
        for field in &block.fields {
            fields.push((field.name.name.as_str(), self.eval(env, &field.value)?));
        }
        Ok(Value::Record(Rc::new(Record {
            name: &name.name,
            fields,
        })))
    }

    /// Applies the `scene` block of a file, before everything else.
    pub(crate) fn scene_block(&mut self, block: &'a Block) {
        let word_index = |e: &mut Self, field: &'a Field, allowed: &[&str]| -> Option<usize> {
            let written = word(&field.value).map(|word| word.name.as_str());
            let index = written.and_then(|written| allowed.iter().position(|a| *a == written));
            if index.is_none() {
                let list = allowed.join(", ");
                let message = format!("`{}` is one of {list}", field.name.name);
                let diagnostic = Diagnostic::error(codes::E0301, field.value.span, message);
                let suggestion =
                    written.and_then(|written| nearest(written, allowed.iter().copied()));
                e.report(suggest(diagnostic, field.value.span, suggestion));
            }
            index
        };
        for field in &block.fields {
            match field.name.name.as_str() {
                "units" => {
                    // `in` is a reserved word.
                    if let Some(index) = word_index(self, field, &["mm", "cm", "m", "inch"]) {
                        self.unit_mm = [1.0, 10.0, 1000.0, 25.4][index];
                    }
                }
                "up" => {
                    if let Some(index) = word_index(self, field, &["y", "z"]) {
                        self.z_up = index == 1;
                    }
                }
                _ => {}
            }
        }
    }

    fn find_field(&self, block: &'a Block, name: &str) -> Option<&'a Field> {
        block.fields.iter().find(|field| field.name.name == name)
    }

    /// Evaluates a field to numbers: one scalar, or three components.
    fn field_numbers(
        &mut self,
        env: &Env<'a>,
        field: &'a Field,
        form: Form,
        requirement: FieldRequirement<'_>,
    ) -> Result<Option<[ExprId; 3]>, Abort> {
        let span = field.value.span;
        let mut value = self.eval(env, &field.value)?;
        if requirement.max_stage > Stage::Uniform {
            value = self.surface_value(value, span)?;
        }
        let numbers = match (form, components(&value)) {
            (Form::Color, Some((Form::Color | Form::Vector(3), numbers)))
            | (Form::Vector(3), Some((Form::Vector(3), numbers)))
            | (Form::Scalar, Some((Form::Scalar, numbers))) => numbers,
            _ => {
                let noun = match form {
                    Form::Scalar => "a number",
                    Form::Vector(_) => "a vec3",
                    Form::Color => "a color",
                };
                self.report_wrong(&value, &format!("{} is {noun}", requirement.subject), span);
                return Ok(None);
            }
        };
        let ids = [numbers[0].id, numbers[1].id, numbers[2].id];
        for (id, number) in ids.iter().zip(numbers).take(form.len()) {
            let stage = self.expressions.stage(*id);
            if stage > requirement.max_stage {
                self.report_too_late(requirement.subject, stage, span);
                return Ok(None);
            }
            if number.quantity == Quantity::Angle {
                let message = format!("{} is not an angle", requirement.subject);
                self.report(Diagnostic::error(codes::E0303, span, message));
                return Ok(None);
            }
            if self.require_finite(*id, span).is_none() {
                return Ok(None);
            }
        }
        Ok(Some(ids))
    }

    fn vector_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
    ) -> Result<Option<ExprTriple>, Abort> {
        let Some(field) = self.find_field(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let requirement = FieldRequirement {
            subject: &what,
            max_stage: Stage::Uniform,
        };
        self.field_numbers(env, field, Form::Vector(3), requirement)
    }

    fn color_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
        stage: Stage,
    ) -> Result<Option<ExprTriple>, Abort> {
        let Some(field) = self.find_field(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        self.field_numbers(
            env,
            field,
            Form::Color,
            FieldRequirement {
                subject: &what,
                max_stage: stage,
            },
        )
    }

    /// Evaluates a field to a number.
    fn scalar_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
        stage: Stage,
    ) -> Result<Option<ExprId>, Abort> {
        let Some(field) = self.find_field(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let requirement = FieldRequirement {
            subject: &what,
            max_stage: stage,
        };
        let numbers = self.field_numbers(env, field, Form::Scalar, requirement)?;
        Ok(numbers.map(|[id, ..]| id))
    }

    /// Evaluates a field to a number from 0 to `limit`.
    fn number_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
        stage: Stage,
        limit: f64,
    ) -> Result<Option<ExprId>, Abort> {
        let id = self.scalar_field(env, block, name, stage)?;
        let (Some(id), Some(field)) = (id, self.find_field(block, name)) else {
            return Ok(None);
        };
        if self.is_uniform(id) {
            let value = self.current_value(id);
            if !(0.0..=limit).contains(&value) {
                let range = match limit.is_finite() {
                    true => format!("from 0 to {limit}"),
                    false => "0 or larger".to_owned(),
                };
                let kind = &block.kind.name;
                let message = format!(
                    "`{name}` of a {kind} is {range}, and this is {}",
                    format_short(value)
                );
                self.report(Diagnostic::error(codes::E0401, field.value.span, message));
                return Ok(None);
            }
        }
        Ok(Some(id))
    }

    /// Evaluates a field to an integer within the range, at compile time.
    fn count_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
        range: std::ops::RangeInclusive<u32>,
    ) -> Result<Option<u32>, Abort> {
        let Some(field) = self.find_field(block, name) else {
            return Ok(None);
        };
        let what = format!("`{name}` of a {}", block.kind.name);
        let requirement = FieldRequirement {
            subject: &what,
            max_stage: Stage::Uniform,
        };
        match self.field_numbers(env, field, Form::Scalar, requirement)? {
            Some([id, ..]) => Ok(self.integer_in_range(&what, id, range, field.value.span)),
            None => Ok(None),
        }
    }

    fn integer_in_range(
        &mut self,
        what: &str,
        id: ExprId,
        range: std::ops::RangeInclusive<u32>,
        span: Span,
    ) -> Option<u32> {
        let value = self.demand(id, &Demand::new(what, span))?;
        let (low, high) = (f64::from(*range.start()), f64::from(*range.end()));
        if !(low..=high).contains(&value) || value.fract() != 0.0 {
            let value = format_short(value);
            let message =
                format!("{what} is a whole number from {low} to {high}, and this is {value}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        Some(value as u32)
    }

    fn angle_field(
        &mut self,
        env: &Env<'a>,
        block: &'a Block,
        name: &str,
    ) -> Result<Option<ExprId>, Abort> {
        let Some(field) = self.find_field(block, name) else {
            return Ok(None);
        };
        let value = self.eval(env, &field.value)?;
        match value {
            Value::Number(number) => {
                Ok(self.angle(name, number, field.value.span, field.name.span))
            }
            other => {
                let message = format!("`{name}` of a {} is an angle", block.kind.name);
                self.report_wrong(&other, &message, field.value.span);
                Ok(None)
            }
        }
    }

    fn material_block(&mut self, env: &Env<'a>, block: &'a Block) -> Result<Value<'a>, Abort> {
        let Some(name) = &block.name else {
            let message = "a material needs a name";
            let example = "write `material stone { color: #8a8a8a }`";
            self.report(Diagnostic::error(codes::E0204, block.kind.span, message).help(example));
            return Ok(Value::Poison);
        };
        let stage = Stage::Normal;
        let errors = self.reports.error_count();
        let default = self.materials[0].clone();
        let albedo = self.color_field(env, block, "color", stage)?;
        let roughness = self.number_field(env, block, "roughness", stage, 1.0)?;
        let metallic = self.number_field(env, block, "metallic", stage, 1.0)?;
        let emission = self.color_field(env, block, "emission", stage)?;
        let bump = match self.find_field(block, "bump") {
            Some(field) => {
                let requirement = FieldRequirement {
                    subject: "`bump` of a material",
                    max_stage: Stage::Point,
                };
                let numbers = self.field_numbers(env, field, Form::Scalar, requirement)?;
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
