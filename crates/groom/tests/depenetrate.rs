//! Depenetration against a plain check: samples along the curves, inside or not by solid angles or the parity of a ray.

use pelage_geom::motion::RigidTransform;
use pelage_geom::rng::uniform;
use pelage_geom::{Bvh, Mesh, Offsets, SurfacePoint, Topology, Vec3, shapes};
use pelage_groom::depenetrate::{Depenetrate, DepenetrateCounts, STRETCH, depenetrate};

/// Centimetres: 1 mm, 0.05 mm, 1 mm.
const SETTINGS: Depenetrate = Depenetrate { step: 0.1, clearance: 0.005, held: 0.1 };
/// Rounding of stored positions of up to 30.
const GRAIN: f64 = 1e-5;

struct Skin {
    mesh: Mesh,
    bvh: Bvh,
}

impl Skin {
    fn new(mesh: Mesh) -> Self {
        let bvh = Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh));
        Skin { mesh, bvh }
    }

    fn corners(&self, t: usize) -> [Vec3; 3] {
        self.mesh.triangle[t].map(|v| Vec3::from(self.mesh.position[v as usize]))
    }

    /// By the sum of solid angles of all triangles (Van Oosterom, Strackee 1983): no hierarchy, no normals.
    fn inside_by_angle(&self, p: Vec3) -> bool {
        let angle = |t: usize| {
            let [a, b, c] = self.corners(t).map(|c| c - p);
            let (x, y, z) = (a.norm(), b.norm(), c.norm());
            libm::atan2(a.dot(&b.cross(&c)), x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
        };
        (0..self.mesh.triangle.len()).map(angle).sum::<f64>() > std::f64::consts::PI
    }

    /// By the number of surfaces in a direction.
    fn inside_by_parity(&self, mut p: Vec3) -> bool {
        let d = Vec3::new(0.31, 0.17, 0.93);
        let mut odd = false;
        while let Some((t, _)) = self.bvh.ray(p, d, f64::INFINITY) {
            odd = !odd;
            p += d * (t + 1e-9);
        }
        odd
    }

    /// `count` curly hairs that leave the skin in any direction outward, bend, and often enter it again.
    fn hairs(&self, count: u64, points: usize, length: f64) -> Vec<[f32; 3]> {
        let mut out = Vec::new();
        for h in 0..count {
            let random = |k: u64| uniform(5, h, 0, k);
            let t = (random(0) * self.mesh.triangle.len() as f64) as usize;
            let (b, c) = (random(1), random(2) * (1.0 - random(1)));
            let root = SurfacePoint { triangle: t as u32, bary: [b as f32, c as f32] };
            let corner = self.corners(t);
            let n = (corner[1] - corner[0]).cross(&(corner[2] - corner[0])).normalize();
            let any = |k: u64| Vec3::new(random(k) - 0.5, random(k + 1) - 0.5, random(k + 2) - 0.5);
            let (mut at, mut d) = (root.blend(corner), (n + 2.0 * any(3)).normalize());
            let bend = any(6) - 0.3 * n;
            let l = length / (points - 1) as f64;
            for k in 0..points {
                let turn = 3.0 * l * k as f64;
                let curl = Vec3::new(libm::sin(turn), libm::cos(turn) - 1.0, 0.0) * (0.15 * random(9));
                let p = at + curl;
                out.push([p.x as f32, p.y as f32, p.z as f32]);
                at += d * l;
                d = (d + bend * (0.8 * l)).normalize();
            }
        }
        out
    }

    fn run(&self, points: usize, position: &mut [[f32; 3]]) -> DepenetrateCounts {
        let offsets = Offsets::uniform(position.len() / points, points);
        depenetrate(&self.bvh, &SETTINGS, None, &offsets, [0.0; 3], None, position)
    }
}

fn at(p: &[f32; 3]) -> Vec3 {
    Vec3::from(p.map(f64::from))
}

fn vertices(p: &[Vec3]) -> Vec<[f32; 3]> {
    p.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect()
}

