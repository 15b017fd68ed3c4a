//! The scene as text, for `--emit scene` and for tests: every shape on a line of its own, operands
//! first, with its numbers as formulas.
//!
//! A formula that is used more than once, or is very deep, is written once in the list of numbers.

use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::{
    Camera, Lens, Light, LightSource, Material, Others, Param, ParamKind, Scene, Shadow, Shape,
    ShapeId, ShapeKind, Triple,
};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::Row;
use sdfc_vm::table::Op;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The deepest formula on one line.
const MAX_LEVELS: u32 = 8;

/// The whole scene as text.
pub fn dump(scene: &Scene) -> String {
    let mut text = String::new();
    let formulas = Formulas::of(scene);
    let mut line = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    if scene.z_up {
        line("up z".to_owned());
    }
    for param in &scene.params {
        line(param_line(param));
    }
    for (id, name) in &formulas.names {
        line(format!("{name} = {}", formulas.definition(*id)));
    }
    for (at, material) in scene.materials.iter().enumerate() {
        line(format!("m{at} {}", material_line(material, &formulas)));
    }
    for (at, shape) in scene.shapes.iter().enumerate() {
        line(format!("s{at} {}", shape_line(shape, &formulas)));
    }
    for (name, id) in &scene.parts {
        line(format!("part {name} = s{}", id.0));
    }
    if let Some(root) = scene.root {
        line(format!("root s{}", root.0));
    }
    for camera in &scene.cameras {
        line(camera_line(camera, &formulas));
    }
    for light in &scene.lights {
        line(light_line(light, &formulas));
    }
    let sky = &scene.sky;
    let fog = sky
        .fog
        .map_or_else(String::new, |fog| format!(" fog {}", formulas.of_id(fog)));
    line(format!(
        "sky top {} horizon {} ground {} ambient {}{fog}",
        formulas.triple(sky.top),
        formulas.triple(sky.horizon),
        formulas.triple(sky.ground),
        formulas.of_id(sky.ambient),
    ));
    let render = &scene.render;
    let far = render.far.map_or_else(|| "automatic".to_owned(), short);
    line(format!(
        "render {}x{} aa {} steps {} far {far} occlusion {:?} normals {:?} tonemap {:?} exposure {}",
        render.size[0],
        render.size[1],
        render.aa,
        render.steps,
        render.occlusion,
        render.normals,
        render.tonemap,
        formulas.of_id(render.exposure),
    ));
    if let Some(animation) = scene.animation {
        let repeats = if animation.repeats { " loop" } else { "" };
        line(format!(
            "animate {}s at {} frames per second{repeats}",
            short(animation.duration),
            short(animation.fps)
        ));
    }
    for check in &scene.checks {
        let sign = if check.strict { ">" } else { ">=" };
        line(format!(
            "check {} {sign} 0: {}",
            formulas.of_id(check.value),
            check.message
        ));
    }
    for printed in &scene.printed {
        line(format!("print {printed}"));
    }
    text
}

fn param_line(param: &Param) -> String {
    let kind = match param.kind {
        ParamKind::Float => "float",
        ParamKind::Int => "int",
        ParamKind::Bool => "bool",
        ParamKind::Length => "length",
        ParamKind::Angle => "angle",
        ParamKind::Time => "time",
        ParamKind::Color => "color",
        ParamKind::Vec2 => "vec2",
        ParamKind::Vec3 => "vec3",
    };
    let value: Vec<String> = param.value.iter().map(|v| short(*v)).collect();
    let mut line = format!("param {}: {kind} = {}", param.name, value.join(", "));
    if let Some((low, high)) = param.range {
        let dots = if param.inclusive { "..=" } else { ".." };
        let _ = write!(line, " in {}{dots}{}", short(low), short(high));
    }
    if let Some(step) = param.step {
        let _ = write!(line, " by {}", short(step));
    }
    line.push_str(if param.structural {
        " (structural)"
    } else {
        " (live)"
    });
    if !param.doc.is_empty() {
        let _ = write!(line, " // {}", param.doc.replace('\n', " "));
    }
    line
}

fn material_line(material: &Material, formulas: &Formulas<'_>) -> String {
    let mut line = format!(
        "material {}: albedo {} roughness {} metallic {} emission {}",
        if material.name.is_empty() {
            "(unnamed)"
        } else {
            &material.name
        },
        formulas.triple(material.albedo),
        formulas.of_id(material.roughness),
        formulas.of_id(material.metallic),
        formulas.triple(material.emission),
    );
    if let Some(bump) = material.bump {
        let _ = write!(line, " bump {}", formulas.of_id(bump));
    }
    line
}

