//! What a person sees while a command works: bars on a terminal, plain lines elsewhere. Everything goes to stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Progress of one stage at a time.
#[derive(Debug)]
pub struct Progress {
    terminal: bool,
    quiet: bool,
    bar: Option<ProgressBar>,
    stage: String,
    total: u64,
    done: u64,
    started: Instant,
    said: Instant,
    stop: Arc<AtomicBool>,
}

impl Progress {
    /// Shows bars if stderr is a terminal; `quiet` shows nothing.
    pub fn new(quiet: bool) -> Self {
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        let stop = Arc::default();
        Progress { terminal, quiet, bar: None, stage: String::new(), total: 0, done: 0, started: now, said: now, stop }
    }

    /// The same, of work that ends with [`crate::Error::Stopped`] soon after `stop` is set.
    pub fn stoppable(quiet: bool, stop: Arc<AtomicBool>) -> Self {
        Progress { stop, ..Progress::new(quiet) }
    }

    /// True if the work is to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Starts a stage of `total` steps.
    pub fn begin(&mut self, stage: &str, total: usize) {
        (self.stage, self.total, self.done) = (stage.to_owned(), total as u64, 0);
        (self.started, self.said) = (Instant::now(), Instant::now());
        if self.terminal && !self.quiet {
            let bar = ProgressBar::new(total as u64);
            let style = "{prefix:<12} {bar:30} {pos:>5}/{len} {per_sec:>10} {eta:>5} left  {msg}";
            bar.set_style(ProgressStyle::with_template(style).expect("a valid template"));
            bar.set_prefix(self.stage.clone());
            bar.enable_steady_tick(Duration::from_millis(200));
            self.bar = Some(bar);
        }
    }

    /// Says what is being worked on.
    pub fn working(&mut self, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(what.to_owned());
        } else if !self.quiet && self.said.elapsed() > Duration::from_secs(2) {
            self.said = Instant::now();
            print_line(&format!("{:<12} {}/{} {what}", self.stage, self.done, self.total));
        }
    }

    /// One step is done.
    pub fn step(&mut self) {
        self.done += 1;
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
    }

    /// Ends the stage with a line.
    pub fn end(&mut self, line: &str) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if !self.quiet {
            print_line(&format!("{:<12} {line} ({:.1} s)", self.stage, self.started.elapsed().as_secs_f64()));
        }
    }

    /// A line of its own about the stage.
    pub fn say_of_stage(&self, line: &str) {
        self.say(&format!("{:<12} {line}", self.stage));
    }

    /// Shows the fraction done of something that takes long, on a terminal; it may be called from any thread. False
    /// as soon as the work is to stop.
    pub fn ticker(&self, what: &str) -> impl Fn(f64) -> bool + Sync + use<> {
        let (bar, what, stop) = (self.bar.clone(), what.to_owned(), self.stop.clone());
        move |done| {
            if let Some(bar) = bar.as_ref().filter(|_| done < 1.0) {
                bar.set_message(format!("{what} {:.0} %", 100.0 * done));
            }
            !stop.load(Ordering::Relaxed)
        }
    }

    /// A line of its own.
    pub fn say(&self, line: &str) {
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.println(line),
            None => print_line(line),
        }
    }
}

/// A line on stderr; a reader that closed the pipe is no error.
pub fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}
