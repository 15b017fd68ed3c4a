//! Light in scenes that were once lit wrongly, on the CPU.

use crate::metamorphic::draw::{Way, frame};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::frame::{CellUse, Frame};

/// The most channels of pixels at edges that rounding changes in a picture.
const MAX_EDGE_CHANNELS: usize = 12;

/// The picture of a text, with one sample for each pixel.
fn picture(text: &str, size: [u32; 2]) -> Frame {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let way = Way {
        size,
        passes: PassOptions::default(),
        cells: CellUse::Auto,
        scale: 1.0,
    };
    frame(&mut *engine, text, &way).expect("it compiles")
}

/// The brightness of a pixel, from 0 to 765.
fn brightness(frame: &Frame, bytes: &[u8], x: usize, y: usize) -> i32 {
    let at = 4 * (y * frame.width + x);
    bytes[at..at + 3]
        .iter()
        .map(|&channel| i32::from(channel))
        .sum()
}

/// The pixels that are brighter than all eight around them by more than `most` of 765.
fn bright_dots(frame: &Frame, most: i32) -> Vec<[usize; 2]> {
    let bytes = frame.rgba8();
    let pixels = (1..frame.height - 1).flat_map(|y| (1..frame.width - 1).map(move |x| [x, y]));
    pixels
        .filter(|&[x, y]| {
            let own = brightness(frame, &bytes, x, y);
            let around = (y - 1..=y + 1).flat_map(|v| (x - 1..=x + 1).map(move |u| [u, v]));
            let mut others = around.filter(|&other| other != [x, y]);
            others.all(|[u, v]| brightness(frame, &bytes, u, v) + most < own)
        })
        .collect()
}

/// Rays that pass an edge nearby are darkened by it, however far away the eye is.
#[test]
fn shadows_of_inner_rims_have_no_bright_dots() {
    let text = "scene { units: mm, up: z }\n\
        camera { from: [0, -20, 140], look: [0, 0, 5], fov: 40deg }\n\
        box(80, 60, 20) - box(76, 56, 18).translate(0, 0, 1)\n";
    let found = bright_dots(&picture(text, [800, 600]), 30);
    assert!(found.is_empty(), "{found:?}");
}

/// A hinge on a floor under grazing light and something other, `scale` times as large and with its middle at `place`.
fn hinge(other: &str, scale: f64, place: [f64; 3]) -> String {
    let at = |p: [f64; 3]| [0, 1, 2].map(|axis| p[axis] * scale + place[axis]);
    let (from, look) = (at([0.482, 1.541, -2.175]), at([0.0, 0.2, 0.0]));
    format!(
        "camera {{ from: {from:?}, look: {look:?}, fov: 40deg }}\n\
         light {{ dir: [0.44, 0.19, 0.46], intensity: 2.5, shadow: plain(0.1) }}\n\
         ((box(1.6, 0.2, 2).translate(0.9, 0.3, 0) - cylinder(r: 0.16, h: 0.6).translate(1.1, 0.3, 0)).mirror(X)\n\
         | cylinder(r: 0.3, h: 0.38).rotate(90deg, X).repeat([0, 0, 0.8], [1, 1, 3]).translate(0, 0.3, 0)\n\
         | plane(Y, at: 0){other}).scale({scale}).translate({place:?})\n"
    )
}

/// The number of channels that differ visibly between two pictures.
fn other_channels(one: &str, other: &str) -> usize {
    let [one, other] = [one, other].map(|text| picture(text, [160, 120]).rgba8());
    let pairs = one.iter().zip(&other);
    pairs.filter(|&(&a, &b)| a.abs_diff(b) > 2).count()
}

/// Neither where a scene on an endless floor is nor its unit changes its shadows and its default occlusion.
#[test]
fn things_on_an_endless_floor_are_lit_alike_in_any_place_and_unit() {
    let here = hinge("", 1.0, [0.0; 3]);
    for (scale, place) in [
        (0.125, [0.0; 3]),
        (0.01, [0.0; 3]),
        (64.0, [0.0; 3]),
        (1.0, [6.0, 2.5, -4.0]),
        (0.125, [-2.0, -3.5, 1.0]),
    ] {
        let count = other_channels(&here, &hinge("", scale, place));
        assert!(
            count <= MAX_EDGE_CHANNELS,
            "{scale} at {place:?}: {count} channels"
        );
    }
}

