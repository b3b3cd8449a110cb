//! Symmetric positive definite systems with entries near the diagonal: ordering and Cholesky factorisation.

/// Cholesky factor of a matrix whose entries lie within `width` of the diagonal, after renumbering.
pub struct Banded {
    /// Unknown -> row.
    row: Vec<usize>,
    width: usize,
    /// Row i holds columns i - width ..= i of the lower factor.
    lower: Vec<f64>,
}

/// Rows in the order in which a breadth-first search from the last vertex of another one meets them (Cuthill, McKee
/// 1969): linked unknowns get near numbers.
fn order(link: &[Vec<usize>]) -> Vec<usize> {
    let search = |starts: &mut dyn Iterator<Item = usize>| {
        let (mut seen, mut found) = (vec![false; link.len()], Vec::with_capacity(link.len()));
        for start in starts {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            found.push(start);
            let mut next = found.len() - 1;
            while next < found.len() {
                for &w in &link[found[next]] {
                    if !seen[w] {
                        seen[w] = true;
                        found.push(w);
                    }
                }
                next += 1;
            }
        }
        found
    };
    let mut found = search(&mut (0..link.len()));
    found.reverse();
    let found = search(&mut found.into_iter());
    let mut row = vec![0; link.len()];
    found.iter().enumerate().for_each(|(r, &v)| row[v] = r);
    row
}

impl Banded {
    /// Factors the matrix of `n` unknowns with `diagonal` and symmetric off-diagonal `entries` (i, j, value), each pair
    /// given once or in summands.
    pub fn new(diagonal: &[f64], entries: &[(usize, usize, f64)]) -> Banded {
        let n = diagonal.len();
        let mut link = vec![Vec::new(); n];
        for &(i, j, _) in entries {
            link[i].push(j);
            link[j].push(i);
        }
        for l in &mut link {
            l.sort_unstable();
            l.dedup();
        }
        let row = order(&link);
        let width = entries.iter().map(|&(i, j, _)| row[i].abs_diff(row[j])).max().unwrap_or(0);
        let mut lower = vec![0.0; n * (width + 1)];
        for (i, d) in diagonal.iter().enumerate() {
            lower[row[i] * (width + 1) + width] += d;
        }
        for &(i, j, x) in entries {
            let (a, b) = (row[i].max(row[j]), row[i].min(row[j]));
            lower[a * (width + 1) + b + width - a] += x;
        }
        let mut factor = Banded { row, width, lower };
        factor.factorise(n);
        factor
    }

    fn factorise(&mut self, n: usize) {
        let w = self.width;
        for i in 0..n {
            let first = i.saturating_sub(w);
            let (done, rest) = self.lower.split_at_mut(i * (w + 1));
            let this = &mut rest[..w + 1];
            for j in first..=i {
                let from = first.max(j.saturating_sub(w));
                let mine = &this[from + w - i..j + w - i];
                if j < i {
                    let other = &done[j * (w + 1)..(j + 1) * (w + 1)];
                    let dot: f64 = mine.iter().zip(&other[from + w - j..w]).map(|(a, b)| a * b).sum();
                    this[j + w - i] = (this[j + w - i] - dot) / other[w];
                } else {
                    let dot: f64 = mine.iter().map(|a| a * a).sum();
                    this[w] = (this[w] - dot).max(1e-30).sqrt();
                }
            }
        }
    }

    /// Solves for two right sides at once.
    pub fn solve(&self, right: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let (n, w) = (right.len(), self.width);
        let mut x = vec![[0.0; 2]; n];
        for (v, r) in right.iter().enumerate() {
            x[self.row[v]] = *r;
        }
        for i in 0..n {
            let first = i.saturating_sub(w);
            let a = &self.lower[i * (w + 1)..(i + 1) * (w + 1)];
            let mut s = x[i];
            for j in first..i {
                for c in 0..2 {
                    s[c] -= a[j + w - i] * x[j][c];
                }
            }
            x[i] = s.map(|s| s / a[w]);
        }
        for i in (0..n).rev() {
            let first = i.saturating_sub(w);
            let a = &self.lower[i * (w + 1)..(i + 1) * (w + 1)];
            x[i] = x[i].map(|s| s / a[w]);
            let s = x[i];
            for j in first..i {
                for c in 0..2 {
                    x[j][c] -= a[j + w - i] * s[c];
                }
            }
        }
        self.row.iter().map(|&r| x[r]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_of_springs_is_solved() {
        let n = 37;
        let link: Vec<(usize, usize, f64)> =
            (0..n).map(|i| (i, (i * 5 + 3) % n, -0.3)).filter(|e| e.0 != e.1).collect();
        let diagonal = vec![2.0; n];
        let x: Vec<[f64; 2]> = (0..n).map(|i| [i as f64, 1.0 - (i * i % 7) as f64]).collect();
        let mut b: Vec<[f64; 2]> = x.iter().map(|x| x.map(|c| 2.0 * c)).collect();
        for &(i, j, a) in &link {
            for c in 0..2 {
                b[i][c] += a * x[j][c];
                b[j][c] += a * x[i][c];
            }
        }
        let y = Banded::new(&diagonal, &link).solve(&b);
        assert!(x.iter().zip(&y).all(|(x, y)| (x[0] - y[0]).abs() + (x[1] - y[1]).abs() < 1e-10));
    }
}
