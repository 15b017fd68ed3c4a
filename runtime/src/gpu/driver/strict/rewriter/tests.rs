//! Tests of barriers in the module and in the languages that naga writes.

use super::*;
use naga::back::wgsl::{WriterFlags, write_string};
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn valid(module: &Module) -> ModuleInfo {
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(module);
    info.unwrap_or_else(|error| panic!("{error:?}"))
}

/// Inserts barriers.
fn with_barriers(module: &Module, info: &ModuleInfo, entry: &str) -> Result<Module, String> {
    let rewrites = Rewrites {
        barriers: true,
        rounding: None,
    };
    rewrite(module, info, entry, rewrites)
}

fn parsed(text: &str) -> (Module, ModuleInfo) {
    let module = naga::front::wgsl::parse_str(text).expect("it parses");
    let info = valid(&module);
    (module, info)
}

#[test]
fn products_and_numbers_are_behind_barriers() {
    let (module, info) = parsed(
        "@group(0) @binding(0) var<storage, read_write> v: array<f32>;
             @compute @workgroup_size(1)
             fn main() {
                 let product = v[0] * 3.0;
                 v[1] = product + v[2];
             }",
    );
    let module = with_barriers(&module, &info, "main").expect("it has a portable form");
    let text = write_string(&module, &valid(&module), WriterFlags::empty());
    let text = text.expect("it is written");
    let (_, body) = text.split_once("fn main() {\n").expect("it has an entry");
    assert_eq!(
            body,
            "    let _e9 = select(0u, 1u, (arrayLength((&v)) == 0u));
    let _e14 = v[0];
    let product = bitcast<f32>((bitcast<u32>((_e14 * bitcast<f32>((bitcast<u32>(3f) ^ _e9)))) ^ _e9));
    let _e24 = v[2];
    v[1] = bitcast<f32>((bitcast<u32>((product + _e24)) ^ _e9));
    return;
}
"
        );
}

/// Every kind of expression and statement that has a portable form.
const TEXT: &str = "
struct Named { count: u32, factor: f32 }
struct Listed { head: atomic<u32>, flags: u32, all: array<vec4f> }
const TABLE = array<vec3f, 2>(vec3f(0.1, 0.2, 0.3), vec3f(0.4));
const HALF = 0.5;
@group(0) @binding(0) var<uniform> named: Named;
@group(0) @binding(1) var<storage, read_write> listed: Listed;
var<workgroup> shared_numbers: array<f32, 64>;
var<workgroup> total: u32;
var<private> last: f32;

fn count(n: u32) -> u32 { return n * 3u + 1u; }

fn sum(v: vec3f) -> f32 { return v.x + v.y + v.z; }

fn third(x: f32) -> f32 {
    var divisor = 3.0;
    if x < 1.5 { return x / divisor; } else { divisor = 5.0; }
    let table = TABLE[count(u32(x)) & 1u];
    return sum(table * vec3f(x) + TABLE[1] * HALF) / divisor;
}

@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) i: u32) {
    var way = vec3f(0.25, 0.5, 1.0);
    var numbers = array<f32, 2>(0.1, 0.2);
    for (var n = 0u; n < named.count; n++) {
        var inner = 0.3;
        switch n % 4u {
            case 0u: { inner *= way[n]; continue; }
            case 1u, 2u: { way.x = -abs(way.y - inner) * named.factor; }
            default: { numbers[n & 1u] = third(way.z) * 0.1; break; }
        }
        let wide = select(way, floor(way.zyx), way < vec3f(inner));
        way = sqrt(max(wide * 2.0 + numbers[n & 1u], vec3f(0.0)));
        if any(way > vec3f(1e6)) { break; }
    }
    loop {
        let old = atomicAdd(&listed.head, 1u);
        let swapped = atomicCompareExchangeWeak(&listed.head, old, 3u);
        if swapped.exchanged { break; }
        last += f32(old);
        continuing { last = last * 1.01 + 0.1; break if last > 9.0; }
    }
    shared_numbers[i] = bitcast<f32>((i + 127u) << 23u) * sum(way);
    workgroupBarrier();
    if i == 0u { total = u32(shared_numbers[1] * 7.5); }
    let all = workgroupUniformLoad(&total);
    listed.all[i % arrayLength(&listed.all)] = vec4f(way, f32(all) * shared_numbers[i]);
}";