/// True if `test` holds for a sample of a hair, `step` apart along it, beyond the held length.
fn any_sample(hair: &[[f32; 3]], step: f64, test: impl Fn(Vec3) -> bool) -> bool {
    let mut gone = 0.0;
    let mut next = SETTINGS.held + 1e-9;
    for w in hair.windows(2) {
        let (a, way) = (at(&w[0]), at(&w[1]) - at(&w[0]));
        while next < gone + way.norm() {
            if test(a + way * ((next - gone) / way.norm())) {
                return true;
            }
            next += step;
        }
        gone += way.norm();
    }
    false
}

/// Runs on hairs over a skin and checks what must hold of all of them; returns the counts.
fn check(skin: &Skin, points: usize, before: &[[f32; 3]], inside: impl Fn(Vec3) -> bool) -> DepenetrateCounts {
    let mut after = before.to_vec();
    let counts = skin.run(points, &mut after);
    let (mut pushed, mut still, mut dipped) = (0, 0, 0);
    for (h, (old, new)) in before.chunks(points).zip(after.chunks(points)).enumerate() {
        assert_eq!(old[0], new[0], "the root of hair {h}");
        assert!(new.iter().flatten().all(|x| x.is_finite()));
        still += usize::from(any_sample(new, 0.1, &inside));
        let was = any_sample(old, 0.1, &inside);
        dipped += usize::from(was);
        if old == new {
            assert!(!was || counts.uncleared > 0, "hair {h} is inside and was left");
        } else {
            pushed += 1;
            assert!(was || any_sample(old, 0.002, &inside), "hair {h} is outside and was pushed");
        }
    }
    assert!(still <= counts.uncleared, "{still} hairs are inside: {counts:?}");
    assert_eq!(pushed, counts.pushed);
    assert!(dipped > before.len() / points / 20, "hairs that try: {dipped}");
    // A second time nothing is left to do.
    let mut again = after.clone();
    let second = skin.run(points, &mut again);
    if counts.uncleared == 0 {
        assert_eq!(second, DepenetrateCounts::default());
        assert_eq!(again, after);
    }
    counts
}

#[test]
fn none_is_inside_a_ball_or_a_ring_and_the_others_keep_every_bit() {
    for (mesh, nine_of_ten) in [(shapes::cube_sphere(6, 8.0), 1.3), (shapes::torus(24, 12, 6.0, 2.0), 3.0)] {
        let skin = Skin::new(mesh);
        let hairs = skin.hairs(300, 16, 9.0);
        let counts = check(&skin, 16, &hairs, |p| skin.inside_by_angle(p));
        assert_eq!((counts.uncleared, counts.deepest[1]), (0, 0.0));
        assert!(counts.stretched <= STRETCH + GRAIN / (9.0 / 15.0) && counts.deepest[0] > 0.5, "{counts:?}");
        // No hair moves much farther than it was deep.
        let far = |hair: &[[f32; 3]]| {
            let c = skin.run(16, &mut hair.to_vec());
            c.moved / (c.deepest[0] + SETTINGS.clearance)
        };
        let mut ratio: Vec<f64> = hairs.chunks(16).map(far).filter(|r| *r > 0.0).collect();
        ratio.sort_by(f64::total_cmp);
        let part = |f: f64| ratio[(f * ratio.len() as f64) as usize];
        println!("{counts:?}; moved by depth: {} {} {} of {}", part(0.5), part(0.9), part(0.999), ratio.len());
        assert!(part(0.5) < 1.3 && part(0.9) < nine_of_ten && part(0.999) < 6.0);
    }
}

#[test]
fn none_is_inside_the_bust() {
    let skin = Skin::new(shapes::bust().mesh);
    let counts = check(&skin, 16, &skin.hairs(400, 16, 6.0), |p| skin.inside_by_parity(p));
    println!("{counts:?}");
    assert!(counts.uncleared <= 2 && counts.deepest[1] < 0.2 * counts.deepest[0], "{counts:?}");
}

