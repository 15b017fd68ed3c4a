// rounding: quotients and square roots to the nearest float, ties to even, on devices that only come near.
// Integers decide: significands are multiplied modulo 2³², which holds the small difference exactly.

/// `a / b`. Zeros, infinities, NaN and results that are not normal numbers are left to the device.
fn sdfc_nearest_quotient(a: f32, b: f32) -> f32 {
    let device = a / b;
    let a_bits = bitcast<u32>(a);
    let b_bits = bitcast<u32>(b);
    let a_exponent = (a_bits >> 23u) & 0xffu;
    let b_exponent = (b_bits >> 23u) & 0xffu;
    let a_significand = (a_bits & 0x7fffffu) | 0x800000u;
    let divisor = (b_bits & 0x7fffffu) | 0x800000u;
    // The quotient of the significands lies from 1 to 2.
    let is_less = u32(a_significand < divisor);
    let dividend = a_significand << is_less;
    let exponent = i32(a_exponent) - i32(b_exponent) - i32(is_less) + 127;
    let is_normal = (a_exponent - 1u) < 254u && (b_exponent - 1u) < 254u && exponent > 0 && exponent < 255;
    // 2²³ times the quotient, a few units off.
    var quotient = u32(f32(dividend) / f32(divisor) * 8388608.0);
    var rest = bitcast<i32>((dividend << 23u) - quotient * divisor);
    // The quotient that is not too large, and its rest.
    for (var i = 0; i < 8 && rest < 0; i++) {
        quotient -= 1u;
        rest += i32(divisor);
    }
    for (var i = 0; i < 8 && rest >= i32(divisor); i++) {
        quotient += 1u;
        rest -= i32(divisor);
    }
    // No quotient of floats lies halfway between two.
    quotient += u32(2 * rest > i32(divisor));
    // The significand's leading bit adds 1 to the exponent, and so does a quotient that was rounded up to 2.
    let bits = ((a_bits ^ b_bits) & 0x80000000u) + (u32(exponent - 1) << 23u) + quotient;
    return select(device, bitcast<f32>(bits), is_normal && (bits << 1u) < 0xff000000u);
}

/// `sqrt(x)`. Numbers that are not normal, and negative ones, are left to the device.
fn sdfc_nearest_root(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let is_normal = (bits - 0x800000u) < 0x7f000000u;
    // The exponent is even after a shift of the significand.
    let exponent = bits >> 23u;
    let shift = (exponent + 1u) & 1u;
    let significand = ((bits & 0x7fffffu) | 0x800000u) << shift;
    // The root of 2²³ times the significand, a few units off.
    var root = u32(sqrt(f32(significand) * 8388608.0));
    var rest = bitcast<i32>((significand << 23u) - root * root);
    for (var i = 0; i < 8 && rest < 0; i++) {
        root -= 1u;
        rest += i32(2u * root + 1u);
    }
    for (var i = 0; i < 8 && rest > i32(2u * root); i++) {
        rest -= i32(2u * root + 1u);
        root += 1u;
    }
    // (root + ½)² = root² + root + ¼
    root += u32(rest > i32(root));
    let result = bitcast<f32>((((exponent + 126u - shift) >> 1u) << 23u) + root);
    return select(sqrt(x), result, is_normal);
}