/// Counts visible operands, constants or results, of operations that round.
fn count_visible(module: &Module, info: &ModuleInfo) -> usize {
    let functions = module.functions.iter();
    let functions = functions.map(|(handle, function)| (function, &info[handle]));
    let entry = (&module.entry_points[0].function, info.get_entry_point(0));
    let mut count = 0;
    for (function, info) in functions.chain([entry]) {
        let is_float = |handle: Handle<Expression>| {
            let inner = info[handle].ty.inner_with(&module.types);
            inner.scalar_kind() == Some(ScalarKind::Float)
        };
        let operands = |handle: Handle<Expression>| match &function.expressions[handle] {
            Expression::Binary { left, right, .. } if is_float(handle) => vec![*left, *right],
            Expression::Math {
                fun: MathFunction::Sqrt | MathFunction::Floor,
                arg,
                ..
            } => vec![*arg],
            _ => vec![],
        };
        // Operations that only select an operand are transparent.
        let picked = |handle: Handle<Expression>| match &function.expressions[handle] {
            Expression::Select { accept, reject, .. } => vec![*accept, *reject],
            Expression::Unary { expr, .. } => vec![*expr],
            Expression::Splat { value, .. } => vec![*value],
            Expression::Compose { components, .. } => components.clone(),
            Expression::Swizzle { vector, .. } => vec![*vector],
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                vec![*base]
            }
            Expression::Math {
                fun: MathFunction::Max,
                arg,
                arg1,
                ..
            } => [Some(*arg), *arg1].into_iter().flatten().collect(),
            _ => vec![],
        };
        for (handle, _) in function.expressions.iter() {
            let mut pending = operands(handle);
            while let Some(operand) = pending.pop() {
                let is_number = match function.expressions[operand] {
                    Expression::Literal(Literal::F32(number)) => number != 0.0,
                    Expression::Constant(_) => true,
                    _ => false,
                };
                count += usize::from(is_number || !operands(operand).is_empty());
                pending.extend(picked(operand));
            }
        }
    }
    count
}

#[test]
fn no_operation_sees_another_or_a_number() {
    let (module, info) = parsed(TEXT);
    assert!(count_visible(&module, &info) > 10);
    let new = with_barriers(&module, &info, "main").expect("it has a portable form");
    let info = valid(&new);
    assert_eq!(count_visible(&new, &info), 0);
    let locals = |module: &Module| {
        let functions = module.functions.iter().map(|(_, function)| function);
        let entry = &module.entry_points[0].function;
        let functions = functions.chain([entry]);
        let functions = functions.flat_map(|function| function.local_variables.iter());
        functions.filter(|(_, local)| local.init.is_some()).count()
    };
    assert_eq!(locals(&new), 0);
    // Functions without floats are unchanged.
    let lengths = |module: &Module| -> Vec<usize> {
        let functions = module.functions.iter();
        functions.map(|(_, f)| f.expressions.len()).collect()
    };
    assert_eq!(lengths(&new)[0], lengths(&module)[0]);
}

/// Metal's and DirectX's languages have the barriers too.
#[test]
fn other_languages_have_the_barriers() {
    use naga::back::{hlsl, msl};
    let (module, info) = parsed(TEXT);
    let new = with_barriers(&module, &info, "main").expect("it has a portable form");
    let info = valid(&new);
    let options = msl::Options {
        lang_version: (2, 4),
        fake_missing_bindings: true,
        ..msl::Options::default()
    };
    let written = msl::write_string(&new, &info, &options, &msl::PipelineOptions::default());
    let (metal, _) = written.expect("it is written");
    let options = hlsl::Options::default();
    let pipeline = hlsl::PipelineOptions::default();
    let mut directx = String::new();
    hlsl::Writer::new(&mut directx, &options, &pipeline)
        .write(&new, &info, None)
        .expect("it is written");
    for (text, barrier) in [
        (metal, "as_type<float>(as_type<uint>("),
        (directx, "asfloat((asuint("),
    ] {
        assert!(text.matches(barrier).count() > 10, "{text}");
    }
}

#[test]
fn without_an_array_of_any_length_there_are_no_barriers() {
    let floats = "@group(0) @binding(0) var<storage, read_write> v: vec4f;
             @compute @workgroup_size(1)
             fn main() { v = v * 2.0; }";
    let (module, info) = parsed(floats);
    let error = with_barriers(&module, &info, "main").expect_err("it has none");
    assert_eq!(
        error,
        "there is no storage buffer with an array of any length"
    );
    let (module, info) = parsed(&floats.replace("vec4f", "vec4u").replace("2.0", "2u"));
    assert!(with_barriers(&module, &info, "main").is_ok());
    let (module, info) = parsed(&format!("var<private> x: f32 = 0.7; {floats}"));
    assert!(with_barriers(&module, &info, "main").is_err());
}
