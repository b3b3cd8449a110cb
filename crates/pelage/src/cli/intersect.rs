//! `pelage intersect`: which hairs run through each other, or through ellipsoids.

use super::print;
use crate::Error;
use crate::curves;
use pelage_geom::{Offsets, Strands, Vec3, curve};
use pelage_groom::chain::ellipsoid::{Ellipsoid, contacts};
use pelage_groom::chain::{Chains, pairs::check};
use pelage_groom::spline::BSpline;
use serde::Serialize;
use std::path::PathBuf;

/// Control points of a spline a point of the curve that it stands for.
const CONTROL: f64 = 0.5;

/// Hairs and ellipsoids of `pelage intersect`.
#[derive(Debug, clap::Args)]
pub struct IntersectArguments {
    /// Curves
    pub curves: PathBuf,
    /// Frame of the file; its first if not given
    #[arg(long)]
    pub frame: Option<f64>,
    /// Diameter of hairs, scene units; that of the file if not given
    #[arg(long)]
    pub width: Option<f64>,
    /// Distance up to which pairs are counted as near, scene units
    #[arg(long, default_value_t = 0.0)]
    pub margin: f64,
    /// Take hairs for cubic B-splines, in chains of cylinders that are wider than them by this at most, scene units
    #[arg(long)]
    pub spline: Option<f64>,
    /// An ellipsoid: centre and semi-axes, X,Y,Z,A,B,C; may be given again
    #[arg(long, value_parser = parse_ellipsoid, allow_hyphen_values = true)]
    pub ellipsoid: Vec<Body>,
    /// Pairs and contacts that the report names
    #[arg(long, default_value_t = 5)]
    pub worst: usize,
    /// JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// An ellipsoid along the axes.
#[derive(Clone, Debug)]
pub struct Body(Ellipsoid);

fn parse_ellipsoid(text: &str) -> Result<Body, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    let Some([x, y, z, a, b, c]) = numbers.and_then(|n| <[f64; 6]>::try_from(n).ok()) else {
        return Err(format!("`{text}` is not an ellipsoid: write X,Y,Z,A,B,C, its centre and semi-axes"));
    };
    Ellipsoid::new(Vec3::new(x, y, z), nalgebra::UnitQuaternion::identity(), Vec3::new(a, b, c)).map(Body)
}

#[derive(Debug, Serialize)]
struct Report {
    hairs: usize,
    links: usize,
    near: usize,
    meeting: usize,
    hairs_meeting: usize,
    deepest: f64,
    worst: Vec<Named>,
    ellipsoids: Vec<Touched>,
}

#[derive(Debug, Serialize)]
struct Named {
    hair: [u64; 2],
    gap: f64,
}

#[derive(Debug, Serialize)]
struct Touched {
    near: usize,
    hairs_meeting: usize,
    deepest: f64,
    deepest_hair: Option<u64>,
}

/// Looks for hairs that meet; true if none do.
pub fn run(a: &IntersectArguments) -> Result<bool, Error> {
    let found = report(a)?;
    let free = found.meeting == 0 && found.ellipsoids.iter().all(|e| e.hairs_meeting == 0);
    if a.json {
        print(&(serde_json::to_string_pretty(&found).expect("plain JSON") + "\n"));
        return Ok(free);
    }
    let mut out = format!(
        "{} hairs of {} links: {} pairs meet ({} hairs), {} come within {}\n",
        found.hairs, found.links, found.meeting, found.hairs_meeting, found.near, a.margin
    );
    if found.meeting > 0 {
        out += &format!("deepest: {:.6}\n", found.deepest);
    }
    for w in &found.worst {
        out += &format!("  {} and {}: gap {:.6}\n", w.hair[0], w.hair[1], w.gap);
    }
    for (k, e) in found.ellipsoids.iter().enumerate() {
        out += &format!("ellipsoid {k}: {} hairs meet it, {} links come near\n", e.hairs_meeting, e.near);
        if let Some(hair) = e.deepest_hair {
            out += &format!("  {hair} is the deepest: {:.6}\n", -e.deepest);
        }
    }
    print(&out);
    Ok(free)
}

fn report(a: &IntersectArguments) -> Result<Report, Error> {
    let file = curves::read(&a.curves, a.frame)?;
    let wrong = |e: String| Error::input(format!("{}: {e}", a.curves.display()), "");
    if a.width.is_none() && file.layers.iter().any(|l| l.width.len() != l.strands.position.len()) {
        let help = "say how thick hairs are: --width DIAMETER, in scene units";
        return Err(Error::input(format!("{} has no widths", a.curves.display()), help));
    }
    let Strands { offsets, origin, position, id, .. } = file.joined();
    let radius: Vec<f32> = match a.width {
        Some(width) => vec![0.5 * width as f32; position.len()],
        None => file.layers.iter().flat_map(|l| &l.width).map(|w| 0.5 * w).collect(),
    };
    let chains = match a.spline {
        None => Chains::of_polylines(&position, &offsets, &radius),
        Some(tolerance) => splines(&position, &offsets, &radius, tolerance),
    };
    let chains = chains.map_err(wrong)?;
    let found = check(&chains, a.margin, a.worst).map_err(wrong)?;
    let named = |h: u32| id[h as usize];
    let ellipsoid = |body: &Body| {
        let at = body.0.moved(-Vec3::from(origin));
        let near = contacts(&chains, &at, a.margin);
        let mut meeting: Vec<u32> = near.iter().filter(|c| c.gap < 0.0).map(|c| c.hair).collect();
        meeting.dedup();
        let deepest = near.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).filter(|c| c.gap < 0.0);
        Touched {
            near: near.len(),
            hairs_meeting: meeting.len(),
            deepest: deepest.map_or(0.0, |c| c.gap),
            deepest_hair: deepest.map(|c| named(c.hair)),
        }
    };
    Ok(Report {
        hairs: found.hairs,
        links: (0..chains.len()).map(|s| chains.links(s)).sum(),
        near: found.near,
        meeting: found.meeting,
        hairs_meeting: found.hairs_meeting,
        deepest: found.deepest,
        worst: found.worst.iter().map(|p| Named { hair: p.hair.map(named), gap: p.gap }).collect(),
        ellipsoids: a.ellipsoid.iter().map(ellipsoid).collect(),
    })
}

/// Chains around the cubic B-splines nearest to polylines.
fn splines(position: &[[f32; 3]], offsets: &Offsets, radius: &[f32], tolerance: f64) -> Result<Chains, String> {
    let spline = |h: usize| {
        let run = offsets.range(h);
        let line: Vec<Vec3> = position[run].iter().map(|p| Vec3::from(p.map(f64::from))).collect();
        // A spline needs four points.
        let line = if line.len() < 4 { curve::resample(&line, 4) } else { line };
        let m = ((line.len() as f64 * CONTROL).ceil() as usize).max(4);
        BSpline::near(&line, m).map_err(|e| format!("hair {h}: {e}"))
    };
    let curves: Vec<BSpline> = (0..offsets.len()).map(spline).collect::<Result<_, _>>()?;
    let widest = |h: usize| radius[offsets.range(h)].iter().fold(0.0f32, |a, b| a.max(*b));
    let radius: Vec<f64> = (0..offsets.len()).map(|h| f64::from(widest(h))).collect();
    Chains::of_splines(&curves, &radius, tolerance)
}
