//! Campaigns: a check run on the inputs of many seeds.
//!
//! An ordinary test runs a few thousand. `SDFC_FUZZ=1000000` runs as many as it says of each campaign,
//! from the seed `SDFC_FUZZ_FROM` on; a release build then also demands that no input takes longer
//! than [`PATIENCE`]. Timings decide nothing else: the guard against hangs is far above any of them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{LazyLock, Mutex};
use std::time::{Duration, Instant};

/// The stack that checks run on. Whoever compiles scenes needs no more; the command line has more.
pub const STACK_BYTES: usize = 2 << 20;
/// The longest that an input may take in the long form of a release build.
pub const PATIENCE: Duration = Duration::from_millis(50);
/// After so long an input is called a hang, in any build.
const HANG: Duration = Duration::from_secs(120);
/// After so many broken promises a campaign ends.
const MOST_FAILURES: usize = 20;

/// What became of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It was refused with a message.
    Refused,
    /// It was accepted, and all that is promised of it holds.
    Accepted,
}

/// How many inputs were refused and accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Refused.
    pub refused: u64,
    /// Accepted.
    pub accepted: u64,
}

impl Tally {
    /// Whether enough were refused and accepted each to say something of both; a few inputs always do.
    pub fn says_something(&self) -> bool {
        let least = (self.refused + self.accepted) / 30;
        self.refused + self.accepted < 300 || (self.refused > least && self.accepted > least)
    }
}

/// What a failure shows of an input.
pub trait Shown {
    /// A text by which a person can see what it is.
    fn shown(&self) -> String;
}

impl Shown for String {
    fn shown(&self) -> String {
        let end = self.floor_char_boundary(4000);
        self[..end].to_owned()
    }
}

impl Shown for Vec<u8> {
    fn shown(&self) -> String {
        format!("{} bytes", self.len())
    }
}

impl Shown for u64 {
    fn shown(&self) -> String {
        String::new()
    }
}

/// The number that an environment variable holds, if it is set.
fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let number = text.parse();
    Some(number.unwrap_or_else(|_| panic!("{variable} is a number, not {text}")))
}

/// How many inputs a campaign has: `few` where nobody asks for more, else what is asked for divided by
/// how much dearer one is than a damaged text.
pub fn count(few: u64, dear: u64) -> u64 {
    number("SDFC_FUZZ").map_or(few, |many| (many / dear).max(1))
}

/// Whether the long form is asked for, in a build whose timings mean something.
fn is_timed() -> bool {
    number("SDFC_FUZZ").is_some() && !cfg!(debug_assertions)
}

/// Checks the inputs of `count` seeds on a thread with the stack of [`STACK_BYTES`], and panics with
/// the seeds and the inputs for which a check did.
pub fn run<I: Shown>(
    name: &str,
    count: u64,
    make: impl Fn(u64) -> I + Sync,
    check: impl Fn(&I) -> Verdict + Sync,
) -> Tally {
    run_timed(name, count, make, check, |_| Duration::ZERO)
}

/// The same, and in the long form with those inputs on which the `work` that a check is about takes
/// longer than [`PATIENCE`] and what more it says that the input may ask for.
pub fn run_timed<I: Shown>(
    name: &str,
    count: u64,
    make: impl Fn(u64) -> I + Sync,
    check: impl Fn(&I) -> Verdict + Sync,
    work: impl Fn(&I) -> Duration + Sync,
) -> Tally {
    let first = number("SDFC_FUZZ_FROM").unwrap_or(0);
    let present = Mutex::new((first, Instant::now()));
    let now = || present.lock().map_or((0, Instant::now()), |now| *now);
    let (tell, told) = channel();
    let work = || {
        let mut tally = Tally::default();
        let mut failures = Vec::new();
        let mut longest = (Duration::ZERO, 0);
        for seed in first..first + count {
            if let Ok(mut now) = present.lock() {
                *now = (seed, Instant::now());
            }
            let (failure, took) = attempt(seed, &make, &check, &work, &mut tally);
            longest = longest.max((took, seed));
            failures.extend(failure);
            if failures.len() >= MOST_FAILURES {
                break;
            }
        }
        // Nobody listens only where the campaign is being given up.
        let _ = tell.send((tally, failures, longest));
    };
    let (tally, failures, longest) = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
        let worker = thread.spawn_scoped(scope, work).expect("a thread starts");
        // Seconds: what takes hours says each minute how far it has come.
        let mut waited = 0_u32;
        loop {
            match told.recv_timeout(Duration::from_secs(1)) {
                Ok(result) => break result,
                Err(RecvTimeoutError::Timeout) if worker.is_finished() => {
                    panic!("{name}: seed {} ended the campaign", now().0)
                }
                Err(RecvTimeoutError::Timeout) => {
                    waited += 1;
                    if waited.is_multiple_of(60) {
                        eprintln!("{name}: seed {} of {}", now().0, first + count);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => panic!("{name}: seed {}", now().0),
            }
            let (seed, since) = now();
            if since.elapsed() > HANG {
                eprintln!("{name}: seed {seed} hangs: {}", make(seed).shown());
                std::process::abort();
            }
        }
    });
    let (took, seed) = longest;
    eprintln!(
        "{name}: {} refused, {} accepted, the longest {took:?} (seed {seed})",
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

/// Checks one input; gives what is wrong, and how long the work on it took where that is asked.
fn attempt<I: Shown>(
    seed: u64,
    make: impl Fn(u64) -> I,
    check: impl Fn(&I) -> Verdict,
    work: impl Fn(&I) -> Duration,
    tally: &mut Tally,
) -> (Option<String>, Duration) {
    let input = make(seed);
    let mut took = Duration::ZERO;
    let mut failure = match catch_unwind(AssertUnwindSafe(|| check(&input))) {
        Ok(Verdict::Refused) => {
            tally.refused += 1;
            None
        }
        Ok(Verdict::Accepted) => {
            tally.accepted += 1;
            None
        }
        Err(panic) => Some(said(&*panic)),
    };
    if is_timed() && failure.is_none() {
        let mut allowed = PATIENCE;
        took = Duration::MAX;
        // What is slow is slow each time.
        for _ in 0..5 {
            let start = processor_time();
            allowed = PATIENCE + work(&input);
            took = took.min(processor_time().saturating_sub(start));
            if took <= allowed {
                break;
            }
        }
        if took > allowed {
            failure = Some(format!("it takes {took:?}, more than {allowed:?}"));
        }
    }
    let failure = failure.map(|why| format!("seed {seed}: {why}\n{}", input.shown()));
    (failure, took)
}

/// How long the processor has worked on this process, to a hundredth of a second; where that is not
/// told, how long it has run.
fn processor_time() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else {
        return START.elapsed();
    };
    // Behind the name, which is in parentheses: user and system time are the 12th and 13th fields, in
    // hundredths of a second on every Linux.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks = ticks.filter_map(|ticks| ticks.parse::<u64>().ok());
    Duration::from_millis(10 * ticks.sum::<u64>())
}

/// What a panic says.
fn said(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}
