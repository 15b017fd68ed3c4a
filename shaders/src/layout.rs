//! Data shared by host and kernels: the uniforms of a frame and the records of the storage buffers, each
//! declared once for Rust and WGSL.
//!
//! `shared!` writes both declarations from one list of fields. In WGSL a `vec3f` begins at a multiple of 16
//! bytes and takes 12, so each precedes a scalar. A test compares every offset with naga's.

use bytemuck::{Pod, Zeroable};
use sdfc_vm::settings::MAX_HALF_SPACES;

/// Declares a struct for Rust (`repr(C)`) and its twin for WGSL, in the constant `WGSL`.
macro_rules! shared {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ident,)+ }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: shared!(@rust $ty),)+
        }
        impl $name {
            /// The declaration in WGSL.
            pub const WGSL: &'static str = concat!(
                "struct ", stringify!($name), " {\n",
                $("    ", stringify!($field), ": ", shared!(@wgsl $ty), ",\n",)+
                "}\n",
            );
            /// Names of the fields and their offsets, in bytes.
            pub const OFFSETS: &'static [(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($name, $field)),)+];
        }
    };
    (@rust f32) => { f32 };
    (@rust u32) => { u32 };
    (@rust vec2f) => { [f32; 2] };
    (@rust vec3f) => { [f32; 3] };
    (@rust vec4f) => { [f32; 4] };
    (@rust vec4u) => { [u32; 4] };
    (@rust HalfSpaces) => { HalfSpaces };
    (@wgsl HalfSpaces) => { "array<vec4f, 6>" };
    (@wgsl $ty:ident) => { stringify!($ty) };
}

/// Planes of half spaces: the normal, which points out of it, and the distance of the origin.
pub type HalfSpaces = [[f32; 4]; MAX_HALF_SPACES];
const _: () = assert!(MAX_HALF_SPACES == 6);

shared! {
    /// The numbers of a frame and of one dispatch: binding 0, a uniform.
    ///
    /// A pixel has coordinates (u, v) in [-1, 1]², from the lower left to the upper right. Its ray starts at
    /// `origin + origin_right · u + origin_up · v` and has the direction `forward + forward_right · u +
    /// forward_up · v`. One of the two pairs is zero, except for a camera outside of a finite scene.
    /// Its rays start on a plane near the scene, at the distance `approach`.
    FrameUniforms {
        /// Start of the middle rays.
        origin: vec3f,
        /// Maximum length of a ray.
        far: f32,
        /// Difference of the start at the right edge.
        origin_right: vec3f,
        /// 1 where raw fields occur, so that the gradient may have any length; else 0.
        is_raw: f32,
        /// Difference of the start at the upper edge.
        origin_up: vec3f,
        /// The part of the field's largest rounding error that is constant along a ray.
        rounding: f32,
        /// Direction of the middle ray.
        forward: vec3f,
        /// Half a pixel's height at the start of its ray; with several samples per pixel, half that
        /// of a sample's part.
        half_pixel_size: f32,
        /// Difference of the direction at the right edge.
        forward_right: vec3f,
        /// Growth of that half height per unit along the ray.
        half_pixel_growth: f32,
        /// Difference of the direction at the upper edge.
        forward_up: vec3f,
        /// Threshold of the march, as a fraction of half a pixel.
        threshold_fraction: f32,
        /// Lower corner of the box of the scene.
        bounds_min: vec3f,
        /// Maximum distance of occlusion.
        occlusion_reach: f32,
        /// Upper corner of that box.
        bounds_max: vec3f,
        /// Sum of the weights of all occlusion taps.
        occlusion_weight: f32,
        /// The sky's colour straight up.
        sky_top: vec3f,
        /// Factor on the light of the sky.
        ambient: f32,
        /// The sky's colour at the horizon.
        sky_horizon: vec3f,
        /// Density of fog: the attenuation per unit of distance.
        fog: f32,
        /// The sky's colour straight down.
        sky_ground: vec3f,
        /// Factor on all light.
        exposure: f32,
        /// The upward direction.
        sky_up: vec3f,
        /// Number of the only material.
        id: f32,
        /// Albedo of the only material.
        albedo: vec3f,
        /// Roughness of the only material.
        roughness: f32,
        /// Emission of the only material.
        emission: vec3f,
        /// Metalness of the only material.
        metallic: f32,
        /// A point of the plane of 2-D shapes and slices; its normal is `forward`.
        centre: vec3f,
        /// Distance between two lines of equal distance.
        spacing: f32,
        /// Width and height of the whole picture, in pixels.
        size: vec2f,
        /// Offset of the ray of this pass within its pixel, from (-½, -½) to (½, ½).
        offset: vec2f,
        /// The rendered part of the picture: left, upper, width, height.
        tile: vec4u,
        /// The distances that `depth` shows as white and black, from the plane at the distance `approach`
        /// from the camera.
        depth_range: vec2f,
        /// Index of the pass over subpixels.
        sample: u32,
        /// Number of these passes.
        samples: u32,
        /// Maximum number of steps of a ray.
        max_steps: u32,
        /// Maximum number of steps of a shadow ray.
        max_shadow_steps: u32,
        /// Number of entries in each half of the queue.
        queue_capacity: u32,
        /// Number of lights.
        light_count: u32,
        /// Distance from the camera to the start of the rays, along `forward`.
        approach: f32,
        /// Weight of the newest slope when steps are relaxed; 0 for plain sphere tracing.
        relaxation: f32,
        /// For generic kernels: number of occlusion taps; 0 for none.
        occlusion_taps: f32,
        /// For generic kernels: distance of the taps of normals, in halves of a pixel.
        normal_spread: f32,
        /// For generic kernels: index of the first of those taps in [`crate::normals::tap_table`].
        normal_taps: u32,
        /// For generic kernels: the flags for fog and for hemispherical occlusion.
        flags: u32,
        /// The part of the field's rounding error that does not vanish at the origin of the scene.
        least_rounding: f32,
        /// Number of half spaces which, together with a box, contain an endless solid; 0 if none are known.
        half_space_count: u32,
        /// Lower corner of that box.
        box_min: vec3f,
        /// Maximum length of rays that fall towards a half space.
        extended_far: f32,
        /// Upper corner of that box.
        box_max: vec3f,
        /// Depth from which on the first half spaces are solid.
        solid_depth: f32,
        /// Those half spaces.
        half_spaces: HalfSpaces,
        /// Number of the first half spaces that are solid from that depth on.
        solid_half_space_count: u32,
        /// Number of the first half spaces that are solid from their planes on.
        exact_half_space_count: u32,
        /// Maximum length of shadow rays.
        light_far: f32,
        /// Factor on a value for the radius of an empty sphere: 1, or less where a bound is only stated; 0 without a bound.
        step_factor: f32,
    }
}

