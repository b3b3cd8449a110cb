//! Hair under light: shadow of hair on hair, shading and the preview rasteriser.
//!
//! Colours are linear with the primaries of sRGB, unless a name says otherwise. The camera looks along +z of its own
//! frame, x to the right and y down; pixel (i, j) covers [i, i + 1] x [j, j + 1], the first row on top.
//! Every picture is the same bytes for any number of threads.

pub mod camera;
mod hair;
pub mod heat;
pub mod image;
pub mod preview;
mod raster;
pub mod shade;
pub mod shadow;
mod shorten;
mod skin_map;
mod slab;
pub mod visible;

pub use camera::{Camera, View};
pub use image::{Image, Tone, contact_sheet};
pub use preview::{HairView, Region, RenderCounts, Scene, Settings, SkinView, render, render_region};
pub use shade::{HairShade, Light, studio_lights};
pub use shorten::shortened;

/// A point or direction in camera space, single precision: relative to the eye, so exact near it.
pub(crate) type V3 = nalgebra::Vector3<f32>;