#[test]
fn a_tip_stays_when_the_middle_dips() {
    let skin = Skin::new(shapes::cube_sphere(24, 8.0));
    // Around the ball at heights above it that are less than 0 in the middle.
    let height = [0.0, 0.3, 0.4, 0.3, 0.15, -0.1, 0.15, 0.3, 0.5, 0.6, 0.6, 0.6];
    let line = height.iter().enumerate().map(|(k, h)| {
        let a = 0.1 * k as f64;
        Vec3::new(libm::sin(a), libm::cos(a), 0.1).normalize() * (8.0 + h)
    });
    let before = vertices(&line.collect::<Vec<_>>());
    let mut after = before.clone();
    let counts = skin.run(12, &mut after);
    assert_eq!((counts.pushed, counts.uncleared), (1, 0));
    assert_eq!((&before[..3], &before[9..]), (&after[..3], &after[9..]));
    assert!(counts.moved < 1.2 * (counts.deepest[0] + SETTINGS.clearance), "{counts:?}");
}

#[test]
fn one_vertex_in_a_plane_comes_straight_up() {
    let skin = Skin::new(shapes::plane(8, 8, 40.0));
    let line = [(0.0, 0.0), (1.0, 0.2), (2.0, 0.05), (3.0, -0.01), (4.0, 0.05), (5.0, 0.2)];
    let before = vertices(&line.map(|(x, y)| Vec3::new(x, y, 0.3)));
    let mut after = before.clone();
    let counts = skin.run(6, &mut after);
    assert_eq!((counts.pushed, counts.uncleared), (1, 0));
    let up = at(&after[3]) - at(&before[3]);
    assert!((up - Vec3::new(0.0, 0.01 + SETTINGS.clearance, 0.0)).norm() < 1e-6, "{up}");
    assert!((0..6).all(|k| k == 3 || before[k] == after[k]));
}

#[test]
fn a_segment_through_the_skin_between_outer_vertices_moves_as_a_whole() {
    let skin = Skin::new(shapes::cube_sphere(24, 8.0));
    // The chord's middle is 0.2 inside; both ends have the same share in it.
    let before = vertices(&[
        Vec3::new(-4.0, 9.5, 0.0),
        Vec3::new(-3.0, 8.6, 0.0),
        Vec3::new(-2.0, 7.8, 0.0),
        Vec3::new(2.0, 7.8, 0.0),
        Vec3::new(4.0, 8.5, 0.0),
    ]);
    let mut after = before.clone();
    let counts = skin.run(5, &mut after);
    assert_eq!((counts.pushed, counts.uncleared), (1, 0));
    let up = [2, 3].map(|k| f64::from(after[k][1] - before[k][1]));
    let middle = 0.5 * (after[2][1] + after[3][1]);
    assert!(middle > 7.99 && middle < 8.1, "{middle}");
    assert!((up[0] - up[1]).abs() < 0.08 && up[0] < 0.3, "{up:?}");
}

#[test]
fn threads_change_nothing() {
    let skin = Skin::new(shapes::torus(24, 12, 6.0, 2.0));
    let before = skin.hairs(300, 16, 9.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut after = before.clone();
        let counts = pool.install(|| skin.run(16, &mut after));
        (counts, after)
    };
    let one = on(1);
    assert!(one.0.pushed > 20);
    assert_eq!(one, on(3));
}

