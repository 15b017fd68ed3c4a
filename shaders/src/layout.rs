//! What host and kernels share: the uniform data of a frame and the records of the storage
//! buffers, each declared once for Rust and WGSL.
//!
//! `shared!` writes both declarations from one list of fields. In WGSL a `vec3f` begins at a
//! multiple of 16 bytes and takes 12, so each stands before a number of its own; a test compares
//! every offset with the one that naga computes.

use bytemuck::{Pod, Zeroable};

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
                $("    ", stringify!($field), ": ", stringify!($ty), ",\n",)+
                "}\n",
            );
            /// The names of the fields and where they begin, in bytes.
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
}

shared! {
    /// The numbers of a frame and of one dispatch: binding 0, a uniform.
    ///
    /// The ray through a pixel, with (u, v) in [-1, 1]² from the lower left to the upper right,
    /// starts at `origin + origin_right · u + origin_up · v` and goes along
    /// `forward + forward_right · u + forward_up · v`. Of the two pairs one is zero, but for an eye
    /// so far away that its rays start on a plane near the scene, `approach` ahead of it.
    Frame {
        /// Where the rays of the middle start.
        origin: vec3f,
        /// How far a ray goes.
        far: f32,
        /// How the start moves to the right edge.
        origin_right: vec3f,
        /// 1 where the length of the field's gradient is not known to be about one, else 0.
        raw: f32,
        /// How the start moves to the upper edge.
        origin_up: vec3f,
        /// The part of the field's largest rounding error that does not grow with the way.
        rounding: f32,
        /// The direction of the middle.
        forward: vec3f,
        /// Half a pixel's height at the start of its ray.
        footprint: f32,
        /// How the direction moves to the right edge.
        forward_right: vec3f,
        /// How much half a pixel's height grows per unit of the way.
        footprint_growth: f32,
        /// How the direction moves to the upper edge.
        forward_up: vec3f,
        /// The threshold of the march, as a share of half a pixel.
        cone: f32,
        /// The lower corner of the box outside which there is nothing.
        bounds_min: vec3f,
        /// How far occlusion reaches.
        occlusion_reach: f32,
        /// The upper corner of that box.
        bounds_max: vec3f,
        /// What the weights of all occlusion taps sum to.
        occlusion_weight: f32,
        /// The sky's colour straight up.
        sky_top: vec3f,
        /// A factor on the light that comes from the sky.
        ambient: f32,
        /// The sky's colour at the horizon.
        sky_horizon: vec3f,
        /// How much of a surface the air hides per unit of distance.
        fog: f32,
        /// The sky's colour straight down.
        sky_ground: vec3f,
        /// A factor on all light.
        exposure: f32,
        /// The direction that is up.
        sky_up: vec3f,
        /// The identity of the only material.
        id: f32,
        /// The albedo of the only material.
        albedo: vec3f,
        /// The roughness of the only material.
        roughness: f32,
        /// The emission of the only material.
        emission: vec3f,
        /// The metalness of the only material.
        metallic: f32,
        /// A point of the plane that plane figures and slices lie in; it faces along `forward`.
        centre: vec3f,
        /// The distance between two lines of equal distance.
        spacing: f32,
        /// Width and height of the whole picture, in pixels.
        size: vec2f,
        /// Where in its pixel the ray of this pass goes, from (-½, -½) to (½, ½).
        offset: vec2f,
        /// The part of the picture that is computed: left, upper, width, height.
        tile: vec4u,
        /// The distances that `depth` shows as white and black, from the plane `approach` ahead of the
        /// eye.
        depth_range: vec2f,
        /// Which of the passes over subpixels this is.
        sample: u32,
        /// How many passes there are.
        samples: u32,
        /// The most steps of a ray.
        steps: u32,
        /// The most steps of a shadow ray.
        shadow_steps: u32,
        /// How many items a half of the queue has room for.
        capacity: u32,
        /// How many lights there are.
        lights: u32,
        /// How far along `forward` the rays start from the eye.
        approach: f32,
        /// The weight of the newest slope when steps are relaxed; 0 for plain sphere tracing.
        relaxation: f32,
        /// For general kernels: how many taps of occlusion there are; 0 for none.
        occlusion_taps: f32,
        /// For general kernels: how far apart the taps of normals are, in halves of a pixel.
        normal_spread: f32,
        /// For general kernels: the first of those taps in [`crate::normals::table`].
        normal_taps: u32,
        /// For general kernels: [`FOG`] and [`HEMISPHERE`].
        choices: u32,
        /// Fills the last 16 bytes.
        reserved0: u32,
        /// Likewise.
        reserved1: u32,
    }
}