/// The other copies that are evaluated: how many on the nearer side, and on the other.
fn others(Others { near, far }: Others) -> String {
    format!("{near}+{far}")
}

fn shape_line(shape: &Shape, formulas: &Formulas<'_>) -> String {
    let operands = |ids: &[ShapeId]| {
        ids.iter()
            .map(|id| format!("s{}", id.0))
            .collect::<Vec<_>>()
            .join(" ")
    };
    let row = |op: Op, children: &[ShapeId], parameters: &[ExprId]| {
        let row = op.row();
        let parts = [
            row.name.to_owned(),
            operands(children),
            named(row, parameters, formulas),
        ];
        parts
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let what = match &shape.kind {
        ShapeKind::Primitive { op, parameters } => row(*op, &[], parameters),
        ShapeKind::Field {
            value,
            slope,
            region,
        } => {
            let slope =
                slope.map_or_else(String::new, |s| format!(" lipschitz {}", formulas.of_id(s)));
            format!(
                "field {}{slope}{}",
                formulas.of_id(*value),
                region_text(region)
            )
        }
        ShapeKind::Polygon { points } => {
            let points = points
                .iter()
                .map(|[x, y]| format!("[{}, {}]", formulas.of_id(*x), formulas.of_id(*y)));
            format!("polygon {}", points.collect::<Vec<_>>().join(" "))
        }
        ShapeKind::Combine {
            op,
            children,
            parameters,
        } => row(*op, children, parameters),
        ShapeKind::Frame {
            child,
            matrix,
            scale,
        } => frame(*child, matrix, *scale, formulas),
        ShapeKind::Repeat {
            op,
            child,
            parameters,
            others: [x, y, z],
        } => format!(
            "{}, others {} {} {}",
            row(*op, &[*child], parameters),
            others(*x),
            others(*y),
            others(*z)
        ),
        ShapeKind::Polar {
            op,
            child,
            parameters,
            others: sectors,
        } => format!(
            "{}, others {}",
            row(*op, &[*child], parameters),
            others(*sectors)
        ),
        ShapeKind::Domain {
            op,
            child,
            parameters,
        }
        | ShapeKind::Distance {
            op,
            child,
            parameters,
        } => row(*op, &[*child], parameters),
        ShapeKind::Warp { child, point } => {
            format!("warp s{} by {}", child.0, formulas.triple(*point))
        }
        ShapeKind::Displace { child, amount } => {
            format!("displace s{} by {}", child.0, formulas.of_id(*amount))
        }
        ShapeKind::Painted { child, material } => format!("paint s{} m{}", child.0, material.0),
        ShapeKind::Nothing => "nothing".to_owned(),
    };
    let plane = if shape.plane { " (2D)" } else { "" };
    match shape.name.as_str() {
        "" => format!("= {what}{plane}"),
        name => format!("{name} = {what}{plane}"),
    }
}

fn frame(child: ShapeId, matrix: &[ExprId; 12], scale: ExprId, formulas: &Formulas<'_>) -> String {
    let is = |at: usize, value: f64| formulas.graph.as_constant(matrix[at]) == Some(value);
    let linear = (0..12).filter(|at| at % 4 != 3);
    let is_shift = linear
        .clone()
        .all(|at| is(at, if at / 4 == at % 4 { 1.0 } else { 0.0 }));
    let shifts = [3, 7, 11];
    if is_shift {
        let by: Vec<String> = shifts.map(|at| formulas.of_id(matrix[at])).to_vec();
        return format!("frame s{} p + [{}]", child.0, by.join(", "));
    }
    let rows: Vec<String> = (0..3)
        .map(|row| {
            let numbers = (0..4).map(|at| formulas.of_id(matrix[4 * row + at]));
            format!("[{}]", numbers.collect::<Vec<_>>().join(", "))
        })
        .collect();
    let scale = match formulas.graph.as_constant(scale) {
        Some(1.0) => String::new(),
        _ => format!(" scale {}", formulas.of_id(scale)),
    };
    format!("frame s{} {}{scale}", child.0, rows.join(" "))
}

fn named(row: &Row, parameters: &[ExprId], formulas: &Formulas<'_>) -> String {
    let mut numbers = parameters.iter();
    let mut parts = Vec::new();
    for parameter in row.parameters {
        let width = parameter.ty.width();
        let values: Vec<String> = numbers
            .by_ref()
            .take(width)
            .map(|id| formulas.of_id(*id))
            .collect();
        parts.push(match values.as_slice() {
            [one] => format!("{} {one}", parameter.name),
            several => format!("{} [{}]", parameter.name, several.join(", ")),
        });
    }
    parts.join(" ")
}

fn region_text(region: &Bounds) -> String {
    if *region == Bounds::EVERYTHING {
        return String::new();
    }
    let corner = |v: [f64; 3]| v.map(short).join(", ");
    format!(" within [{}] [{}]", corner(region.min), corner(region.max))
}

fn camera_line(camera: &Camera, formulas: &Formulas<'_>) -> String {
    let lens = match camera.lens {
        Lens::Perspective(fov) => format!("fov {}", formulas.of_id(fov)),
        Lens::Orthographic(height) => format!("height {}", formulas.of_id(height)),
    };
    let automatic = if camera.automatic { " (automatic)" } else { "" };
    let name = spaced(&camera.name);
    format!(
        "camera{name} from {} look {} up {} {lens}{automatic}",
        formulas.triple(camera.from),
        formulas.triple(camera.look),
        formulas.triple(camera.up),
    )
}

fn light_line(light: &Light, formulas: &Formulas<'_>) -> String {
    let source = match light.source {
        LightSource::Directional(dir) => format!("dir {}", formulas.triple(dir)),
        LightSource::Point(at) => format!("at {}", formulas.triple(at)),
    };
    let shadow = match light.shadow {
        Shadow::None => "none".to_owned(),
        Shadow::Hard => "hard".to_owned(),
        Shadow::Plain(width) => format!("plain({})", formulas.of_id(width)),
        Shadow::Soft(width) => format!("soft({})", formulas.of_id(width)),
        Shadow::Sized(width) => format!("sized({})", formulas.of_id(width)),
    };
    format!(
        "light{} {source} color {} intensity {} shadow {shadow}",
        spaced(&light.name),
        formulas.triple(light.color),
        formulas.of_id(light.intensity),
    )
}

fn spaced(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" {name}")
    }
}

