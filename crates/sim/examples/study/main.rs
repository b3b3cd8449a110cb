//! The study of error against time, and drawings of single hairs: prints CSV, writes SVG.
//!
//! `cargo run --release -p pelage-sim --example study -- COMMAND [FOLDER]`, with the command `released`, `method`, `cantilever`,
//! `tolerance`, `shot`, `speed`, `many`, or `pictures`; SVG files go to the folder (`docs/pictures`).
#![allow(missing_docs, clippy::disallowed_methods, clippy::needless_range_loop)]

mod accuracy;
mod pictures;
#[path = "../../../pelage/src/bench/plot.rs"]
mod plot;
mod shot;
mod solver;

fn main() {
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    let folder = args.next().unwrap_or_else(|| "docs/pictures".to_string());
    let write = |name: &str, text: String| {
        std::fs::write(format!("{folder}/{name}.svg"), text).expect("the folder should exist");
    };
    match command.as_str() {
        "released" => accuracy::released(&write),
        "method" => accuracy::method(),
        "cantilever" => accuracy::cantilever(&write),
        "tolerance" => accuracy::tolerance(&write),
        "shot" => shot::halved(&write),
        "many" => shot::many(),
        "speed" => solver::speed(),
        "pictures" => pictures::draw(&write),
        _ => eprintln!("one of: released method cantilever tolerance shot speed many pictures"),
    }
}

/// Writes an SVG file's text under a name.
type Write<'a> = &'a dyn Fn(&str, String);

/// Runs something on some threads.
fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

/// Processor time of this thread, seconds: the machine may be shared.
fn cpu_seconds() -> f64 {
    // Giving way brings the figure up to date.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    text.split_whitespace().next().and_then(|v| v.parse::<f64>().ok()).expect("a number") * 1e-9
}
