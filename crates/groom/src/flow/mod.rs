//! Hair as streamlines of ideal flow around a body.
//!
//! After Hadap, Magnenat-Thalmann, "Hair shape as streamlines of fluid flow" (course notes 2003): a stream, sources and
//! vortices that a person places ([`Element`]); a body whose panels are sources of such strengths that the flow through
//! them is what a map says ([`Body`], the paper's equations 6 to 9); hair that follows the sum ([`trace`]). The paper
//! puts a point source under each panel; here the panel itself is the source, so that there is no offset to choose and
//! less flow leaks between the panels.
//!
//! The flow through a panel is what is asked at its centre only. Near the edges of a wall it goes in and out, and
//! inside the body it does not rest: a streamline that gets in crosses the body. Measured on spheres of 192 and 768
//! panels in a stream of speed 1: where the wall lets 0.3 through, no streamline comes in that starts a tenth of a
//! panel's edge above it; where it lets nothing through, about 2 % of those do that start 0.3 edges above it, and most
//! that start right on it. So whatever the panels, let a [`trace::Guard`] hold points outside.
//!
//! A flow is cheap to edit: the matrix of a body is factored once ([`Body::new`]), and after a change of elements or of
//! the map only [`Body::solve`] is needed, as it is for every frame of moving elements. To trace many hairs, sum the
//! panels in a tree and keep the sum in a grid: [`Fast`], [`Grid`]. [`Flow::velocity`] is the plain sum to compare
//! with.

mod body;
mod coarse;
mod element;
mod grid;
mod panel;
#[cfg(test)]
pub(crate) mod test_laws;
pub mod trace;
mod tree;
pub mod trim;

pub use body::{Body, Factored, FlowError};
pub use coarse::coarse;
pub use element::Element;
pub(crate) use element::segment;
pub use grid::Grid;
pub use panel::Panel;
pub use tree::{Fast, OPENING};

use pelage_geom::Vec3;

/// A flow as a sum: elements, and a body with the strengths of its panels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flow<'a> {
    /// The elements.
    pub elements: &'a [Element],
    /// \[N\] the panels of a body; none for a flow without a body.
    pub panels: &'a [Panel],
    /// \[N\] source strength of each panel, from [`Body::solve`].
    pub strength: &'a [f64],
}

impl Flow<'_> {
    /// Velocity at a point, summed over all elements and panels. At a panel's centre the sides are taken as they come
    /// in rounding: see [`Flow::velocity_at_panel`].
    pub fn velocity(&self, at: Vec3) -> Vec3 {
        let panels = self.panels.iter().zip(self.strength);
        panels.fold(self.by_elements(at), |v, (p, s)| v + p.velocity(at) * *s)
    }

    /// Velocity just outside the centre of panel `i`: what is prescribed is its component along the panel's normal.
    pub fn velocity_at_panel(&self, i: usize) -> Vec3 {
        let at = self.panels[i].centre;
        let panels = self.panels.iter().zip(self.strength).enumerate();
        panels.fold(self.by_elements(at), |v, (j, (p, s))| {
            v + if i == j { p.velocity_at_centre() } else { p.velocity(at) } * *s
        })
    }

    /// Velocity by the elements alone.
    pub fn by_elements(&self, at: Vec3) -> Vec3 {
        self.elements.iter().fold(Vec3::zeros(), |v, e| v + e.velocity(at))
    }
}
