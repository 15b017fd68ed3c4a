//! Campaigns: a check run on the inputs of many seeds.
//!
//! An ordinary test runs at most a few thousand. `SDFC_FUZZ=1000000` runs that many in each campaign,
//! divided by its relative cost, from the seed `SDFC_FUZZ_FROM` on. A release build then also requires that
//! no input takes longer than [`MAX_INPUT_TIME`]. Times decide nothing else: the guard against hangs is far
//! above all of them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{LazyLock, Mutex};
use std::time::{Duration, Instant};

/// Stack size of the thread that runs checks, in bytes. Compiling a scene needs no more, and the command
/// line has more.
pub const STACK_BYTES: usize = 2 << 20;
/// Longest time per input in the long form of a release build.
pub const MAX_INPUT_TIME: Duration = Duration::from_millis(50);
/// Time per input after which a campaign aborts as hanging, in any build.
const HANG_TIMEOUT: Duration = Duration::from_secs(120);
/// Number of failures after which a campaign ends.
const MAX_FAILURES: usize = 20;

/// Outcome of a successful check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckOutcome {
    /// The input was refused with a message.
    Refused,
    /// The input was accepted, and all invariants hold.
    Accepted,
}

/// Numbers of refused and accepted inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Number of refused inputs.
    pub refused: u64,
    /// Number of accepted inputs.
    pub accepted: u64,
}

impl Tally {
    /// Reports whether more than 1 in 30 inputs was refused, and more than 1 in 30 accepted. Fewer than 300
    /// inputs always pass.
    pub fn is_balanced(&self) -> bool {
        let minimum = (self.refused + self.accepted) / 30;
        self.refused + self.accepted < 300 || (self.refused > minimum && self.accepted > minimum)
    }
}

/// Text form of an input for failure messages.
pub trait Describe {
    /// Returns a readable form of the input.
    fn describe(&self) -> String;
}

impl Describe for String {
    fn describe(&self) -> String {
        let end = self.floor_char_boundary(4000);
        self[..end].to_owned()
    }
}

impl Describe for Vec<u8> {
    fn describe(&self) -> String {
        format!("{} bytes", self.len())
    }
}

impl Describe for u64 {
    fn describe(&self) -> String {
        String::new()
    }
}

/// Returns the number in an environment variable, if it is set.
fn env_number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let env_number = text.parse();
    Some(env_number.unwrap_or_else(|_| panic!("{variable} is a number, not {text}")))
}

/// Returns the number of inputs of a campaign: `default_count`, or `SDFC_FUZZ` divided by `relative_cost`
/// if that is set.
///
/// `relative_cost` is the cost of an input in units of that of a damaged text.
pub fn input_count(default_count: u64, relative_cost: u64) -> u64 {
    env_number("SDFC_FUZZ").map_or(default_count, |requested_count| {
        (requested_count / relative_cost).max(1)
    })
}

/// Reports whether times are checked: in the long form of a release build.
fn is_timed() -> bool {
    env_number("SDFC_FUZZ").is_some() && !cfg!(debug_assertions)
}

/// Checks the inputs of `count` seeds on a thread with a stack of [`STACK_BYTES`].
///
/// Panics with the seeds and inputs whose checks panicked.
pub fn run<I: Describe>(
    name: &str,
    count: u64,
    make: impl Fn(u64) -> I + Sync,
    check: impl Fn(&I) -> CheckOutcome + Sync,
) -> Tally {
    run_timed(name, count, make, check, |_| Duration::ZERO)
}