/// Set in [`Frame::choices`] where the air hides what is far.
pub const FOG: u32 = 1;
/// Set in [`Frame::choices`] where occlusion looks all over the hemisphere.
pub const HEMISPHERE: u32 = 2;

shared! {
    /// Where cells are, and which are the first: see [`crate::interpreter::tape`].
    Grid {
        /// The lower corner of their box.
        low: vec3f,
        /// How many bits the numbers of a place have.
        bits: u32,
        /// From coordinates to those numbers.
        scale: vec3f,
        /// How many of the bits say which child of a cell it is.
        digit: u32,
        /// The first cell of the distance.
        distance: u32,
        /// The whole tape of the distance, for points outside the box.
        distance_whole: u32,
        /// The first cell of surfaces.
        surface: u32,
        /// The whole tape of surfaces.
        surface_whole: u32,
    }
}

shared! {
    /// How cells are cut on a device: see [`crate::interpreter::cut`].
    Cut {
        /// The lower corner of the box that is cut.
        low: vec3f,
        /// How many levels of cells there are at most.
        levels: u32,
        /// The sides of that box.
        size: vec3f,
        /// How many bits of a place say which child of a cell it is, along each axis.
        digit: u32,
        /// Where rays start.
        eye: vec3f,
        /// A pixel's height at the start of its ray.
        footprint: f32,
        /// How much that grows per unit of the way.
        growth: f32,
        /// A cell's side in pixels, at most.
        leaf: f32,
        /// Where the field is this far from zero or farther, nothing but its sign is kept.
        band: f32,
        /// The slope of the whole program.
        slope: f32,
        /// What rounding puts into the place of a cell.
        rounding: f32,
        /// Tapes of so many clauses or fewer are not cut further.
        few: u32,
        /// How many clauses the whole tape has.
        whole: u32,
        /// The word of a child outside of the band.
        empty: u32,
        /// The word of one inside.
        full: u32,
        /// For how many nodes there is room.
        nodes: u32,
        /// For how many clauses and lengths of tapes there is.
        tapes: u32,
        /// For how many words of choices there is.
        choices: u32,
        /// For how many cells to be cut there is.
        queue: u32,
        /// How many clauses the cells of a dispatch have together, more or less.
        budget: u32,
        /// The most workgroups along an axis.
        per_axis: u32,
        /// Nothing: it fills the last 16 bytes.
        filler: u32,
    }
}

/// The [`Job::before`] of a cell that nothing is known of.
pub const NONE_BEFORE: u32 = u32::MAX;

shared! {
    /// A cell that is to be cut on a device.
    Job {
        /// Which entry of the nodes is its.
        entry: u32,
        /// Where its tape begins.
        tape: u32,
        /// How many clauses that has; 0 for a cell that an edit left as it was, with all that it was cut
        /// into.
        length: u32,
        /// How often space was cut for it.
        level: u32,
        /// Its place among the cells of its level along x.
        x: u32,
        /// Along y.
        y: u32,
        /// Along z.
        z: u32,
        /// How many levels in a row left next to nothing of their parents' tapes out.
        stale: u32,
        /// Which entry was its before an edit; [`NONE_BEFORE`] where all cells are cut anew.
        before: u32,
    }
}