/// A number with at most six decimals.
fn short(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if value.abs() < 1e9 && (rounded != 0.0 || value == 0.0) {
        format!("{}", rounded + 0.0)
    } else {
        format!("{value:e}")
    }
}

/// The numbers of a scene as formulas.
struct Formulas<'s> {
    graph: &'s Expressions,
    params: &'s [Param],
    /// The numbers that have a name of their own.
    names: BTreeMap<ExprId, String>,
}

impl<'s> Formulas<'s> {
    fn of(scene: &'s Scene) -> Self {
        let graph = &scene.expressions;
        let mut uses: BTreeMap<ExprId, u32> = BTreeMap::new();
        let mut pending = used_numbers(scene);
        for &id in &pending {
            *uses.entry(id).or_default() += 1;
        }
        let mut seen: BTreeSet<ExprId> = BTreeSet::new();
        while let Some(id) = pending.pop() {
            if seen.insert(id) {
                for operand in operands(graph, id) {
                    *uses.entry(operand).or_default() += 1;
                    pending.push(operand);
                }
            }
        }
        // Operands have lower ids, so levels are known in order.
        let mut levels: BTreeMap<ExprId, u32> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for &id in &seen {
            let inner = operands(graph, id)
                .into_iter()
                .map(|o| match names.contains_key(&o) {
                    true => 0,
                    false => levels.get(&o).copied().unwrap_or(0),
                });
            let level = inner.max().map_or(0, |level| level + 1);
            levels.insert(id, level);
            if level > 0 && (uses[&id] > 1 || level > MAX_LEVELS) {
                names.insert(id, format!("n{}", names.len()));
            }
        }
        Self {
            graph,
            params: &scene.params,
            names,
        }
    }

    fn of_id(&self, id: ExprId) -> String {
        match self.names.get(&id) {
            Some(name) => name.clone(),
            None => self.definition(id),
        }
    }

    fn triple(&self, numbers: Triple) -> String {
        format!("[{}]", numbers.map(|id| self.of_id(id)).join(", "))
    }

