//! Writes skins: positions, texture coordinates and triangles, binary little-endian.

use pelage_geom::Mesh;
use ply_rs::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;
use std::collections::BTreeMap;

/// A PLY file of a mesh: float `x y z s t`, one vertex per (position, texture coordinate), in order of first use by the
/// triangles. Positions are written in single precision.
pub fn mesh_bytes(mesh: &Mesh) -> Vec<u8> {
    let mut index = BTreeMap::new();
    let (mut vertices, mut faces): (Vec<DefaultElement>, Vec<DefaultElement>) = (Vec::new(), Vec::new());
    for (t, triangle) in mesh.triangle.iter().enumerate() {
        let mut corners = Vec::with_capacity(3);
        for (k, v) in triangle.iter().enumerate() {
            let uv = mesh.corner_uv.get(t).map_or([0.0; 2], |c| c[k]);
            let next = vertices.len() as u32;
            let at = *index.entry((*v, uv.map(f32::to_bits))).or_insert(next);
            if at == next {
                let [x, y, z] = mesh.position[*v as usize].map(|p| p as f32);
                let values = [("x", x), ("y", y), ("z", z), ("s", uv[0]), ("t", uv[1])];
                vertices.push(values.into_iter().map(|(n, p)| (n.to_owned(), Property::Float(p))).collect());
            }
            corners.push(at);
        }
        faces.push([("vertex_indices".to_owned(), Property::ListUInt(corners))].into_iter().collect());
    }
    let mut ply = Ply::<DefaultElement>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    let mut vertex = ElementDef::new("vertex".to_owned());
    for name in ["x", "y", "z", "s", "t"] {
        vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(ScalarType::Float)));
    }
    let mut face = ElementDef::new("face".to_owned());
    let corners = PropertyType::List(ScalarType::UChar, ScalarType::UInt);
    face.properties.add(PropertyDef::new("vertex_indices".to_owned(), corners));
    ply.header.elements.add(vertex);
    ply.header.elements.add(face);
    ply.payload.insert("vertex".to_owned(), vertices);
    ply.payload.insert("face".to_owned(), faces);
    let mut out = Vec::new();
    Writer::new().write_ply(&mut out, &mut ply).expect("writing a consistent mesh to memory does not fail");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_written_mesh_reads_back_as_the_same_surface() {
        let mesh = pelage_geom::shapes::cube_sphere(3, 2.0);
        let read = super::super::parse_mesh(Path::new("m.ply"), &mesh_bytes(&mesh)).unwrap().mesh;
        assert_eq!(read.corner_uv, mesh.corner_uv);
        for t in 0..mesh.triangle.len() as u32 {
            for (a, b) in mesh.corners(t).iter().zip(read.corners(t)) {
                assert!((a - b).norm() < 1e-6);
            }
        }
    }
}
