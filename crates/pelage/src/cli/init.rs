//! `pelage init`: a new shot folder that runs as it is.

use super::{Sample, print};
use crate::Error;
use crate::format::ply;
use crate::sample;
use std::path::Path;

/// Makes the folder from a sample, or around a skin of the user's.
pub fn init(dir: &Path, skin: Option<&Path>, meters_per_unit: f64, kind: Sample) -> Result<bool, Error> {
    if dir.read_dir().is_ok_and(|mut d| d.next().is_some()) {
        let hint = "name a new folder: init never writes over files";
        return Err(Error::input(format!("{} is not empty", dir.display()), hint));
    }
    let files = match skin {
        None => sample::files(kind),
        Some(path) => {
            let mesh = ply::read_mesh(path)?.mesh;
            if mesh.corner_uv.is_empty() {
                let hint = "unwrap the mesh and write s, t (or u, v) per vertex";
                return Err(Error::input(format!("{} has no texture coordinates", path.display()), hint));
            }
            if !(meters_per_unit.is_finite() && meters_per_unit > 0.0) {
                return Err(Error::input("--meters-per-unit must be above 0", "1 for metres, 0.01 for centimetres"));
            }
            let bytes = std::fs::read(path).map_err(Error::disk(path))?;
            sample::around(bytes, &mesh, meters_per_unit)
        }
    };
    sample::write(dir, &files)?;
    print(&format!("made {} files in {d}\nnext: cd {d} && pelage run\n", files.len(), d = dir.display()));
    Ok(true)
}
