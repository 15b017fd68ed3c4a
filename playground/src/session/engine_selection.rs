//! Engine selection. The instant engine draws edits at once. The prepared engine, if available, must
//! first be made ready for a scene and then takes over if it is faster. On hardware the instant engine
//! also needs preparation, but only once for all scenes; until then the CPU draws.

use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::Mode;
use std::collections::BTreeMap;
use std::time::Duration;

/// Kinds of devices that are available.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Devices {
    /// True if a GPU is available, including software implementations.
    pub gpu: bool,
    /// True if a hardware GPU is available.
    pub hardware: bool,
}

/// The requested engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// The fastest engine available; the CPU for scenes that only it draws without holes.
    #[default]
    Auto,
    /// Only this engine. Another engine draws while it is being prepared.
    Only(EngineKind),
}

/// One of the two engines of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EngineTier {
    /// The engine that draws edits at once.
    Instant,
    /// The engine that must be prepared for each scene.
    Prepared,
}

/// The scene and mode that the prepared engine is made ready for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PreparedKey {
    /// Build number of the scene.
    pub(crate) scene: u64,
    /// Render mode.
    pub(crate) mode: Mode,
}

/// Warm-up state of an engine that must be made ready for all scenes once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum WarmUpState {
    /// Not started.
    #[default]
    Cold,
    /// In progress.
    WarmingUp,
    /// Finished: no scene waits for its kernels.
    Warm,
}

/// Reason why an engine is not used.
#[derive(Clone, Debug, PartialEq, Eq)]
struct EngineFailure {
    why: String,
    /// True if the engine is retried with the next build of the scene.
    this_build_only: bool,
}

/// Selects the engine that draws.
#[derive(Clone, Debug, Default)]
pub(crate) struct EngineSelection {
    devices: Devices,
    choice: EngineChoice,
    /// Warm-up state of the interpreter on hardware. Its kernels run every scene and take long to
    /// compile.
    warm_up: WarmUpState,
    /// Key that the prepared engine is ready for.
    ready: Option<PreparedKey>,
    /// Key that the prepared engine is being made ready for.
    preparing: Option<PreparedKey>,
    /// Times of the same picture on the instant and on the prepared engine.
    compared_times: Option<[Duration; 2]>,
    /// Failed engines and the reasons.
    failed: BTreeMap<EngineKind, EngineFailure>,
    /// Set if a slope in the scene is only estimated: then the CPU alone proves that rays step over no surface.
    needs_proof: bool,
}

impl EngineSelection {
    pub(crate) fn new(devices: Devices) -> Self {
        Self {
            devices,
            ..Self::default()
        }
    }

    pub(crate) fn set_choice(&mut self, choice: EngineChoice) {
        self.choice = choice;
        // An explicit selection retries failed engines.
        self.failed.clear();
        self.reset_prepared();
    }

    pub(crate) fn choice(&self) -> EngineChoice {
        self.choice
    }

    pub(crate) fn devices(&self) -> Devices {
        self.devices
    }

    /// Returns the engines that failed, with the reasons.
    pub(crate) fn failures(&self) -> impl Iterator<Item = (EngineKind, &str)> {
        let failed = self.failed.iter();
        failed.map(|(kind, failure)| (*kind, failure.why.as_str()))
    }

    /// Records that an engine cannot continue.
    pub(crate) fn fail(&mut self, kind: EngineKind, why: String) {
        if kind == EngineKind::Interp {
            self.warm_up = WarmUpState::Cold;
        }
        self.record_failure(kind, why, false);
    }

    /// Records that an engine cannot draw this build of the scene.
    pub(crate) fn fail_this_build(&mut self, kind: EngineKind, why: String) {
        self.record_failure(kind, why, true);
    }

    fn record_failure(&mut self, kind: EngineKind, why: String, this_build_only: bool) {
        self.failed.insert(
            kind,
            EngineFailure {
                why,
                this_build_only,
            },
        );
        self.reset_prepared();
    }

    /// Retries engines that failed only for the previous build. `needs_proof` is set if a slope in the new one is only
    /// estimated.
    pub(crate) fn begin_build(&mut self, needs_proof: bool) {
        self.needs_proof = needs_proof;
        self.failed.retain(|_, failure| !failure.this_build_only);
    }

    fn is_usable(&self, kind: EngineKind) -> bool {
        !self.failed.contains_key(&kind)
    }

