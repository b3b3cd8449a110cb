//! Cameras: where the eye is, how much it sees, and how to frame a groom without asking.

use pelage_geom::Vec3;

/// A pinhole camera, or a parallel one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the eye, scene units.
    pub eye: [f64; 3],
    /// A point in the middle of the picture, scene units.
    pub target: [f64; 3],
    /// Direction that is up in the picture; need not be unit or at right angles to the view.
    pub up: [f64; 3],
    /// Angle between the lower and the upper border of the picture, degrees, in (0, 180).
    pub fov_y_deg: f64,
    /// What is nearer than this along the view is not drawn, scene units, > 0.
    pub near: f64,
    /// Height of the picture in scene units for a parallel projection; `None` for perspective.
    pub parallel_height: Option<f64>,
}

/// Angle of view of automatic framing, degrees: a portrait lens. Wider distorts a head, narrower flattens its depth.
const FRAME_FOV_DEG: f64 = 28.0;
/// Part of the half picture left free around an automatic frame. Below 0.02 silhouettes touch the border.
const FRAME_MARGIN: f64 = 0.06;

/// A camera with a picture size: scene space to camera space to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the eye, scene units.
    pub eye: Vec3,
    /// Unit axes in scene space: right, down, forward.
    pub axis: [Vec3; 3],
    /// Pixels per scene unit: at distance 1 in perspective, everywhere in parallel projection.
    pub focal: f64,
    /// Pixel coordinates of the view axis.
    pub centre: [f64; 2],
    /// Nearest depth that is drawn, scene units, > 0.
    pub near: f64,
    /// True for parallel projection.
    pub parallel: bool,
}

impl Camera {
    /// Frames an axis-aligned box (low, high), scene units, seen along `direction` (from the camera to the scene), for
    /// pictures with `aspect` = width / height. All of the box is inside the picture with a small margin, and as large
    /// as it can be.
    pub fn frame(bounds: ([f64; 3], [f64; 3]), direction: [f64; 3], up: [f64; 3], aspect: f64) -> Camera {
        let (lo, hi) = bounds;
        let corner = (0..8).map(|k| std::array::from_fn::<f64, 3, _>(|i| if k >> i & 1 == 0 { lo[i] } else { hi[i] }));
        Camera::frame_points(corner, direction, up, aspect)
    }

    /// Frames a set of points, tighter than their box. Points that are not finite are passed over; without any, the
    /// camera stands one unit from the origin.
    pub fn frame_points(
        points: impl IntoIterator<Item = [f64; 3]>,
        direction: [f64; 3],
        up: [f64; 3],
        aspect: f64,
    ) -> Camera {
        let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
        let axis = axes(Vec3::from(direction), Vec3::from(up));
        let half = libm::tan(0.5 * FRAME_FOV_DEG.to_radians()) * (1.0 - FRAME_MARGIN);
        let slope = [half * aspect, half];
        // Sides of the pyramid that touch the points: with the eye at e, |x - ex| <= slope (z - ez) for all points.
        let mut side = [[f64::NEG_INFINITY; 2]; 2];
        let mut z = [f64::INFINITY, f64::NEG_INFINITY];
        for p in points {
            let p = Vec3::from(p);
            let c = axis.map(|a| a.dot(&p));
            if !c.iter().all(|v| v.is_finite()) {
                continue;
            }
            for i in 0..2 {
                side[i][0] = side[i][0].max(c[i] - slope[i] * c[2]);
                side[i][1] = side[i][1].max(-c[i] - slope[i] * c[2]);
            }
            z = [z[0].min(c[2]), z[1].max(c[2])];
        }
        if z[0] > z[1] {
            (side, z) = ([[0.0; 2]; 2], [0.0; 2]);
        }
        let reach = |i: usize| -(side[i][0] + side[i][1]) / (2.0 * slope[i]);
        let ez = reach(0).min(reach(1));
        let middle = 0.5 * (z[0] + z[1]);
        // A single point, or a box flat along the view: stand back by its own size, or by 1.
        let least = if z[1] > z[0] { 0.05 * (z[1] - z[0]) } else { 0.0 };
        let ez = if z[0] - ez > least.max(1e-12 * (1.0 + z[0].abs())) { ez } else { z[0] - least.max(1.0) };
        let place = |i: usize| 0.5 * (side[i][0] - side[i][1]);
        let at = |depth: f64| (axis[0] * place(0) + axis[1] * place(1) + axis[2] * depth).into();
        Camera {
            eye: at(ez),
            target: at(middle),
            up: (-axis[1]).into(),
            fov_y_deg: FRAME_FOV_DEG,
            near: 0.02 * (middle - ez),
            parallel_height: None,
        }
    }

