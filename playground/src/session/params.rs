//! Params of a scene and their current values.

use crate::build::BuiltScene;
use crate::param_input;
use crate::param_source::{self, ParamSource};
use sdfc_vm::settings::{Param, ParamKind};
use std::sync::Arc;

/// A param with its current value and its notation in the source text.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamState {
    /// Declaration of the param; `spec.default` is the value in the text.
    pub spec: Param,
    /// Current value: one number, three for a colour (linear), or as many as a vector has.
    pub value: Vec<f64>,
    /// Notation of the value in the source text, if found.
    pub source: Option<ParamSource>,
}

impl ParamState {
    /// Reports whether the value differs from the text.
    pub fn is_changed(&self) -> bool {
        self.value != self.spec.default
    }

    /// Returns the unit suffix and the size of the unit in scene units.
    pub fn unit(&self) -> (&'static str, f64) {
        match (&self.source, self.spec.kind) {
            (Some(source), _) if !source.unit.unit.suffix().is_empty() => {
                (source.unit.unit.suffix(), source.unit.factor)
            }
            (_, ParamKind::Angle) => ("deg", 1_f64.to_radians()),
            (_, ParamKind::Time) => ("s", 1.0),
            _ => ("", 1.0),
        }
    }

    /// Returns the value in the notation of the language.
    pub fn text(&self) -> String {
        param_source::text(self.spec.kind, &self.value, self.source.as_ref())
    }

    /// Evaluates a typed number with an optional unit, such as `9cm`.
    ///
    /// # Errors
    ///
    /// A message if the text is not a number of the param's quantity.
    pub fn evaluate(&self, text: &str) -> Result<f64, String> {
        let (_, factor) = self.unit();
        param_input::evaluate(text, self.spec.kind, factor, self.source.as_ref())
    }

    /// Replaces a value by that of the text if both are written the same way. A colour picker computes in
    /// `f32`, and texts hold eight bits of each channel.
    fn snapped_to_text(&self, value: Vec<f64>) -> Vec<f64> {
        let written =
            |value: &[f64]| param_source::text(self.spec.kind, value, self.source.as_ref());
        if written(&value) == written(&self.spec.default) {
            self.spec.default.clone()
        } else {
            value
        }
    }

    /// Returns the nearest value that the declaration allows; `None` for a value of the wrong length or
    /// with non-finite numbers.
    fn clamped(&self, mut value: Vec<f64>) -> Option<Vec<f64>> {
        if value.len() != self.spec.value.len() || value.iter().any(|v| !v.is_finite()) {
            return None;
        }
        for v in &mut value {
            match self.spec.kind {
                ParamKind::Bool => *v = f64::from(*v != 0.0),
                ParamKind::Int => *v = v.round(),
                ParamKind::Color => *v = v.max(0.0),
                _ => {}
            }
            if let Some((min, max)) = self.spec.range {
                *v = v.clamp(min, max);
                if !self.spec.inclusive && *v >= max {
                    *v = match self.spec.kind {
                        ParamKind::Int => max - 1.0,
                        // The largest `f32` below the exclusive end.
                        _ => f64::from((max as f32).next_down()),
                    };
                }
            }
        }
        Some(value)
    }
}

/// Effect of a changed param.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ParamChange {
    /// Nothing changed.
    None,
    /// Only numbers changed: the current programs can be drawn with them.
    Live,
    /// The program changes: a rebuild is required.
    Structural,
}

/// All params of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct ParamStates {
    all: Vec<ParamState>,
}

impl ParamStates {
    pub(crate) fn all(&self) -> &[ParamState] {
        &self.all
    }

    /// Replaces the params by those of a new scene. Values set by hand are kept where they still fit.
    pub(crate) fn take(&mut self, scene: &BuiltScene) {
        let previous = std::mem::take(&mut self.all);
        let params = &scene.opened.compiled.module.settings.params;
        for (spec, source) in params.iter().zip(&scene.param_sources) {
            let mut param = ParamState {
                value: spec.default.clone(),
                spec: spec.clone(),
                source: source.clone(),
            };
            let old = previous
                .iter()
                .find(|old| old.spec.name == spec.name && old.spec.kind == spec.kind);
            if let Some(value) = old
                .filter(|old| old.is_changed())
                .and_then(|old| param.clamped(old.value.clone()))
            {
                param.value = param.snapped_to_text(value);
            }
            self.all.push(param);
        }
    }

    pub(crate) fn set(&mut self, index: usize, value: Vec<f64>) -> ParamChange {
        let Some(param) = self.all.get_mut(index) else {
            return ParamChange::None;
        };
        let value = param.clamped(value);
        match value.map(|value| param.snapped_to_text(value)) {
            Some(value) if value != param.value => {
                param.value = value;
                if param.spec.structural {
                    ParamChange::Structural
                } else {
                    ParamChange::Live
                }
            }
            _ => ParamChange::None,
        }
    }

    pub(crate) fn reset(&mut self, index: usize) -> ParamChange {
        match self.all.get(index) {
            Some(param) => self.set(index, param.spec.default.clone()),
            None => ParamChange::None,
        }
    }

    /// Returns the values passed to engines.
    pub(crate) fn values(&self) -> Arc<Vec<Vec<f64>>> {
        Arc::new(self.all.iter().map(|param| param.value.clone()).collect())
    }

    /// Returns the build overrides: the structural params that differ from the text.
    pub(crate) fn overrides(&self) -> Vec<(String, String)> {
        let is_structural_override =
            |param: &&ParamState| param.spec.structural && param.is_changed();
        let overridden = self.all.iter().filter(is_structural_override);
        overridden
            .map(|param| (param.spec.name.clone(), param.text()))
            .collect()
    }

    /// Reports whether the scene was built with the current values of the structural params.
    pub(crate) fn matches_structure(&self, scene: &BuiltScene) -> bool {
        let params = &scene.opened.compiled.module.settings.params;
        self.all
            .iter()
            .zip(params)
            .all(|(param, built)| !param.spec.structural || param.value == built.value)
    }
}
