//! Which engine draws: one that shows an edit at once, and, where there is one, a faster one that
//! has to be made ready for a scene first and takes over when it is. On hardware the first one has to be
//! made ready too, but once for all scenes; until then the CPU draws.

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tier {
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

/// How far an engine is that has to be made ready for all scenes once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Warmth {
    /// Nothing is done yet.
    #[default]
    Cold,
    /// It is being made ready.
    WarmingUp,
    /// It is ready.
    Warm,
}

/// Why an engine is not used.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Failure {
    why: String,
    /// Whether it may do better with another build of the scene.
    for_now: bool,
}

/// The engines of a session.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiers {
    devices: Devices,
    choice: Choice,
    /// How far the interpreter is on hardware: its kernels run every scene, and take a while to make.
    warmth: Warmth,
    /// What the second engine is ready for.
    ready: Option<Key>,
    /// What it is being made ready for.
    preparing: Option<Key>,
    /// How long the same picture took either.
    compared: Option<[Duration; 2]>,
    /// The engines that failed, and why.
    failed: BTreeMap<EngineKind, Failure>,
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
        let failed = self.failed.iter();
        failed.map(|(kind, failure)| (*kind, failure.why.as_str()))
    }

    /// An engine cannot go on.
    pub(crate) fn fail(&mut self, kind: EngineKind, why: String) {
        if kind == EngineKind::Interp {
            self.warmth = Warmth::Cold;
        }
        self.fails(kind, why, false);
    }

    /// An engine cannot do this build of the scene.
    pub(crate) fn fail_for_now(&mut self, kind: EngineKind, why: String) {
        self.fails(kind, why, true);
    }

    fn fails(&mut self, kind: EngineKind, why: String, for_now: bool) {
        self.failed.insert(kind, Failure { why, for_now });
        self.forget();
    }

    /// The scene is another, which all engines that run here may do.
    pub(crate) fn try_again(&mut self) {
        self.failed.retain(|_, failure| !failure.for_now);
    }

    fn works(&self, kind: EngineKind) -> bool {
        !self.failed.contains_key(&kind)
    }

    /// The engine that is to show edits at once.
    fn wanted(&self) -> EngineKind {
        match self.choice {
            Choice::Only(EngineKind::Wgsl) | Choice::Auto if self.devices.hardware => {
                EngineKind::Interp
            }
            Choice::Only(EngineKind::Wgsl) | Choice::Auto => EngineKind::Cpu,
            Choice::Only(kind) => kind,
        }
    }

    /// Whether that one draws only once it is warm.
    fn waits(&self) -> bool {
        let wanted = self.wanted();
        let once = self.devices.hardware && wanted == EngineKind::Interp;
        once && self.works(wanted) && self.warmth != Warmth::Warm
    }

    /// The engine of a tier, if it has one. While the first one is made ready, the CPU is in its place.
    pub(crate) fn engine(&self, tier: Tier) -> Option<EngineKind> {
        match tier {
            Tier::Instant => {
                let wanted = self.wanted();
                let can = self.works(wanted) && !self.waits();
                Some(if can { wanted } else { EngineKind::Cpu })
            }
            Tier::Prepared => {
                let wanted = match self.choice {
                    Choice::Auto => self.devices.hardware,
                    Choice::Only(kind) => kind == EngineKind::Wgsl && self.devices.gpu,
                };
                Some(EngineKind::Wgsl).filter(|kind| wanted && self.works(*kind))
            }
        }
    }

    /// The engine that is to be made ready for all scenes now, if there is one.
    pub(crate) fn warms_up(&mut self) -> Option<EngineKind> {
        let begins = self.waits() && self.warmth == Warmth::Cold;
        begins.then(|| {
            self.warmth = Warmth::WarmingUp;
            self.wanted()
        })
    }

    /// It is ready for all scenes.
    pub(crate) fn is_warm(&mut self) {
        self.warmth = Warmth::Warm;
    }

    /// Whether it is being made ready.
    pub(crate) fn is_warming_up(&self) -> bool {
        self.warmth == Warmth::WarmingUp
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

    /// Whether the second engine is to be made ready for this: once the first one is, with which it is
    /// compared.
    pub(crate) fn is_to_prepare(&self, key: Key) -> bool {
        let is_free = self.preparing.is_none() && !self.waits();
        self.engine(Tier::Prepared).is_some() && self.ready != Some(key) && is_free
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

    fn warm() -> Tiers {
        let mut tiers = Tiers::new(HARDWARE);
        tiers.warms_up();
        tiers.is_warm();
        tiers
    }

    #[test]
    fn the_second_engine_draws_when_it_is_ready_and_faster() {
        let mut tiers = warm();
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
        let mut tiers = warm();
        tiers.fail(EngineKind::Interp, "lost".to_owned());
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Cpu));
        assert_eq!(tiers.warms_up(), None, "it is not tried again by itself");
        tiers.choose(Choice::Only(EngineKind::Interp));
        assert_eq!(tiers.warms_up(), Some(EngineKind::Interp));
        tiers.is_warm();
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Interp));
    }

    #[test]
    fn the_cpu_draws_until_the_interpreter_is_warm_where_it_has_to_be() {
        let mut tiers = Tiers::new(HARDWARE);
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Cpu));
        assert_eq!(tiers.warms_up(), Some(EngineKind::Interp));
        assert_eq!(tiers.warms_up(), None, "once is enough");
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Cpu));
        assert!(
            !tiers.is_to_prepare(KEY),
            "there is nothing to compare with"
        );
        tiers.is_warm();
        assert_eq!(tiers.engine(Tier::Instant), Some(EngineKind::Interp));
        assert!(tiers.is_to_prepare(KEY));
        // In software its kernels are made for each scene.
        let mut software = Tiers::new(Devices {
            gpu: true,
            hardware: false,
        });
        software.choose(Choice::Only(EngineKind::Interp));
        assert_eq!(software.warms_up(), None);
        assert_eq!(software.engine(Tier::Instant), Some(EngineKind::Interp));
    }
}
