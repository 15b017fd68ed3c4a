//! The scene as text, for `--emit scene` and for tests: one shape per line, operands first, with its
//! numbers as formulas.
//!
//! A formula with several uses, or a very deep one, is written once in the list of numbers.

use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::{
    ExprTriple, Material, NeighbourCells, ParamKind, Scene, SceneCamera, SceneLens, SceneLight,
    SceneLightSource, SceneParam, SceneShadow, Shape, ShapeId, ShapeKind,
};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, Row};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Maximum depth of a formula on one line.
const MAX_LEVELS: u32 = 8;

/// Returns the complete scene as text.
pub fn dump(scene: &Scene) -> String {
    let mut text = String::new();
    let formulas = FormulaTable::new(scene);
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
    for (index, material) in scene.materials.iter().enumerate() {
        line(format!("m{index} {}", material_line(material, &formulas)));
    }
    for (index, shape) in scene.shapes.iter().enumerate() {
        line(format!("s{index} {}", shape_line(shape, &formulas)));
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
        .map_or_else(String::new, |fog| format!(" fog {}", formulas.formula(fog)));
    line(format!(
        "sky top {} horizon {} ground {} ambient {}{fog}",
        formulas.triple(sky.top),
        formulas.triple(sky.horizon),
        formulas.triple(sky.ground),
        formulas.formula(sky.ambient),
    ));
    let render = &scene.render;
    let far_text = render.far.map_or_else(|| "automatic".to_owned(), short);
    line(format!(
        "render {}x{} aa {} steps {} far {far_text} occlusion {:?} normals {:?} tonemap {:?} exposure {}",
        render.size[0],
        render.size[1],
        render.aa,
        render.steps,
        render.occlusion,
        render.normals,
        render.tonemap,
        formulas.formula(render.exposure),
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
            formulas.formula(check.value),
            check.message
        ));
    }
    for printed in &scene.printed {
        line(format!("print {printed}"));
    }
    text
}

fn param_line(param: &SceneParam) -> String {
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

fn material_line(material: &Material, formulas: &FormulaTable<'_>) -> String {
    let mut line = format!(
        "material {}: albedo {} roughness {} metallic {} emission {}",
        if material.name.is_empty() {
            "(unnamed)"
        } else {
            &material.name
        },
        formulas.triple(material.albedo),
        formulas.formula(material.roughness),
        formulas.formula(material.metallic),
        formulas.triple(material.emission),
    );
    if let Some(bump) = material.bump {
        let _ = write!(line, " bump {}", formulas.formula(bump));
    }
    line
}

/// Returns the numbers of other copies that are evaluated, on the nearer side and on the other.
fn other_counts(NeighbourCells { near, far }: NeighbourCells) -> String {
    format!("{near}+{far}")
}

fn shape_line(shape: &Shape, formulas: &FormulaTable<'_>) -> String {
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
            named_parameters(row, parameters, formulas),
        ];
        parts
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let definition = match &shape.kind {
        ShapeKind::Primitive { op, parameters } => row(*op, &[], parameters),
        ShapeKind::Field {
            value,
            slope,
            region,
        } => {
            let slope = slope.map_or_else(String::new, |s| {
                format!(" lipschitz {}", formulas.formula(s))
            });
            format!(
                "field {}{slope}{}",
                formulas.formula(*value),
                region_text(region)
            )
        }
        ShapeKind::Polygon { points } => {
            let points = points
                .iter()
                .map(|[x, y]| format!("[{}, {}]", formulas.formula(*x), formulas.formula(*y)));
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
            other_counts(*x),
            other_counts(*y),
            other_counts(*z)
        ),
        ShapeKind::Polar {
            op,
            child,
            parameters,
            others: sectors,
        } => format!(
            "{}, others {}",
            row(*op, &[*child], parameters),
            other_counts(*sectors)
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
            format!("displace s{} by {}", child.0, formulas.formula(*amount))
        }
        ShapeKind::Painted { child, material } => format!("paint s{} m{}", child.0, material.0),
        ShapeKind::Nothing => "nothing".to_owned(),
    };
    let dimension = if shape.is_2d { " (2D)" } else { "" };
    match shape.name.as_str() {
        "" => format!("= {definition}{dimension}"),
        name => format!("{name} = {definition}{dimension}"),
    }
}

fn frame(
    child: ShapeId,
    matrix: &[ExprId; 12],
    scale: ExprId,
    formulas: &FormulaTable<'_>,
) -> String {
    let is_constant =
        |index: usize, value: f64| formulas.graph.as_constant(matrix[index]) == Some(value);
    let linear = (0..12).filter(|index| index % 4 != 3);
    let is_shift = linear
        .clone()
        .all(|index| is_constant(index, if index / 4 == index % 4 { 1.0 } else { 0.0 }));
    let shifts = [3, 7, 11];
    if is_shift {
        let shift: Vec<String> = shifts.map(|index| formulas.formula(matrix[index])).to_vec();
        return format!("frame s{} p + [{}]", child.0, shift.join(", "));
    }
    let rows: Vec<String> = (0..3)
        .map(|row| {
            let numbers = (0..4).map(|index| formulas.formula(matrix[4 * row + index]));
            format!("[{}]", numbers.collect::<Vec<_>>().join(", "))
        })
        .collect();
    let scale = match formulas.graph.as_constant(scale) {
        Some(1.0) => String::new(),
        _ => format!(" scale {}", formulas.formula(scale)),
    };
    format!("frame s{} {}{scale}", child.0, rows.join(" "))
}

