//! Flags that change a scene's camera.

use super::named_values::one_of;
use sdfc_runtime::render::ResolvedLens;
use sdfc_runtime::settings::{CameraChanges, ViewSide};

/// Flags that change the camera of any scene.
#[derive(Clone, Debug, Default, clap::Args)]
#[group(skip)]
pub(crate) struct CameraArgs {
    /// Side from which the scene is seen, framed.
    #[arg(long, value_name = "SIDE", value_parser = one_of(SIDES), conflicts_with_all = ["from", "look", "up"])]
    view: Option<ViewSide>,
    /// Position of the camera, in the scene's units: 3,2,4. Without --look it looks at the middle of the scene, or
    /// where the scene's camera looks.
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    from: Option<[f64; 3]>,
    /// Point at the centre of the picture. If the scene's camera has no position, --from is required, except for 2-D
    /// shapes.
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    look: Option<[f64; 3]>,
    /// Upward direction of the camera.
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    up: Option<[f64; 3]>,
    /// Vertical field of view: 35deg, 0.6rad or 0.1turn.
    #[arg(long, value_name = "ANGLE", value_parser = angle, conflicts_with = "ortho", allow_hyphen_values = true)]
    fov: Option<f64>,
    /// Parallel rays, with this visible height in the scene's units. With --fit, the height follows from the scene.
    #[arg(long, value_name = "HEIGHT", value_parser = height, allow_hyphen_values = true)]
    ortho: Option<f64>,
    /// Move the camera along and across its direction, so that the scene fills the picture. --from and --look give
    /// the direction.
    #[arg(long)]
    fit: bool,
}

const SIDES: &[(&str, ViewSide)] = &[
    ("front", ViewSide::Front),
    ("back", ViewSide::Back),
    ("left", ViewSide::Left),
    ("right", ViewSide::Right),
    ("top", ViewSide::Top),
    ("bottom", ViewSide::Bottom),
    ("corner", ViewSide::Corner),
];

impl CameraArgs {
    /// Returns the changes.
    pub(crate) fn changes(&self) -> CameraChanges {
        let perspective = self.fov.map(ResolvedLens::Perspective);
        let orthographic = self.ortho.map(ResolvedLens::Orthographic);
        CameraChanges {
            side: self.view,
            from: self.from,
            look: self.look,
            up: self.up,
            lens: perspective.or(orthographic),
            is_fitted: self.fit,
        }
    }
}

/// Parses three numbers with commas between them.
fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text
        .trim_matches(['[', ']'])
        .split(',')
        .map(|word| word.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "write three numbers with commas between them, such as 3,2,4".to_owned())
}

/// Parses a height, which is finite and more than zero.
fn height(text: &str) -> Result<f64, String> {
    let height = text.trim().parse().ok();
    height
        .filter(|height: &f64| height.is_finite() && *height > 0.0)
        .ok_or_else(|| "write a finite number above 0, such as 2.5".to_owned())
}

/// Parses an angle with its unit, and returns it in radians.
fn angle(text: &str) -> Result<f64, String> {
    let units = [
        ("deg", 1.0_f64.to_radians()),
        ("rad", 1.0),
        ("turn", std::f64::consts::TAU),
    ];
    let value = units.iter().find_map(|(unit, radians)| {
        let number = text.strip_suffix(unit)?.trim();
        Some(number.parse::<f64>().ok()? * radians)
    });
    let angle = value.ok_or_else(|| "write an angle with its unit, such as 35deg".to_owned())?;
    match angle > 0.0 && angle < std::f64::consts::PI {
        true => Ok(angle),
        false => Err("a field of view is between 0deg and 180deg".to_owned()),
    }
}