    /// Frames points that are looked at from all sides: from `turns` places on a circle about the upright line through their
    /// middle, of which `direction` says the first. Returns the camera there and a point of the line.
    pub fn frame_turning(
        points: &[[f64; 3]],
        direction: [f64; 3],
        up: [f64; 3],
        aspect: f64,
        turns: u32,
    ) -> (Camera, [f64; 3]) {
        let finite = || points.iter().filter(|p| p.iter().all(|v| v.is_finite()));
        let axis = middle(finite().map(|p| Vec3::from(*p)));
        let turn = |k: u32| turn(Vec3::from(up), std::f64::consts::TAU * f64::from(k) / f64::from(turns.max(1)));
        let turned = (0..turns.max(1)).flat_map(|k| {
            let turn = turn(k);
            finite().map(move |p| (axis + turn * (Vec3::from(*p) - axis)).into())
        });
        (Camera::frame_points(turned, direction, up, aspect), axis.into())
    }

    /// The camera on its way round an upright line through a point, by an angle in radians.
    pub fn turned(&self, axis: [f64; 3], up: [f64; 3], angle: f64) -> Camera {
        let (axis, turn) = (Vec3::from(axis), turn(Vec3::from(up), angle));
        let at = |p: [f64; 3]| (axis + turn * (Vec3::from(p) - axis)).into();
        Camera { eye: at(self.eye), target: at(self.target), up: (turn * Vec3::from(self.up)).into(), ..*self }
    }

    /// The same view about the same middle, `by` times as large: a longer lens from the same place.
    pub fn zoomed(&self, by: f64) -> Camera {
        let by = if by > 0.0 && by.is_finite() { by } else { 1.0 };
        let half = libm::tan(0.5 * self.fov_y_deg.to_radians()) / by;
        Camera {
            fov_y_deg: 2.0 * libm::atan(half).to_degrees(),
            parallel_height: self.parallel_height.map(|h| h / by),
            ..*self
        }
    }

    /// The projection for a picture of `width` x `height` pixels. Nonsense (eye on target, up along the view, angle out
    /// of range) is replaced by something that can be drawn.
    pub fn view(&self, width: usize, height: usize) -> View {
        let eye = Vec3::from(self.eye);
        let forward = Vec3::from(self.target) - eye;
        let fov = if self.fov_y_deg > 0.0 && self.fov_y_deg < 179.0 { self.fov_y_deg } else { FRAME_FOV_DEG };
        let rows = height as f64;
        let focal = match self.parallel_height {
            Some(h) if h > 0.0 && h.is_finite() => rows / h,
            Some(_) => rows,
            None => 0.5 * rows / libm::tan(0.5 * fov.to_radians()),
        };
        View {
            eye,
            axis: axes(forward, Vec3::from(self.up)),
            focal,
            centre: [0.5 * width as f64, 0.5 * rows],
            near: if self.near > 0.0 && self.near.is_finite() { self.near } else { 1e-6 },
            parallel: self.parallel_height.is_some(),
        }
    }
}

impl View {
    /// Scene space to camera space (right, down, depth).
    pub fn to_camera(&self, p: Vec3) -> Vec3 {
        self.turn(p - self.eye)
    }

    /// A direction of scene space in camera space.
    pub fn turn(&self, d: Vec3) -> Vec3 {
        Vec3::new(self.axis[0].dot(&d), self.axis[1].dot(&d), self.axis[2].dot(&d))
    }

    /// Pixels per scene unit at a depth.
    pub fn scale(&self, depth: f64) -> f64 {
        if self.parallel { self.focal } else { self.focal / depth }
    }

    /// Pixel coordinates and depth of a point of scene space; `None` nearer than the near plane.
    pub fn project(&self, p: Vec3) -> Option<[f64; 3]> {
        let c = self.to_camera(p);
        let s = self.scale(c.z);
        (c.z >= self.near).then(|| [self.centre[0] + c.x * s, self.centre[1] + c.y * s, c.z])
    }
}

/// Middle of the bounds of finite points; the origin without any.
pub(crate) fn middle(points: impl Iterator<Item = Vec3>) -> Vec3 {
    let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(none, |(low, high), p| (low.inf(&p), high.sup(&p)));
    if low.x <= high.x { (low + high) * 0.5 } else { Vec3::zeros() }
}

/// Rotation by an angle about a direction, which need not be unit (Rodrigues' formula); none about no direction.
fn turn(up: Vec3, angle: f64) -> nalgebra::Matrix3<f64> {
    let Some(n) = unit(up) else { return nalgebra::Matrix3::identity() };
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let cross = n.cross_matrix();
    nalgebra::Matrix3::identity() + cross * sin + cross * cross * (1.0 - cos)
}

/// Right, down, forward; any of them made up where the input has none.
fn axes(forward: Vec3, up: Vec3) -> [Vec3; 3] {
    let f = unit(forward).unwrap_or(-Vec3::z());
    let side = |up: Vec3| unit(up).and_then(|u| unit(f.cross(&u)).filter(|_| f.cross(&u).norm() > 1e-6));
    let right = side(up).or_else(|| side(Vec3::y())).or_else(|| side(Vec3::z())).unwrap_or(Vec3::x());
    [right, f.cross(&right), f]
}

