// A test of the bits: comparing a number with itself has no effect on a GPU.

fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
}