    /// Recursion over at most [`MAX_LEVELS`] levels.
    fn definition(&self, id: ExprId) -> String {
        match self.graph.get(id) {
            Expression::Constant(value) => short(*value),
            Expression::Param(param, component) => {
                let Some(param) = self.params.get(param.0 as usize) else {
                    return String::new();
                };
                match (param.kind, component) {
                    (ParamKind::Color, at) => {
                        format!("{}.{}", param.name, ["r", "g", "b"][usize::from(*at)])
                    }
                    (ParamKind::Vec2 | ParamKind::Vec3, at) => {
                        format!("{}.{}", param.name, ["x", "y", "z"][usize::from(*at)])
                    }
                    _ => param.name.clone(),
                }
            }
            Expression::Time => "time".to_owned(),
            Expression::Coordinate(axis) => format!("p.{}", ["x", "y", "z"][usize::from(*axis)]),
            Expression::NormalComponent(axis) => {
                format!("n.{}", ["x", "y", "z"][usize::from(*axis)])
            }
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let list: Vec<String> = values.iter().map(|id| self.of_id(*id)).collect();
                let sign = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    Op::Div => "/",
                    Op::Less => "<",
                    _ => "",
                };
                if let ([a, b], false) = (list.as_slice(), sign.is_empty()) {
                    return format!("({a} {sign} {b})");
                }
                let mut arguments = list;
                if let Some(point) = point {
                    arguments.insert(0, self.triple(*point));
                }
                let named = named(op.row(), parameters, self);
                if !named.is_empty() {
                    arguments.push(named);
                }
                format!("{}({})", op.row().name, arguments.join(", "))
            }
        }
    }
}

fn operands(graph: &Expressions, id: ExprId) -> Vec<ExprId> {
    match graph.get(id) {
        Expression::Apply {
            point,
            values,
            parameters,
            ..
        } => point
            .iter()
            .flatten()
            .chain(values)
            .chain(parameters)
            .copied()
            .collect(),
        _ => Vec::new(),
    }
}

/// Every number that the scene itself names.
fn used_numbers(scene: &Scene) -> Vec<ExprId> {
    let mut ids: Vec<ExprId> = Vec::new();
    for shape in &scene.shapes {
        match &shape.kind {
            ShapeKind::Primitive { parameters, .. }
            | ShapeKind::Combine { parameters, .. }
            | ShapeKind::Repeat { parameters, .. }
            | ShapeKind::Polar { parameters, .. }
            | ShapeKind::Domain { parameters, .. }
            | ShapeKind::Distance { parameters, .. } => ids.extend(parameters),
            ShapeKind::Field { value, slope, .. } => {
                ids.push(*value);
                ids.extend(slope);
            }
            ShapeKind::Polygon { points } => ids.extend(points.iter().flatten()),
            ShapeKind::Frame { matrix, scale, .. } => {
                ids.extend(matrix);
                ids.push(*scale);
            }
            ShapeKind::Warp { point, .. } => ids.extend(point),
            ShapeKind::Displace { amount, .. } => ids.push(*amount),
            ShapeKind::Painted { .. } | ShapeKind::Nothing => {}
        }
    }
    for material in &scene.materials {
        ids.extend(
            material
                .albedo
                .iter()
                .chain(&material.emission)
                .chain(&material.bump),
        );
        ids.extend([material.roughness, material.metallic]);
    }
    for camera in &scene.cameras {
        ids.extend(camera.from.iter().chain(&camera.look).chain(&camera.up));
        ids.push(match camera.lens {
            Lens::Perspective(fov) => fov,
            Lens::Orthographic(height) => height,
        });
    }
    for light in &scene.lights {
        ids.extend(light.color);
        ids.push(light.intensity);
        match light.source {
            LightSource::Directional(v) | LightSource::Point(v) => ids.extend(v),
        }
        match light.shadow {
            Shadow::None | Shadow::Hard => {}
            Shadow::Plain(width) | Shadow::Soft(width) | Shadow::Sized(width) => ids.push(width),
        }
    }
    let sky = &scene.sky;
    ids.extend(
        sky.top
            .iter()
            .chain(&sky.horizon)
            .chain(&sky.ground)
            .chain(&sky.fog),
    );
    ids.extend([sky.ambient, scene.render.exposure]);
    ids.extend(scene.checks.iter().map(|check| check.value));
    ids
}
