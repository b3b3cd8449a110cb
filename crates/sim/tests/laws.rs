//! Laws of strands: energy, momentum, rest, and what must not change the result.

mod common;

use common::{G, GRAVITY, MODELS, Rig, Vec3, links, plain, rod, straight, turned};
use pelage_sim::{Body, End, Material, Model, Rigid, Settings};

/// Mass of a point, kilograms: half of the hair on both sides.
fn masses(material: &Material, hair: &[Vec3]) -> Vec<f64> {
    let per_length = material.density * std::f64::consts::FRAC_PI_4 * material.diameter * material.diameter;
    let half = |a: usize, b: usize| 0.5 * per_length * (hair[b] - hair[a]).norm();
    let n = hair.len();
    (0..n).map(|i| if i > 0 { half(i - 1, i) } else { 0.0 } + if i + 1 < n { half(i, i + 1) } else { 0.0 }).collect()
}

fn velocities(shot: &Rig, h: usize) -> Vec<Vec3> {
    shot.sim.velocities()[shot.sim.offsets().range(h)].iter().map(|v| Vec3::from(*v)).collect()
}

/// Kinetic, elastic and potential energy of a hair of length 1 m that is straight by nature and clamped along `clamp`
/// (or not at all), over what it weighs times its length; 0 for potential energy at the height of the root less 1 m.
fn energy(shot: &Rig, settings: &Settings, clamp: Option<Vec3>) -> f64 {
    let m = &settings.material;
    let p = shot.hair(0);
    let n = p.len() - 1;
    let l = 1.0 / n as f64;
    let area = std::f64::consts::FRAC_PI_4 * m.diameter * m.diameter;
    let bend = m.young * area * m.diameter * m.diameter / 16.0 * m.bend_factor;
    let mass: Vec<f64> =
        vec![l; n + 1].iter().enumerate().map(|(i, l)| if i == 0 || i == n { 0.5 * l } else { *l }).collect();
    let unit = m.density * area;
    let mut sum = 0.0;
    for ((x, v), mass) in p.iter().zip(velocities(shot, 0)).zip(&mass) {
        sum += unit * mass * (0.5 * v.norm_squared() - Vec3::from(shot.gravity).dot(&(x - p[0])) + G);
    }
    let angle = |a: Vec3, b: Vec3| libm::atan2(a.cross(&b).norm(), a.dot(&b));
    for i in 0..n {
        let e = p[i + 1] - p[i];
        let stretch = m.young * area * m.stretch_factor / l;
        sum += 0.5 * stretch * (e.norm() - l) * (e.norm() - l);
        let (before, k) = if i > 0 { (Some(p[i] - p[i - 1]), bend / l) } else { (clamp, 2.0 * bend / l) };
        if let Some(before) = before {
            let a = angle(before, e);
            sum += 0.5 * k * a * a;
        }
    }
    sum / (unit * G)
}

#[test]
fn energy_does_not_grow_without_forcing() {
    // 1e5 steps of hair released from rest, at the default tolerance.
    for model in MODELS.into_iter().filter(|m| *m == Model::Rod) {
        for (gamma, n, dt) in [(10.0, 6, 1.0 / 192.0), (10.0, 20, 1.0 / 192.0)] {
            let tolerance = Settings::default().tolerance;
            let settings = Settings { substeps: Some(50), tolerance, ..plain(model, rod(gamma)) };
            let mut shot = Rig::under(&[straight(n, Vec3::x())], &settings, GRAVITY).unwrap();
            let first = energy(&shot, &settings, Some(Vec3::x()));
            let (mut most, mut half) = (0.0f64, 0.0);
            for k in 0..2000 {
                shot.wait(50.0 * dt).unwrap();
                let now = energy(&shot, &settings, Some(Vec3::x()));
                most = most.max(now / first - 1.0);
                if k == 40 {
                    half = now / first;
                }
            }
            let last = energy(&shot, &settings, Some(Vec3::x())) / first;
            println!("{model:?} Gamma {gamma}: most {most:.1e}, {half:.4} after 2000 steps, {last:.4} after all");
            assert!(most <= 1e-6, "{most}");
        }
    }
}