shared! {
    /// A light: an element of binding 1, an array.
    Light {
        /// The direction towards a light far away, of length one; the place of a near one.
        place: vec3f,
        /// 0 for a light far away, 1 for one at a place.
        near: f32,
        /// Its colour times its intensity.
        color: vec3f,
        /// The tangent of the angle under which half of it is seen, for soft shadows.
        size: f32,
        /// The form of its shadow: [`crate::features::Shadow`] as a number.
        shadow: u32,
        /// How many lights there are; each says so.
        count: u32,
        /// Unused.
        reserved0: u32,
        /// Unused.
        reserved1: u32,
    }
}

shared! {
    /// What the rays of a block of pixels have in common: see [`crate::beam`].
    Beam {
        /// How far all of them can go.
        t: f32,
        /// How many times the field was evaluated for that.
        steps: u32,
    }
}

shared! {
    /// A ray under way, or where it ended.
    Ray {
        /// How far it came.
        t: f32,
        /// The field there, positive on the side the ray started on.
        radius: f32,
        /// The step that is tried next.
        step: f32,
        /// How the field changes along the ray, as a running mean.
        trend: f32,
        /// How far it was one step before.
        t_before: f32,
        /// The field there.
        radius_before: f32,
        /// How it ended: see [`crate::marching::Status::of`].
        status: u32,
        /// How many times the field was evaluated on the way.
        steps: u32,
    }
}

shared! {
    /// A shadow ray under way, or its result.
    ShadowRay {
        /// What is known of the gradient while a claim is checked; see [`crate::claim`].
        gradient: vec3f,
        /// The phase of that check.
        phase: f32,
        /// The way from the claim to the place of the present round.
        offset: vec3f,
        /// The number of rounds before it.
        round: f32,
        /// How far it came.
        t: f32,
        /// What arrives of the light so far: 0 to 1, for a sized light -1 to 1.
        visibility: f32,
        /// What would arrive by the point before alone, its field taken for a distance.
        last: f32,
        /// The place of the claim on the ray; [`crate::shadow::NO_CLAIM`] without one.
        claim_t: f32,
        /// The field at the place of the present round.
        value: f32,
        /// 1 where the ray ends after the check of the claim.
        ends: f32,
        /// The number of times that the claim was moved, to be checked once more.
        moves: f32,
        /// How many evaluations it took; [`crate::shadow::DONE`] is set when it has ended.
        steps: u32,
        /// The field at the point before.
        before: f32,
        /// The way from there.
        step: f32,
        /// The number of the ray towards a light with a size; see [`crate::shadow::rim`].
        number: f32,
        /// The greatest visibility of the rays to its rim that have ended.
        best: f32,
        /// The place where rays to its rim begin; see [`crate::shadow::cleared`].
        cleared: f32,
        /// The number of evaluations before the present ray.
        begun: f32,
        /// The size by which the ray to the rim is measured; 0 while the light's room is.
        size: f32,
        /// The slope of the field at the point before.
        fall: f32,
    }
}

shared! {
    /// A look around from a surface under way, or its result.
    OcclusionRay {
        /// The part of the gradient that is found while a claim is checked; see [`crate::claim`].
        gradient: vec3f,
        /// The phase of that check.
        phase: f32,
        /// The way from the tap to the place of the present round.
        offset: vec3f,
        /// The number of rounds before it.
        round: f32,
        /// What is hidden so far.
        hidden: f32,
        /// The tap that is looked at.
        tap: f32,
        /// The field at the place of the present round.
        value: f32,
        /// The number of evaluations so far.
        steps: f32,
    }
}

shared! {
    /// What a surface is made of at a point.
    Surface {
        /// The share of light it reflects.
        albedo: vec3f,
        /// From 0, a mirror, to 1, chalk.
        roughness: f32,
        /// The light it gives off.
        emission: vec3f,
        /// From 0, a dielectric, to 1, a metal.
        metallic: f32,
        /// The gradient of the height by which it seems displaced.
        bump: vec3f,
        /// Which material it is.
        id: f32,
    }
}
