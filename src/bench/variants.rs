//! Variants of the settings of a picture that trade speed for error.

use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::{CellMode, Normals, RenderSettings};
use sdfc_shaders::marching;
use serde::{Serialize, Serializer};

/// A variant of the settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct RenderSettingsVariant {
    /// Threshold of the march, as a fraction of half a pixel.
    pub(crate) threshold: f64,
    /// Relaxation of steps; 0 is plain sphere tracing.
    pub(crate) relaxation: f64,
    /// Method for normals.
    #[serde(serialize_with = "as_name")]
    pub(crate) normals: Normals,
    /// Tolerance of simplified shapes, in pixels; `None` where all detail is kept.
    pub(crate) lod: Option<f64>,
    /// True if space is never split into cells.
    pub(crate) whole: bool,
}

fn as_name<S: Serializer>(normals: &Normals, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name(*normals))
}

/// Returns the name of a method for normals, as on the command line.
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

impl RenderSettingsVariant {
    /// Returns the variant of a scene's own settings.
    pub(crate) fn from_settings(settings: &RenderSettings) -> Self {
        Self {
            threshold: settings.threshold_fraction,
            relaxation: settings.relaxation,
            normals: settings.normals,
            lod: None,
            whole: settings.cells == CellMode::Never,
        }
    }

    /// Returns the finest variant, with which other pictures are compared.
    pub(crate) fn finest() -> Self {
        Self {
            threshold: THRESHOLDS[0],
            relaxation: 0.0,
            normals: Normals::Exact,
            lod: None,
            whole: true,
        }
    }

    /// Returns the settings of the same picture with this variant. Detail belongs to the compiler, and not to
    /// them.
    pub(crate) fn applied(&self, settings: &RenderSettings) -> RenderSettings {
        RenderSettings {
            threshold_fraction: self.threshold,
            relaxation: self.relaxation,
            normals: self.normals,
            cells: if self.whole {
                CellMode::Never
            } else {
                settings.cells
            },
            ..settings.clone()
        }
    }

    /// Returns a bound in pixels of the displacement of silhouettes. It is the distance from a surface within
    /// which a ray estimates its root and passes surfaces beside it, plus the tolerance of simplified shapes.
    pub(crate) fn silhouette_pixels_bound(&self) -> f64 {
        let half_pixels: f64 = marching::secant_start(self.threshold, 1.0);
        half_pixels / 2.0 + self.lod.unwrap_or(0.0)
    }

    /// Returns the differences from `default`, for people.
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

/// The tried thresholds; [`RenderSettings::DEFAULT_THRESHOLD_FRACTION`] is one of them.
const THRESHOLDS: [f64; 7] = [0.002, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0];
/// The tried tolerances of simplified shapes, in pixels.
const LOD_PIXELS: [f64; 3] = [0.5, 1.0, 2.0];
/// The tried methods for normals.
const NORMALS: [Normals; 4] = [
    Normals::Exact,
    Normals::Tetrahedron,
    Normals::Central,
    Normals::Forward,
];

/// Returns the variants that are measured on an engine, the default first and none of them twice. Those with
/// less detail are omitted where the compiler cannot reduce it.
pub(crate) fn sweep(
    default: RenderSettingsVariant,
    engine: EngineKind,
    has_detail: bool,
) -> Vec<RenderSettingsVariant> {
    let mut variants = vec![default];
    let mut add = |variant: RenderSettingsVariant| {
        if !variants.contains(&variant) && (has_detail || variant.lod.is_none()) {
            variants.push(variant);
        }
    };
    let plain = RenderSettingsVariant {
        relaxation: 0.0,
        ..default
    };
    for threshold in THRESHOLDS {
        add(RenderSettingsVariant {
            threshold,
            ..default
        });
    }
    add(plain);
    for normals in NORMALS {
        add(RenderSettingsVariant { normals, ..default });
    }
    for pixels in LOD_PIXELS {
        add(RenderSettingsVariant {
            lod: Some(pixels),
            ..default
        });
    }
    // Generated code never has cells.
    if engine != EngineKind::Wgsl {
        add(RenderSettingsVariant {
            whole: true,
            ..default
        });
        add(RenderSettingsVariant {
            whole: true,
            ..plain
        });
    }
    for (threshold, relaxation, normals, lod) in COMBINATIONS {
        add(RenderSettingsVariant {
            threshold,
            relaxation,
            normals: normals.unwrap_or(default.normals),
            lod,
            whole: default.whole,
        });
    }
    variants
}

/// Combinations, from fine to coarse: threshold, relaxation, normals, detail.
const COMBINATIONS: [(f64, f64, Option<Normals>, Option<f64>); 7] = [
    (0.01, 0.0, None, None),
    (0.25, 0.0, None, None),
    (0.1, RenderSettings::DEFAULT_RELAXATION, None, Some(0.5)),
    (0.5, RenderSettings::DEFAULT_RELAXATION, None, Some(0.5)),
    (
        0.5,
        RenderSettings::DEFAULT_RELAXATION,
        Some(Normals::Forward),
        None,
    ),
    (
        1.0,
        RenderSettings::DEFAULT_RELAXATION,
        Some(Normals::Tetrahedron),
        Some(1.0),
    ),
    (
        1.0,
        RenderSettings::DEFAULT_RELAXATION,
        Some(Normals::Forward),
        Some(2.0),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn default() -> RenderSettingsVariant {
        RenderSettingsVariant {
            threshold: RenderSettings::DEFAULT_THRESHOLD_FRACTION,
            relaxation: RenderSettings::DEFAULT_RELAXATION,
            normals: Normals::Exact,
            lod: None,
            whole: false,
        }
    }

    #[test]
    fn every_value_of_every_setting_is_tried_alone() {
        let variants = sweep(default(), EngineKind::Cpu, true);
        let labels: Vec<String> = variants
            .iter()
            .map(|variant| variant.label(&default()))
            .collect();
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
    fn unsupported_settings_are_left_out() {
        let variants = sweep(default(), EngineKind::Wgsl, true);
        assert!(variants.iter().all(|variant| !variant.whole));
        let variants = sweep(default(), EngineKind::Cpu, false);
        assert!(variants.iter().all(|variant| variant.lod.is_none()));
    }

    #[test]
    fn promises_are_in_pixels() {
        assert_eq!(default().silhouette_pixels_bound(), 0.5);
        let fine = RenderSettingsVariant {
            threshold: 0.01,
            ..default()
        };
        assert!((fine.silhouette_pixels_bound() - 0.1).abs() < 1e-12);
        let coarse = RenderSettingsVariant {
            threshold: 1.0,
            lod: Some(2.0),
            ..default()
        };
        assert_eq!(coarse.silhouette_pixels_bound(), 2.5);
    }
}