/// Momentum and angular momentum about the origin.
fn momenta(mass: &[f64], shot: &Rig) -> (Vec3, Vec3) {
    let p = shot.hair(0);
    let v = velocities(shot, 0);
    let momentum = mass.iter().zip(&v).map(|(m, v)| v * *m).sum();
    let angular = mass.iter().zip(p.iter().zip(&v)).map(|(m, (x, v))| x.cross(v) * *m).sum();
    (momentum, angular)
}

/// A strand that flies freely, thrown by letting go of its root while it swings.
fn thrown(model: Model, natural: &[[f64; 3]], dt: f64) -> (Rig, Settings) {
    let held = Settings { root: End::Pinned, tolerance: 1e-9, ..plain(model, rod(30.0)) };
    let mut shot = Rig::under(&[natural.to_vec()], &held, [3.0, -G, 2.0]).unwrap();
    shot.steps((0.4 / dt) as usize, dt).unwrap();
    let free = Settings { root: End::Free, tolerance: 1e-9, ..held };
    let mut flying = Rig::under(&[natural.to_vec()], &free, [0.0; 3]).unwrap();
    flying.sim.restore(&shot.sim.save()).unwrap();
    (flying, free)
}

#[test]
fn a_free_strand_keeps_its_momentum() {
    let n = 24;
    let curl: Vec<[f64; 3]> = (0..=n)
        .map(|i| {
            let s = f64::from(i) / f64::from(n);
            [0.08 * libm::cos(12.0 * s), -0.5 * s, 0.08 * libm::sin(12.0 * s)]
        })
        .collect();
    for model in MODELS {
        for natural in [straight(n as usize, Vec3::x()), curl.clone()] {
            let mut turned = Vec::new();
            for dt in [4e-3, 2e-3, 1e-3] {
                let (mut shot, settings) = thrown(model, &natural, 1e-3);
                let rest: Vec<Vec3> = natural.iter().map(|p| Vec3::from(*p)).collect();
                let mass = masses(&settings.material, &rest);
                // What the pin pulled is still in the first step's guess.
                shot.wait(dt).unwrap();
                let (p0, l0) = momenta(&mass, &shot);
                let centre = |shot: &Rig| -> Vec3 {
                    let total: f64 = mass.iter().sum();
                    shot.hair(0).iter().zip(&mass).map(|(x, m)| x * *m).sum::<Vec3>() / total
                };
                let c0 = centre(&shot);
                let seconds = 0.512;
                shot.steps((seconds / dt) as usize, dt).unwrap();
                let (p1, l1) = momenta(&mass, &shot);
                let flown = centre(&shot) - c0 - p0 / mass.iter().sum::<f64>() * seconds;
                println!(
                    "{model:?} dt {dt}: momentum {:.1e} angular {:.1e} centre {:.1e} m",
                    (p1 - p0).norm() / p0.norm(),
                    (l1 - l0).norm() / l0.norm(),
                    flown.norm()
                );
                // The extra particles of springs, a thousandth of the mass, are not seen.
                let exact = model == Model::Rod;
                assert!((p1 - p0).norm() < if exact { 1e-10 } else { 1e-3 } * p0.norm());
                assert!(flown.norm() < if exact { 1e-9 } else { 1e-3 });
                turned.push((l1 - l0).norm() / l0.norm());
            }
            if model == Model::Rod {
                println!("  angular momentum {turned:?}");
                // Of second order in the step, down to what pins leave.
                assert!(turned[0] < 1e-4 && turned[2] < (turned[0] / 12.0).max(1e-6), "{turned:?}");
            }
        }
    }
}

