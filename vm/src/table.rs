//! The table of operations: one row each. Derived from it are the enum, the encoding, the listing, the
//! verifier, and the evaluation on every number type. So are the recorded WGSL, the interpreter's `switch`,
//! the language's built-ins and the reference.
//!
//! A row consists of the name, the body with its inputs and parameters, the result, a conversion, and the facts
//! about the operation. The conversion turns a call's arguments into the parameters.
//!
//! To add a shape, write its functions in a file of [`crate::ops::shapes`]. Then add a row here after the last
//! shape of its kind, and define its inside for the tests.

mod define;
mod facts;
mod methods;

use crate::blend::{Blend, BlendKernel};
use crate::interval::MAX_NOISE_STEEPNESS;
use crate::ops::{map_bounds, prepare, shapes};
use crate::real::Real;
use crate::row::AxisExtent::{Function, Infinite, Largest, Sum};
use crate::row::{
    ArgumentKind as A, BoundsRule, BuiltinSignature, Category, Continuity, DefinedFor, Exactness,
    Input, OpFacts, Output, Parameter, ParameterType, SlopeRule, optional, required,
};
use define::{define_operations, input_kind};
use facts::{
    COMBINE, DIMENSION, DISTANCE, DOMAIN, INTERSECTION, JUMP, LATTICE, MATH, NOT_NEGATIVE, PLANE,
    POLE, SOLID, SUBTRACTION, UNION, UP_TO_ONE, Y_AXIS, Z_AXIS, flat,
};

