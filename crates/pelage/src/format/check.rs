//! Checks of hair before it is written and after it is read back, the same for every format.

use super::{FormatError, HairFrame, HairLayer, ShotFacts};
use pelage_geom::Offsets;
use std::path::{Path, PathBuf};

/// Turns an error of the operating system while writing `path` into one for people.
pub(super) fn write_error(path: &Path, error: &std::io::Error) -> FormatError {
    FormatError::new(path, format!("could not be written: {error}"))
        .hint("see that the folder exists, can be written to and has space left")
}

/// Turns an error of the operating system while reading `path` into one for people.
pub(super) fn read_error(path: &Path, error: &std::io::Error) -> FormatError {
    FormatError::new(path, format!("could not be read: {error}"))
}

/// What has to be remembered of a layer to check its frames.
#[derive(Clone, Debug)]
struct LayerShape {
    name: String,
    offsets: Offsets,
    id: Vec<u64>,
}

/// Follows a shot while its frames are written: their order, their sizes and their values.
#[derive(Debug)]
pub(super) struct ShotCheck {
    path: PathBuf,
    frames: Vec<i32>,
    written: usize,
    layers: Vec<LayerShape>,
    /// Columns of transmittance.
    shadows: usize,
}

impl ShotCheck {
    /// Checks the facts and what does not change over the shot.
    pub(super) fn new(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Result<Self, FormatError> {
        check_facts(path, facts)?;
        for (i, layer) in layers.iter().enumerate() {
            check_layer(path, layer)?;
            if layers[..i].iter().any(|other| other.name == layer.name) {
                return Err(FormatError::new(path, format!("two layers are called {:?}", layer.name))
                    .hint("give every layer its own name"));
            }
        }
        let shape = |l: &HairLayer| LayerShape { name: l.name.clone(), offsets: l.offsets.clone(), id: l.id.clone() };
        let layers = layers.iter().map(shape).collect();
        let shadows = facts.shadow_columns().len();
        Ok(ShotCheck { path: path.to_path_buf(), frames: facts.frames.clone(), written: 0, layers, shadows })
    }

    /// Checks that `frame` is the next one and has one entry a layer, with one value a point, all of them finite.
    /// Returns the bounds of each layer.
    pub(super) fn frame(&mut self, frame: i32, layers: &[HairFrame]) -> Result<Vec<Bounds>, FormatError> {
        let bad = |what: String| FormatError::new(&self.path, what).at(format!("frame {frame}"));
        match self.frames.get(self.written) {
            Some(&next) if next == frame => {}
            Some(&next) => return Err(bad(format!("comes out of order: frame {next} has to be written next"))),
            None => return Err(bad("comes after the last frame of the shot".into())),
        }
        if layers.len() != self.layers.len() {
            return Err(bad(format!("has {} layers, the shot has {}", layers.len(), self.layers.len())));
        }
        let mut bounds = Vec::with_capacity(layers.len());
        for (shape, data) in self.layers.iter().zip(layers) {
            let points = shape.offsets.total();
            let sizes = [
                ("positions", data.position.len(), points, false),
                ("velocities", data.velocity.len(), points, false),
                ("widths", data.width.len(), points, true),
                ("opacities", data.opacity.len(), shape.offsets.len(), true),
            ];
            for (what, count, expected, may_be_empty) in sizes {
                if count != expected && !(may_be_empty && count == 0) {
                    return Err(bad(format!("layer {:?} has {count} {what}, expected {expected}", shape.name)));
                }
            }
            if data.transmittance.len() != self.shadows {
                let found = data.transmittance.len();
                return Err(bad(format!("has {found} columns of transmittance, expected {}", self.shadows)));
            }
            for column in data.transmittance {
                if column.len() != points {
                    let what = format!("has {} values of transmittance, expected {points}", column.len());
                    return Err(bad(format!("layer {:?} {what}", shape.name)));
                }
                if let Some(i) = column.iter().position(|t| !(0.0..=1.0).contains(t)) {
                    let hair = shape.id[shape.offsets.run_of(i)];
                    return Err(bad(format!("layer {:?}, hair {hair}: a transmittance is {}", shape.name, column[i])));
                }
            }
            let scan = |what: &str, values: &[[f32; 3]]| match Bounds::of(values) {
                Some(b) => Ok(b),
                None => Err(bad(not_finite(shape, what, values))),
            };
            scan("velocity", data.velocity)?;
            if let Some(i) = data.width.iter().position(|w| !is_width(*w)) {
                let hair = shape.id[shape.offsets.run_of(i)];
                return Err(bad(format!("layer {:?}, hair {hair}: a width is {}", shape.name, data.width[i])));
            }
            if let Some(i) = data.opacity.iter().position(|x| !x.is_finite()) {
                let hair = shape.id[i];
                return Err(bad(format!("layer {:?}, hair {hair}: the opacity is {}", shape.name, data.opacity[i])));
            }
            bounds.push(scan("position", data.position)?);
        }
        self.written += 1;
        Ok(bounds)
    }

    /// Checks that every frame of the shot was written.
    pub(super) fn finish(&self) -> Result<(), FormatError> {
        match self.frames.get(self.written) {
            None => Ok(()),
            Some(next) => Err(FormatError::new(
                &self.path,
                format!("is not complete: {} of {} frames were written", self.written, self.frames.len()),
            )
            .at(format!("frame {next}"))),
        }
    }
}

/// A diameter that renderers take: finite and not negative.
pub(super) fn is_width(w: f32) -> bool {
    w.is_finite() && w >= 0.0
}

/// Names the hair and the point of the first value that is not a number.
fn not_finite(shape: &LayerShape, what: &str, values: &[[f32; 3]]) -> String {
    let point = values.iter().position(|v| v.iter().any(|x| !x.is_finite())).unwrap_or(0);
    let hair = shape.offsets.run_of(point);
    let along = point - shape.offsets.range(hair).start;
    format!("layer {:?}, hair {}: {what} of point {along} is {:?}", shape.name, shape.id[hair], values[point])
}

fn check_facts(path: &Path, facts: &ShotFacts) -> Result<(), FormatError> {
    let bad = |what: String| Err(FormatError::new(path, what));
    for (name, value) in [("fps", facts.fps), ("meters_per_unit", facts.meters_per_unit)] {
        if !(value.is_finite() && value > 0.0) {
            return bad(format!("{name} is {value}, expected a positive number"));
        }
    }
    if facts.up != 'Y' && facts.up != 'Z' {
        return bad(format!("up is {:?}, expected 'Y' or 'Z'", facts.up));
    }
    if facts.origin.iter().any(|x| !x.is_finite()) {
        return bad(format!("the origin is {:?}", facts.origin));
    }
    if facts.frames.is_empty() {
        return bad("the shot has no frames".into());
    }
    match facts.frames.windows(2).find(|w| w[0] >= w[1]) {
        Some(w) => bad(format!("frames must ascend, but {} is followed by {}", w[0], w[1])),
        None => Ok(()),
    }
}

fn check_layer(path: &Path, layer: &HairLayer) -> Result<(), FormatError> {
    let bad = |what: String| Err(FormatError::new(path, what).at(format!("layer {:?}", layer.name)));
    let (curves, points) = (layer.offsets.len(), layer.offsets.total());
    let sizes = [
        ("ids", layer.id.len(), curves, false),
        ("root texture coordinates", layer.root_uv.len(), curves, false),
        ("skin faces", layer.skin_face.len(), curves, true),
        ("skin weights", layer.skin_bary.len(), curves, true),
        ("colours", layer.color.len(), if layer.color.len() == points { points } else { curves }, false),
        ("opacities", layer.opacity.len(), curves, false),
        ("rest points", layer.rest.len(), points, false),
        ("widths", layer.width.len(), points, false),
    ];
    for (what, len, expected, may_be_empty) in sizes {
        if len != expected && !(may_be_empty && len == 0) {
            return bad(format!("has {len} {what}, expected {expected}"));
        }
    }
    if layer.skin_face.len() != layer.skin_bary.len() {
        return bad("has skin faces without skin weights or the reverse".into());
    }
    if let Some(short) = layer.offsets.counts().position(|n| n < 2) {
        let n = layer.offsets.range(short).len();
        return bad(format!("hair {} has {n} points, a curve needs at least 2", layer.id[short]));
    }
    let mut ids = layer.id.clone();
    ids.sort_unstable();
    if let Some(w) = ids.windows(2).find(|w| w[0] == w[1]) {
        return bad(format!("two hairs have the id {}", w[0]));
    }
    if let Some(big) = ids.last().filter(|&&id| id > i64::MAX as u64) {
        return bad(format!("the id {big} does not fit 63 bits"));
    }
    let per_curve = [
        ("root texture coordinate", bytemuck::cast_slice::<_, f32>(&layer.root_uv), 2),
        ("skin weight", bytemuck::cast_slice(&layer.skin_bary), 2),
        ("opacity", &layer.opacity, 1),
    ];
    for (what, values, width) in per_curve {
        if let Some(i) = values.iter().position(|x| !x.is_finite()) {
            return bad(format!("hair {}: the {what} is {}", layer.id[i / width], values[i]));
        }
    }
    if let Some(i) = layer.color.iter().position(|c| c.iter().any(|x| !x.is_finite())) {
        let hair = if layer.color_per_point() { layer.offsets.run_of(i) } else { i };
        return bad(format!("hair {}: a colour is {:?}", layer.id[hair], layer.color[i]));
    }
    if let Some(i) = layer.rest.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        let hair = layer.offsets.run_of(i);
        return bad(format!("hair {}: a point of the rest pose is {:?}", layer.id[hair], layer.rest[i]));
    }
    match layer.width.iter().position(|w| !is_width(*w)) {
        Some(i) => bad(format!("hair {}: a width is {}", layer.id[layer.offsets.run_of(i)], layer.width[i])),
        None => Ok(()),
    }
}