#[test]
fn internal_forces_have_no_sum_and_no_torque() {
    // Bent and let go: nothing moves its centre, and it does not start to turn.
    let n = 20;
    let arc: Vec<f64> = (0..n).map(|i| 0.1 * (f64::from(i) - 3.0) + 0.004 * f64::from(i * i)).collect();
    for model in MODELS {
        let settings = Settings { root: End::Free, tolerance: 1e-9, ..plain(model, rod(3.0)) };
        let natural = straight(n as usize, Vec3::new(1.0, 0.2, 0.4));
        let mut shot = Rig::deformed(&[natural], &[links(&arc)], &settings, [0.0; 3]).unwrap();
        let mass = masses(&settings.material, &shot.hair(0));
        // Momentum and its moment that the nodes exchange.
        for dt in [1e-4, 1e-3] {
            shot.steps(20, dt).unwrap();
            let (p, l) = momenta(&mass, &shot);
            let v = velocities(&shot, 0);
            let size: f64 = mass.iter().zip(&v).map(|(m, v)| m * v.norm()).sum();
            println!(
                "{model:?} dt {dt}: {:.1e} {:.1e} fastest {:.2}",
                p.norm() / size,
                l.norm() / size,
                shot.fastest()
            );
            let (sum, turn) = if model == Model::Rod { (1e-11, 1e-4) } else { (2e-3, 2e-3) };
            assert!(shot.fastest() > 1e-2 && p.norm() < sum * size && l.norm() < turn * size);
        }
    }
}

/// A hair of human thickness: its length, its direction, and the radius of its curls, 10 turns per decimetre at most.
fn human(length: f64, direction: Vec3, curl: f64, segments: usize) -> Vec<[f64; 3]> {
    let t = direction.normalize();
    let u = t.cross(&Vec3::new(0.3, 0.5, -0.8)).normalize();
    let v = t.cross(&u);
    (0..=segments)
        .map(|i| {
            let s = length * i as f64 / segments as f64;
            let a = 120.0 * s;
            (t * s + u * (curl * (libm::cos(a) - 1.0)) + v * (curl * libm::sin(a))).into()
        })
        .collect()
}

#[test]
fn groomed_hair_stays_for_a_minute() {
    let down = -Vec3::y();
    let poses = [
        (0.02, Vec3::y(), 0.0),
        (0.05, Vec3::y(), 0.0),
        (0.05, Vec3::x(), 0.002),
        (0.1, Vec3::new(1.0, 0.3, 0.0), 0.0),
        (0.1, Vec3::new(0.5, -1.0, 0.2), 0.004),
        (0.2, down + Vec3::x() * 0.2, 0.0),
        (0.2, down, 0.006),
        (0.3, down + Vec3::z() * 0.1, 0.0),
    ];
    let hairs: Vec<_> = poses.iter().map(|(l, d, c)| human(*l, *d, *c, 30)).collect();
    for model in MODELS {
        let settings = Settings { model, sleep: false, ..Settings::default() };
        let settings = Settings { material: Material { drag_factor: 0.0, ..settings.material }, ..settings };
        let mut shot = Rig::under(&hairs, &settings, GRAVITY).unwrap();
        println!("stiffened {:?}", shot.started.stiffened);
        let mut fastest = 0.0f64;
        for _ in 0..60 {
            shot.wait(1.0).unwrap();
            fastest = fastest.max(shot.fastest());
        }
        for (h, (length, direction, curl)) in poses.iter().enumerate() {
            let drift =
                shot.hair(h).iter().zip(&hairs[h]).map(|(a, b)| (a - Vec3::from(*b)).norm()).fold(0.0, f64::max);
            let stiffened = shot.started.stiffened.iter().find(|s| s.id == h as u64 + 1);
            let bound = if stiffened.is_some() { 1e-3 } else { 1e-6 };
            println!("{model:?} {length} {:?} curl {curl}: drift {:.1e} L", direction.as_slice(), drift / length);
            assert!(stiffened.is_none_or(|s| s.factor > 0.0));
            assert!(drift < bound * length, "{drift}");
        }
        println!("{model:?}: fastest {fastest:.1e} m/s");
        assert!(fastest < 1e-5);
    }
}

