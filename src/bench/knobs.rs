//! What is turned: the settings of a picture that trade speed for error.

use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::{CellUse, Normals, RenderSettings};
use sdfc_shaders::marching;
use serde::{Serialize, Serializer};

/// A position of all knobs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Knobs {
    /// How near a march comes before it looks for the root, as a share of half a pixel.
    pub(crate) threshold: f64,
    /// How far steps are relaxed; 0 is plain sphere tracing.
    pub(crate) relaxation: f64,
    /// How normals are found.
    #[serde(serialize_with = "as_name")]
    pub(crate) normals: Normals,
    /// How many pixels simpler shapes may be off; `None` where all detail is kept.
    pub(crate) lod: Option<f64>,
    /// Whether space is never cut into cells.
    pub(crate) whole: bool,
}

fn as_name<S: Serializer>(normals: &Normals, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name(*normals))
}

/// The name of a way to find normals, as the command line has it.
fn name(normals: Normals) -> &'static str {
    match normals {
        Normals::Exact => "exact",
        Normals::Forward => "forward",
        Normals::Central => "central",
        Normals::Reverse => "reverse",
        Normals::Tetrahedron => "tetrahedron",
        Normals::Wide => "wide",
    }
}

impl Knobs {
    /// As a scene's own settings have them.
    pub(crate) fn of(settings: &RenderSettings) -> Self {
        Self {
            threshold: settings.cone,
            relaxation: settings.relaxation,
            normals: settings.normals,
            lod: None,
            whole: settings.cells == CellUse::Never,
        }
    }

    /// The finest of all: what other pictures are compared with.
    pub(crate) fn finest() -> Self {
        Self {
            threshold: THRESHOLDS[0],
            relaxation: 0.0,
            normals: Normals::Exact,
            lod: None,
            whole: true,
        }
    }

    /// The settings of the same picture with the knobs like this; detail is the compiler's, and not
    /// among them.
    pub(crate) fn applied(&self, settings: &RenderSettings) -> RenderSettings {
        RenderSettings {
            cone: self.threshold,
            relaxation: self.relaxation,
            normals: self.normals,
            cells: if self.whole {
                CellUse::Never
            } else {
                settings.cells
            },
            ..settings.clone()
        }
    }

    /// By how many pixels silhouettes may move, by construction: by as much as a ray may be away from the
    /// surface whose root it guesses, since it passes what is beside it there; and by what simpler shapes
    /// may be off.
    pub(crate) fn promised_pixels(&self) -> f64 {
        let half_pixels: f64 = marching::near(self.threshold, 1.0);
        half_pixels / 2.0 + self.lod.unwrap_or(0.0)
    }

    /// What of them is not as in `default`, for people.
    pub(crate) fn label(&self, default: &Self) -> String {
        let mut parts = Vec::new();
        if self.threshold != default.threshold {
            parts.push(format!("threshold {}", self.threshold));
        }
        if self.relaxation != default.relaxation {
            parts.push(match self.relaxation {
                0.0 => "plain steps".to_owned(),
                weight => format!("relaxation {weight}"),
            });
        }
        if self.normals != default.normals {
            parts.push(format!("normals {}", name(self.normals)));
        }
        if let Some(pixels) = self.lod {
            parts.push(format!("lod {pixels} px"));
        }
        if self.whole != default.whole {
            parts.push("no cells".to_owned());
        }
        if parts.is_empty() {
            parts.push("default".to_owned());
        }
        parts.join(", ")
    }
}

/// The thresholds that are tried; [`RenderSettings::CONE`] is one of them.
const THRESHOLDS: [f64; 7] = [0.002, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0];
/// How many pixels simpler shapes may be off.
const DETAILS: [f64; 3] = [0.5, 1.0, 2.0];
/// The ways to find normals that are tried.
const NORMALS: [Normals; 4] = [
    Normals::Exact,
    Normals::Tetrahedron,
    Normals::Central,
    Normals::Forward,
];