/// An axis-aligned box around points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

impl Bounds {
    /// The box around `points` (a point at zero if there are none), or `None` if a value is not finite.
    ///
    /// Four points at a time, so that the compiler can use vector instructions: this runs at memory speed.
    pub(super) fn of(points: &[[f32; 3]]) -> Option<Bounds> {
        let Some(&first) = points.first() else { return Some(Bounds { min: [0.0; 3], max: [0.0; 3] }) };
        let (blocks, tail) = points.as_chunks::<4>();
        let mut lo: [f32; 12] = std::array::from_fn(|k| first[k % 3]);
        let mut hi = lo;
        let mut wrong = [0u32; 12];
        let mut add = |v: [f32; 12]| {
            for k in 0..12 {
                lo[k] = if v[k] < lo[k] { v[k] } else { lo[k] };
                hi[k] = if v[k] > hi[k] { v[k] } else { hi[k] };
                wrong[k] |= u32::from(!v[k].is_finite());
            }
        };
        for block in blocks {
            add(bytemuck::cast(*block));
        }
        for p in tail {
            add(std::array::from_fn(|k| p[k % 3]));
        }
        if wrong.iter().any(|&w| w != 0) {
            return None;
        }
        let fold = |v: [f32; 12], pick: fn(f32, f32) -> f32| {
            std::array::from_fn(|a| pick(pick(v[a], v[a + 3]), pick(v[a + 6], v[a + 9])))
        };
        Some(Bounds { min: fold(lo, f32::min), max: fold(hi, f32::max) })
    }