/// Assorted hairs of different lengths, some curly.
fn assorted(count: usize) -> Vec<Vec<[f64; 3]>> {
    (0..count)
        .map(|k| {
            let f = k as f64;
            let direction = Vec3::new(libm::sin(1.7 * f), libm::cos(2.3 * f), libm::sin(0.9 * f + 1.0));
            let root = Vec3::new(0.01 * f, 0.02 * libm::sin(f), 0.0);
            let hair = human(0.04 + 0.013 * f, direction, if k % 3 == 0 { 0.003 } else { 0.0 }, 8 + 5 * (k % 4));
            hair.iter().map(|p| (Vec3::from(*p) + root).into()).collect()
        })
        .collect()
}

/// A shake of the skin: sideways and turning.
fn shake(time: f64, offset: Vec3) -> impl Fn(f64) -> Rigid + Sync {
    move |f| {
        let t = time + f / 24.0;
        let at = offset + Vec3::new(0.05 * libm::sin(9.0 * t), 0.0, 0.02 * libm::sin(7.0 * t));
        Rigid { translation: at.into(), ..turned(Vec3::new(0.2, 1.0, 0.1), 0.6 * libm::sin(8.0 * t)) }
    }
}

/// Half a second of shaking in air.
fn shaken(hairs: &[Vec<[f64; 3]>], settings: &Settings, offset: Vec3) -> Rig {
    let mut shot = Rig::under(hairs, settings, GRAVITY).unwrap();
    for _ in 0..12 {
        let motion = shake(shot.time, offset);
        shot.go(1.0 / 24.0, &motion, &Body::default(), None).unwrap();
    }
    shot
}

fn same_bits(a: &[[f64; 3]], b: &[[f64; 3]]) -> bool {
    a.iter().flatten().map(|x| x.to_bits()).eq(b.iter().flatten().map(|x| x.to_bits()))
}

#[test]
fn lanes_and_threads_change_no_bit() {
    let hairs = assorted(21);
    for model in MODELS {
        let settings = Settings { model, ..Settings::default() };
        let one = shaken(&hairs, &settings, Vec3::zeros());
        let plain = shaken(&hairs, &Settings { wide: false, ..settings.clone() }, Vec3::zeros());
        assert!(same_bits(&one.sim.positions(), &plain.sim.positions()));
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let other = pool.install(|| shaken(&hairs, &settings, Vec3::zeros()));
            assert_eq!(one.sim.save(), other.sim.save());
        }
    }
}

#[test]
fn order_and_company_change_no_bit() {
    let hairs = assorted(21);
    for model in MODELS {
        let settings = Settings { model, ..Settings::default() };
        let one = shaken(&hairs, &settings, Vec3::zeros());
        // Shuffled by a fixed permutation.
        let order: Vec<usize> = (0..hairs.len()).map(|k| (8 * k + 5) % hairs.len()).collect();
        let shuffled: Vec<_> = order.iter().map(|&k| hairs[k].clone()).collect();
        let other = shaken(&shuffled, &settings, Vec3::zeros());
        for (k, &h) in order.iter().enumerate() {
            assert_eq!(one.hair(h), other.hair(k), "{model:?} hair {h}");
            let alone = shaken(&hairs[h..=h], &settings, Vec3::zeros());
            assert_eq!(one.hair(h), alone.hair(0), "{model:?} hair {h} alone");
        }
    }
}

