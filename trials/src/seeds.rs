//! Valid inputs to damage: the scenes of the repository and their compiled files.

use sdfc_compiler::compile::{Options, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_lang::Sources;
use sdfc_vm::file::encode_file;
use std::path::Path;
use std::sync::LazyLock;

/// Texts of `examples/`, `tests/scenes/` and `lang/tests/scenes/`, by file name.
pub static TEXTS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let mut texts = read_texts("../examples");
    texts.extend(read_texts("../tests/scenes"));
    texts.extend(read_texts("../lang/tests/scenes"));
    texts
});

/// Bytecode of `tests/scenes/`, and of a scene with all kinds of settings.
pub static FILES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut texts = read_texts("../tests/scenes");
    texts.push(SETTINGS_SCENE.to_owned());
    texts.iter().map(|text| compile_text(text)).collect()
});

/// Texts of clauses, in the format of Fidget and libfive.
pub const CLAUSES: &[&str] = &[
    "# a disc\n_0 var-x\n_1 square _0\n_2 var-y\n_3 square _2\n_4 add _1 _3\n_5 sqrt _4\n_6 const 1\n_7 sub _5 _6\n",
    "_0 var-x\n_1 var-y\n_2 var-z\n_3 abs _0\n_4 abs _1\n_5 abs _2\n_6 max _3 _4\n_7 max _6 _5\n_8 const 0.5\n_9 sub _7 _8\n",
    "a var-x\nb var-y\nc var-z\nd sin a\ne cos b\nf mul d e\ng exp c\nh recip g\ni atan2 f h\nj min i a\nk const -0.25\nl max j k\nm compare l b\nn mod m c\no pow n a\np floor o\nq round p\nr ceil q\ns and r a\nt or s b\nu not t\nv ln u\nw tan v\nx asin w\ny acos x\nz atan y\nzz div z a\nzzz neg zz\n",
];

/// A scene with every kind of setting and of parameter.
const SETTINGS_SCENE: &str = "
scene { units: cm, up: z }
param r = 0.5 in 0.1..=1;
param n: int = 3 in 1..=5;
param on = true;
param turn: angle = 20deg in 0deg..90deg;
param tint: color = #d08040;
param at: vec3 = [0.1, 0.2, 0.3];
camera near { from: [2, 3, 1], look: at, fov: 40deg }
camera far { from: [0, -9, 4], look: [0, 0, 0], up: [0, 0, 1], height: 3 }
light key { dir: [1, 2, 3], intensity: 2, shadow: soft(0.05) }
light lamp { at: [1, 1, 1], color: #ffddaa, shadow: hard }
sky { top: #203050, horizon: #8090a0, ground: #202020, ambient: 0.8, fog: 0.01 }
render { size: [64, 48], aa: 2, steps: 200, far: 50 }
animate { duration: 2s, fps: 24, loop: true }
material spots { color: fn(p) => mix(tint, #ffffff, step(0, sin(9 * p.x))), roughness: 0.4, bump: fn(p) => 0.02 * noise(p * 8) }
assert(r < 2, \"too large\");
part whole = union(for i in 0..n { sphere(r).translate(i * 0.6, 0, 0) }, smooth: 0.1).rotate(turn, Z);
(if on { whole.material(spots) } else { box(r) }) | box(0.3).translate(at + [0, 0, sin(time)]).color(tint)
";

fn read_texts(folder: &str) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&folder).expect("the folder can be read");
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("its entries too").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "sdf"))
        .collect();
    paths.sort();
    let read = |path| std::fs::read_to_string(path).expect("a scene can be read");
    paths.into_iter().map(read).collect()
}

/// Compiles a valid scene to bytes.
fn compile_text(text: &str) -> Vec<u8> {
    let mut sources = Sources::new();
    let file = sources.add("seed", text);
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}\n{text}"));
    let (compile_text, diagnostics) = compile(scene, &Options::default());
    let compile_text = compile_text.unwrap_or_else(|| panic!("{diagnostics:?}\n{text}"));
    encode_file(&compile_text.module)
}