    /// The box grown by `by` on every side, in single precision as other tools compute it.
    pub(super) fn padded(self, by: f32) -> [[f32; 3]; 2] {
        [self.min.map(|x| x - by), self.max.map(|x| x + by)]
    }
}

#[cfg(test)]
pub(super) mod samples {
    use super::*;

    /// Two layers with curves of different lengths; the second one has no skin.
    pub(crate) fn shot() -> (ShotFacts, Vec<HairLayer>) {
        let facts = ShotFacts {
            name: "sample".into(),
            meters_per_unit: 0.01,
            up: 'Y',
            fps: 24.0,
            frames: vec![1001, 1002, 1003],
            origin: [10.0, 0.5, -3.25],
            lights: vec![],
            extra: vec![("groom".into(), "bust \"long\" é".into()), ("version".into(), "0.1.0".into())],
        };
        let layer = |name: &str, counts: &[usize], skin: bool| {
            let offsets = Offsets::from_counts(counts.iter().copied());
            let (c, v) = (offsets.len(), offsets.total());
            let f = |i: usize, k: usize| ((i * 7 + k * 3) % 11) as f32 * 0.125 - 0.5;
            HairLayer {
                name: name.into(),
                id: (0..c as u64).map(|i| (i + 1).wrapping_mul(0x1357_9bdf_0246_8ace) >> 1).collect(),
                root_uv: (0..c).map(|i| [f(i, 0), f(i, 1)]).collect(),
                skin_face: if skin { (0..c as i32).collect() } else { vec![] },
                skin_bary: if skin { (0..c).map(|i| [0.25, 0.03125 * i as f32]).collect() } else { vec![] },
                rest: (0..v).map(|i| [f(i, 0), f(i, 1), f(i, 2)]).collect(),
                width: (0..v).map(|i| 0.01 + 0.001 * (i % 5) as f32).collect(),
                color: (0..c).map(|i| [0.5, 0.25, 0.0625 * i as f32]).collect(),
                opacity: (0..c).map(|i| 1.0 - 0.125 * i as f32).collect(),
                offsets,
            }
        };
        (facts, vec![layer("over coat", &[4, 2, 5], true), layer("2nd", &[3, 3, 3, 3, 7], false)])
    }

