//! How a layer of hair is simulated: material, model, ends, and the numbers of the method.

use crate::SimError;
use crate::lanes::Width;

/// What hair is made of. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Diameter of the round section, metres.
    pub diameter: f64,
    /// Young's modulus, pascals.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kilograms per cubic metre.
    pub density: f64,
    /// Relaxation time of bending and twisting, seconds: internal damping is this times stiffness.
    pub damping: f64,
    /// Artist's factor on bending stiffness.
    pub bend_factor: f64,
    /// Artist's factor on twisting stiffness.
    pub twist_factor: f64,
    /// Artist's factor on stretching stiffness.
    pub stretch_factor: f64,
    /// Artist's factor on air drag.
    pub drag_factor: f64,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            diameter: 70e-6,
            young: 3.9e9,
            poisson: 0.3,
            density: 1300.0,
            damping: 2e-3,
            bend_factor: 1.0,
            twist_factor: 1.0,
            stretch_factor: 1.0,
            drag_factor: 1.0,
        }
    }
}

/// Model of a strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Discrete elastic rod.
    #[default]
    Rod,
    /// Springs with altitude springs, calibrated to the material, robust integration.
    Springs,
    /// Springs with the paper's nine steps.
    Paper,
}

/// How an end of a strand is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum End {
    /// Not at all.
    #[default]
    Free,
    /// Its point, free to turn.
    Pinned,
    /// Its point, its direction, and its turn about it.
    Clamped,
}

/// How a layer is simulated; constant over a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Model of a strand.
    pub model: Model,
    /// What the hair is made of.
    pub material: Material,
    /// How roots are held.
    pub root: End,
    /// How tips are held.
    pub tip: End,
    /// Segments of a strand, equal in arc length; `None`: the input's points as they are.
    pub segments: Option<usize>,
    /// Steps in a span; `None`: chosen from the prescribed motion.
    pub substeps: Option<u32>,
    /// A stage ends when no segment would turn by more than this in all later iterations, radians. Above 1e-4 what is
    /// left over spoils the guess of the next step, and costs accuracy and time; below 1e-7 steps take one more iteration
    /// for nothing that can be seen.
    pub tolerance: f64,
    /// A strand that turns farther than this in a step takes smaller ones, radians.
    pub largest_turn: f64,
    /// Start in equilibrium under gravity.
    pub sag_free: bool,
    /// Largest strain that limiting leaves in a segment.
    pub strain_limit: f64,
    /// Coulomb friction with the body.
    pub friction: f64,
    /// Distance that hair keeps from the body, metres.
    pub offset: f64,
    /// A root that moves farther than this in a span takes its hair along without dynamics, metres.
    pub teleport: f64,
    /// Let strands at rest sleep.
    pub sleep: bool,
    /// Use the widest lanes of the processor. Changes no bit of the result.
    pub wide: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            model: Model::Rod,
            root: End::Clamped,
            tip: End::Free,
            material: Material::default(),
            segments: None,
            substeps: None,
            tolerance: 1e-5,
            largest_turn: 0.2,
            sag_free: true,
            strain_limit: 0.01,
            friction: 0.3,
            offset: 0.5e-3,
            teleport: 1.0,
            sleep: true,
            wide: true,
        }
    }
}

impl Settings {
    /// Registers to use.
    pub fn width(&self) -> Width {
        if self.wide { Width::widest() } else { Width::Plain }
    }

    /// Checks the ranges.
    pub fn check(&self) -> Result<(), SimError> {
        self.material.check()?;
        positive("tolerance", self.tolerance)?;
        positive("largest_turn", self.largest_turn)?;
        positive("strain_limit", self.strain_limit)?;
        positive("teleport", self.teleport)?;
        at_least_0("friction", self.friction)?;
        at_least_0("offset", self.offset)
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), SimError> {
    let ok = value.is_finite() && value > 0.0;
    if ok { Ok(()) } else { Err(SimError::Setting { name, value, expected: "a number above 0" }) }
}

fn at_least_0(name: &'static str, value: f64) -> Result<(), SimError> {
    let ok = value.is_finite() && value >= 0.0;
    if ok { Ok(()) } else { Err(SimError::Setting { name, value, expected: "a number of at least 0" }) }
}

impl Material {
    /// Checks the ranges.
    pub fn check(&self) -> Result<(), SimError> {
        positive("diameter", self.diameter)?;
        positive("young", self.young)?;
        positive("density", self.density)?;
        positive("bend_factor", self.bend_factor)?;
        positive("twist_factor", self.twist_factor)?;
        positive("stretch_factor", self.stretch_factor)?;
        at_least_0("drag_factor", self.drag_factor)?;
        at_least_0("damping", self.damping)?;
        if !(self.poisson > -1.0 && self.poisson <= 0.5) {
            let expected = "above -1 and at most 0.5";
            return Err(SimError::Setting { name: "poisson", value: self.poisson, expected });
        }
        Ok(())
    }
}