    /// Returns the engine that should draw edits at once.
    fn requested_engine(&self) -> EngineKind {
        match self.choice {
            EngineChoice::Auto if self.needs_proof => EngineKind::Cpu,
            EngineChoice::Only(EngineKind::Wgsl) | EngineChoice::Auto if self.devices.hardware => {
                EngineKind::Interp
            }
            EngineChoice::Only(EngineKind::Wgsl) | EngineChoice::Auto => EngineKind::Cpu,
            EngineChoice::Only(kind) => kind,
        }
    }

    /// Reports whether the requested engine still has to be warmed up.
    fn needs_warm_up(&self) -> bool {
        let requested = self.requested_engine();
        let warms_up_once = self.devices.hardware && requested == EngineKind::Interp;
        warms_up_once && self.is_usable(requested) && self.warm_up != WarmUpState::Warm
    }

    /// Returns the engine of a tier, if it has one. The CPU replaces the instant engine during its
    /// warm-up.
    pub(crate) fn engine(&self, tier: EngineTier) -> Option<EngineKind> {
        match tier {
            EngineTier::Instant => {
                let requested = self.requested_engine();
                let is_available = self.is_usable(requested) && !self.needs_warm_up();
                Some(if is_available {
                    requested
                } else {
                    EngineKind::Cpu
                })
            }
            EngineTier::Prepared => {
                let requested = match self.choice {
                    EngineChoice::Auto => self.devices.hardware && !self.needs_proof,
                    EngineChoice::Only(kind) => kind == EngineKind::Wgsl && self.devices.gpu,
                };
                Some(EngineKind::Wgsl).filter(|kind| requested && self.is_usable(*kind))
            }
        }
    }

    /// Starts the warm-up of the instant engine if it is due, and returns that engine.
    pub(crate) fn start_warm_up(&mut self) -> Option<EngineKind> {
        let starts = self.needs_warm_up() && self.warm_up == WarmUpState::Cold;
        starts.then(|| {
            self.warm_up = WarmUpState::WarmingUp;
            self.requested_engine()
        })
    }

    /// Records the end of the warm-up.
    pub(crate) fn set_warm(&mut self) {
        self.warm_up = WarmUpState::Warm;
    }

    /// Reports whether the warm-up is in progress.
    pub(crate) fn is_warming_up(&self) -> bool {
        self.warm_up == WarmUpState::WarmingUp
    }

    /// Returns the tier that draws a scene and mode.
    pub(crate) fn tier_for(&self, key: PreparedKey) -> EngineTier {
        let is_requested = self.choice == EngineChoice::Only(EngineKind::Wgsl);
        let is_faster = self
            .compared_times
            .is_none_or(|[instant_time, prepared_time]| prepared_time < instant_time);
        if self.engine(EngineTier::Prepared).is_some()
            && self.ready == Some(key)
            && (is_requested || is_faster)
        {
            EngineTier::Prepared
        } else {
            EngineTier::Instant
        }
    }

    /// Reports whether the prepared engine should be made ready for a key. The instant engine must be
    /// ready first, because the two are compared.
    pub(crate) fn should_prepare(&self, key: PreparedKey) -> bool {
        let is_free = self.preparing.is_none() && !self.needs_warm_up();
        self.engine(EngineTier::Prepared).is_some() && self.ready != Some(key) && is_free
    }

    pub(crate) fn start_preparing(&mut self, key: PreparedKey) {
        self.preparing = Some(key);
    }

    /// Returns the key that is being prepared.
    pub(crate) fn preparing(&self) -> Option<PreparedKey> {
        self.preparing
    }

    /// Records the end of the preparation and the times of the same picture on both engines.
    pub(crate) fn finish_preparing(&mut self, compared_times: Option<[Duration; 2]>) {
        self.ready = self.preparing.take();
        self.compared_times = compared_times;
    }

    /// Records that the preparation failed.
    pub(crate) fn cancel_preparing(&mut self) {
        self.preparing = None;
    }

    /// Returns the times of the same picture on the instant and on the prepared engine.
    pub(crate) fn compared_times(&self) -> Option<[Duration; 2]> {
        self.compared_times
    }