#[test]
fn hair_on_a_skin_that_has_moved_is_moved_alike() {
    let skin = Skin::new(shapes::torus(24, 12, 6.0, 2.0));
    let points = 16;
    let motion =
        RigidTransform { rotation: [0.5, -0.5, 0.5, 0.5], translation: [900.0, -3.0, 200.0], pivot: [1.0, 2.0, 3.0] };
    let origin = [900.0, 0.0, 200.0];
    let rest = skin.hairs(200, points, 9.0);
    let carry = |p: &[f32; 3]| {
        let q = motion.apply(at(p)) - Vec3::from(origin);
        [q.x as f32, q.y as f32, q.z as f32]
    };
    let moved: Vec<[f32; 3]> = rest.iter().map(carry).collect();
    let (mut a, mut b) = (rest.clone(), moved.clone());
    let at_rest = skin.run(points, &mut a);
    let offsets = Offsets::uniform(200, points);
    let then = depenetrate(&skin.bvh, &SETTINGS, Some(&motion), &offsets, origin, None, &mut b);
    assert_eq!((at_rest.pushed, 0), (then.pushed, then.uncleared));
    // Coordinates are stored relative to another point: what is rounded otherwise shows most in deep hair.
    let mut apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (at(&carry(a)) - at(b)).norm()).collect();
    apart.sort_by(f64::total_cmp);
    assert!(apart[apart.len() * 9 / 10] < 1e-5 && apart[apart.len() - 1] < 0.05, "{}", apart[apart.len() - 1]);
    let mut kept = 0;
    for ((old, new), rest) in moved.chunks(points).zip(b.chunks(points)).zip(rest.chunks(points).zip(a.chunks(points)))
    {
        assert_eq!(old == new, rest.0 == rest.1);
        kept += usize::from(old == new);
    }
    assert!(kept > 20 && kept < 180, "{kept}");
}

#[test]
fn what_cannot_be_cleared_is_counted_and_what_is_no_hair_is_left() {
    let skin = Skin::new(shapes::cube_sphere(12, 8.0));
    let line = |from: f64, to: f64| (0..5).map(move |k| Vec3::new(0.0, from + (to - from) * (k as f64 / 4.0), 0.0));
    let mut lines: Vec<Vec<[f32; 3]>> = Vec::new();
    // A root half a centimetre deep; hair that never leaves; a number that is none; a point; nothing; one that is clear.
    lines.push(vertices(&line(7.5, 9.5).collect::<Vec<_>>()));
    lines.push(vertices(&line(1.0, 2.0).collect::<Vec<_>>()));
    lines.push(vertices(&line(8.0, 4.0).collect::<Vec<_>>()));
    lines[2][3][1] = f32::NAN;
    lines.push(vertices(&[Vec3::zeros()]));
    lines.push(Vec::new());
    lines.push(vertices(&line(8.0, 9.0).collect::<Vec<_>>()));
    let offsets = Offsets::from_counts(lines.iter().map(Vec::len));
    let before = lines.concat();
    let mut after = before.clone();
    let counts = depenetrate(&skin.bvh, &SETTINGS, None, &offsets, [0.0; 3], None, &mut after);
    assert_eq!((counts.uncleared, counts.buried), (2, 2), "{counts:?}");
    let bits = |p: &[[f32; 3]]| p.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&before[10..]), bits(&after[10..]));
    // The first is only inside where it has to be.
    assert_eq!(bits(&before[..5]), bits(&after[..5]));
    assert!(after[5..10].iter().flatten().all(|x| x.is_finite()) && counts.deepest[1] <= counts.deepest[0]);
    let none = depenetrate(&Bvh::default(), &SETTINGS, None, &offsets, [0.0; 3], None, &mut after);
    assert_eq!(none, DepenetrateCounts::default());
}

/// A hair that hangs beside a ball and is drawn through its middle, a little to this side and that from frame to frame.
#[test]
fn hair_stays_on_the_side_that_it_came_from() {
    let skin = Skin::new(shapes::cube_sphere(24, 3.0));
    let hair = |x: f64| {
        vertices(
            &(0..17).map(|k| Vec3::new(if k > 4 { x } else { 0.0 }, 7.0 - 0.6 * k as f64, 0.1)).collect::<Vec<_>>(),
        )
    };
    let mut came = hair(3.4);
    came[..5].copy_from_slice(&hair(0.0)[..5]);
    let offsets = Offsets::uniform(1, 17);
    let run = |frame: i32, from: Option<&[[f32; 3]]>| {
        let mut out = hair(0.3 * libm::sin(2.0 * f64::from(frame)));
        let counts = depenetrate(&skin.bvh, &SETTINGS, None, &offsets, [0.0; 3], from, &mut out);
        assert_eq!((counts.pushed, counts.uncleared), (1, 0));
        assert!(!any_sample(&out, 0.1, |p| skin.inside_by_parity(p)));
        out
    };
    let jumps = |from: Option<&[[f32; 3]]>| {
        let frames: Vec<_> = (0..12).map(|f| run(f, from)).collect();
        let jump =
            |w: &[Vec<[f32; 3]>]| w[0].iter().zip(&w[1]).map(|(p, q)| (at(p) - at(q)).norm()).fold(0.0, f64::max);
        frames.windows(2).map(jump).fold(0.0, f64::max)
    };
    assert!(jumps(None) > 3.0, "by the nearest way out it changes sides: {}", jumps(None));
    assert!(jumps(Some(&came)) < 1.0, "{}", jumps(Some(&came)));
}