/// Set in `FrameUniforms::flags` with fog.
pub const FOG_FLAG: u32 = 1;
/// Set in `FrameUniforms::flags` where occlusion samples the hemisphere.
pub const HEMISPHERE_FLAG: u32 = 2;
/// Set in `FrameUniforms::flags` where values of raw fields are no lower bounds of distances.
pub const ESTIMATE_FLAG: u32 = 4;

shared! {
    /// The grid of cells, and its first cells: see [`crate::interpreter::tape`].
    GridUniforms {
        /// Lower corner of the box of the cells.
        low: vec3f,
        /// Number of bits of a grid coordinate.
        coordinate_bits: u32,
        /// Factor from scene coordinates to grid coordinates.
        scale: vec3f,
        /// Number of bits per level, which select the child of a cell along an axis.
        digit_bits: u32,
        /// Word of the first cell of the distance.
        distance_root: u32,
        /// The full tape of the distance, for points outside the box.
        distance_full_tape: u32,
        /// Word of the first cell of surfaces.
        surface_root: u32,
        /// The full tape of surfaces.
        surface_full_tape: u32,
    }
}

shared! {
    /// Parameters of splitting cells on a device: see [`crate::interpreter::split_cells`].
    SplitParams {
        /// Lower corner of the box that is split.
        low: vec3f,
        /// Maximum number of levels of cells.
        max_levels: u32,
        /// Sides of that box.
        size: vec3f,
        /// Number of bits per level, which select the child of a cell along an axis.
        digit_bits: u32,
        /// Start of the rays.
        camera: vec3f,
        /// Full height of a pixel of the image at the start of its ray. It is twice
        /// [`FrameUniforms::half_pixel_size`], times the samples along a side.
        pixel_size: f32,
        /// Growth of that per unit along the ray.
        pixel_growth: f32,
        /// Side in pixels up to which a cell is a leaf.
        max_leaf_pixels: f32,
        /// Field value from which on only the sign of a cell is kept.
        band: f32,
        /// Slope bound of the whole program.
        slope: f32,
        /// Rounding error of a cell's position.
        rounding: f32,
        /// Distance by which a cell is enlarged before only its sign is kept.
        margin: f32,
        /// Number of clauses up to which a cell is not split further.
        max_leaf_clauses: u32,
        /// Number of clauses of the full tape.
        full_tape_length: u32,
        /// Word of a child outside of the band.
        empty_word: u32,
        /// Word of a child inside.
        full_word: u32,
        /// Capacity for nodes.
        node_capacity: u32,
        /// Capacity for clauses and lengths of tapes.
        tape_capacity: u32,
        /// Capacity for words of choices.
        choice_capacity: u32,
        /// Capacity for listed cells.
        queue_capacity: u32,
        /// Approximate number of clauses of the cells of one dispatch.
        clause_budget: u32,
        /// Maximum number of workgroups along an axis.
        max_groups_per_axis: u32,
    }
}

/// Placeholder for the entry before an edit of a cell that is split anew.
pub const NO_OLD_ENTRY: u32 = u32::MAX;