/// Checks inputs as [`run`] does, and in the long form also their times.
///
/// `timed_work` runs the timed part of a check. It returns the time that the input may take beyond
/// [`MAX_INPUT_TIME`].
pub fn run_timed<I: Describe>(
    name: &str,
    count: u64,
    make: impl Fn(u64) -> I + Sync,
    check: impl Fn(&I) -> CheckOutcome + Sync,
    timed_work: impl Fn(&I) -> Duration + Sync,
) -> Tally {
    let first_seed = env_number("SDFC_FUZZ_FROM").unwrap_or(0);
    let progress = Mutex::new((first_seed, Instant::now()));
    let current = || {
        progress
            .lock()
            .map_or((0, Instant::now()), |current| *current)
    };
    let (sender, receiver) = channel();
    let run_seeds = || {
        let mut tally = Tally::default();
        let mut failures = Vec::new();
        let mut longest = (Duration::ZERO, 0);
        for seed in first_seed..first_seed + count {
            if let Ok(mut current) = progress.lock() {
                *current = (seed, Instant::now());
            }
            let (failure, elapsed) = attempt(seed, &make, &check, &timed_work, &mut tally);
            longest = longest.max((elapsed, seed));
            failures.extend(failure);
            if failures.len() >= MAX_FAILURES {
                break;
            }
        }
        // The receiver is gone only if the campaign is being aborted.
        let _ = sender.send((tally, failures, longest));
    };
    let (tally, failures, longest) = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
        let worker = thread
            .spawn_scoped(scope, run_seeds)
            .expect("a thread starts");
        // In seconds. Long campaigns report their progress once a minute.
        let mut waited_seconds = 0_u32;
        loop {
            match receiver.recv_timeout(Duration::from_secs(1)) {
                Ok(result) => break result,
                Err(RecvTimeoutError::Timeout) if worker.is_finished() => {
                    panic!("{name}: seed {} ended the campaign", current().0)
                }
                Err(RecvTimeoutError::Timeout) => {
                    waited_seconds += 1;
                    if waited_seconds.is_multiple_of(60) {
                        eprintln!("{name}: seed {} of {}", current().0, first_seed + count);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => panic!("{name}: seed {}", current().0),
            }
            let (seed, started) = current();
            if started.elapsed() > HANG_TIMEOUT {
                eprintln!("{name}: seed {seed} hangs: {}", make(seed).describe());
                std::process::abort();
            }
        }
    });
    let (elapsed, seed) = longest;
    eprintln!(
        "{name}: {} refused, {} accepted, the longest {elapsed:?} (seed {seed})",
        tally.refused, tally.accepted
    );
    assert!(
        failures.is_empty(),
        "{name}: {} failures\n{}",
        failures.len(),
        failures.join("\n")
    );
    tally
}

/// Checks one input. Returns the failure, and the time of the work where times are checked.
fn attempt<I: Describe>(
    seed: u64,
    make: impl Fn(u64) -> I,
    check: impl Fn(&I) -> CheckOutcome,
    timed_work: impl Fn(&I) -> Duration,
    tally: &mut Tally,
) -> (Option<String>, Duration) {
    let input = make(seed);
    let mut elapsed = Duration::ZERO;
    let mut failure = match catch_unwind(AssertUnwindSafe(|| check(&input))) {
        Ok(CheckOutcome::Refused) => {
            tally.refused += 1;
            None
        }
        Ok(CheckOutcome::Accepted) => {
            tally.accepted += 1;
            None
        }
        Err(panic) => Some(panic_message(&*panic)),
    };
    if is_timed() && failure.is_none() {
        let mut max_time = MAX_INPUT_TIME;
        elapsed = Duration::MAX;
        // The minimum of up to 5 runs, since noise only adds time.
        for _ in 0..5 {
            let start = cpu_time();
            max_time = MAX_INPUT_TIME + timed_work(&input);
            elapsed = elapsed.min(cpu_time().saturating_sub(start));
            if elapsed <= max_time {
                break;
            }
        }
        if elapsed > max_time {
            failure = Some(format!("it takes {elapsed:?}, more than {max_time:?}"));
        }
    }
    let failure = failure.map(|message| format!("seed {seed}: {message}\n{}", input.describe()));
    (failure, elapsed)
}

/// Returns the CPU time of this process, to 10 ms, or its run time where the CPU time is not available.
fn cpu_time() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else {
        return START.elapsed();
    };
    // After the name in parentheses, user and system time are the 12th and 13th fields, in 1/100 s on every
    // Linux.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks = ticks.filter_map(|ticks| ticks.parse::<u64>().ok());
    Duration::from_millis(10 * ticks.sum::<u64>())
}

/// Returns the message of a panic.
fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}
