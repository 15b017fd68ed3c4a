#!/usr/bin/env python3
"""Writes `precise.csv`: values and derivatives of operations at awkward places.

    pip install mpmath
    python3 precise.py > precise.csv

Distances are computed from what the shapes are (the nearest point of a box, of a segment, …) and
not by the formulas under test. All parameters are numbers that `f32` holds; the points are numbers
that `f64` holds, written out in full. Derivatives are taken at 120 digits.
"""

import struct

from mpmath import mp, mpf

mp.dps = 120


def single(v):
    """The `f32` nearest to a number, exactly."""
    return mpf(struct.unpack("f", struct.pack("f", v))[0])


def clamp(v, low, high):
    return min(max(v, low), high)


def norm(*v):
    return mp.sqrt(sum(c * c for c in v))


def box(p, half):
    """To the nearest point of a box outside, to the nearest face inside, negative."""
    gaps = [abs(c) - h for c, h in zip(p, half)]
    if max(gaps) > 0:
        return norm(*[c - clamp(c, -h, h) for c, h in zip(p, half)])
    return max(gaps)


def sphere(p, k):
    return norm(*p) - k[0]


def cuboid(p, k):
    return box(p, k)


def rounded_cuboid(p, k):
    return box(p, [h - k[3] for h in k[:3]]) - k[3]


def capsule(p, k):
    return norm(p[0], p[1] - clamp(p[1], -k[0], k[0]), p[2]) - k[1]


def torus(p, k):
    around = norm(p[0], p[2])
    # The nearest point of the ring lies in the direction of the point.
    ring = (p[0] / around * k[0], 0, p[2] / around * k[0])
    return norm(*[a - b for a, b in zip(p, ring)]) - k[1]


def cylinder(p, k):
    return box((norm(p[0], p[2]), p[1]), k)


def infinite_cone(p, k):
    around, depth = norm(p[0], p[2]), -p[1]
    if around * k[0] + depth * k[1] < 0:
        return norm(around, depth)
    return around * k[1] - depth * k[0]


def plane(p, k):
    return sum(a * b for a, b in zip(p, k)) - k[3]


def gyroid(p, k):
    x, y, z = [c * k[0] for c in p]
    wave = mp.sin(x) * mp.cos(y) + mp.sin(y) * mp.cos(z) + mp.sin(z) * mp.cos(x)
    return abs(wave * k[1]) - k[2]


def smooth(bulge):
    def union(v, k):
        return min(v[0], v[1]) - bulge(abs(v[0] - v[1]), k[0], k[1])

    return union


def quadratic(x, w, c):
    return max(w - x, 0) ** 2 * c


def cubic(x, w, c):
    return max(w - x, 0) ** 3 * c


def circular(x, w, c):
    t = max(w - x, 0) * c
    return w * (1 + t - mp.sqrt(1 + t * (2 - t))) / 2


def exponential(x, w, c):
    return w * mp.log(1 + mpf(2) ** (-x * c), 2)


POINTS = [
    (0.3, -0.7, 0.2),
    (1e-9, 2.0, 3e-9),
    (-1e6, 3e5, 7e5),
    (1e-12, -1e-12, 1e-13),
    (0.750000001, 1e-7, -1e-7),
    (-0.7499999999, 0.2, 0.1),
    (0.1, 0.5000000001, 0.2),
    (123456.789, -0.25, 0.5),
    (0.6, 0.8, 1e-15),
    (-1e-20, 0.9, 0.4),
]
VALUES = [
    (0.3, 0.31),
    (1e-12, -1e-12),
    (1e6, 1000000.0000001),
    (-0.7, 0.2),
    (0.1, 0.39999),
    (-3e-9, 5.0),
]


def rows():
    solids = [
        (sphere, [0.75]),
        (cuboid, [0.75, 0.5, 0.25]),
        (rounded_cuboid, [0.75, 0.5, 0.25, 0.125]),
        (capsule, [0.5, 0.375]),
        (torus, [0.625, 0.25]),
        (cylinder, [0.75, 0.5]),
        (infinite_cone, [0.6, 0.8]),
        (plane, [0.6, 0.8, 0.0, 0.25]),
        (gyroid, [4.0, 0.5, 0.02]),
    ]
    for solid, numbers in solids:
        for point in POINTS:
            # Far out, sines of `f64` are of numbers that were rounded.
            if solid is gyroid and max(map(abs, point)) > 1e4:
                continue
            yield solid.__name__, numbers, solid, point
    blends = [
        ("smooth_union", quadratic, [0.3, 0.8333333]),
        ("cubic_union", cubic, [0.3, 1.851852]),
        ("circular_union", circular, [0.25, 4.0]),
        ("exponential_union", exponential, [0.125, 8.0]),
    ]
    for name, bulge, numbers in blends:
        for values in VALUES:
            yield name, numbers, smooth(bulge), values
    functions = {
        "div": lambda v, k: v[0] / v[1],
        "mul": lambda v, k: v[0] * v[1],
        "atan2": lambda v, k: mp.atan2(v[0], v[1]),
        "sqrt": lambda v, k: mp.sqrt(v[0]),
        "sin": lambda v, k: mp.sin(v[0]),
        "cos": lambda v, k: mp.cos(v[0]),
        "tan": lambda v, k: mp.tan(v[0]),
        "exp": lambda v, k: mp.exp(v[0]),
        "ln": lambda v, k: mp.log(v[0]),
        "tanh": lambda v, k: mp.tanh(v[0]),
        "pow": lambda v, k: v[0] ** v[1],
    }
    two = [(0.3, 0.7), (1e-9, 3.0), (7.5, -1e-3), (123.0, 0.1)]
    one = [(0.3,), (1e-9,), (7.5,), (1.5707963267948966,), (3.141592653589793,)]
    for name, function in functions.items():
        for values in two if name in ("div", "mul", "atan2", "pow") else one:
            yield name, [], function, values


def text(v, digits):
    return mp.nstr(v, digits, min_fixed=-5, max_fixed=20)


print("operation,parameters,inputs,value,derivatives")
for name, numbers, function, inputs in rows():
    k = [single(v) for v in numbers]
    inputs = [mpf(v) for v in inputs]

    def along(axis, h):
        moved = list(inputs)
        moved[axis] += h
        return function(moved, k)

    step = mpf(10) ** -50
    slopes = [(along(a, step) - along(a, -step)) / (2 * step) for a in range(len(inputs))]
    fields = [
        [text(v, 20) for v in k],
        [repr(float(v)) for v in inputs],
        [text(function(inputs, k), 60)],
        [text(v, 30) for v in slopes],
    ]
    print(",".join([name] + [" ".join(field) for field in fields]))