/// The positions that are measured on an engine, the default first and none of them twice. Those
/// with less detail are left out where the compiler cannot leave any out.
pub(crate) fn sweep(default: Knobs, engine: EngineKind, has_detail: bool) -> Vec<Knobs> {
    let mut all = vec![default];
    let mut add = |knobs: Knobs| {
        if !all.contains(&knobs) && (has_detail || knobs.lod.is_none()) {
            all.push(knobs);
        }
    };
    let plain = Knobs {
        relaxation: 0.0,
        ..default
    };
    for threshold in THRESHOLDS {
        add(Knobs {
            threshold,
            ..default
        });
    }
    add(plain);
    for normals in NORMALS {
        add(Knobs { normals, ..default });
    }
    for pixels in DETAILS {
        add(Knobs {
            lod: Some(pixels),
            ..default
        });
    }
    // Generated code has no cells to begin with.
    if engine != EngineKind::Wgsl {
        add(Knobs {
            whole: true,
            ..default
        });
        add(Knobs {
            whole: true,
            ..plain
        });
    }
    for (threshold, relaxation, normals, lod) in COMBINATIONS {
        add(Knobs {
            threshold,
            relaxation,
            normals: normals.unwrap_or(default.normals),
            lod,
            whole: default.whole,
        });
    }
    all
}

/// Several knobs at once, from fine to coarse: threshold, relaxation, normals, detail.
const COMBINATIONS: [(f64, f64, Option<Normals>, Option<f64>); 7] = [
    (0.01, 0.0, None, None),
    (0.25, 0.0, None, None),
    (0.1, RenderSettings::RELAXATION, None, Some(0.5)),
    (0.5, RenderSettings::RELAXATION, None, Some(0.5)),
    (
        0.5,
        RenderSettings::RELAXATION,
        Some(Normals::Forward),
        None,
    ),
    (
        1.0,
        RenderSettings::RELAXATION,
        Some(Normals::Tetrahedron),
        Some(1.0),
    ),
    (
        1.0,
        RenderSettings::RELAXATION,
        Some(Normals::Forward),
        Some(2.0),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn default() -> Knobs {
        Knobs {
            threshold: RenderSettings::CONE,
            relaxation: RenderSettings::RELAXATION,
            normals: Normals::Exact,
            lod: None,
            whole: false,
        }
    }

    #[test]
    fn every_value_of_every_knob_is_tried_alone() {
        let all = sweep(default(), EngineKind::Cpu, true);
        let labels: Vec<String> = all.iter().map(|knobs| knobs.label(&default())).collect();
        let alone = [
            "default",
            "threshold 0.002",
            "threshold 0.01",
            "threshold 0.1",
            "threshold 0.25",
            "threshold 0.5",
            "threshold 1",
            "plain steps",
            "normals tetrahedron",
            "normals central",
            "normals forward",
            "lod 0.5 px",
            "lod 1 px",
            "lod 2 px",
            "no cells",
            "plain steps, no cells",
        ];
        assert_eq!(labels[..alone.len()], alone);
        assert_eq!(labels.len(), alone.len() + COMBINATIONS.len());
        let mut once = labels.clone();
        once.sort();
        once.dedup();
        assert_eq!(once.len(), labels.len(), "{labels:?}");
    }

    #[test]
    fn what_an_engine_or_the_compiler_has_not_is_left_out() {
        let whole = sweep(default(), EngineKind::Wgsl, true);
        assert!(whole.iter().all(|knobs| !knobs.whole));
        let kept = sweep(default(), EngineKind::Cpu, false);
        assert!(kept.iter().all(|knobs| knobs.lod.is_none()));
    }

    #[test]
    fn promises_are_in_pixels() {
        assert_eq!(default().promised_pixels(), 0.5);
        let fine = Knobs {
            threshold: 0.01,
            ..default()
        };
        assert!((fine.promised_pixels() - 0.1).abs() < 1e-12);
        let coarse = Knobs {
            threshold: 1.0,
            lod: Some(2.0),
            ..default()
        };
        assert_eq!(coarse.promised_pixels(), 2.5);
    }
}
