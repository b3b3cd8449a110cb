//! The stages of a shot. `plan` says what each step reads; a stage file runs its steps: read, call one pure function,
//! write.

mod areas;
mod body;
mod clumps;
mod clusters;
mod explain;
mod guides;
mod kept;
mod look;
mod plan;
mod plan_groom;
mod plan_kept;
mod plan_light;
mod plan_look;
mod plan_picture;
mod plan_simulate;
mod reasons;
mod run;
mod skin;

pub mod comb;
pub mod curves;
pub mod export;
pub mod groom;
pub mod heat;
pub mod instance;
pub mod interpolate;
pub mod preview;
pub mod shadow;
pub mod simulate;
pub mod tables;

pub use plan::{Plan, Step, What, candidate_density, layer_seed};
pub use run::{Options, Pictures, PlannedStage, Runner};
pub use skin::{Skin, SkinPose};

/// A stage, in the order of the flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Control hairs placed and combed; once per groom.
    Groom,
    /// Roots, weights and features of every hair; once per groom.
    Instance,
    /// Hair in motion, one stretch of frames after another.
    Simulate,
    /// Every hair at every frame.
    Interpolate,
    /// Light that arrives at every point of every hair.
    Shadow,
    /// Files for other programs.
    Export,
    /// Pictures.
    Preview,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Stage; 7] = [
        Stage::Groom,
        Stage::Instance,
        Stage::Simulate,
        Stage::Interpolate,
        Stage::Shadow,
        Stage::Export,
        Stage::Preview,
    ];

    /// Name as typed on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Groom => "groom",
            Stage::Instance => "instance",
            Stage::Simulate => "simulate",
            Stage::Interpolate => "interpolate",
            Stage::Shadow => "shadow",
            Stage::Export => "export",
            Stage::Preview => "preview",
        }
    }
}