shared! {
    /// A cell to be split on a device.
    CellJob {
        /// Index of its entry among the nodes.
        node_entry: u32,
        /// Start of its tape.
        tape: u32,
        /// Number of clauses of the tape; 0 for a cell that an edit left unchanged, with all its descendants.
        length: u32,
        /// Number of levels below the root.
        level: u32,
        /// Its position among the cells of its level along x.
        x: u32,
        /// Position along y.
        y: u32,
        /// Position along z.
        z: u32,
        /// Number of successive levels that removed less than a tenth of their parents' clauses.
        stalled_levels: u32,
        /// Index of its entry before an edit; [`NO_OLD_ENTRY`] where all cells are split anew.
        old_entry: u32,
    }
}

shared! {
    /// A light: an element of binding 1, an array.
    LightRecord {
        /// The direction of length one towards a directional light; the position of a positional one.
        position: vec3f,
        /// 1 for a positional light, 0 for a directional one.
        is_positional: f32,
        /// Its colour times its intensity.
        color: vec3f,
        /// Tangent of its angular radius, for soft shadows.
        size: f32,
        /// Form of its shadow: [`crate::features::ShadowForm`] as a number.
        shadow_form: u32,
        /// Number of lights, the same in each of them.
        light_count: u32,
        /// Samples of shadow rays that are occluder candidates: [`crate::shadow::Checks`] as a number.
        checks: f32,
        /// Unused.
        reserved0: u32,
    }
}

shared! {
    /// The common advance of the rays of a block of pixels: see [`crate::beam`].
    Beam {
        /// Distance that all of them advance.
        t: f32,
        /// Number of evaluations of the field.
        steps: u32,
    }
}

shared! {
    /// An active ray, or its end.
    RayState {
        /// Distance along the ray.
        t: f32,
        /// Field value there, positive on the side on which the ray started.
        field: f32,
        /// Next step to try.
        step: f32,
        /// Running mean of the field's slope along the ray; below −1 it counts probes since the last step.
        trend: f32,
        /// Distance of the last sample above zero: one step before, or earlier.
        t_before: f32,
        /// Field value there.
        field_before: f32,
        /// Status word: see [`crate::marching::Status`].
        status: u32,
        /// Number of evaluations of the field.
        steps: u32,
    }
}

shared! {
    /// An active shadow ray, or its result.
    ShadowRayState {
        /// The gradient as far as it is found while a candidate is probed; see [`crate::candidate`].
        gradient: vec3f,
        /// Phase of the probe.
        phase: f32,
        /// Offset from the candidate to the round's point.
        offset: vec3f,
        /// Number of earlier rounds.
        round: f32,
        /// Gradient at the face that the rounds before have reached, zero before the first.
        face: vec3f,
        /// Field value at the round's point.
        value: f32,
        /// Distance along the ray.
        t: f32,
        /// The visibility so far: 0 to 1, for a sized light −1 to 1.
        visibility: f32,
        /// The visibility at the previous sample alone, its field taken for a distance.
        last_visibility: f32,
        /// Distance of the candidate along the ray, or a placeholder.
        candidate_t: f32,
        /// Number of moves of the candidate.
        moves: f32,
        /// Distance along the ray before which no sample is a candidate, or a placeholder where the ray ends after the
        /// probe of the candidate.
        next_check_t: f32,
        /// Number of evaluations; with a flag once it has ended.
        steps: u32,
        /// Field value at the previous sample.
        field_before: f32,
        /// Step from there.
        step: f32,
        /// Number of the ray towards a light with a size; see [`crate::shadow`].
        ray_number: f32,
        /// The greatest visibility of the finished rays to its rim.
        best_visibility: f32,
        /// Distance at which rays to its rim start, negative once it is final.
        clear_t: f32,
        /// Number of evaluations before the present ray.
        steps_before: f32,
        /// The light's size for the ray to the rim; 0 while the light's room is measured.
        size: f32,
        /// Slope of the field at the previous sample.
        slope_before: f32,
        /// Fills the record to a multiple of 16 bytes.
        filler: f32,
    }
}

shared! {
    /// The state of occlusion sampling from a surface, or its result.
    OcclusionState {
        /// The gradient as far as it is found while a candidate is probed; see [`crate::candidate`].
        gradient: vec3f,
        /// Phase of the probe.
        phase: f32,
        /// Offset from the tap to the round's point.
        offset: vec3f,
        /// Number of earlier rounds.
        round: f32,
        /// Gradient at the face that the rounds before have reached, zero before the first.
        face: vec3f,
        /// Field value at the round's point.
        value: f32,
        /// The hidden weight so far.
        hidden: f32,
        /// Index of the current tap.
        tap_index: f32,
        /// Number of evaluations so far.
        steps: f32,
        /// Fills the record to a multiple of 16 bytes.
        filler: f32,
    }
}

shared! {
    /// The material of a surface at a point.
    Surface {
        /// Fraction of light that it reflects.
        albedo: vec3f,
        /// From 0, a mirror, to 1, chalk.
        roughness: f32,
        /// The light that it emits.
        emission: vec3f,
        /// From 0, a dielectric, to 1, a metal.
        metallic: f32,
        /// Gradient of the height of its bump map.
        bump: vec3f,
        /// Number of the material.
        id: f32,
    }
}
