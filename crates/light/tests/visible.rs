//! What is called out of sight is out of sight: against rays and projections.

use pelage_geom::{Bvh, Topology, Vec3, rng, shapes};
use pelage_light::camera::Camera;
use pelage_light::visible::{Depths, Sight};

fn unit(seed: u64, k: u64) -> Vec3 {
    let at = |c: u64| 2.0 * rng::uniform(seed, k, c, 0) - 1.0;
    (0..)
        .map(|j| Vec3::new(at(3 * j), at(3 * j + 1), at(3 * j + 2)))
        .find(|v| (0.01..1.0).contains(&v.norm()))
        .unwrap()
        .normalize()
}

/// Balls around a ball of skin, for both projections: of those that are called hidden, no point can be reached by a ray from
/// the eye; of those out of the picture, no point is in it. And most of those that are, are found.
#[test]
fn what_is_called_unseen_is_unseen() {
    let mesh = shapes::cube_sphere(32, 1.0);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh));
    let size = [320, 240];
    for parallel_height in [None, Some(1.6)] {
        let camera = Camera {
            eye: [0.0, 0.5, 4.0],
            target: [0.3, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            fov_y_deg: 25.0,
            near: 0.1,
            parallel_height,
        };
        let depths = Depths::new(&camera, size, &mesh.position, &mesh.triangle);
        let view = camera.view(size[0], size[1]);
        let (mut count, mut missed) = ([0; 3], 0);
        for k in 0..2000 {
            let centre = unit(1, k) * (0.9 + 0.4 * rng::uniform(2, k, 0, 0));
            let radius = 0.02 + 0.2 * rng::uniform(2, k, 1, 0);
            let sight = depths.sight(centre, radius);
            let mut any = false;
            for j in 0..40 {
                let p = centre + unit(3, 1000 * k + j) * radius * rng::uniform(4, k, j, 0);
                let inside = view.project(p).is_some_and(|q| (0..2).all(|i| q[i] >= 0.0 && q[i] <= size[i] as f64));
                let from = if parallel_height.is_some() { p - view.axis[2] * 10.0 } else { view.eye };
                let way = p - from;
                let covered = bvh.ray(from, way, 1.0 - 1e-9).is_some();
                assert!(!(sight == Sight::Outside && inside), "{k}: {p:?} is in the picture");
                assert!(!(sight == Sight::Hidden && inside && !covered), "{k}: {p:?} is seen");
                any |= inside && !covered;
            }
            count[sight as usize] += 1;
            missed += usize::from(!any && sight == Sight::Seen);
        }
        assert!(count.iter().all(|n| *n > 100), "{count:?}");
        assert!(missed < 300, "{missed} of {count:?} are not seen and not told");
    }
}

/// Nothing is hidden by what is not there, and a ball that holds the eye is seen.
#[test]
fn without_skin_nothing_is_hidden() {
    let camera = Camera {
        eye: [0.0; 3],
        target: [0.0, 0.0, -1.0],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: 40.0,
        near: 0.01,
        parallel_height: None,
    };
    let depths = Depths::new(&camera, [64, 48], &[], &[]);
    assert_eq!(depths.sight(Vec3::new(0.0, 0.0, -3.0), 0.1), Sight::Seen);
    assert_eq!(depths.sight(Vec3::new(0.0, 0.0, 3.0), 0.1), Sight::Outside);
    assert_eq!(depths.sight(Vec3::new(0.0, 0.0, 0.3), 0.5), Sight::Seen);
    assert_eq!(depths.sight(Vec3::new(9.0, 0.0, -3.0), 0.1), Sight::Outside);
    // 48 rows over 40 degrees: at distance 3 minus the ball a unit is 48 / (2 tan 20 degrees) / 2.9 pixels.
    let expected = 24.0 / libm::tan(20f64.to_radians()) / 2.9;
    assert!((depths.pixels(Vec3::new(0.0, 0.0, -3.0), 0.1, 1.0) - expected).abs() < 1e-9);
}