/// A ray just above the highest solid is darkened by it, though it leaves the box of all solids before it is there.
#[test]
fn a_tall_post_far_away_changes_no_penumbra() {
    let off = "render { occlusion: off }\n";
    let post = "| cylinder(r: 0.1, h: 40).translate(-80, 0, 80)";
    let texts = ["", post].map(|other| format!("{off}{}", hinge(other, 1.0, [0.0; 3])));
    assert_eq!(other_channels(&texts[0], &texts[1]), 0);
}

/// The penumbras of wide lights are those of surfaces, whatever the fields are that make these, alone or in a map.
#[test]
fn wide_lights_see_no_fields() {
    let scene = |light: &str, shape: &str| {
        format!(
            "camera {{ from: [2, 2.4, 3], look: [0, 0, 0], fov: 40deg }}\n\
             light {{ {light} }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {shape} | plane(Y, at: -0.6)\n"
        )
    };
    let wavy = "warp(fn(p) => [p.x, p.y + 0.2 * sin(3 * p.x), p.z])";
    let two = |ball: &str, map: &str| format!("({ball} | sphere(0.3).translate(0.9, 0, 0)).{map}");
    let ball = "sphere(0.5)";
    let mut pairs: Vec<[String; 2]> = [
        "field(fn(p) => dot(p, p) - 0.25)",
        "field(fn(p) => pow(length(p), 3) - 0.125)",
        "field(fn(p) => exp(length(p)) - exp(0.5))",
        "field(fn(p) => (length(p) - 0.5) * (1 + 0.2 * length(p)))",
        "field(fn(p) => pow(dot(p, p), 6) - pow(0.25, 6))",
        "field(fn(p) => exp(10 * length(p)) - exp(5))",
    ]
    .map(|field| [field.to_owned(), ball.to_owned()])
    .to_vec();
    for field in [
        "field(fn(p) => 50 * (length(p) - 0.5))",
        "field(fn(p) => 0.02 * (length(p) - 0.5))",
    ] {
        for map in [wavy, "twist(20deg)"] {
            pairs.push([two(field, map), two(ball, map)]);
        }
    }
    let turned = "fn turned(p: vec3) -> vec3 { let c = cos(1.2 * p.y); let s = sin(1.2 * p.y); \
        [c * p.x - s * p.z, p.y, s * p.x + c * p.z] }\n";
    let bar = "field(fn(p) => { let q = abs(turned(p)) - [0.2, 0.5, 0.2]; \
        length(max(q, vec3(0))) + min(max(q.x, max(q.y, q.z)), 0) }, lipschitz: 2)";
    pairs.push([
        format!("{turned}box(0.4, 1, 0.4).warp(turned)"),
        format!("{turned}{bar}"),
    ]);
    // Half of a slot that ends at the plane of its mirror.
    let slotted = |slot: &str| format!("(box(1.2, 0.6, 1.2) - {slot})");
    pairs.push([
        slotted("box(0.2, 0.6, 2).translate(0.1, 0.2, 0).mirror(X)"),
        slotted("box(0.4, 0.6, 2).translate(0, 0.2, 0)"),
    ]);
    let mut failures = Vec::new();
    for light in [
        "dir: [0.5, 0.8, 0.3], shadow: soft(0.4)",
        "dir: [-0.6, 0.8, 0.2], shadow: plain(0.3)",
    ] {
        for [one, other] in &pairs {
            let count = other_channels(&scene(light, one), &scene(light, other));
            if count > MAX_EDGE_CHANNELS {
                failures.push(format!("{light}, {one}: {count} channels"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A solid whose crossing by a ray is known in closed form.
#[derive(Clone, Copy)]
enum Solid {
    /// A box around a place with these halves of its sides.
    Cuboid([f64; 3], [f64; 3]),
    /// A ball around a place.
    Ball([f64; 3], f64),
}

impl Solid {
    /// Its text in a scene.
    fn text(self) -> String {
        match self {
            Self::Cuboid([x, y, z], [a, b, c]) => {
                let sides = [2.0 * a, 2.0 * b, 2.0 * c];
                format!(
                    "box({}, {}, {}).translate({x}, {y}, {z})",
                    sides[0], sides[1], sides[2]
                )
            }
            Self::Ball([x, y, z], radius) => format!("sphere({radius}).translate({x}, {y}, {z})"),
        }
    }

    /// Reports whether the way from `p` along `d`, as long as that, leads through it.
    fn blocks(self, p: [f64; 3], d: [f64; 3]) -> bool {
        match self {
            Self::Cuboid(middle, half) => {
                let (mut first, mut last) = (0.0_f64, 1.0_f64);
                for axis in 0..3 {
                    let ends = [-half[axis], half[axis]]
                        .map(|side| (middle[axis] + side - p[axis]) / d[axis]);
                    first = first.max(ends[0].min(ends[1]));
                    last = last.min(ends[0].max(ends[1]));
                }
                first < last
            }
            Self::Ball(middle, radius) => {
                let to = [0, 1, 2].map(|axis| middle[axis] - p[axis]);
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let nearest = (dot(to, d) / dot(d, d)).clamp(0.0, 1.0);
                let way = [0, 1, 2].map(|axis| to[axis] - nearest * d[axis]);
                dot(way, way) < radius * radius
            }
        }
    }
}

/// The way from a point to a light: towards its direction, or to its place.
fn way_to(lamp: ([f64; 3], bool), p: [f64; 3]) -> [f64; 3] {
    match lamp {
        (place, true) => [0, 1, 2].map(|axis| place[axis] - p[axis]),
        (direction, false) => direction.map(|d| 100.0 * d),
    }
}

/// The number of points of a light's disc that are hidden from `p`, and of all: on rings up to `radius` times its own.
fn hidden_points(
    solids: &[Solid],
    lamp: ([f64; 3], bool),
    size: f64,
    p: [f64; 3],
    radius: f64,
) -> (usize, usize) {
    let axis = way_to(lamp, p);
    let length = axis.map(|d| d * d).iter().sum::<f64>().sqrt();
    let unit = axis.map(|d| d / length);
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let aside = cross(unit, [0.3, 0.1, 0.9]);
    let scale = aside.map(|d| d * d).iter().sum::<f64>().sqrt();
    let right = aside.map(|d| d / scale);
    let up = cross(unit, right);
    let mut hidden = 0;
    let mut count = 0;
    for ring in 0..=8_u32 {
        for turn in 0..24_u32 {
            let angle = f64::from(turn) * std::f64::consts::TAU / 24.0;
            let out = size * length * radius * f64::from(ring) / 8.0;
            let (sin, cos) = angle.sin_cos();
            let way = [0, 1, 2].map(|k| axis[k] + out * (cos * right[k] + sin * up[k]));
            let is_hidden = way[1] <= 0.0 || solids.iter().any(|solid| solid.blocks(p, way));
            hidden += usize::from(is_hidden);
            count += 1;
        }
    }
    (hidden, count)
}

/// Linear light of a byte of a picture. It stands here again on purpose: the check shares nothing with the renderer.
fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// The pixels of the ground that are lit otherwise than a light's disc is seen from there: where nothing of it is seen
/// they are dark, where all is seen they are lit in full, and where its middle is hidden at most by half.
fn wrongly_lit(solids: &[Solid], lamp: ([f64; 3], bool), size: f64, form: &str) -> Vec<String> {
    const SIDE: usize = 96;
    let (place, is_near) = lamp;
    let key = if is_near { "at" } else { "dir" };
    let scene = |shadow: &str| {
        let shapes: Vec<String> = solids.iter().map(|solid| solid.text()).collect();
        format!(
            "camera {{ from: [0, 20, 0], look: [0, 0, 0], up: [0, 0, -1], height: 6 }}\n\
             light {{ {key}: [{}, {}, {}], intensity: 3, shadow: {shadow} }}\n\
             sky {{ top: #000000, horizon: #000000, ground: #000000, ambient: 0 }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {} | plane(Y)\n",
            place[0],
            place[1],
            place[2],
            shapes.join(" | ")
        )
    };
    let shaded = picture(&scene(&format!("{form}({size})")), [SIDE as u32; 2]);
    let full = picture(&scene("none"), [SIDE as u32; 2]);
    let (shaded, full) = (shaded.rgba8(), full.rgba8());
    let mut wrong = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let to_scene = |pixel: usize| ((pixel as f64 + 0.5) / SIDE as f64 - 0.5) * 6.0;
            let p = [to_scene(x), 1e-6, to_scene(y)];
            // What a solid covers is not the ground.
            let above = [1e-9, 20.0, 1e-9];
            let near = [p[0], 0.0, p[2]];
            if solids.iter().any(|solid| solid.blocks(near, above)) {
                continue;
            }
            let at = 4 * (y * SIDE + x);
            let (found, most) = (linear(shaded[at]), linear(full[at]));
            let (wide, count) = hidden_points(solids, lamp, size, p, 1.2);
            let (middle, _) = hidden_points(solids, lamp, size, p, 0.15);
            let fault = match wide {
                all if all == count => found > 0.002,
                0 => found < 0.97 * most,
                _ => middle == count && found > 0.55 * most,
            };
            if fault {
                wrong.push(format!(
                    "{x}, {y}: {found:.3} of {most:.3}, {wide} of {count} hidden"
                ));
            }
        }
    }
    wrong
}

/// Thin plates, beams and balls, however thin and however far from what they shade.
#[test]
fn light_is_where_a_lamp_is_seen_and_nowhere_else() {
    let sheet = |thickness: f64| Solid::Cuboid([0.3, 1.0, -0.2], [0.9, thickness, 0.7]);
    let post = Solid::Cuboid([-1.2, 0.8, 0.9], [0.1, 0.8, 0.1]);
    let ball = Solid::Ball([-1.0, 0.7, -1.0], 0.4);
    let sun = ([0.3, 1.0, 0.2], false);
    let bulb = ([0.1, 3.0, -0.1], true);
    for lamp in [sun, bulb] {
        for thickness in [0.002, 0.02, 0.2] {
            let solids = [sheet(thickness), post, ball];
            for (form, size) in [("sized", 0.08), ("sized", 0.02)] {
                let wrong = wrongly_lit(&solids, lamp, size, form);
                assert!(
                    wrong.is_empty(),
                    "{form}, {thickness}, {lamp:?}: {wrong:#?}"
                );
            }
        }
    }
}

/// Nothing of a lamp in a closed case gets out of it, be it ever so thin.
#[test]
fn closed_cases_keep_their_light() {
    for thickness in [0.002, 0.02, 0.1] {
        for form in [
            "hard",
            "plain(0.05)",
            "soft(0.05)",
            "sized(0.08)",
            "sized(0.02)",
        ] {
            let text = format!(
                "camera {{ from: [2.5, 2, 3], look: [0, 0.4, 0], fov: 50deg }}\n\
                 light {{ at: [0.02, 0.5, 0.03], intensity: 4, shadow: {form} }}\n\
                 sky {{ top: #000000, horizon: #000000, ground: #000000, ambient: 0 }}\n\
                 box(0.4, 0.3, 0.4).shell({thickness}).translate(0, 0.5, 0) | plane(Y) | plane(Z, at: -2)\n"
            );
            let frame = picture(&text, [96, 72]);
            let bytes = frame.rgba8();
            let lit = (0..72).flat_map(|y| (0..96).map(move |x| (x, y)));
            let lit = lit
                .filter(|&(x, y)| brightness(&frame, &bytes, x, y) > 3)
                .count();
            assert_eq!(lit, 0, "{form}, {thickness}");
        }
    }
}

/// A shadow depends on where a field changes its sign, however steep it is there or elsewhere.
#[test]
fn hard_shadows_of_steep_and_flat_fields_are_those_of_a_ball() {
    let scene = |shape: &str| {
        format!(
            "camera {{ from: [2.6, 2.2, 3.6], look: [0, -0.1, 0], fov: 42deg }}\n\
             light {{ dir: [-1, 2, 1.5], shadow: hard }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {shape} | plane(Y, at: -1.3)\n"
        )
    };
    let ball = picture(&scene("sphere(1)"), [96, 72]).rgba8();
    for body in [
        "(length(p) - 1) * 0.000000000001",
        "(length(p) - 1) * 1000000",
        "pow(length(p), 20) - 1",
        "(pow(length(p), 40) - 1) * 0.000000000000001",
    ] {
        let other = picture(
            &scene(&format!("field(fn(p) => {body}, within: 3)")),
            [96, 72],
        )
        .rgba8();
        let worst = ball.iter().zip(&other).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{body}: {worst:?}");
    }
}

/// A lamp 2.6 mm from a bar of 30 mm, 3 m above a floor: the near part of the floor lies wholly behind the bar.
#[test]
fn a_lamp_beside_its_holder_lights_no_floor_behind_it() {
    let text = |intensity: f64| {
        format!(
            "camera {{ from: [2.5, 1.2, 5.5], look: [0.5, 1.5, 0], fov: 45deg }}\n\
             light bulb {{ at: [0, 3.05, 0.8], intensity: {intensity}, shadow: hard }}\n\
             capsule(from: [0, 3.0776457, 0.7333333], to: [0, 3, 0.8], r: 0.03) | plane(Y).color(#808080)"
        )
    };
    let size = [320, 240];
    let [lit, dark] = [12.0, 0.0].map(|intensity| picture(&text(intensity), size).rgba8());
    let floor = 4 * 200 * 320;
    let wrong = lit[floor..].chunks(4).zip(dark[floor..].chunks(4));
    let wrong = wrong.filter(|(lit, dark)| lit != dark).count();
    assert_eq!(wrong, 0, "pixels are lit through the bar");
}