/// Passes the rows to a macro: `callback! { rows… }`.
macro_rules! for_each_operation {
    ($callback:path) => {
        $callback! {
            // ---------------------------------------------------------------- solids
            /// A sphere of radius `r`.
            Sphere "sphere" = shapes::sphere(p: Point; r: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "sphere", arguments: &[required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[0]); 3]),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                has_equal_axes: true,
                source: "J. C. Hart, Sphere Tracing, 1996, appendix A",
                ..SOLID
            };
            /// A box of the full size `size`.
            Cuboid "cuboid" = shapes::cuboid(p: Point; half: Vec3) -> Value, prepare::half_size, OpFacts {
                language: Some(BuiltinSignature { name: "box", arguments: &[required("size", A::Size3)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[2])]),
                flats: &[flat(0, 0), flat(1, 1), flat(2, 2)],
                is_convex: true,
                source: "I. Quilez, Distance Functions: box",
                ..SOLID
            };
            /// A box of the full size `size` with rounded edges and corners. Their radius is `round`, at most half the smallest size.
            RoundedCuboid "rounded_cuboid" = shapes::rounded_cuboid(p: Point; half: Vec3, round: Scalar) -> Value, shapes::rounded_cuboid_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "box", arguments: &[required("size", A::Size3), optional("round", A::LengthOrZero, &[0.0])] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[2])]),
                is_convex: true,
                source: "I. Quilez, Distance Functions: round box",
                ..SOLID
            };
            /// The edges of a box of the full size `size`, as square bars of the full thickness `thickness`.
            BoxFrame "box_frame" = shapes::box_frame(p: Point; half: Vec3, bar: Scalar) -> Value, shapes::box_frame_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "box_frame", arguments: &[required("size", A::Size3), required("thickness", A::Length)] }),
                exactness: Exactness::ExactOutside,
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[2])]),
                source: "I. Quilez, Distance Functions: box frame",
                ..SOLID
            };
            /// All points within `r` of a segment of the y axis, centred at the origin. The segment has the length `h`, the capsule the length `h` + 2 `r`.
            Capsule "capsule" = shapes::capsule(p: Point; half: Scalar, r: Scalar) -> Value, prepare::halve_first, OpFacts {
                language: Some(BuiltinSignature { name: "capsule", arguments: &[required("h", A::LengthOrZero), required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[1]), Sum(&[0, 1]), Sum(&[1])]),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: vertical capsule",
                ..SOLID
            };
            /// All points within `r` of the segment from `from` to `to`. Equal ends give a sphere.
            CapsuleBetween "capsule_between" = shapes::capsule_between(p: Point; start: Vec3, r: Scalar, axis: Vec3, inverse: Scalar) -> Value, shapes::capsule_between_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "capsule", arguments: &[required("from", A::Vec3), required("to", A::Vec3), required("r", A::Radius)] }),
                bounds: BoundsRule::Shape(shapes::capsule_between_bounds),
                is_convex: true,
                source: "I. Quilez, Distance Functions: capsule",
                ..SOLID
            };
            /// A ring around the y axis: all points within `r2` of a circle of the radius `r1`. The distance is exact inside if `r2` is at most `r1`.
            Torus "torus" = shapes::torus(p: Point; ring: Scalar, tube: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "torus", arguments: &[required("r1", A::Radius), required("r2", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[0, 1]), Sum(&[1]), Sum(&[0, 1])]),
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: torus",
                ..SOLID
            };
            /// An arc of a ring around the y axis with round ends. It covers the angle `angle` and is symmetric about the +x axis.
            CappedTorus "capped_torus" = shapes::capped_torus(p: Point; ring: Scalar, tube: Scalar, end: Vec2) -> Value, shapes::capped_torus_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "torus", arguments: &[required("r1", A::Radius), required("r2", A::Radius), required("angle", A::Angle)] }),
                bounds: BoundsRule::Shape(shapes::capped_torus_bounds),
                source: "I. Quilez, Distance Functions: capped torus",
                ..SOLID
            };
            /// A cylinder of radius `r` and height `h` around the y axis.
            Cylinder "cylinder" = shapes::cylinder(p: Point; r: Scalar, half: Scalar) -> Value, prepare::halve_last, OpFacts {
                language: Some(BuiltinSignature { name: "cylinder", arguments: &[required("r", A::Radius), required("h", A::Length)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[0])]),
                flats: &[flat(1, 1)],
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: capped cylinder",
                ..SOLID
            };
            /// A cylinder with rounded rims. Their radius is `round`, at most `r` and at most half of `h`.
            RoundedCylinder "rounded_cylinder" = shapes::rounded_cylinder(p: Point; r: Scalar, half: Scalar, round: Scalar) -> Value, shapes::rounded_cylinder_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "cylinder", arguments: &[required("r", A::Radius), required("h", A::Length), optional("round", A::LengthOrZero, &[0.0])] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[0])]),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: rounded cylinder",
                ..SOLID
            };
            /// A cylinder of radius `r` from `from` to `to`. Between equal ends there is nothing.
            CylinderBetween "cylinder_between" = shapes::cylinder_between(p: Point; middle: Vec3, r: Scalar, axis: Vec3, half: Scalar) -> Value, shapes::cylinder_between_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "cylinder", arguments: &[required("from", A::Vec3), required("to", A::Vec3), required("r", A::Radius)] }),
                bounds: BoundsRule::Shape(shapes::cylinder_between_bounds),
                is_convex: true,
                source: "I. Quilez, Distance Functions: arbitrary capped cylinder",
                ..SOLID
            };
            /// An infinite cone that opens downwards from its apex at the origin. `angle` is the full opening angle, at most half a turn.
            InfiniteCone "infinite_cone" = shapes::infinite_cone(p: Point; side: Vec2) -> Value, shapes::infinite_cone_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "infinite_cone", arguments: &[required("angle", A::Angle)] }),
                bounds: BoundsRule::Shape(shapes::infinite_cone_bounds),
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: cone",
                ..SOLID
            };
            /// A cone around the y axis of the height `h`, with the radius `r1` at its bottom and `r2` at its top.
            Cone "cone" = shapes::cone(p: Point; bottom: Scalar, top: Scalar, half: Scalar, slope: Scalar, across: Vec2) -> Value, shapes::cone_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "cone", arguments: &[required("r1", A::RadiusOrZero), required("r2", A::RadiusOrZero), required("h", A::Length)] }),
                bounds: BoundsRule::Centred([Largest(&[0, 1]), Sum(&[2]), Largest(&[0, 1])]),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: capped cone; by the nearest of face, side and rim",
                ..SOLID
            };
            /// A cone with rounded rims and tip. Their radius is `round`, or the largest radius that fits inside.
            RoundedCone "rounded_cone" = shapes::rounded_cone(p: Point; bottom: Scalar, top: Scalar, half: Scalar, slope: Scalar, across: Vec2, middle: Scalar, round: Scalar) -> Value, shapes::rounded_cone_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "cone", arguments: &[required("r1", A::RadiusOrZero), required("r2", A::RadiusOrZero), required("h", A::Length), optional("round", A::LengthOrZero, &[0.0])] }),
                bounds: BoundsRule::Shape(shapes::rounded_cone_bounds),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "the cone inset on all sides, and offset outwards",
                ..SOLID
            };
            /// The convex hull of two spheres on the y axis, `r1` below and `r2` above, with their centres `h` apart. If one sphere contains the other, the hull is the larger sphere.
            RoundCone "round_cone" = shapes::round_cone(p: Point; lower: Scalar, upper: Scalar, low: Scalar, height: Scalar, slant: Vec2) -> Value, shapes::round_cone_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "round_cone", arguments: &[required("r1", A::Radius), required("r2", A::Radius), required("h", A::Length)] }),
                bounds: BoundsRule::Shape(shapes::round_cone_bounds),
                is_convex: true,
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: round cone",
                ..SOLID
            };
            /// An ellipsoid with the radii `r` along the axes. If the radii differ by a factor of more than 1,000, the value may be far less than the distance.
            Ellipsoid "ellipsoid" = shapes::ellipsoid(p: Point; r: Vec3) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "ellipsoid", arguments: &[required("r", A::Radii3)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[2])]),
                is_convex: true,
                source: "D. Eberly, Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid, 2013",
                ..SOLID
            };
            /// The half space below a plane with the normal `normal`. `at` is the signed distance of the plane from the origin, along the normal.
            Plane "plane" = shapes::plane(p: Point; normal: Vec3, at: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "plane", arguments: &[required("normal", A::Direction), optional("at", A::Offset, &[0.0])] }),
                bounds: BoundsRule::Shape(shapes::plane_bounds),
                is_convex: true,
                source: "J. C. Hart, Sphere Tracing, 1996, appendix A",
                ..SOLID
            };
            /// All points between two parallel planes with the normal `normal`. They are `thickness` apart, and the origin is halfway between them.
            Slab "slab" = shapes::slab(p: Point; normal: Vec3, half: Scalar) -> Value, prepare::halve_last, OpFacts {
                language: Some(BuiltinSignature { name: "slab", arguments: &[required("normal", A::Direction), required("thickness", A::Length)] }),
                bounds: BoundsRule::Shape(shapes::slab_bounds),
                is_convex: true,
                source: "two planes",
                ..SOLID
            };
            /// A prism of the height `h` on a regular polygon of `n` corners, at least 3. They are at the distance `r` from the y axis, the first on the +x side.
            Prism "prism" = shapes::prism(p: Point; sector: Scalar, inverse: Scalar, apothem: Scalar, side: Scalar, half: Scalar) -> Value, shapes::prism_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "prism", arguments: &[required("n", A::Count), required("r", A::Radius), required("h", A::Length)] }),
                bounds: BoundsRule::Centred([Function(shapes::ngon_radius), Sum(&[4]), Function(shapes::ngon_radius)]),
                flats: &[flat(1, 4)],
                is_convex: true,
                source: "a regular polygon, extruded",
                ..SOLID
            };
            /// An octahedron with its corners on the axes, at the distance `r` from the centre.
            Octahedron "octahedron" = shapes::octahedron(p: Point; r: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "octahedron", arguments: &[required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[0]); 3]),
                is_convex: true,
                has_equal_axes: true,
                source: "I. Quilez, Distance Functions: octahedron",
                ..SOLID
            };
            /// A tetrahedron with its corners on diagonals of the cube around the origin, at the distance `r` from the centre.
            Tetrahedron "tetrahedron" = shapes::tetrahedron(p: Point; inner: Scalar) -> Value, shapes::tetrahedron_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "tetrahedron", arguments: &[required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Function(shapes::tetrahedron_half_edge); 3]),
                is_convex: true,
                source: "the nearest of a face, an edge and a corner, by symmetry",
                ..SOLID
            };
            /// A pyramid of the height `h` on a square with sides of the length `size`. The origin is at half its height.
            Pyramid "pyramid" = shapes::pyramid(p: Point; base: Scalar, half: Scalar, across: Vec2, slope: Scalar, inverse: Scalar) -> Value, shapes::pyramid_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "pyramid", arguments: &[required("size", A::Length), required("h", A::Length)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Sum(&[0])]),
                is_convex: true,
                source: "I. Quilez, Distance Functions: pyramid; by the nearest of base, side and edge",
                ..SOLID
            };
            /// A link of a chain in the xy plane. It is a ring of the radius `r1` and the thickness `r2`, with straight segments of the length `length` between its halves.
            Link "link" = shapes::link(p: Point; half: Scalar, ring: Scalar, tube: Scalar) -> Value, prepare::halve_first, OpFacts {
                language: Some(BuiltinSignature { name: "link", arguments: &[required("length", A::LengthOrZero), required("r1", A::Radius), required("r2", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[1, 2]), Sum(&[0, 1, 2]), Sum(&[2])]),
                source: "I. Quilez, Distance Functions: link",
                ..SOLID
            };
            /// The gyroid of A. Schoen as an infinite sheet that repeats every `cell` along each axis. Its thickness is `thickness` where the field is steepest, and at most √2 times as much elsewhere.
            Gyroid "gyroid" = shapes::gyroid(p: Point; frequency: Scalar, scale: Scalar, half: Scalar) -> Value, shapes::periodic_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "gyroid", arguments: &[required("cell", A::Length), required("thickness", A::Length)] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::Infinite,
                has_equal_axes: true,
                source: "A. H. Schoen, Infinite Periodic Minimal Surfaces, 1970; the level function divided by its slope bound √3",
                ..SOLID
            };
            /// The primitive surface of H. A. Schwarz as an infinite sheet that repeats every `cell` along each axis. Its thickness is `thickness` where the field is steepest, and at most √2 times as much elsewhere.
            SchwarzP "schwarz_p" = shapes::schwarz_p(p: Point; frequency: Scalar, scale: Scalar, half: Scalar) -> Value, shapes::periodic_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "schwarz_p", arguments: &[required("cell", A::Length), required("thickness", A::Length)] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::Infinite,
                source: "H. A. Schwarz, 1865, by its nodal approximation; the level function divided by its slope bound √3",
                ..SOLID
            };
            /// The diamond surface of H. A. Schwarz as an infinite sheet that repeats every `cell` along each axis. Its thickness is `thickness` where the field is steepest, and at most √2 times as much elsewhere.
            Diamond "diamond" = shapes::diamond(p: Point; frequency: Scalar, scale: Scalar, half: Scalar) -> Value, shapes::periodic_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "diamond", arguments: &[required("cell", A::Length), required("thickness", A::Length)] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::Infinite,
                source: "H. A. Schwarz, 1865, by its nodal approximation; the level function divided by its slope bound √3",
                ..SOLID
            };
            // ---------------------------------------------------------------- plane shapes
            /// A disc of radius `r`.
            Circle "circle" = shapes::circle(p: Plane; r: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "circle", arguments: &[required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[0]), Infinite]),
                is_convex: true,
                axis_of_revolution: Some(Z_AXIS),
                source: "J. C. Hart, Sphere Tracing, 1996, appendix A",
                ..PLANE
            };
            /// A rectangle of the full size `size`.
            Rect "rect" = shapes::rect(p: Plane; half: Vec2) -> Value, prepare::half_size, OpFacts {
                language: Some(BuiltinSignature { name: "rect", arguments: &[required("size", A::Size2)] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Infinite]),
                flats: &[flat(0, 0), flat(1, 1)],
                is_convex: true,
                source: "I. Quilez, 2D Distance Functions: box",
                ..PLANE
            };
            /// A rectangle with rounded corners. Their radius is `round`, at most half the smaller size.
            RoundedRect "rounded_rect" = shapes::rounded_rect(p: Plane; half: Vec2, round: Scalar) -> Value, shapes::rounded_rect_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "rect", arguments: &[required("size", A::Size2), optional("round", A::LengthOrZero, &[0.0])] }),
                bounds: BoundsRule::Centred([Sum(&[0]), Sum(&[1]), Infinite]),
                is_convex: true,
                source: "I. Quilez, 2D Distance Functions: rounded box",
                ..PLANE
            };
            /// All points of the plane within `r` of the segment from `from` to `to`. Equal ends give a disc.
            Segment "segment" = shapes::segment(p: Plane; start: Vec2, axis: Vec2, inverse: Scalar, r: Scalar) -> Value, shapes::segment_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "segment", arguments: &[required("from", A::Vec2), required("to", A::Vec2), required("r", A::Radius)] }),
                bounds: BoundsRule::Shape(shapes::segment_bounds),
                is_convex: true,
                source: "I. Quilez, 2D Distance Functions: segment",
                ..PLANE
            };
            /// A regular polygon of `n` corners, at least 3. They are at the distance `r` from the centre, the first on the +y axis.
            Ngon "ngon" = shapes::ngon(p: Plane; sector: Scalar, inverse: Scalar, apothem: Scalar, side: Scalar) -> Value, shapes::ngon_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "ngon", arguments: &[required("n", A::Count), required("r", A::Radius)] }),
                bounds: BoundsRule::Centred([Function(shapes::ngon_radius), Function(shapes::ngon_radius), Infinite]),
                is_convex: true,
                source: "the sector of a side, by symmetry",
                ..PLANE
            };
            /// A star of `n` tips. They are at the distance `r1` from the centre, the first on the +y axis. The corners between them are at the distance `r2`.
            Star "star" = shapes::star(p: Plane; sector: Scalar, inverse: Scalar, tip: Scalar, length: Scalar, across: Vec2) -> Value, shapes::star_parameters, OpFacts {
                language: Some(BuiltinSignature { name: "star", arguments: &[required("n", A::Count), required("r1", A::Radius), required("r2", A::Radius)] }),
                bounds: BoundsRule::Centred([Function(shapes::star_radius), Function(shapes::star_radius), Infinite]),
                source: "half the sector of a tip, by symmetry",
                ..PLANE
            };
            /// An edge of a polygon, as one operation of a chain. The value is the distance to the edges so far. It is negative where a ray to the right crosses an odd number of them. The chain begins with the constant 1e30.
            PolygonEdge "polygon_edge" = shapes::polygon_edge(acc: Value, p: Plane; a: Vec2, b: Vec2) -> Value, prepare::identity, OpFacts {
                category: Category::Internal,
                slope: SlopeRule::MaxOfOperandsOrOne,
                bounds: BoundsRule::Map(shapes::polygon_edge_bounds),
                source: "I. Quilez, 2D Distance Functions: polygon; by the nearest of sides and corners",
                ..PLANE
            };
            // ---------------------------------------------------------------- between plane and space
            /// The 2-D shape as a solid of the height `h` along z, half of it on each side of the plane.
            Extrude "extrude" = dimension::extrude(d: Value, p: Point; half: Scalar) -> Value, prepare::halve_first, OpFacts {
                language: Some(BuiltinSignature { name: "extrude", arguments: &[required("h", A::Length)] }),
                bounds: BoundsRule::Map(map_bounds::extrude),
                uses_only_signs: true,
                flats: &[flat(2, 0)],
                source: "I. Quilez, Distance Functions: extrusion",
                ..DIMENSION
            };
            /// The 2-D shape as a solid with rounded rims. Their radius is `round`, at most half of `h`. Of a field, the written value counts, as for an offset.
            RoundedExtrude "rounded_extrude" = dimension::rounded_extrude(d: Value, p: Point; half: Scalar, round: Scalar) -> Value, prepare::rounded_extrude, OpFacts {
                language: Some(BuiltinSignature { name: "extrude", arguments: &[required("h", A::Length), optional("round", A::LengthOrZero, &[0.0])] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::Map(map_bounds::extrude),
                source: "a smaller extrusion, offset outwards",
                ..DIMENSION
            };
            /// The 2-D shape, moved by `offset` along x and revolved around the y axis. If the shape crosses the axis, the distance may be too small.
            Revolve "revolve" = dimension::revolve(p: Point; offset: Scalar) -> Point, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "revolve", arguments: &[optional("offset", A::Offset, &[0.0])] }),
                slope: SlopeRule::Fold,
                bounds: BoundsRule::Map(map_bounds::revolve),
                axis_of_revolution: Some(Y_AXIS),
                source: "I. Quilez, Distance Functions: revolution",
                ..DIMENSION
            };
            /// The 2-D shape, moved by `offset` along x and revolved around the y axis by `angle`, symmetric about the +x axis. If the shape crosses the axis, the distance may be too small.
            RevolvePart "revolve_part" = dimension::revolve_part(p: Point; offset: Scalar, end: Vec2) -> Point, prepare::revolve_part, OpFacts {
                language: Some(BuiltinSignature { name: "revolve", arguments: &[optional("offset", A::Offset, &[0.0]), required("angle", A::Angle)] }),
                slope: SlopeRule::Fold,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::revolve),
                source: "the half plane of the point, or that of the nearer end",
                ..DIMENSION
            };
            /// The ends of a partial revolution. Its parameter derives from the angle.
            RevolveClose "revolve_close" = dimension::revolve_close(d: Value, p: Point; end: Vec2) -> Value, prepare::revolve_close, OpFacts {
                category: Category::Internal,
                bounds: BoundsRule::FirstOperand,
                uses_only_signs: true,
                source: "a wedge of space, intersected",
                ..DIMENSION
            };
            /// The 2-D section of a solid in the plane z = 0.
            Slice "slice" = dimension::slice(p: Point;) -> Point, prepare::identity, OpFacts {
                exactness: Exactness::Bound,
                slope: SlopeRule::Fold,
                bounds: BoundsRule::Map(map_bounds::slice),
                source: "the solid's distance bounds that to its section",
                ..DIMENSION
            };
            // ---------------------------------------------------------------- combinations
            /// The union of both operands.
            Union "union" = combine::union(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                exactness: Exactness::ExactOutside,
                bounds: BoundsRule::Hull,
                blend: Some(Blend { kernel: BlendKernel::Hard, sign: 1.0, negate_second: false }),
                uses_only_signs: true,
                source: "A. Ricci, A Constructive Geometry for Computer Graphics, 1973",
                ..UNION
            };
            /// The intersection of both operands.
            Intersection "intersection" = combine::intersection(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Hard, sign: -1.0, negate_second: false }),
                uses_only_signs: true,
                source: "A. Ricci, A Constructive Geometry for Computer Graphics, 1973",
                ..INTERSECTION
            };
            /// The first operand without the second. A cut shows the material of the first operand, or that of the second where it
            /// has one.
            Subtraction "subtraction" = combine::subtraction(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Hard, sign: -1.0, negate_second: true }),
                uses_only_signs: true,
                source: "A. Ricci, A Constructive Geometry for Computer Graphics, 1973",
                ..SUBTRACTION
            };
            /// The points inside exactly one operand.
            Xor "xor" = combine::xor(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                bounds: BoundsRule::Hull,
                uses_only_signs: true,
                source: "I. Quilez, Distance Functions: xor",
                ..COMBINE
            };
            /// The union with a quadratic blend. `thickness` is its offset where both distances are equal. The blend ends where the distances differ by 4 times `thickness`.
            SmoothUnion "smooth_union" = combine::smooth_union(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::quadratic, OpFacts {
                bounds: BoundsRule::HullGrown(|a| BlendKernel::Quadratic.max_offset(a[0])),
                blend: Some(Blend { kernel: BlendKernel::Quadratic, sign: 1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: quadratic",
                ..UNION
            };
            /// The intersection with a quadratic blend of `thickness` along its edge.
            SmoothIntersection "smooth_intersection" = combine::smooth_intersection(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::quadratic, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Quadratic, sign: -1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: quadratic",
                ..INTERSECTION
            };
            /// The first operand without the second, with a quadratic blend of `thickness` along the edge.
            SmoothSubtraction "smooth_subtraction" = combine::smooth_subtraction(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::quadratic, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Quadratic, sign: -1.0, negate_second: true }),
                source: "I. Quilez, Smooth Minimum: quadratic",
                ..SUBTRACTION
            };
            /// The union with a cubic blend. `thickness` is its offset where both distances are equal. The blend ends where the distances differ by 6 times `thickness`.
            CubicUnion "cubic_union" = combine::cubic_union(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::cubic, OpFacts {
                bounds: BoundsRule::HullGrown(|a| BlendKernel::Cubic.max_offset(a[0])),
                blend: Some(Blend { kernel: BlendKernel::Cubic, sign: 1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: cubic",
                ..UNION
            };
            /// The intersection with a cubic blend of `thickness` along its edge.
            CubicIntersection "cubic_intersection" = combine::cubic_intersection(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::cubic, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Cubic, sign: -1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: cubic",
                ..INTERSECTION
            };
            /// The first operand without the second, with a cubic blend of `thickness` along the edge.
            CubicSubtraction "cubic_subtraction" = combine::cubic_subtraction(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::cubic, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Cubic, sign: -1.0, negate_second: true }),
                source: "I. Quilez, Smooth Minimum: cubic",
                ..SUBTRACTION
            };
            /// The union with a circular blend. `thickness` is its offset where both distances are equal. The blend ends where the distances differ by 3.41 times `thickness`.
            CircularUnion "circular_union" = combine::circular_union(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::circular, OpFacts {
                bounds: BoundsRule::HullGrown(|a| BlendKernel::Circular.max_offset(a[0])),
                blend: Some(Blend { kernel: BlendKernel::Circular, sign: 1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: circular",
                ..UNION
            };
            /// The intersection with a circular blend of `thickness` along its edge.
            CircularIntersection "circular_intersection" = combine::circular_intersection(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::circular, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Circular, sign: -1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: circular",
                ..INTERSECTION
            };
            /// The first operand without the second, with a circular blend of `thickness` along the edge.
            CircularSubtraction "circular_subtraction" = combine::circular_subtraction(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::circular, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Circular, sign: -1.0, negate_second: true }),
                source: "I. Quilez, Smooth Minimum: circular",
                ..SUBTRACTION
            };
            /// The union with an exponential blend. `thickness` is its offset where both distances are equal. The blend has no end, and alone of all blends it is associative.
            ExponentialUnion "exponential_union" = combine::exponential_union(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::exponential, OpFacts {
                bounds: BoundsRule::HullGrown(|a| BlendKernel::Exponential.max_offset(a[0])),
                blend: Some(Blend { kernel: BlendKernel::Exponential, sign: 1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: exponential",
                ..UNION
            };
            /// The intersection with an exponential blend of `thickness` along its edge.
            ExponentialIntersection "exponential_intersection" = combine::exponential_intersection(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::exponential, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Exponential, sign: -1.0, negate_second: false }),
                source: "I. Quilez, Smooth Minimum: exponential",
                ..INTERSECTION
            };
            /// The first operand without the second, with an exponential blend of `thickness` along the edge.
            ExponentialSubtraction "exponential_subtraction" = combine::exponential_subtraction(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::exponential, OpFacts {
                blend: Some(Blend { kernel: BlendKernel::Exponential, sign: -1.0, negate_second: true }),
                source: "I. Quilez, Smooth Minimum: exponential",
                ..SUBTRACTION
            };
            /// The union with a quadratic blend of varying thickness. The thickness is `thickness` at `focus`. It grows by `growth` per unit of length away from there, up to `most`.
            DistanceUnion "distance_union" = combine::distance_union(a: Value, b: Value, p: Point; focus: Vec3, thickness: Scalar, growth: Scalar, most: Scalar) -> Value, prepare::identity, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::PlusParams(|a| a[4].abs()),
                bounds: BoundsRule::HullGrown(|a| a[5]),
                source: "I. Quilez, Smooth Minimum: quadratic, of varying thickness",
                ..UNION
            };
            /// The union with a chamfer along the edge between both operands. The chamfer is flat, at 45 degrees, and starts `size` from the edge on both sides.
            ChamferUnion "chamfer_union" = combine::chamfer_union(a: Value, b: Value; size: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                bounds: BoundsRule::HullGrown(|a| a[0] / 2.0),
                source: "hg_sdf by Mercury, 2015",
                ..UNION
            };
            /// The intersection with a chamfer along its edge. The chamfer is flat, at 45 degrees, and starts `size` from the edge on both sides.
            ChamferIntersection "chamfer_intersection" = combine::chamfer_intersection(a: Value, b: Value; size: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                source: "hg_sdf by Mercury, 2015",
                ..INTERSECTION
            };
            /// The first operand without the second, with a chamfer along the edge. The chamfer is flat, at 45 degrees, and starts `size` from the edge on both sides.
            ChamferSubtraction "chamfer_subtraction" = combine::chamfer_subtraction(a: Value, b: Value; size: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                source: "hg_sdf by Mercury, 2015",
                ..SUBTRACTION
            };
            /// The union with a fillet along the edge between both operands: a quarter circle of the radius `r`.
            RoundUnion "round_union" = combine::round_union(a: Value, b: Value; r: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                bounds: BoundsRule::HullGrown(|a| a[0] * (1.0 - std::f64::consts::FRAC_1_SQRT_2)),
                source: "hg_sdf by Mercury, 2015",
                ..UNION
            };
            /// The intersection with its edge rounded by a quarter circle of the radius `r`.
            RoundIntersection "round_intersection" = combine::round_intersection(a: Value, b: Value; r: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                source: "hg_sdf by Mercury, 2015",
                ..INTERSECTION
            };
            /// The first operand without the second, with the edge rounded by a quarter circle of the radius `r`.
            RoundSubtraction "round_subtraction" = combine::round_subtraction(a: Value, b: Value; r: Scalar) -> Value, prepare::profile, OpFacts {
                exactness: Exactness::Unknown,
                slope: SlopeRule::Norm,
                source: "hg_sdf by Mercury, 2015",
                ..SUBTRACTION
            };
            /// The union with `n` stairs along the edge between both operands. All stairs together are `size` wide.
            StairsUnion "stairs_union" = combine::stairs_union(a: Value, b: Value; size: Scalar, step: Scalar) -> Value, prepare::stairs, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                bounds: BoundsRule::HullGrown(|a| a[0] / 2.0),
                source: "hg_sdf by Mercury, 2015",
                ..UNION
            };
            /// The intersection with `n` stairs along its edge. All stairs together are `size` wide.
            StairsIntersection "stairs_intersection" = combine::stairs_intersection(a: Value, b: Value; size: Scalar, step: Scalar) -> Value, prepare::stairs, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                source: "hg_sdf by Mercury, 2015",
                ..INTERSECTION
            };
            /// The first operand without the second, with `n` stairs along the edge. All stairs together are `size` wide.
            StairsSubtraction "stairs_subtraction" = combine::stairs_subtraction(a: Value, b: Value; size: Scalar, step: Scalar) -> Value, prepare::stairs, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                source: "hg_sdf by Mercury, 2015",
                ..SUBTRACTION
            };
            /// The linear interpolation from the first shape at `t` = 0 to the second at `t` = 1. `t` is clamped to 0 and 1.
            Morph "morph" = combine::morph(a: Value, b: Value; t: Scalar) -> Value, prepare::clamp01, OpFacts {
                language: Some(BuiltinSignature { name: "morph", arguments: &[required("t", A::Number)] }),
                bounds: BoundsRule::Hull,
                source: "J. C. Hart, Sphere Tracing, 1996: metamorphosis",
                ..COMBINE
            };
            // ---------------------------------------------------------------- changes of the point
            /// The part of the shape on the positive side of each mirrored axis, and its mirror image. An axis is mirrored if its component of `axes` is not zero. If the shape crosses a mirror plane, the distance may be too small.
            Mirror "mirror" = domain::mirror(p: Point; axes: Vec3) -> Point, prepare::mirror_flags, OpFacts {
                language: Some(BuiltinSignature { name: "mirror", arguments: &[required("axes", A::Vec3)] }),
                exactness: Exactness::ExactOutside,
                bounds: BoundsRule::Map(map_bounds::mirror),
                source: "I. Quilez, Distance Functions: symmetry",
                ..DOMAIN
            };
            /// An infinite grid of copies, `spacing` apart along each axis. Along axes with a spacing of zero there are no copies. The opcode evaluates the copy of the point's own cell.
            Repeat "repeat" = domain::repeat(p: Point; spacing: Vec3, inverse: Vec3) -> Point, prepare::spacing, OpFacts {
                language: Some(BuiltinSignature { name: "repeat", arguments: &[required("spacing", A::Lengths3)] }),
                exactness: Exactness::ExactOutside,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::repeat),
                source: "I. Quilez, Distance Functions: repetition",
                ..DOMAIN
            };
            /// A copy of an infinite repetition, `which` cells farther along each axis on the side that is nearer to the point.
            RepeatNeighbour "repeat_neighbour" = domain::repeat_neighbour(p: Point; spacing: Vec3, inverse: Vec3, which: Vec3) -> Point, prepare::spacing, OpFacts {
                category: Category::Internal,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::repeat),
                source: "I. Quilez, Domain Repetition",
                ..DOMAIN
            };
            /// `count` copies along each axis, `spacing` apart, centred at the origin. The opcode evaluates the copy of the point's own cell.
            RepeatLimited "repeat_limited" = domain::repeat_limited(p: Point; spacing: Vec3, inverse: Vec3, last: Vec3) -> Point, prepare::limited_spacing, OpFacts {
                language: Some(BuiltinSignature { name: "repeat", arguments: &[required("spacing", A::Lengths3), required("count", A::Counts3)] }),
                exactness: Exactness::ExactOutside,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::repeat_limited),
                source: "I. Quilez, Distance Functions: limited repetition",
                ..DOMAIN
            };
            /// A copy of a limited repetition, `which` cells farther along each axis on the side that is nearer to the point. Beyond the last cell, it is the copy of the last cell.
            RepeatLimitedNeighbour "repeat_limited_neighbour" = domain::repeat_limited_neighbour(p: Point; spacing: Vec3, inverse: Vec3, last: Vec3, which: Vec3) -> Point, prepare::limited_spacing, OpFacts {
                category: Category::Internal,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::repeat_limited),
                source: "I. Quilez, Domain Repetition",
                ..DOMAIN
            };
            /// `n` copies around the y axis, turned by `phase` around it, as `rotate` turns. The opcode evaluates the copy of the point's own sector.
            Polar "polar" = domain::polar(p: Point; sector: Scalar, inverse: Scalar, phase: Scalar) -> Point, prepare::polar, OpFacts {
                language: Some(BuiltinSignature { name: "polar", arguments: &[required("n", A::Count), optional("phase", A::Angle, &[0.0])] }),
                exactness: Exactness::ExactOutside,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::polar),
                source: "hg_sdf by Mercury, 2015: modulo polar",
                ..DOMAIN
            };
            /// A copy around the y axis, `which` sectors farther on the side that is nearer to the point.
            PolarNeighbour "polar_neighbour" = domain::polar_neighbour(p: Point; sector: Scalar, inverse: Scalar, phase: Scalar, which: Scalar) -> Point, prepare::polar_neighbour, OpFacts {
                category: Category::Internal,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::polar),
                source: "I. Quilez, Domain Repetition",
                ..DOMAIN
            };
            /// `n` copies of a 2-D shape around the origin. `phase` turns them, as `rotate` turns. The opcode evaluates the copy of the point's own sector.
            PolarPlane "polar_plane" = domain::polar_plane(p: Point; sector: Scalar, inverse: Scalar, phase: Scalar) -> Point, prepare::polar, OpFacts {
                language: Some(BuiltinSignature { name: "polar", arguments: &[required("n", A::Count), optional("phase", A::Angle, &[0.0])] }),
                exactness: Exactness::ExactOutside,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::polar_plane),
                source: "hg_sdf by Mercury, 2015: modulo polar",
                ..DOMAIN
            };
            /// A copy around the z axis, `which` sectors farther on the side that is nearer to the point.
            PolarPlaneNeighbour "polar_plane_neighbour" = domain::polar_plane_neighbour(p: Point; sector: Scalar, inverse: Scalar, phase: Scalar, which: Scalar) -> Point, prepare::polar_neighbour, OpFacts {
                category: Category::Internal,
                continuity: Continuity::Jumps,
                bounds: BoundsRule::Map(map_bounds::polar_plane),
                source: "I. Quilez, Domain Repetition",
                ..DOMAIN
            };
            /// The shape, cut through its middle, with its parts moved apart by `by` along each axis.
            Elongate "elongate" = domain::elongate(p: Point; half: Vec3) -> Point, prepare::half_size, OpFacts {
                language: Some(BuiltinSignature { name: "elongate", arguments: &[required("by", A::Lengths3)] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::Map(map_bounds::elongate),
                source: "I. Quilez, Distance Functions: elongation",
                ..DOMAIN
            };
            /// The shape rotated about the y axis by `rate` per unit of its height.
            Twist "twist" = domain::twist(p: Point; rate: Scalar) -> Point, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "twist", arguments: &[required("rate", A::Angle)] }),
                exactness: Exactness::Unknown,
                slope: SlopeRule::PointMap(map_bounds::twist_stretch),
                bounds: BoundsRule::Map(map_bounds::twist),
                source: "A. Barr, Global and Local Deformations, 1984; stretch by its singular values",
                ..DOMAIN
            };
            /// The shape rotated about the z axis by `rate` per unit along x. Where `rate` times y reaches one, space overlaps itself.
            Bend "bend" = domain::bend(p: Point; rate: Scalar) -> Point, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "bend", arguments: &[required("rate", A::Angle)] }),
                exactness: Exactness::Unknown,
                slope: SlopeRule::PointMap(map_bounds::bend_stretch),
                bounds: BoundsRule::Map(map_bounds::bend),
                source: "I. Quilez, Distance Functions: cheap bend; stretch by its singular values",
                ..DOMAIN
            };
            // ---------------------------------------------------------------- changes of the distance
            /// All points outside of the shape.
            Complement "complement" = distance::complement(d: Value;) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "complement", arguments: &[] }),
                bounds: BoundsRule::Infinite,
                uses_only_signs: true,
                source: "A. Ricci, A Constructive Geometry for Computer Graphics, 1973",
                ..DISTANCE
            };
            /// The shape with its surface moved outwards by `by`, or inwards if `by` is negative. An outward offset rounds convex edges. The distance is exact outside for outward offsets, and inside for inward ones.
            Offset "offset" = distance::offset(d: Value; by: Scalar) -> Value, prepare::identity, OpFacts {
                language: Some(BuiltinSignature { name: "offset", arguments: &[required("by", A::Offset)] }),
                exactness: Exactness::Bound,
                bounds: BoundsRule::HullGrown(|a| a[0]),
                source: "J. C. Hart, Sphere Tracing, 1996",
                ..DISTANCE
            };
            /// A wall of the full thickness `thickness`, centred on the surface.
            Shell "shell" = distance::shell(d: Value; half: Scalar) -> Value, prepare::halve_last, OpFacts {
                language: Some(BuiltinSignature { name: "shell", arguments: &[required("thickness", A::Length)] }),
                exactness: Exactness::ExactOutside,
                bounds: BoundsRule::HullGrown(|a| a[0]),
                source: "I. Quilez, Distance Functions: onion",
                ..DISTANCE
            };
            /// The correction of an elongated shape's distance inside the gap. It reads the point before [`Op::Elongate`].
            ElongateCorrect "elongate_correct" = distance::elongate_correct(d: Value, p: Point; half: Vec3) -> Value, prepare::half_size, OpFacts {
                category: Category::Internal,
                slope: SlopeRule::MaxOfOperandsOrOne,
                uses_only_signs: true,
                source: "I. Quilez, Distance Functions: elongation",
                ..DISTANCE
            };
            /// The distance in a space scaled by `factor`.
            ScaleDistance "scale_distance" = distance::scale_distance(d: Value; factor: Scalar) -> Value, prepare::identity, OpFacts {
                category: Category::Internal,
                slope: SlopeRule::ScaledBy(|a| a[0].abs()),
                uses_only_signs: true,
                source: "J. C. Hart, Sphere Tracing, 1996",
                ..DISTANCE
            };
            /// A raw field divided by its slope bound `slope`. The parameter of the row derives from that bound.
            FieldDistance "field_distance" = distance::field_distance(v: Value; inverse_slope: Scalar) -> Value, prepare::inverse_slope, OpFacts {
                category: Category::Internal,
                exactness: Exactness::Bound,
                slope: SlopeRule::ScaledBy(|a| a[0].abs()),
                uses_only_signs: true,
                source: "D. Kalra and A. Barr, Guaranteed Ray Intersections with Implicit Surfaces, 1989",
                ..DISTANCE
            };
            /// A safe step for a raw field whose slope grows away from the origin. Its parameters derive from the half side of a cube, the slope bound inside, and the factor and exponent of the bound outside.
            FieldGrowth "field_growth" = distance::field_growth(v: Value, p: Point; side: Scalar, exponent: Scalar, share: Scalar, inverse: Scalar, beyond: Scalar) -> Value, prepare::growth, OpFacts {
                category: Category::Internal,
                exactness: Exactness::Bound,
                slope: SlopeRule::Constant(1.0),
                uses_only_signs: true,
                source: "the larger of the safe steps inside the cube and by the power law outside",
                ..DISTANCE
            };
            /// A discontinuous raw field, as the distance `step` in which its sign does not change, with that sign.
            Piecewise "piecewise" = distance::piecewise(v: Value, step: Value;) -> Value, prepare::identity, OpFacts {
                category: Category::Internal,
                exactness: Exactness::Bound,
                slope: SlopeRule::Unbounded,
                uses_only_signs: true,
                source: "a path through a discontinuity is at least as long as the distance to it, and as the safe step of the piece beyond",
                ..DISTANCE
            };
            /// A distance that is valid only within `margin` of a box around its shape. Farther away, the value is the distance to the box. No step is longer than `limit`. Its parameters derive from the box's two corners, the margin and the limit.
            Bounded "bounded" = distance::bounded(d: Value, p: Point; centre: Vec3, margin: Scalar, half: Vec3, limit: Scalar) -> Value, prepare::corners, OpFacts {
                category: Category::Internal,
                exactness: Exactness::Bound,
                slope: SlopeRule::Step,
                bounds: BoundsRule::Map(map_bounds::bounded),
                uses_only_signs: true,
                source: "the larger of two bounds",
                ..DISTANCE
            };
            // ---------------------------------------------------------------- arithmetic
            /// The first coordinate of the point.
            X "x" = math::x(p: Point;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Constant(1.0),
                ..MATH
            };
            /// The second coordinate of the point.
            Y "y" = math::y(p: Point;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Constant(1.0),
                ..MATH
            };
            /// The third coordinate of the point.
            Z "z" = math::z(p: Point;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Constant(1.0),
                ..MATH
            };
            /// A number of the program.
            Constant "constant" = math::constant(; value: Scalar) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Constant(0.0),
                bounds: BoundsRule::Shape(map_bounds::constant),
                ..MATH
            };
            /// The point with the three operands as its coordinates.
            MakePoint "make_point" = math::point(x: Value, y: Value, z: Value;) -> Point, prepare::identity, MATH;
            /// The sum of two numbers.
            Add "add" = math::add(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Sum,
                is_commutative: true,
                ..MATH
            };
            /// The difference of two numbers.
            Sub "sub" = math::sub(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Sum,
                ..MATH
            };
            /// The product of two numbers.
            Mul "mul" = math::mul(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                is_commutative: true,
                ..MATH
            };
            /// The quotient of two numbers; a divisor below 1e-18 in magnitude counts as 1e-18. Where both numbers are zero in a part of space, a field is outside.
            Div "div" = math::div(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                defined_for: DefinedFor::NotBothZero,
                ..POLE
            };
            /// The remainder of a floored division: it has the divisor's sign.
            Modulo "modulo" = math::modulo(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                defined_for: DefinedFor::DivisorNotZero,
                ..JUMP
            };
            /// The number with the opposite sign.
            Neg "neg" = math::neg(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The absolute value.
            Abs "abs" = math::abs(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The sign as a number: −1, 0 or 1.
            Sign "sign" = math::sign(a: Value;) -> Value, prepare::identity, JUMP;
            /// The smaller of two numbers.
            Min "min" = math::min(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                is_commutative: true,
                ..MATH
            };
            /// The larger of two numbers.
            Max "max" = math::max(a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                is_commutative: true,
                ..MATH
            };
            /// The first number, clamped to the range from the second to the third.
            Clamp "clamp" = math::clamp(a: Value, low: Value, high: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The largest integer that is not greater.
            Floor "floor" = math::floor(a: Value;) -> Value, prepare::identity, JUMP;
            /// The smallest integer that is not less.
            Ceil "ceil" = math::ceil(a: Value;) -> Value, prepare::identity, JUMP;
            /// The nearest integer; halves are rounded up.
            Round "round" = math::round(a: Value;) -> Value, prepare::identity, JUMP;
            /// The number minus the largest integer that is not greater.
            Fract "fract" = math::fract(a: Value;) -> Value, prepare::identity, JUMP;
            /// The integer part, rounded towards zero.
            Trunc "trunc" = math::trunc(a: Value;) -> Value, prepare::identity, JUMP;
            /// The square root. It is zero for negative numbers, and a field is outside there.
            Sqrt "sqrt" = math::sqrt(a: Value;) -> Value, prepare::identity, NOT_NEGATIVE;
            /// One over the square root; numbers below 1e-30 count as 1e-30. Where the number is negative, a field is outside.
            InverseSqrt "inverse_sqrt" = math::inverse_sqrt(a: Value;) -> Value, prepare::identity, NOT_NEGATIVE;
            /// The sine of an angle in radians.
            Sin "sin" = math::sin(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The cosine of an angle in radians.
            Cos "cos" = math::cos(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The tangent of an angle in radians.
            Tan "tan" = math::tan(a: Value;) -> Value, prepare::identity, POLE;
            /// The angle with this sine. The number is clamped to −1 and 1; beyond them, a field is outside.
            Asin "asin" = math::asin(a: Value;) -> Value, prepare::identity, UP_TO_ONE;
            /// The angle with this cosine. The number is clamped to −1 and 1; beyond them, a field is outside.
            Acos "acos" = math::acos(a: Value;) -> Value, prepare::identity, UP_TO_ONE;
            /// The angle with this tangent, in [−π/2, π/2].
            Atan "atan" = math::atan(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The angle of the vector (`x`, `y`) in [−π, π]; 0 at the origin.
            Atan2 "atan2" = math::atan2(y: Value, x: Value;) -> Value, prepare::identity, JUMP;
            /// The hyperbolic sine.
            Sinh "sinh" = math::sinh(a: Value;) -> Value, prepare::identity, MATH;
            /// The hyperbolic cosine.
            Cosh "cosh" = math::cosh(a: Value;) -> Value, prepare::identity, MATH;
            /// The hyperbolic tangent.
            Tanh "tanh" = math::tanh(a: Value;) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::MaxOfOperands(1.0),
                ..MATH
            };
            /// The exponential function.
            Exp "exp" = math::exp(a: Value;) -> Value, prepare::identity, MATH;
            /// Two to the power of the number.
            Exp2 "exp2" = math::exp2(a: Value;) -> Value, prepare::identity, MATH;
            /// The natural logarithm; for zero and negative numbers, that of the smallest number. Where the number is negative, a field is outside.
            Ln "ln" = math::ln(a: Value;) -> Value, prepare::identity, NOT_NEGATIVE;
            /// The logarithm to base two; for zero and negative numbers, that of the smallest number. Where the number is negative, a field is outside.
            Log2 "log2" = math::log2(a: Value;) -> Value, prepare::identity, NOT_NEGATIVE;
            /// The first number to the power of the second. Where the first is negative, a field is outside, unless the second is a constant integer.
            Pow "pow" = math::pow(a: Value, b: Value;) -> Value, prepare::identity, NOT_NEGATIVE;
            /// 0 where the second number is below the first, 1 elsewhere.
            Step "step" = math::step(edge: Value, a: Value;) -> Value, prepare::identity, JUMP;
            /// 0 up to the first number and 1 from the second on. Between them, it is a smooth cubic of the third.
            Smoothstep "smoothstep" = math::smoothstep(low: Value, high: Value, a: Value;) -> Value, prepare::identity, MATH;
            /// The linear interpolation from the first number at `t` = 0 to the second at `t` = 1, and its extrapolation.
            Mix "mix" = math::mix(a: Value, b: Value, t: Value;) -> Value, prepare::identity, MATH;
            /// 1 where the first number is smaller, 0 elsewhere.
            Less "less" = math::less(a: Value, b: Value;) -> Value, prepare::identity, JUMP;
            /// 1 where both truth values are 1, 0 elsewhere.
            And "and" = math::and(a: Value, b: Value;) -> Value, prepare::identity, MATH;
            /// 1 where at least one truth value is 1, 0 elsewhere.
            Or "or" = math::or(a: Value, b: Value;) -> Value, prepare::identity, MATH;
            /// 1 for the truth value 0, 0 for 1.
            Not "not" = math::not(a: Value;) -> Value, prepare::identity, MATH;
            /// The second number where the first is above a half, the third elsewhere.
            Select "select" = math::select(condition: Value, a: Value, b: Value;) -> Value, prepare::identity, OpFacts {
                continuity: Continuity::Selects,
                ..MATH
            };
            /// Gradient noise on a lattice of the spacing 1. It is smooth, zero at lattice points, between −1 and 1, and mostly between −0.5 and 0.5.
            Noise "noise" = math::noise(p: Point; seed: Scalar) -> Value, prepare::identity, OpFacts {
                slope: SlopeRule::Constant(MAX_NOISE_STEEPNESS),
                source: "K. Perlin, Improving Noise, 2002",
                ..LATTICE
            };
            /// The operand plus `amplitude` times noise at `frequency` times the point. Its parameters derive from frequency, amplitude and seed.
            NoiseOctave "noise_octave" = math::noise_octave(acc: Value, p: Point; offset: Vec3, frequency: Scalar, amplitude: Scalar, seed: Scalar) -> Value, prepare::octave, OpFacts {
                slope: SlopeRule::PlusParams(|a| (a[3] * a[4]).abs() * MAX_NOISE_STEEPNESS),
                source: "K. Perlin, Improving Noise, 2002",
                ..LATTICE
            };
            /// The operand plus `amplitude` times ridges, 1 − 2·|noise|, at `frequency` times the point. Its parameters derive from frequency, amplitude and seed.
            RidgeOctave "ridge_octave" = math::ridge_octave(acc: Value, p: Point; offset: Vec3, frequency: Scalar, amplitude: Scalar, seed: Scalar) -> Value, prepare::octave, OpFacts {
                slope: SlopeRule::PlusParams(|a| 2.0 * (a[3] * a[4]).abs() * MAX_NOISE_STEEPNESS),
                source: "F. K. Musgrave, in Texturing and Modeling, 1994",
                ..LATTICE
            };
            /// The number times itself.
            Square "square" = math::square(a: Value;) -> Value, prepare::identity, MATH;
            /// The slope of gradient noise along a direction, which normalizes fields that read noise.
            NoiseSlope "noise_slope" = math::noise_slope(p: Point; along: Vec3, seed: Scalar) -> Value, prepare::identity, OpFacts {
                source: "K. Perlin, Improving Noise, 2002",
                ..LATTICE
            };
        }
    };
}
pub(crate) use for_each_operation;

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The operation, which is the row's index.
    pub op: Op,
    /// Its name in Rust, WGSL and listings.
    pub name: &'static str,
    /// Its description for `sdfc ops`, in sentences.
    pub doc: &'static str,
    /// Its inputs besides the parameters, in the order of the body.
    pub inputs: &'static [Input],
    /// Its parameters, in the order of the pool.
    pub parameters: &'static [Parameter],
    /// Kind of its result.
    pub output: Output,
    /// Its bounds, slope, exactness, symmetry and place in the language.
    pub facts: OpFacts,
}

for_each_operation!(define_operations);