fn named_parameters(row: &Row, parameters: &[ExprId], formulas: &FormulaTable<'_>) -> String {
    let mut numbers = parameters.iter();
    let mut parts = Vec::new();
    for parameter in row.parameters {
        let width = parameter.ty.width();
        let values: Vec<String> = numbers
            .by_ref()
            .take(width)
            .map(|id| formulas.formula(*id))
            .collect();
        parts.push(match values.as_slice() {
            [single] => format!("{} {single}", parameter.name),
            several => format!("{} [{}]", parameter.name, several.join(", ")),
        });
    }
    parts.join(" ")
}

fn region_text(region: &Bounds) -> String {
    if *region == Bounds::ALL_SPACE {
        return String::new();
    }
    let corner = |v: [f64; 3]| v.map(short).join(", ");
    format!(" within [{}] [{}]", corner(region.min), corner(region.max))
}

fn camera_line(camera: &SceneCamera, formulas: &FormulaTable<'_>) -> String {
    let lens = match camera.lens {
        SceneLens::Perspective(fov) => format!("fov {}", formulas.formula(fov)),
        SceneLens::Orthographic(height) => format!("height {}", formulas.formula(height)),
    };
    let automatic = if camera.auto_framed {
        " (automatic)"
    } else {
        ""
    };
    let name = spaced(&camera.name);
    format!(
        "camera{name} from {} look {} up {} {lens}{automatic}",
        formulas.triple(camera.from),
        formulas.triple(camera.look),
        formulas.triple(camera.up),
    )
}

fn light_line(light: &SceneLight, formulas: &FormulaTable<'_>) -> String {
    let source = match light.source {
        SceneLightSource::Directional(dir) => format!("dir {}", formulas.triple(dir)),
        SceneLightSource::Point(at) => format!("at {}", formulas.triple(at)),
    };
    let shadow = match light.shadow {
        SceneShadow::None => "none".to_owned(),
        SceneShadow::Hard => "hard".to_owned(),
        SceneShadow::Plain(width) => format!("plain({})", formulas.formula(width)),
        SceneShadow::Soft(width) => format!("soft({})", formulas.formula(width)),
        SceneShadow::Sized(width) => format!("sized({})", formulas.formula(width)),
    };
    format!(
        "light{} {source} color {} intensity {} shadow {shadow}",
        spaced(&light.name),
        formulas.triple(light.color),
        formulas.formula(light.intensity),
    )
}

fn spaced(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" {name}")
    }
}

/// Formats a number with at most six decimals.
fn short(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if value.abs() < 1e9 && (rounded != 0.0 || value == 0.0) {
        format!("{}", rounded + 0.0)
    } else {
        format!("{value:e}")
    }
}

/// Numbers of a scene as formulas.
struct FormulaTable<'s> {
    graph: &'s Expressions,
    params: &'s [SceneParam],
    /// Names of the numbers that have their own definition.
    names: BTreeMap<ExprId, String>,
}

impl<'s> FormulaTable<'s> {
    fn new(scene: &'s Scene) -> Self {
        let graph = &scene.expressions;
        let mut uses: BTreeMap<ExprId, u32> = BTreeMap::new();
        let mut pending = used_numbers(scene);
        for &id in &pending {
            *uses.entry(id).or_default() += 1;
        }
        let mut visited: BTreeSet<ExprId> = BTreeSet::new();
        while let Some(id) = pending.pop() {
            if visited.insert(id) {
                for operand in operands(graph, id) {
                    *uses.entry(operand).or_default() += 1;
                    pending.push(operand);
                }
            }
        }
        // Operands have lower ids, so levels are known in order.
        let mut levels: BTreeMap<ExprId, u32> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for &id in &visited {
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

    fn formula(&self, id: ExprId) -> String {
        match self.names.get(&id) {
            Some(name) => name.clone(),
            None => self.definition(id),
        }
    }

    fn triple(&self, numbers: ExprTriple) -> String {
        format!("[{}]", numbers.map(|id| self.formula(id)).join(", "))
    }

    /// Returns the definition of a number as text. It recurses over at most [`MAX_LEVELS`] levels.
    fn definition(&self, id: ExprId) -> String {
        match self.graph.get(id) {
            Expression::Constant(value) => short(*value),
            Expression::Param(param, component) => {
                let Some(param) = self.params.get(param.0 as usize) else {
                    return String::new();
                };
                match (param.kind, component) {
                    (ParamKind::Color, component_index) => {
                        format!(
                            "{}.{}",
                            param.name,
                            ["r", "g", "b"][usize::from(*component_index)]
                        )
                    }
                    (ParamKind::Vec2 | ParamKind::Vec3, component_index) => {
                        format!(
                            "{}.{}",
                            param.name,
                            ["x", "y", "z"][usize::from(*component_index)]
                        )
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
                let list: Vec<String> = values.iter().map(|id| self.formula(*id)).collect();
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
                let named = named_parameters(op.row(), parameters, self);
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

/// Returns all numbers that the scene refers to directly.
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
            SceneLens::Perspective(fov) => fov,
            SceneLens::Orthographic(height) => height,
        });
    }
    for light in &scene.lights {
        ids.extend(light.color);
        ids.push(light.intensity);
        match light.source {
            SceneLightSource::Directional(v) | SceneLightSource::Point(v) => ids.extend(v),
        }
        match light.shadow {
            SceneShadow::None | SceneShadow::Hard => {}
            SceneShadow::Plain(width) | SceneShadow::Soft(width) | SceneShadow::Sized(width) => {
                ids.push(width)
            }
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