/// Two balls, one in the other, as a limb in a body: hair with its root in the other is left, all other ends outside both.
#[test]
fn hair_ends_outside_a_skin_that_runs_through_itself() {
    let centre = [Vec3::zeros(), Vec3::new(6.0, 0.5, 0.3)];
    let mut mesh = Mesh::default();
    for c in centre {
        let ball = shapes::cube_sphere(16, 4.0);
        let first = mesh.position.len() as u32;
        mesh.position.extend(ball.position.iter().map(|p| <[f64; 3]>::from(Vec3::from(*p) + c)));
        mesh.triangle.extend(ball.triangle.iter().map(|t| t.map(|v| first + v)));
    }
    let skin = Skin::new(mesh);
    let points = 16;
    let before = skin.hairs(600, points, 6.0);
    let mut after = before.clone();
    let counts = skin.run(points, &mut after);
    let (mut grown, mut left, mut nearest_is_not_out) = (0, 0, 0);
    for (h, (old, new)) in before.chunks(points).zip(after.chunks(points)).enumerate() {
        let depth = centre.map(|c| 4.0 - (at(&old[0]) - c).norm());
        // Its own ball's surface, and that of the other above it.
        let covered = depth[0].max(depth[1]);
        let still = any_sample(new, 0.1, |p| skin.inside_by_angle(p));
        if covered > 0.5 {
            grown += 1;
            let never_out = !any_sample(old, 0.1, |p| !skin.inside_by_angle(p));
            left += usize::from(never_out && old == new);
            assert!(!never_out || old == new, "hair {h} grows inside and was moved");
        } else if covered < 0.01 {
            assert!(!still, "hair {h} is inside");
            let was = any_sample(old, 0.1, |p| skin.inside_by_angle(p));
            assert!(was || old == new || any_sample(old, 0.002, |p| skin.inside_by_angle(p)), "hair {h} was pushed");
            // What the nearest skin alone would have let pass.
            let behind = |p: Vec3| skin.bvh.closest(p, f64::INFINITY).unwrap().signed_distance < 0.0;
            nearest_is_not_out += usize::from(any_sample(old, 0.1, |p| skin.inside_by_angle(p) && !behind(p)));
        }
    }
    println!("{grown} grow inside, {left} never come out; {nearest_is_not_out}; {counts:?}");
    assert!(grown > 20 && left > 5 && nearest_is_not_out > 5);
    assert!(counts.buried >= grown && counts.uncleared == counts.buried, "{counts:?}");
}

/// A gate for speed that needs no clock: how many segments are looked at on fixed inputs. A count may be 2 % away from what it
/// was; more work wants a reason, less is written down here too.
#[test]
fn pushing_hair_out_takes_as_many_looks() {
    let ball = Skin::new(shapes::cube_sphere(12, 10.0));
    let torus = Skin::new(shapes::torus(48, 24, 8.0, 2.0));
    for (name, skin, before) in [("ball", &ball, [107, 5_106]), ("torus", &torus, [52, 2_783])] {
        let mut hairs = skin.hairs(400, 24, 6.0);
        let found = skin.run(24, &mut hairs);
        let now = [found.pushed as u64, found.looks];
        let near = |now: u64, before: u64| (now as f64 / before as f64 - 1.0).abs() < 0.02;
        assert!(near(now[0], before[0]) && near(now[1], before[1]), "{name}: {now:?} instead of {before:?}");
    }
}
