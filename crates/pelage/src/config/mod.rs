//! Shot and groom files.