/// Unit vector, unless the length is zero or not finite.
fn unit(v: Vec3) -> Option<Vec3> {
    let big = v.amax();
    if !(big > 0.0 && big.is_finite()) {
        return None;
    }
    let v = v / big;
    Some(v / v.norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_framed_box_touches_the_margin_and_stays_inside() {
        let (w, h) = (640usize, 480usize);
        for direction in [[0.0, 0.0, -1.0], [1.0, -0.4, 0.3], [0.0, -1.0, 0.0], [-0.2, 0.9, 0.1]] {
            let (lo, hi) = ([-1.0, 20.0, 3.0], [5.0, 21.0, 4.5]);
            let camera = Camera::frame((lo, hi), direction, [0.0, 1.0, 0.0], 640.0 / 480.0);
            let view = camera.view(w, h);
            let mut reach: f64 = 0.0;
            for k in 0..8 {
                let p = Vec3::from_fn(|i, _| if k >> i & 1 == 0 { lo[i] } else { hi[i] });
                let [x, y, _] = view.project(p).expect("in front of the camera");
                reach = reach.max((x / 320.0 - 1.0).abs()).max((y / 240.0 - 1.0).abs());
            }
            assert!((reach - (1.0 - FRAME_MARGIN)).abs() < 1e-9, "{direction:?}: {reach}");
        }
    }

    #[test]
    fn zoom_scales_about_the_middle() {
        let camera = Camera::frame(([-1.0; 3], [1.0; 3]), [0.3, -0.2, -1.0], [0.0, 1.0, 0.0], 1.5);
        for camera in [camera, Camera { parallel_height: Some(3.0), ..camera }] {
            let p = Vec3::new(0.5, -0.7, 0.2);
            let at = |camera: Camera| camera.view(300, 200).project(p).expect("in front of the camera");
            let (one, three) = (at(camera), at(camera.zoomed(3.0)));
            for (i, middle) in [150.0, 100.0].into_iter().enumerate() {
                assert!((three[i] - middle - 3.0 * (one[i] - middle)).abs() < 1e-9, "{one:?} {three:?}");
            }
            assert_eq!(camera.zoomed(f64::NAN), camera.zoomed(1.0));
        }
    }

    #[test]
    fn a_turntable_sees_everything_from_every_side() {
        let points: Vec<[f64; 3]> =
            (0..40).map(|k| [f64::from(k % 7), f64::from(k % 5) * 0.3, f64::from(k) * 0.1]).collect();
        let (camera, axis) = Camera::frame_turning(&points, [0.2, -0.3, -1.0], [0.0, 1.0, 0.0], 1.5, 12);
        let mut reach: f64 = 0.0;
        for k in 0..12 {
            let turned = camera.turned(axis, [0.0, 1.0, 0.0], std::f64::consts::TAU * f64::from(k) / 12.0);
            let view = turned.view(300, 200);
            assert!((turned.eye[1] - camera.eye[1]).abs() < 1e-12);
            for p in &points {
                let [x, y, _] = view.project(Vec3::from(*p)).expect("in front of the camera");
                reach = reach.max((x / 150.0 - 1.0).abs()).max((y / 100.0 - 1.0).abs());
            }
        }
        assert!((reach - (1.0 - FRAME_MARGIN)).abs() < 1e-9, "{reach}");
        let nothing = Camera::frame_turning(&[], [0.0; 3], [0.0; 3], 1.0, 0);
        assert!(nothing.0.eye.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn up_is_up_and_right_is_right() {
        let camera = Camera::frame(([-1.0; 3], [1.0; 3]), [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0);
        let view = camera.view(100, 100);
        let [x, y, near] = view.project(Vec3::new(0.5, 0.5, 0.5)).unwrap();
        let [_, _, far] = view.project(Vec3::new(0.5, 0.5, -0.5)).unwrap();
        assert!(x > 50.0 && y < 50.0 && near < far, "{x} {y} {near} {far}");
    }

    #[test]
    fn nonsense_gives_a_finite_camera() {
        let nan = f64::NAN;
        for (bounds, direction, up) in [
            (([0.0; 3], [0.0; 3]), [0.0; 3], [0.0; 3]),
            (([nan; 3], [nan; 3]), [nan; 3], [0.0, 1.0, 0.0]),
            (([-1.0; 3], [1.0; 3]), [0.0, -1.0, 0.0], [0.0, 2.0, 0.0]),
            (([1e30; 3], [1e30; 3]), [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
        ] {
            let camera = Camera::frame(bounds, direction, up, nan);
            let view = camera.view(10, 10);
            assert!(view.eye.iter().all(|v| v.is_finite()) && view.near > 0.0, "{camera:?}");
            assert!(view.axis.iter().all(|a| (a.norm() - 1.0).abs() < 1e-9), "{camera:?}");
            assert!(view.axis[0].dot(&view.axis[1]).abs() < 1e-9);
        }
    }
}