    /// The shot with a colour for each point of its first layer.
    pub(crate) fn coloured() -> (ShotFacts, Vec<HairLayer>) {
        let (facts, mut layers) = shot();
        layers[0].color = layers[0].rest.iter().map(|p| p.map(|x| 0.5 + 0.5 * x)).collect();
        (facts, layers)
    }

    /// The shot with two lights.
    pub(crate) fn lit() -> (ShotFacts, Vec<HairLayer>) {
        let (facts, layers) = shot();
        (ShotFacts { lights: vec!["key".into(), "rim-2".into()], ..facts }, layers)
    }

    /// Columns of transmittance of `layer` at `frame`.
    pub(crate) fn light(layer: &HairLayer, frame: i32) -> Vec<Vec<f32>> {
        let of = |c: usize| (0..layer.width.len()).map(|i| ((i + 3 * c + frame as usize) % 9) as f32 * 0.125).collect();
        (0..3).map(of).collect()
    }

    /// Hands the frames of the lit shot to a writer, one after another.
    pub(crate) fn write_lit(mut write: impl FnMut(i32, &[HairFrame])) {
        let (facts, layers) = lit();
        for &number in &facts.frames {
            let data: Vec<_> = layers.iter().map(|l| (frame(l, number), light(l, number))).collect();
            let frames = data.iter().map(|((position, velocity), transmittance)| HairFrame {
                position,
                velocity,
                transmittance,
                ..HairFrame::default()
            });
            write(number, &frames.collect::<Vec<_>>());
        }
    }

    /// Diameters and opacities of `layer` at `frame`, other than the layer's.
    pub(crate) fn look(layer: &HairLayer, frame: i32) -> (Vec<f32>, Vec<f32>) {
        let t = (frame - 1000) as f32;
        let width = layer.width.iter().map(|w| w * (1.0 + 0.25 * t)).collect();
        (width, layer.opacity.iter().map(|o| o * (1.0 - 0.125 * t)).collect())
    }

