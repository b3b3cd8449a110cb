//! End-to-end, golden, determinism, cache and command-line tests.
