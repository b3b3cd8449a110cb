//! The machine that is measured, and its clocks.

use pelage_sim::lanes::{self, Lanes, Pack, Width};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::time::Instant;

/// What tells this program on this machine from others: hash of the executable, processor.
pub(super) fn program() -> String {
    let bytes = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
    format!("{} {}", blake3::hash(&bytes).to_hex(), processor().replace('"', ""))
}

/// Facts of the machine and of the program for the report.
pub(super) fn facts() -> Value {
    json!({
        "program": format!("pelage {}", env!("CARGO_PKG_VERSION")),
        "optimised": !cfg!(debug_assertions),
        "processor": processor(),
        "threads": rayon::current_num_threads(),
        "widest registers": format!("{:?}", Width::widest()),
        "memory_GB": field("/proc/meminfo", "MemTotal").and_then(|v| kilobytes(&v)).map_or(0.0, |b| (b / 1e8).round() / 10.0),
        "system": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
    })
}

/// The processor's name.
fn processor() -> String {
    field("/proc/cpuinfo", "model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// What stands after a name and a colon in one of the system's files.
fn field(path: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find(|l| l.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// "123 kB" in bytes.
fn kilobytes(text: &str) -> Option<f64> {
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
}

/// Resident memory of this process now, bytes; 0 where the system does not tell.
pub(super) fn resident_bytes() -> f64 {
    field("/proc/self/status", "VmRSS").and_then(|v| kilobytes(&v)).unwrap_or(0.0)
}

/// Runs something on some threads.
pub(super) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

/// What some work on a single thread gives, and its processor seconds.
pub(super) fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> (T, f64) {
    on_threads(1, || {
        let start = thread_seconds();
        let done = work();
        (done, thread_seconds() - start)
    })
}

/// Processor seconds of this thread: the machine may be shared. Seconds on the clock where the system does not tell.
pub(super) fn thread_seconds() -> f64 {
    // Giving way brings the figure up to date.
    std::thread::yield_now();
    let read = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    thread_local!(static START: Instant = Instant::now());
    read().unwrap_or_else(|| START.with(|s| s.elapsed().as_secs_f64()))
}

/// Seconds on the clock of the fastest of some runs.
pub(super) fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let once = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..runs.max(1)).map(|_| once(&mut work)).fold(f64::INFINITY, f64::min)
}

/// Bytes a second that all threads together read and write: `a = b + 3 c` over arrays far larger than any cache (24 bytes
/// a number; McCalpin's triad).
pub(super) fn bandwidth() -> f64 {
    const NUMBERS: usize = 16 << 20;
    const CHUNK: usize = 1 << 16;
    let (mut a, b, c) = (vec![0.0f64; NUMBERS], vec![1.0f64; NUMBERS], vec![2.0f64; NUMBERS]);
    let seconds = fastest(5, || {
        let chunks = a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).zip(c.par_chunks(CHUNK));
        chunks.for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + 3.0 * c;
            }
        });
        std::hint::black_box(&mut a);
    });
    24.0 * NUMBERS as f64 / seconds
}

/// Sixteen chains of multiply-adds that do not wait for each other.
struct Peak(usize);

impl lanes::Kernel for Peak {
    type Out = Pack;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Pack {
        let (factor, term) = (L::splat(0.999_999), L::splat(1e-6));
        let mut chain: [L; 16] = std::array::from_fn(|k| L::splat(k as f64));
        for _ in 0..self.0 {
            for c in &mut chain {
                *c = c.mul_add(factor, term);
            }
        }
        let mut out = Pack::default();
        chain.into_iter().fold(L::splat(0.0), |a, b| a + b).store(&mut out);
        out
    }
}

/// Double-precision operations a second of all threads together; a multiply-add counts two.
pub(super) fn peak() -> f64 {
    const ROUNDS: usize = 2_000_000;
    let threads = rayon::current_num_threads();
    let seconds = fastest(3, || {
        (0..threads).into_par_iter().with_max_len(1).for_each(|_| {
            std::hint::black_box(lanes::run(Width::widest(), Peak(std::hint::black_box(ROUNDS))));
        });
    });
    (threads * ROUNDS * 16 * lanes::LANES * 2) as f64 / seconds
}
