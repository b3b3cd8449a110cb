//! The skin and the maps as stages read them.

use crate::Error;
use crate::config::{Channel as ConfigChannel, MapRef, WrapMode};
use crate::format::image::{self, Channel};
use crate::format::{nurbs, ply};
use crate::project::{InputFile, Project, SkinAt};
use pelage_geom::{Bvh, Mesh, Pose, SurfacePoint, TiledMap, Topology, Vec3, Wrap};
use std::cell::OnceCell;

/// The rest skin with everything that is found on it once.
#[derive(Debug)]
pub struct Skin {
    /// The mesh at rest.
    pub mesh: Mesh,
    /// Its connectivity.
    pub topology: Topology,
    /// Its rest pose.
    pub rest: Pose,
    /// What the file had odd.
    pub warnings: Vec<String>,
    /// Polygons in its file.
    faces: usize,
    bvh: OnceCell<Bvh>,
}

/// The skin at one frame.
pub type SkinPose = Pose;

impl Skin {
    /// Reads the rest pose of a project.
    pub fn read(project: &Project) -> Result<Self, Error> {
        Self::from_file(project.rest.as_ref().expect("a shot with a skin"))
    }

    fn from_file(file: &InputFile) -> Result<Self, Error> {
        let patches = nurbs::is_nurbs(&file.path);
        let read = if patches { nurbs::read_mesh(&file.path)? } else { ply::read_mesh(&file.path)? };
        let mesh = read.mesh;
        if mesh.corner_uv.is_empty() {
            let what = format!("{}: the skin has no texture coordinates", file.label);
            let hint = "hair is placed by texture coordinates: unwrap the mesh and write s, t (or u, v) per vertex";
            return Err(Error::input(what, hint));
        }
        let topology = Topology::new(&mesh);
        let area: f64 = topology.area.iter().sum();
        if !(area.is_finite() && area > 0.0) {
            let what = format!("{}: the skin's area is {area} square scene units", file.label);
            return Err(Error::input(what, "hair needs a surface: check the scale of the mesh"));
        }
        let rest = Pose::new(&mesh, &topology, mesh.position.clone());
        let c = topology.counts;
        let mut warnings: Vec<String> = read.warnings.iter().map(|w| format!("{}: {w}", file.label)).collect();
        for (n, what) in [
            (c.zero_area, "triangles without area carry no hair"),
            (c.zero_uv_area, "triangles without area in (u, v): tangents come from their neighbours"),
            (c.non_manifold_edges, "edges that do not join exactly two triangles"),
        ] {
            if n > 0 {
                warnings.push(format!("{}: {n} {what}", file.label));
            }
        }
        Ok(Skin { mesh, topology, rest, warnings, faces: read.faces, bvh: OnceCell::new() })
    }

    /// Closest-point structure over the rest pose.
    pub fn bvh(&self) -> &Bvh {
        self.bvh.get_or_init(|| Bvh::build(&self.mesh.position, &self.mesh.triangle, &self.topology))
    }

    /// Corners at rest of the triangle that a point is on.
    pub fn corners(&self, p: &SurfacePoint) -> [Vec3; 3] {
        pelage_geom::mesh::corners(&self.mesh.position, self.mesh.triangle[p.triangle as usize])
    }

    /// Polygons in its file.
    pub fn faces(&self) -> usize {
        self.faces
    }

    /// Area of the rest skin, square scene units.
    pub fn area(&self) -> f64 {
        self.topology.area.iter().sum()
    }

    /// Point that exported positions are relative to: the scene's origin, unless the skin is so far from it (100 times
    /// its size) that single precision would show; then the middle of the rest skin.
    pub fn origin(&self) -> [f64; 3] {
        let (low, high) = self.mesh.bounds();
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let size = (Vec3::from(high) - Vec3::from(low)).norm();
        if Vec3::from(middle).norm() > 100.0 * size { middle } else { [0.0; 3] }
    }

    /// Smooth unit normal at a point of a pose.
    pub fn normal(&self, pose: &SkinPose, p: &SurfacePoint) -> [f32; 3] {
        let n = pose.frame(&self.mesh, &self.topology, p).n;
        [n.x as f32, n.y as f32, n.z as f32]
    }

    /// The skin at a frame.
    pub fn pose(&self, at: &SkinAt) -> Result<SkinPose, Error> {
        let position = match at {
            SkinAt::Rest => return Ok(self.rest.clone()),
            SkinAt::Rigid(t) => self.mesh.position.iter().map(|p| t.apply(Vec3::from(*p)).into()).collect(),
            SkinAt::File(file) if nurbs::is_nurbs(&file.path) => {
                nurbs::read_frame(&file.path, self.mesh.position.len())?
            }
            SkinAt::File(file) => ply::read_frame(&file.path, self.mesh.position.len(), self.faces)?,
        };
        Ok(Pose::new(&self.mesh, &self.topology, position))
    }
}

/// What a map's texels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texel {
    /// One linear value.
    Value,
    /// Three linear values: a direction.
    Direction,
    /// A colour: sRGB in integer formats.
    Color,
}

/// Reads a map's tiles. Oddities go to `warnings`.
pub fn read_map(
    tiles: &[(u32, InputFile)],
    m: &MapRef,
    texel: Texel,
    warnings: &mut Vec<String>,
) -> Result<TiledMap, Error> {
    let channel = match m.channel {
        _ if texel != Texel::Value => Channel::Rgb,
        ConfigChannel::Grey => Channel::Auto,
        ConfigChannel::R => Channel::R,
        ConfigChannel::G => Channel::G,
        ConfigChannel::B => Channel::B,
        ConfigChannel::A => Channel::A,
    };
    let wrap = match m.wrap {
        WrapMode::Clamp => Wrap::Clamp,
        WrapMode::Repeat => Wrap::Repeat,
    };
    let mut read = |(number, file): &(u32, InputFile)| {
        let read = image::read_map(&file.path, channel, texel == Texel::Color)?;
        warnings.extend(read.warnings.iter().map(|w| format!("{}: {w}", file.label)));
        Ok((*number, read.map))
    };
    Ok(TiledMap { tiles: tiles.iter().map(&mut read).collect::<Result<_, Error>>()?, wrap })
}