    fn reset_prepared(&mut self) {
        self.ready = None;
        self.compared_times = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: PreparedKey = PreparedKey {
        scene: 1,
        mode: Mode::Shaded,
    };
    const HARDWARE: Devices = Devices {
        gpu: true,
        hardware: true,
    };
    const MS: Duration = Duration::from_millis(1);

    fn warm() -> EngineSelection {
        let mut engine_selection = EngineSelection::new(HARDWARE);
        engine_selection.start_warm_up();
        engine_selection.set_warm();
        engine_selection
    }

    #[test]
    fn the_second_engine_draws_when_it_is_ready_and_faster() {
        let mut engine_selection = warm();
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Interp)
        );
        assert_eq!(engine_selection.tier_for(KEY), EngineTier::Instant);
        assert!(engine_selection.should_prepare(KEY));
        engine_selection.start_preparing(KEY);
        assert!(!engine_selection.should_prepare(KEY));
        engine_selection.finish_preparing(Some([4 * MS, MS]));
        assert_eq!(engine_selection.tier_for(KEY), EngineTier::Prepared);
        // After an edit the instant engine draws until the other one is prepared again.
        let edited = PreparedKey { scene: 2, ..KEY };
        assert_eq!(engine_selection.tier_for(edited), EngineTier::Instant);
        engine_selection.start_preparing(edited);
        engine_selection.finish_preparing(Some([MS, 4 * MS]));
        assert_eq!(
            engine_selection.tier_for(edited),
            EngineTier::Instant,
            "it is slower"
        );
        engine_selection.set_choice(EngineChoice::Only(EngineKind::Wgsl));
        engine_selection.start_preparing(edited);
        engine_selection.finish_preparing(Some([MS, 4 * MS]));
        assert_eq!(
            engine_selection.tier_for(edited),
            EngineTier::Prepared,
            "it was asked for"
        );
    }

    #[test]
    fn the_cpu_draws_what_only_it_can_prove() {
        let mut engine_selection = warm();
        engine_selection.begin_build(true);
        let instant = engine_selection.engine(EngineTier::Instant);
        assert_eq!(instant, Some(EngineKind::Cpu));
        assert!(!engine_selection.should_prepare(KEY));
        engine_selection.set_choice(EngineChoice::Only(EngineKind::Interp));
        let instant = engine_selection.engine(EngineTier::Instant);
        assert_eq!(instant, Some(EngineKind::Interp), "it was asked for");
        engine_selection.set_choice(EngineChoice::Auto);
        engine_selection.begin_build(false);
        let instant = engine_selection.engine(EngineTier::Instant);
        assert_eq!(instant, Some(EngineKind::Interp));
    }

    #[test]
    fn without_hardware_the_cpu_draws_and_nothing_is_prepared() {
        for gpu in [false, true] {
            let engine_selection = EngineSelection::new(Devices {
                gpu,
                hardware: false,
            });
            assert_eq!(
                engine_selection.engine(EngineTier::Instant),
                Some(EngineKind::Cpu)
            );
            assert!(!engine_selection.should_prepare(KEY));
        }
    }

    #[test]
    fn the_cpu_takes_the_place_of_what_fails_until_it_is_chosen_again() {
        let mut engine_selection = warm();
        engine_selection.fail(EngineKind::Interp, "lost".to_owned());
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Cpu)
        );
        assert_eq!(
            engine_selection.start_warm_up(),
            None,
            "it is not tried again by itself"
        );
        engine_selection.set_choice(EngineChoice::Only(EngineKind::Interp));
        assert_eq!(engine_selection.start_warm_up(), Some(EngineKind::Interp));
        engine_selection.set_warm();
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Interp)
        );
    }

    #[test]
    fn the_cpu_draws_until_the_interpreter_is_warm_where_it_has_to_be() {
        let mut engine_selection = EngineSelection::new(HARDWARE);
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Cpu)
        );
        assert_eq!(engine_selection.start_warm_up(), Some(EngineKind::Interp));
        assert_eq!(engine_selection.start_warm_up(), None, "once is enough");
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Cpu)
        );
        assert!(
            !engine_selection.should_prepare(KEY),
            "there is nothing to compare with"
        );
        engine_selection.set_warm();
        assert_eq!(
            engine_selection.engine(EngineTier::Instant),
            Some(EngineKind::Interp)
        );
        assert!(engine_selection.should_prepare(KEY));
        // On software devices the interpreter's kernels are compiled for each scene.
        let mut software = EngineSelection::new(Devices {
            gpu: true,
            hardware: false,
        });
        software.set_choice(EngineChoice::Only(EngineKind::Interp));
        assert_eq!(software.start_warm_up(), None);
        assert_eq!(
            software.engine(EngineTier::Instant),
            Some(EngineKind::Interp)
        );
    }
}
