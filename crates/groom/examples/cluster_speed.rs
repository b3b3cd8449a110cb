//! Time of a hair tree: splitting, owners, hairs, bind and update.
#![allow(missing_docs, clippy::disallowed_methods)]

use pelage_geom::{Frame, NONE, Vec3};
use pelage_groom::cluster::{
    Cluster, Curve, Cylinder, Length, Owners, Region, Tree, attach, bind, grow, split, update,
};
use std::time::Instant;

const HAIRS: usize = 100_000;
const POINTS: usize = 32;

fn main() {
    let mut tree = Tree::default();
    for k in 0..20u32 {
        let centre = [f64::from(k % 5) * 0.2 + 0.1, f64::from(k / 5) * 0.25 + 0.1];
        let region = Region::circle(centre, 0.13);
        let root = Vec3::new(centre[0] * 20.0, centre[1] * 20.0, 0.0);
        let frame = Frame { origin: root, n: Vec3::z(), du: Vec3::x(), dv: Vec3::y() };
        let way = [(0.0, 0.0), (0.3, 2.0), (1.5, 5.0), (2.0, 3.0), (2.2, -8.0)];
        let control = way.iter().map(|(x, z)| root + Vec3::new(*x, 0.3 * x * z, *z)).collect();
        let mut cylinder = Cylinder::over(&region, control, &frame, [20.0; 2]);
        cylinder.twist = Curve { t: vec![0.0, 1.0], value: vec![0.0, 3.0] };
        tree.cluster.push(Cluster { parent: NONE, region, cylinder });
    }
    timed("20 clusters split into 4 each, those into 4, those into 3", || {
        for (level, n) in [4, 4, 3].into_iter().enumerate() {
            let levels = tree.levels();
            for k in (0..levels.len()).filter(|k| levels[*k] == level) {
                split(&mut tree, k as u32, n, 8).expect("children");
            }
        }
    });
    println!("{} clusters", tree.cluster.len());
    let region = Region { centre: [0.5, 0.5], radius: vec![0.5] };
    let uv: Vec<[f64; 2]> = region.fill(HAIRS).into_iter().map(|p| region.at(p)).collect();
    let root: Vec<Vec3> = uv.iter().map(|[u, v]| Vec3::new(20.0 * u, 20.0 * v, 0.0)).collect();
    let owners = timed("owners of 100,000 hairs", || Owners::find(&tree, &uv));
    let hairs = attach(&tree, &owners.last(), &uv, &root).expect("attached");
    let hairs: Vec<_> = hairs.into_iter().filter(|h| h.cluster != NONE).collect();
    let natural = timed("hairs of 32 points", || grow(&tree, &hairs, &[Length::Natural], POINTS, 0.5).expect("hairs"));
    println!("{} hairs", natural.len() / POINTS);
    timed("the same, cut", || grow(&tree, &hairs, &[Length::Cut(6.0)], POINTS, 0.5).expect("hairs"));
    let bound = timed("bind all that is below one cluster", || bind(&tree, 0).expect("bound"));
    timed("update it", || update(&mut tree, &bound).expect("updated"));
    let mut one = Tree { cluster: tree.cluster[..1].to_vec() };
    timed("one cluster split into 100", || split(&mut one, 0, 100, 8).expect("children"));
}

fn timed<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = f();
    println!("{what}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    out
}