#[test]
fn a_saved_state_goes_on_as_if_nothing_happened() {
    let hairs = assorted(11);
    for model in MODELS {
        let settings = Settings { model, ..Settings::default() };
        let whole = shaken(&hairs, &settings, Vec3::zeros());
        let mut first = Rig::under(&hairs, &settings, GRAVITY).unwrap();
        for k in 0..12 {
            if k == 5 {
                let mut fresh = Rig::under(&hairs, &settings, GRAVITY).unwrap();
                fresh.sim.restore(&first.sim.save()).unwrap();
                fresh.time = first.time;
                assert_eq!(fresh.sim.save(), first.sim.save());
                first = fresh;
            }
            let motion = shake(first.time, Vec3::zeros());
            first.go(1.0 / 24.0, &motion, &Body::default(), None).unwrap();
        }
        assert!(same_bits(&whole.sim.positions(), &first.sim.positions()));
        assert_eq!(whole.sim.save(), first.sim.save());
        assert!(first.sim.restore(&whole.sim.save()[8..]).is_err());
    }
}

#[test]
fn far_from_the_origin_hair_moves_as_near_it() {
    let hairs = assorted(8);
    for model in MODELS {
        let settings = Settings { model, ..Settings::default() };
        let near = shaken(&hairs, &settings, Vec3::zeros());
        for offset in [Vec3::new(1e4, 0.0, 0.0), Vec3::new(-6e3, 5e3, 6e3)] {
            // Groomed there, and moved there by the skin.
            let moved: Vec<Vec<[f64; 3]>> =
                hairs.iter().map(|h| h.iter().map(|p| (Vec3::from(*p) + offset).into()).collect()).collect();
            let mut far = Rig::under(&moved, &settings, GRAVITY).unwrap();
            for root in &mut far.roots {
                root.position = (Vec3::from(root.position) - offset).into();
            }
            for _ in 0..12 {
                let motion = shake(far.time, offset);
                far.go(1.0 / 24.0, &motion, &Body::default(), None).unwrap();
            }
            for (h, hair) in hairs.iter().enumerate() {
                let length: f64 = hair.windows(2).map(|w| (Vec3::from(w[1]) - Vec3::from(w[0])).norm()).sum();
                let apart =
                    far.hair(h).iter().zip(near.hair(h)).map(|(a, b)| (a - offset - b).norm()).fold(0.0, f64::max);
                println!("{model:?} hair {h}: {:.1e} L", apart / length);
                assert!(apart < 1e-6 * length, "{model:?} hair {h}: {}", apart / length);
            }
        }
    }
}

#[test]
fn a_mirrored_groom_moves_mirrored() {
    let hairs = assorted(8);
    let mirror = |p: [f64; 3]| [-p[0], p[1], p[2]];
    let mirrored: Vec<Vec<[f64; 3]>> = hairs.iter().map(|h| h.iter().map(|p| mirror(*p)).collect()).collect();
    let place = |time: f64, sign: f64| {
        move |f: f64| {
            let t = time + f / 24.0;
            // Mirrored in x, turns about y and z change their sign.
            let [x, y, z, w] = turned(Vec3::new(0.2 * sign, 1.0, 0.1), 0.6 * sign * libm::sin(8.0 * t)).rotation;
            Rigid {
                translation: [sign * 0.05 * libm::sin(9.0 * t), 0.0, 0.02 * libm::sin(7.0 * t)],
                rotation: [x, y, z, w],
            }
        }
    };
    for model in MODELS {
        let settings = Settings { model, ..Settings::default() };
        let mut shots =
            [Rig::under(&hairs, &settings, GRAVITY).unwrap(), Rig::under(&mirrored, &settings, GRAVITY).unwrap()];
        for _ in 0..12 {
            for (shot, sign) in shots.iter_mut().zip([1.0, -1.0]) {
                let motion = place(shot.time, sign);
                shot.go(1.0 / 24.0, &motion, &Body::default(), None).unwrap();
            }
        }
        for h in 0..hairs.len() {
            let (a, b) = (shots[0].hair(h), shots[1].hair(h));
            let apart = a.iter().zip(&b).map(|(a, b)| (Vec3::from(mirror((*a).into())) - b).norm()).fold(0.0, f64::max);
            println!("{model:?} mirrored hair {h}: {apart:.1e} m");
            // The zig-zag of springs has a handedness and a first azimuth.
            assert!(apart < if model == Model::Rod { 1e-9 } else { 2e-2 }, "hair {h}: {apart}");
        }
    }
}

