//! The params of a scene as they are set by hand.

use crate::build::Scene;
use crate::written::{self, Written};
use sdfc_vm::settings::{Param, ParamKind};
use std::sync::Arc;

/// A param, its present value, and how its author writes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Knob {
    /// What the scene says about it; `spec.default` is the value in the text.
    pub spec: Param,
    /// The present value: one number, or three for colours (linear) and vectors.
    pub value: Vec<f64>,
    /// How it is written, where that is known.
    pub written: Option<Written>,
}

impl Knob {
    /// Whether it differs from the text.
    pub fn is_changed(&self) -> bool {
        self.value != self.spec.default
    }

    /// The unit's letters, and what one of it is in the scene's own units.
    pub fn unit(&self) -> (&'static str, f64) {
        match (&self.written, self.spec.kind) {
            (Some(written), _) if !written.unit.unit.suffix().is_empty() => {
                (written.unit.unit.suffix(), written.unit.factor)
            }
            (_, ParamKind::Angle) => ("deg", 1_f64.to_radians()),
            (_, ParamKind::Time) => ("s", 1.0),
            _ => ("", 1.0),
        }
    }

    /// The value as the language writes it.
    pub fn text(&self) -> String {
        written::text(self.spec.kind, &self.value, self.written.as_ref())
    }

    /// The nearest value that the scene allows.
    fn allowed(&self, mut value: Vec<f64>) -> Option<Vec<f64>> {
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
            if let Some((least, most)) = self.spec.range {
                *v = v.clamp(least, most);
                if !self.spec.inclusive && *v >= most {
                    *v = match self.spec.kind {
                        ParamKind::Int => most - 1.0,
                        // The largest number of single precision below the end.
                        _ => f64::from((most as f32).next_down()),
                    };
                }
            }
        }
        Some(value)
    }
}

/// What a change of a param asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Nothing changed.
    None,
    /// Numbers: the scene as it is can be drawn with them.
    Live,
    /// Another program.
    Structural,
}

/// All params of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Knobs {
    all: Vec<Knob>,
}

impl Knobs {
    pub(crate) fn all(&self) -> &[Knob] {
        &self.all
    }

    /// Takes the params of a new scene; values that were set by hand stay where they still fit.
    pub(crate) fn take(&mut self, scene: &Scene) {
        let before = std::mem::take(&mut self.all);
        let params = &scene.opened.compiled.module.settings.params;
        for (spec, written) in params.iter().zip(&scene.written) {
            let mut knob = Knob {
                value: spec.default.clone(),
                spec: spec.clone(),
                written: written.clone(),
            };
            let old = before
                .iter()
                .find(|old| old.spec.name == spec.name && old.spec.kind == spec.kind);
            if let Some(value) = old
                .filter(|old| old.is_changed())
                .and_then(|old| knob.allowed(old.value.clone()))
            {
                knob.value = value;
            }
            self.all.push(knob);
        }
    }

    pub(crate) fn set(&mut self, index: usize, value: Vec<f64>) -> Change {
        let Some(knob) = self.all.get_mut(index) else {
            return Change::None;
        };
        match knob.allowed(value) {
            Some(value) if value != knob.value => {
                knob.value = value;
                if knob.spec.structural {
                    Change::Structural
                } else {
                    Change::Live
                }
            }
            _ => Change::None,
        }
    }

    pub(crate) fn reset(&mut self, index: usize) -> Change {
        match self.all.get(index) {
            Some(knob) => self.set(index, knob.spec.default.clone()),
            None => Change::None,
        }
    }

    /// The values that engines get.
    pub(crate) fn values(&self) -> Arc<Vec<Vec<f64>>> {
        Arc::new(self.all.iter().map(|knob| knob.value.clone()).collect())
    }

    /// What a build needs to know: the values that decide structure, where they are not the text's.
    pub(crate) fn overrides(&self) -> Vec<(String, String)> {
        let decide = |knob: &&Knob| knob.spec.structural && knob.is_changed();
        let all = self.all.iter().filter(decide);
        all.map(|knob| (knob.spec.name.clone(), knob.text()))
            .collect()
    }

    /// Whether the scene was built with the present values of what decides structure.
    pub(crate) fn fit(&self, scene: &Scene) -> bool {
        let params = &scene.opened.compiled.module.settings.params;
        self.all
            .iter()
            .zip(params)
            .all(|(knob, built)| !knob.spec.structural || knob.value == built.value)
    }
}
