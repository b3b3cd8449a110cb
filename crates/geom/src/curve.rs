//! Polylines: length, resampling, closest point.