#[test]
fn hair_turned_as_a_whole_moves_turned() {
    // Gravity turned along: nothing prefers an axis.
    let turn = turned(Vec3::new(0.3, -0.5, 0.7), 1.1).quaternion();
    let hairs = assorted(8);
    let rotated: Vec<Vec<[f64; 3]>> =
        hairs.iter().map(|h| h.iter().map(|p| (turn * Vec3::from(*p)).into()).collect()).collect();
    for model in MODELS {
        // Steps so short that all converge well: what is left of an iteration differs with the axes.
        let settings = Settings { sag_free: false, model, substeps: Some(40), tolerance: 1e-8, ..Settings::default() };
        let mut a = Rig::under(&hairs, &settings, GRAVITY).unwrap();
        let mut b = Rig::under(&rotated, &settings, (turn * Vec3::from(GRAVITY)).into()).unwrap();
        for shot in [&mut a, &mut b] {
            shot.steps(4, 1.0 / 24.0).unwrap();
        }
        for h in 0..hairs.len() {
            let apart = a.hair(h).iter().zip(b.hair(h)).map(|(a, b)| (turn * a - b).norm()).fold(0.0, f64::max);
            println!("{model:?} hair {h}: {apart:.1e} m");
            assert!(apart < if model == Model::Rod { 1e-6 } else { 2e-2 }, "{model:?} hair {h}: {apart}");
        }
    }
}

#[test]
fn hair_of_a_material_of_its_own_moves_as_in_a_layer_of_it() {
    let soft = Material { damping: 1e-3, ..Material::default() };
    let kinds = [
        soft,
        Material { diameter: 120e-6, bend_factor: 3.0, drag_factor: 0.5, ..soft },
        Material { young: 1e9, density: 2000.0, twist_factor: 0.2, stretch_factor: 0.5, drag_factor: 4.0, ..soft },
    ];
    // Arcs of several lengths, so that groups mix kinds and sizes.
    let arc = |h: usize| {
        let length = 0.1 + 0.01 * (h % 5) as f64;
        let at = |k: usize| 1.5 * k as f64 / 12.0;
        let point = |k| [length * libm::sin(at(k)) / 1.5, 0.02 * h as f64, length * (1.0 - libm::cos(at(k))) / 1.5];
        (0..=12).map(point).collect()
    };
    let hairs: Vec<Vec<[f64; 3]>> = (0..20).map(arc).collect();
    let own: Vec<Material> = (0..hairs.len()).map(|h| kinds[h % 3]).collect();
    for model in MODELS {
        let settings = |material| Settings { model, material, ..Settings::default() };
        let moved = |rig: Result<Rig, _>| {
            let mut rig: Rig = rig.unwrap();
            let motion = |f: f64| Rigid { translation: [0.02 * f, 0.0, 0.0], ..turned(Vec3::z(), 0.1 * f) };
            (0..6).for_each(|_| rig.go(1.0 / 24.0, &motion, &Body::default(), None).unwrap());
            rig
        };
        let mixed = moved(Rig::made_of(&own, &hairs, &settings(Material { bend_factor: 9.0, ..soft }), GRAVITY));
        let layers: Vec<Rig> = kinds.iter().map(|m| moved(Rig::new(&hairs, &settings(*m)))).collect();
        for h in 0..hairs.len() {
            assert_eq!(mixed.hair(h), layers[h % 3].hair(h), "{model:?}, hair {h}");
            assert_ne!(mixed.hair(h), layers[(h + 1) % 3].hair(h), "{model:?}, hair {h}");
        }
        let none = [Material { density: 0.0, ..soft }];
        assert!(Rig::made_of(&none, &hairs[..1], &settings(soft), GRAVITY).is_err());
    }
}
