//! Where a prim is: the product of the transform operations of it and what it hangs from (UsdGeomXformable).

use super::curves::value_at;
use super::read::{CrateFile, Node};
use crate::format::FormatError;

type Result<T> = std::result::Result<T, FormatError>;

/// A transform of row vectors, p' = p M, as USD writes them: the fourth row is the translation.
pub(super) type Matrix = [[f64; 4]; 4];

/// No transform.
pub(super) const IDENTITY: Matrix =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// First `a`, then `b`.
pub(super) fn then(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Determinant of the part that is not translation.
pub(super) fn determinant(m: &Matrix) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// The transform from the space of `prim` to the space of the scene at `frame`. What cannot be followed is noted.
pub(super) fn local_to_world(
    file: &mut CrateFile,
    prim: Node,
    frame: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Matrix> {
    let mut world = IDENTITY;
    let mut next = Some(prim);
    while let Some(node) = next {
        let (local, reset) = local(file, node, frame, notes)?;
        world = then(&world, &local);
        next = if reset { None } else { file.parent(node) };
    }
    Ok(world)
}

/// The transform of one prim, and whether it leaves its parent's aside.
fn local(file: &mut CrateFile, prim: Node, frame: Option<f64>, notes: &mut Vec<String>) -> Result<(Matrix, bool)> {
    let mut matrix = IDENTITY;
    let order = match file.attribute(prim, "xformOpOrder").and_then(|a| file.field(a, "default")) {
        Some(rep) => file.tokens(rep)?,
        None => return Ok((matrix, false)),
    };
    // The last operation is applied to the points first.
    let mut reset = false;
    for op in order.iter().rev() {
        if op == "!resetXformStack!" {
            reset = true;
            break;
        }
        let (name, inverse) = op.strip_prefix("!invert!").map_or((op.as_str(), false), |n| (n, true));
        let kind = name.split(':').nth(1).unwrap_or("");
        let Some(attribute) = file.attribute(prim, name) else { continue };
        let Some(values) = value_at(file, attribute, frame)? else { continue };
        match operation(kind, &values).map(|m| if inverse { invert(&m) } else { Some(m) }) {
            Some(Some(m)) => matrix = then(&matrix, &m),
            Some(None) => notes.push(format!("{}: {op} cannot be inverted and was ignored", file.name(prim))),
            None => notes.push(format!("{}: the transform operation {op} was ignored", file.name(prim))),
        }
    }
    Ok((matrix, reset))
}

/// The matrix of an operation, `None` if it is not known.
fn operation(kind: &str, v: &[f64]) -> Option<Matrix> {
    let mut m = IDENTITY;
    match (kind, v.len()) {
        ("translate", 3) => m[3][..3].copy_from_slice(v),
        ("scale", 3) => (0..3).for_each(|i| m[i][i] = v[i]),
        ("transform", 16) => m = std::array::from_fn(|i| std::array::from_fn(|j| v[4 * i + j])),
        ("orient", 4) => m = from_quaternion([v[0], v[1], v[2]], v[3])?,
        ("rotateX" | "rotateY" | "rotateZ", 1) => m = rotation(kind.as_bytes()[6], v[0]),
        (_, 3) => {
            let axes = kind.strip_prefix("rotate").filter(|a| a.len() == 3)?;
            for axis in axes.bytes() {
                let angle = v[usize::from(axis.checked_sub(b'X')?)..].first()?;
                m = then(&m, &rotation(axis, *angle));
            }
        }
        _ => return None,
    }
    Some(m)
}

/// A rotation by `degrees` about X, Y or Z.
fn rotation(axis: u8, degrees: f64) -> Matrix {
    let (s, c) = libm::sincos(degrees.to_radians());
    let (i, j) = match axis {
        b'X' => (1, 2),
        b'Y' => (2, 0),
        _ => (0, 1),
    };
    let mut m = IDENTITY;
    (m[i][i], m[i][j], m[j][i], m[j][j]) = (c, s, -s, c);
    m
}

/// The rotation of a quaternion with imaginary part `v` and real part `r`, of any length but zero.
fn from_quaternion(v: [f64; 3], r: f64) -> Option<Matrix> {
    let n = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + r * r).sqrt();
    // USD takes the angle from the real part alone. Where rounding is all that keeps it from a unit, so is it here,
    // to agree with USD; between two samples it is far from one.
    let r = if (n - 1.0).abs() < 1e-5 { r.clamp(-1.0, 1.0) } else { r / n };
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let scale = if length > 0.0 { (1.0 - r * r).max(0.0).sqrt() / length } else { 0.0 };
    let [x, y, z] = v.map(|c| c * scale);
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * r), 2.0 * (x * z - y * r), 0.0],
        [2.0 * (x * y - z * r), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * r), 0.0],
        [2.0 * (x * z + y * r), 2.0 * (y * z - x * r), 1.0 - 2.0 * (x * x + y * y), 0.0],
    ];
    (n > 0.0 && n.is_finite()).then_some([rows[0], rows[1], rows[2], IDENTITY[3]])
}

/// The inverse of an affine transform, `None` if it flattens space.
fn invert(m: &Matrix) -> Option<Matrix> {
    let det = determinant(m);
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    let cofactor = |i: usize, j: usize| {
        let (a, b, c, d) = ((j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3);
        (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / det
    };
    let rows: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| cofactor(i, j)));
    let back = |j: usize| -(0..3).map(|k| m[3][k] * rows[k][j]).sum::<f64>();
    let [x, y, z] = rows.map(|[a, b, c]| [a, b, c, 0.0]);
    let out = [x, y, z, [back(0), back(1), back(2), 1.0]];
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(m: &Matrix, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| p[0] * m[0][j] + p[1] * m[1][j] + p[2] * m[2][j] + m[3][j])
    }

    fn close(a: [f64; 3], b: [f64; 3]) {
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-12), "{a:?} {b:?}");
    }

    #[test]
    fn rotations_turn_the_right_way() {
        close(apply(&operation("rotateX", &[90.0]).unwrap(), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        close(apply(&operation("rotateY", &[90.0]).unwrap(), [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        close(apply(&operation("rotateZ", &[90.0]).unwrap(), [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        // X is turned first: y goes to z, which the turn about Z leaves alone.
        close(apply(&operation("rotateXYZ", &[90.0, 0.0, 90.0]).unwrap(), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        let half = 0.5f64.sqrt();
        close(apply(&operation("orient", &[half, 0.0, 0.0, half]).unwrap(), [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert!(operation("rotateXYA", &[1.0; 3]).is_none() && operation("shear", &[1.0; 3]).is_none());
        assert!(operation("orient", &[0.0; 4]).is_none());
    }

    #[test]
    fn an_inverse_undoes() {
        let turn = operation("rotateZYX", &[10.0, 20.0, 30.0]).unwrap();
        let stretch = operation("scale", &[2.0, -3.0, 0.5]).unwrap();
        let shift = operation("translate", &[1.0, 2.0, 3.0]).unwrap();
        let m = then(&then(&stretch, &turn), &shift);
        assert!((determinant(&m) + 3.0).abs() < 1e-12);
        let p = [0.3, -0.7, 1.9];
        close(apply(&invert(&m).unwrap(), apply(&m, p)), p);
        assert!(invert(&operation("scale", &[1.0, 0.0, 1.0]).unwrap()).is_none());
    }
}
