//! Blocks: `camera`, `light`, `material`, `sky`, `render`, `animate`, `scene` and `record`, with
//! their fields and defaults.

use super::Elaborator;
use super::bound::short;
use super::calls::word;
use super::diagnose::{nearest, suggest, unknown_name};
use super::evaluate::{Halt, Here};
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{Quantity, Record, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{
    Animation, Camera, Lens, Light, LightSource, Material, Normals, Occlusion, Render, Shadow, Sky,
    Tonemap, Triple,
};
use sdfc_lang::ast::{self, Block, ExprKind, Field};
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

    fn camera(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
        let name = self.block_name(block);
        if !name.is_empty() && self.cameras.iter().any(|camera| camera.name == name) {
            let message = format!("there are two cameras `{name}`");
            let span = block
                .name
                .as_ref()
                .map_or(block.kind.span, |name| name.span);
            self.report(Diagnostic::error(codes::E0214, span, message));
            return Ok(());
        }
        let from = self.vector_field(here, block, "from")?;
        let look = self.vector_field(here, block, "look")?;
        let up = self.vector_field(here, block, "up")?;
        let fov = self.angle_field(here, block, "fov")?;
        let height = self.number_field(here, block, "height", Stage::Uniform, f64::INFINITY)?;
        let mut camera = self.automatic_camera();
        camera.name = name;
        camera.automatic = from.is_none();
        camera.from = from.unwrap_or(camera.from);
        camera.look = look.unwrap_or(camera.look);
        let (lens, place) = match (fov, height) {
            (Some(_), Some(_)) => {
                let message = "a camera has `fov` (perspective) or `height` (parallel), not both";
                self.report(Diagnostic::error(codes::E0208, block.kind.span, message));
                return Ok(());
            }
            (None, Some(height)) => (Lens::Orthographic { height }, "height"),
            (Some(fov), None) => (Lens::Perspective { fov }, "fov"),
            (None, None) => (camera.lens, ""),
        };
        camera.lens = lens;
        if let Some(field) = self.given(block, place) {
            let (id, most) = match lens {
                Lens::Perspective { fov } => (fov, std::f64::consts::PI),
                Lens::Orthographic { height } => (height, f64::INFINITY),
            };
            let now = self.present(id);
            if !(now > 0.0 && now < most) {
                let message = match lens {
                    Lens::Perspective { .. } => {
                        let now = short(now.to_degrees());
                        format!("a field of view lies between 0 and 180 degrees, and this is {now}")
                    }
                    Lens::Orthographic { .. } => {
                        format!(
                            "the height of a view is larger than 0, and this is {}",
                            short(now)
                        )
                    }
                };
                self.report(Diagnostic::error(codes::E0401, field.value.span, message));
            }
        }
        self.aim(&mut camera, up, block);
        self.cameras.push(camera);
        Ok(())
    }

    /// Checks that a camera looks somewhere, and chooses what is up if it looks straight down.
    fn aim(&mut self, camera: &mut Camera, up: Option<Triple>, block: &Block) {
        let at = |e: &mut Self, v: Triple| v.map(|id| e.present(id));
        let (from, look) = (at(self, camera.from), at(self, camera.look));
        let way: [f64; 3] = std::array::from_fn(|i| look[i] - from[i]);
        let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !camera.automatic && length(way) == 0.0 {
            let message = "the camera is at the very point that it looks at";
            self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
            return;
        }
        let upright = up.unwrap_or(camera.up);
        let upwards = at(self, upright);
        let across = [
            way[1] * upwards[2] - way[2] * upwards[1],
            way[2] * upwards[0] - way[0] * upwards[2],
            way[0] * upwards[1] - way[1] * upwards[0],
        ];
        let is_along = length(across) <= 1e-6 * length(way) * length(upwards);
        camera.up = upright;
        if !camera.automatic && is_along {
            if up.is_some() {
                let message = "the camera looks along its own `up`";
                self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
                return;
            }
            // Seen from above, as on a map.
            let north = if self.z_up {
                [0.0, 1.0, 0.0]
            } else {
                [0.0, 0.0, -1.0]
            };
            camera.up = north.map(|v| self.graph.constant(v));
        }
    }

    /// The camera of a scene without one.
    pub(crate) fn automatic_camera(&mut self) -> Camera {
        let mut c = |v: f64| self.graph.constant(v);
        let from = if self.z_up {
            [3.0, -4.0, 2.5]
        } else {
            [3.0, 2.5, 4.0]
        };
        let up = if self.z_up {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        Camera {
            name: String::new(),
            from: from.map(&mut c),
            look: [0.0; 3].map(&mut c),
            up: up.map(&mut c),
            lens: Lens::Perspective {
                fov: c(35.0_f64.to_radians()),
            },
            automatic: true,
        }
    }

    fn light(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
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

    fn sky_block(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
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
        let dim = horizon.map(|id| self.op(sdfc_vm::table::Op::Mul, &[id, share]));
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

    fn render_block(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
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
            steps: 256,
            far: None,
            occlusion: Occlusion::FiveTap,
            occlusion_reach: None,
            normals: Normals::Exact,
            tonemap: Tonemap::Aces,
            exposure: self.graph.constant(1.0),
        }
    }

    fn animate(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
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

    fn block_name(&self, block: &ast::Block) -> String {
        block
            .name
            .as_ref()
            .map_or_else(String::new, |name| name.name.clone())
    }
}
