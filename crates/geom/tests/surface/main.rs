//! Laws of the skin: topology, poses, closest points, paths.

mod bvh;
mod path;
mod pose;
mod shapes;
mod topology;

use pelage_geom::{Bvh, Pose, Topology, Vec3, rng};

#[test]
fn the_same_for_any_number_of_threads() {
    let mesh = shapes::sphere(160, 120, 0.9);
    let run = || {
        let topology = Topology::new(&mesh);
        let pose = Pose::new(&mesh, &topology, mesh.position.clone());
        let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
        let query = |k: u64| Vec3::from([0, 1, 2].map(|c| 4.0 * rng::uniform(5, k, 0, c) - 2.0));
        let closest: Vec<_> = (0..500).map(|k| bvh.closest(query(k), f64::INFINITY)).collect();
        (topology, pose, closest)
    };
    let with = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run);
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}
