//! Painted maps: linear values over the texture square, v up, sampled bilinearly.

/// One image. Row 0 is the bottom of the texture square (v = 0).
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Texels along u.
    pub width: usize,
    /// Texels along v.
    pub height: usize,
    /// Values per texel: 1 or 3.
    pub channels: usize,
    /// `height` rows of `width` texels of `channels` values, bottom row first.
    pub data: Vec<f32>,
}

/// What a map says outside its texture square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The border texel goes on.
    #[default]
    Clamp,
    /// The map repeats.
    Repeat,
}

/// A map over one texture square or over several UDIM tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct TiledMap {
    /// (UDIM number, map), ascending. A single map that is not tiled has number 0.
    pub tiles: Vec<(u32, Map)>,
    /// Behaviour outside the texture square; within tiles always clamped.
    pub wrap: Wrap,
}

/// UDIM number of a point: 1001 + floor(u) + 10 floor(v), for u in [0, 10) and v >= 0.
pub fn udim(uv: [f32; 2]) -> Option<u32> {
    let (u, v) = (uv[0].floor(), uv[1].floor());
    ((0.0..10.0).contains(&u) && (0.0..900.0).contains(&v)).then(|| 1001 + u as u32 + 10 * v as u32)
}

impl Map {
    /// Bilinear sample at texture coordinates; texel (i, j) has its centre at ((i + 0.5) / width, (j + 0.5) / height).
    /// Unused channels are 0.
    pub fn sample(&self, uv: [f32; 2], wrap: Wrap) -> [f32; 3] {
        let (i, fu) = texels(uv[0], self.width, wrap);
        let (j, fv) = texels(uv[1], self.height, wrap);
        std::array::from_fn(|c| {
            if c >= self.channels {
                return 0.0;
            }
            let at = |i: usize, j: usize| self.data[(j * self.width + i) * self.channels + c];
            let low = lerp(at(i[0], j[0]), at(i[1], j[0]), fu);
            let high = lerp(at(i[0], j[1]), at(i[1], j[1]), fu);
            lerp(low, high, fv)
        })
    }
}

/// `a` at 0, `b` at 1, and exactly `a` where both are equal.
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// The two texels around a coordinate and the weight of the second.
fn texels(x: f32, size: usize, wrap: Wrap) -> ([usize; 2], f32) {
    let x = match wrap {
        Wrap::Clamp => x.clamp(0.0, 1.0),
        Wrap::Repeat => x - x.floor(),
    };
    let t = x * size as f32 - 0.5;
    let low = t.floor();
    let last = size as i64 - 1;
    let fit = |i: i64| match wrap {
        Wrap::Clamp => i.clamp(0, last) as usize,
        Wrap::Repeat => i.rem_euclid(size as i64) as usize,
    };
    ([fit(low as i64), fit(low as i64 + 1)], t - low)
}

impl TiledMap {
    /// First channel of the texel that a point lies in; 0 where no tile covers it.
    pub fn nearest(&self, uv: [f32; 2]) -> f32 {
        let texel = |map: &Map, uv: [f32; 2], wrap| {
            let side = |x: f32, size: usize| {
                let (near, weight) = texels(x, size, wrap);
                near[usize::from(weight >= 0.5)]
            };
            map.data[(side(uv[1], map.height) * map.width + side(uv[0], map.width)) * map.channels]
        };
        match self.tiles.as_slice() {
            [(0, map)] => texel(map, uv, self.wrap),
            tiles => {
                let found = udim(uv).and_then(|n| tiles.binary_search_by_key(&n, |t| t.0).ok());
                found.map_or(0.0, |k| texel(&tiles[k].1, uv.map(|x| x - x.floor()), Wrap::Clamp))
            }
        }
    }

    /// Bilinear sample; 0 where no tile covers the point.
    pub fn sample(&self, uv: [f32; 2]) -> [f32; 3] {
        match self.tiles.as_slice() {
            [(0, map)] => map.sample(uv, self.wrap),
            tiles => {
                let found = udim(uv).and_then(|n| tiles.binary_search_by_key(&n, |t| t.0).ok());
                found.map_or([0.0; 3], |k| {
                    tiles[k].1.sample([uv[0] - uv[0].floor(), uv[1] - uv[1].floor()], Wrap::Clamp)
                })
            }
        }
    }

    /// First channel of [`TiledMap::sample`].
    pub fn value(&self, uv: [f32; 2]) -> f32 {
        self.sample(uv)[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Map {
        Map { width: 4, height: 2, channels: 1, data: vec![0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0, 13.0] }
    }

    #[test]
    fn texel_centres_give_texel_values_and_v_is_up() {
        assert_eq!(ramp().sample([0.125, 0.25], Wrap::Clamp)[0], 0.0);
        assert_eq!(ramp().sample([0.875, 0.75], Wrap::Clamp)[0], 13.0);
        assert_eq!(ramp().sample([0.5, 0.5], Wrap::Clamp)[0], 6.5);
    }

    #[test]
    fn outside_the_square() {
        assert_eq!(ramp().sample([-3.0, 0.25], Wrap::Clamp)[0], 0.0);
        assert_eq!(ramp().sample([1.125, 0.25], Wrap::Repeat)[0], 0.0);
        assert_eq!(ramp().sample([0.0, 0.25], Wrap::Repeat)[0], 1.5);
    }

    #[test]
    fn udim_tiles_are_found_by_number() {
        let flat = |v| Map { width: 1, height: 1, channels: 1, data: vec![v] };
        let map = TiledMap { tiles: vec![(1001, flat(1.0)), (1012, flat(2.0))], wrap: Wrap::Clamp };
        assert_eq!(map.value([0.5, 0.5]), 1.0);
        assert_eq!(map.value([1.5, 1.5]), 2.0);
        assert_eq!(map.value([1.5, 0.5]), 0.0);
        assert_eq!(map.value([-0.5, 0.5]), 0.0);
    }
}