    /// Positions and velocities of `layer` at `frame`.
    pub(crate) fn frame(layer: &HairLayer, frame: i32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let t = (frame - 1000) as f32 * 0.1;
        let position = layer.rest.iter().map(|p| [p[0] + t * p[1], p[1] - t, p[2] * (1.0 + t)]).collect();
        let velocity = layer.rest.iter().map(|p| [2.4 * p[1], -2.4, 2.4 * p[2]]).collect();
        (position, velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_agree_with_a_plain_loop() {
        for n in 1..40usize {
            let points: Vec<[f32; 3]> =
                (0..n).map(|i| std::array::from_fn(|k| ((i * 31 + k * 17) % 23) as f32 - 11.5)).collect();
            let b = Bounds::of(&points).unwrap();
            for k in 0..3 {
                assert_eq!(b.min[k], points.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min));
                assert_eq!(b.max[k], points.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max));
            }
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut broken = points.clone();
                broken[n / 2][n % 3] = bad;
                assert_eq!(Bounds::of(&broken), None, "{bad} among {n}");
            }
        }
        assert_eq!(Bounds::of(&[]).unwrap().padded(1.0), [[-1.0; 3], [1.0; 3]]);
    }

    #[test]
    fn refuses_what_no_reader_could_use() {
        let path = Path::new("x");
        let (facts, layers) = samples::shot();
        assert!(ShotCheck::new(path, &facts, &layers).is_ok());
        type Spoil = fn(&mut ShotFacts, &mut Vec<HairLayer>);
        let wrong: [(&str, Spoil); 12] = [
            ("fps", |f, _| f.fps = 0.0),
            ("meters_per_unit", |f, _| f.meters_per_unit = f64::NAN),
            ("up", |f, _| f.up = 'X'),
            ("origin", |f, _| f.origin[1] = f64::INFINITY),
            ("no frames", |f, _| f.frames.clear()),
            ("ascend", |f, _| f.frames[1] = 1001),
            ("two layers", |_, l| l[1].name = l[0].name.clone()),
            ("at least 2", |_, l| l[1].offsets = Offsets::from_counts([3, 3, 1, 5, 7])),
            ("two hairs", |_, l| l[0].id[2] = l[0].id[1]),
            ("63 bits", |_, l| l[0].id[0] = u64::MAX),
            ("width", |_, l| l[0].width[3] = -1.0),
            ("rest", |_, l| l[0].rest[10][1] = f32::NAN),
        ];
        for (word, spoil) in wrong {
            let (mut f, mut l) = (facts.clone(), layers.clone());
            spoil(&mut f, &mut l);
            let error = ShotCheck::new(path, &f, &l).unwrap_err().to_string();
            assert!(error.contains(word), "{word}: {error}");
        }
    }

    #[test]
    fn a_value_that_is_not_finite_is_named_by_its_hair() {
        let (facts, layers) = samples::shot();
        let mut check = ShotCheck::new(Path::new("x"), &facts, &layers).unwrap();
        let (p0, v0) = samples::frame(&layers[0], 1001);
        let (mut p1, v1) = samples::frame(&layers[1], 1001);
        p1[7][2] = f32::NAN;
        let of = |position, velocity| HairFrame { position, velocity, ..HairFrame::default() };
        let frames = [of(&p0, &v0), of(&p1, &v1)];
        let error = check.frame(1001, &frames).unwrap_err().to_string();
        assert!(error.contains(&format!("hair {}: position of point 1", layers[1].id[2])), "{error}");
        assert!(check.finish().is_err());
    }

    #[test]
    fn columns_of_a_frame_are_of_the_right_size_and_sound() {
        let (facts, layers) = samples::shot();
        let fresh = || ShotCheck::new(Path::new("x"), &facts, &layers).unwrap();
        let data: Vec<_> = layers.iter().map(|l| (samples::frame(l, 1001), samples::look(l, 1001))).collect();
        let of = |k: usize| {
            let ((position, velocity), (width, opacity)) = &data[k];
            HairFrame { position, velocity, width, opacity, transmittance: &[] }
        };
        fresh().frame(1001, &[of(0), of(1)]).unwrap();
        let error = |f: HairFrame| fresh().frame(1001, &[of(0), f]).unwrap_err().to_string();
        assert!(error(HairFrame { width: &[0.1; 4], ..of(1) }).contains("has 4 widths, expected 19"));
        assert!(error(HairFrame { opacity: &[0.1; 19], ..of(1) }).contains("has 19 opacities, expected 5"));
        let lit = [vec![0.5; 19], vec![1.0; 19]];
        assert!(error(HairFrame { transmittance: &lit, ..of(1) }).contains("2 columns of transmittance, expected 0"));
        let (facts, layers) = samples::lit();
        let mut lit: Vec<_> = layers.iter().map(|l| samples::light(l, 1001)).collect();
        let run = |lit: &[Vec<Vec<f32>>]| {
            let frame = |k: usize| HairFrame { transmittance: &lit[k], ..of(k) };
            let mut check = ShotCheck::new(Path::new("x"), &facts, &layers).unwrap();
            check.frame(1001, &[frame(0), frame(1)]).map(drop).map_err(|e| e.to_string())
        };
        run(&lit).unwrap();
        lit[1][2][4] = 1.5;
        let hair = layers[1].id[1];
        assert!(run(&lit).unwrap_err().contains(&format!("hair {hair}: a transmittance is 1.5")));
        lit[1][2].pop();
        assert!(run(&lit).unwrap_err().contains("18 values of transmittance, expected 19"));
        let mut width = data[1].1.0.clone();
        width[4] = -0.5;
        let hair = layers[1].id[1];
        assert!(error(HairFrame { width: &width, ..of(1) }).contains(&format!("hair {hair}: a width is -0.5")));
        let opacity = [0.5, f32::NAN, 0.5, 0.5, 0.5];
        assert!(error(HairFrame { opacity: &opacity, ..of(1) }).contains(&format!("hair {hair}: the opacity is NaN")));
    }

    #[test]
    fn colours_are_one_a_curve_or_one_a_point() {
        let (facts, mut layers) = samples::coloured();
        let check = |l: &[HairLayer]| ShotCheck::new(Path::new("x"), &facts, l);
        assert!(layers[0].color_per_point() && !layers[1].color_per_point() && check(&layers).is_ok());
        layers[0].color[5][1] = f32::NAN;
        let error = check(&layers).unwrap_err().to_string();
        assert!(error.contains(&format!("hair {}: a colour", layers[0].id[1])), "{error}");
        layers[0].color.pop();
        assert!(check(&layers).unwrap_err().to_string().contains("has 10 colours, expected 3"));
    }
}
