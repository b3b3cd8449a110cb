//! Hair under light: shading and the preview rasteriser.
