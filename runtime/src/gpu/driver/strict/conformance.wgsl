// conformance: single operations on floats, and expressions that drivers tend to rewrite.

@group(0) @binding(0) var<storage, read> operands: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> answered: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&operands) { return; }
    let a = operands[id.x].x;
    let b = operands[id.x].y;
    let c = operands[id.x].z;
    let sum = a + b;
    let part = sum - a;
    let root = sqrt(abs(a));
    let at = id.x * 16u;
    answered[at] = sum;
    answered[at + 1u] = a - b;
    answered[at + 2u] = a * b;
    answered[at + 3u] = a / b;
    answered[at + 4u] = root;
    answered[at + 5u] = floor(a);
    answered[at + 6u] = f32(i32(c));
    answered[at + 7u] = a * b + c;
    answered[at + 8u] = (a - (sum - part)) + (b - part);
    answered[at + 9u] = (c * 0.1) * 0.3 + (c + 0.1) + 0.2;
    answered[at + 10u] = a / 3.0;
    answered[at + 11u] = root * root;
    answered[at + 12u] = a * c + b * c;
    answered[at + 13u] = min(a, b) - max(b, c);
    answered[at + 14u] = 1.0 / a;
    answered[at + 15u] = 1.0 / root;
}
