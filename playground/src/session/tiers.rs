//! Which engine draws: one that shows an edit at once, and, where there is one, a faster one that
//! has to be made ready first and takes over when it is.

use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::Mode;
use std::collections::BTreeMap;
use std::time::Duration;

/// What runs here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Devices {
    /// Whether there is a GPU at all, software included.
    pub gpu: bool,
    /// Whether there is one in hardware.
    pub hardware: bool,
}

/// Which engine is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// What is best here.
    #[default]
    Auto,
    /// This one; one that has to be made ready first is waited for with another.
    Only(EngineKind),
}

/// Which of the two engines of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tier {
    /// The one that shows an edit at once.
    Instant,
    /// The one that has to be made ready.
    Prepared,
}

/// What the second engine is ready for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key {
    /// The scene's build.
    pub(crate) scene: u64,
    /// What is shown.
    pub(crate) mode: Mode,
}

/// The engines of a session.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiers {
    devices: Devices,
    choice: Choice,
    /// What the second engine is ready for.
    ready: Option<Key>,
    /// What it is being made ready for.
    preparing: Option<Key>,
    /// How long the same picture took either.
    compared: Option<[Duration; 2]>,
    /// The engines that failed, and why.
    failed: BTreeMap<EngineKind, String>,
}

impl Tiers {
    pub(crate) fn new(devices: Devices) -> Self {
        Self {
            devices,
            ..Self::default()
        }
    }

    pub(crate) fn choose(&mut self, choice: Choice) {
        self.choice = choice;
        // Whoever chooses wants it tried again.
        self.failed.clear();
        self.forget();
    }

    pub(crate) fn choice(&self) -> Choice {
        self.choice
    }

    pub(crate) fn devices(&self) -> Devices {
        self.devices
    }

    /// Why engines are not used that failed.
    pub(crate) fn failures(&self) -> impl Iterator<Item = (EngineKind, &str)> {
        self.failed.iter().map(|(kind, why)| (*kind, why.as_str()))
    }

    /// An engine cannot go on. Whether there is another one in its place.
    pub(crate) fn fail(&mut self, kind: EngineKind, why: String) -> bool {
        self.failed.insert(kind, why);
        self.forget();
        kind != EngineKind::Cpu
    }

    /// The engine of a tier.
    pub(crate) fn engine(&self, tier: Tier) -> Option<EngineKind> {
        let works = |kind: &EngineKind| !self.failed.contains_key(kind);
        let instant = match (self.choice, self.devices.hardware) {
            (Choice::Only(EngineKind::Wgsl) | Choice::Auto, true) => EngineKind::Interp,
            (Choice::Only(EngineKind::Wgsl) | Choice::Auto, false) => EngineKind::Cpu,
            (Choice::Only(kind), _) => kind,
        };
        match tier {
            Tier::Instant => Some(instant).filter(works).or(Some(EngineKind::Cpu)),
            Tier::Prepared => {
                let wanted = match self.choice {
                    Choice::Auto => self.devices.hardware,
                    Choice::Only(kind) => kind == EngineKind::Wgsl && self.devices.gpu,
                };
                wanted.then_some(EngineKind::Wgsl).filter(works)
            }
        }
    }

    /// The tier that draws this.
    pub(crate) fn tier(&self, key: Key) -> Tier {
        let fixed = self.choice == Choice::Only(EngineKind::Wgsl);
        let faster = self.compared.is_none_or(|[first, second]| second < first);
        if self.engine(Tier::Prepared).is_some() && self.ready == Some(key) && (fixed || faster) {
            Tier::Prepared
        } else {
            Tier::Instant
        }
    }

    /// Whether the second engine is to be made ready for this.
    pub(crate) fn is_to_prepare(&self, key: Key) -> bool {
        self.engine(Tier::Prepared).is_some()
            && self.ready != Some(key)
            && self.preparing.is_none()
    }

    pub(crate) fn prepares(&mut self, key: Key) {
        self.preparing = Some(key);
    }

    /// What it is being made ready for, if it is.
    pub(crate) fn preparing(&self) -> Option<Key> {
        self.preparing
    }

    /// It is ready; the same picture took so long on the first and on the second.
    pub(crate) fn prepared(&mut self, compared: Option<[Duration; 2]>) {
        self.ready = self.preparing.take();
        self.compared = compared;
    }

    /// It is not ready after all.
    pub(crate) fn unprepared(&mut self) {
        self.preparing = None;
    }

    /// How long the same picture took the first and the second engine.
    pub(crate) fn compared(&self) -> Option<[Duration; 2]> {
        self.compared
    }

    fn forget(&mut self) {
        self.ready = None;
        self.compared = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: Key = Key {
        scene: 1,
        mode: Mode::Shaded,
    };
    const HARDWARE: Devices = Devices {
        gpu: true,
        hardware: true,
    };
    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn the_second_engine_draws_when_it_is_ready_and_faster() {
        let mut tiers = Tiers::new(HARDWARE);
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Interp));
        assert_eq!(tiers.tier(KEY), Tier::Instant);
        assert!(tiers.is_to_prepare(KEY));
        tiers.prepares(KEY);
        assert!(!tiers.is_to_prepare(KEY));
        tiers.prepared(Some([4 * MS, MS]));
        assert_eq!(tiers.tier(KEY), Tier::Prepared);
        // An edit falls back until it is ready again.
        let edited = Key { scene: 2, ..KEY };
        assert_eq!(tiers.tier(edited), Tier::Instant);
        tiers.prepares(edited);
        tiers.prepared(Some([MS, 4 * MS]));
        assert_eq!(tiers.tier(edited), Tier::Instant, "it is slower");
        tiers.choose(Choice::Only(EngineKind::Wgsl));
        tiers.prepares(edited);
        tiers.prepared(Some([MS, 4 * MS]));
        assert_eq!(tiers.tier(edited), Tier::Prepared, "it was asked for");
    }

    #[test]
    fn without_hardware_the_cpu_draws_and_nothing_is_prepared() {
        for gpu in [false, true] {
            let tiers = Tiers::new(Devices {
                gpu,
                hardware: false,
            });
            assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Cpu));
            assert!(!tiers.is_to_prepare(KEY));
        }
    }

    #[test]
    fn the_cpu_takes_the_place_of_what_fails_until_it_is_chosen_again() {
        let mut tiers = Tiers::new(HARDWARE);
        assert!(tiers.fail(EngineKind::Interp, "lost".to_owned()));
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Cpu));
        tiers.choose(Choice::Only(EngineKind::Interp));
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Interp));
        assert!(!tiers.fail(EngineKind::Cpu, "a bug".to_owned()));
    }
}
