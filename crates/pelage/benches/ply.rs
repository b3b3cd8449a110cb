//! Times of PLY: a skin of a million triangles, a table of a million rows. Best of three.

use pelage::format::ply::{Column, Table, parse_mesh, parse_tables, write_tables};
use std::path::Path;
use std::time::Instant;

/// Triangulated grid of `n` x `n` squares as binary little-endian PLY: 8 floats a vertex.
fn grid(columns: usize, rows: usize) -> Vec<u8> {
    let (across, up) = (columns + 1, rows + 1);
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        across * up,
        2 * columns * rows
    )
    .into_bytes();
    for i in 0..across * up {
        let (x, y) = ((i % across) as f32, (i / across) as f32);
        let (s, t) = (x / columns as f32, y / rows as f32);
        for v in [x, y, (x * 0.37).fract(), 0.0, 0.0, 1.0, s, t] {
            out.extend(v.to_le_bytes());
        }
    }
    for q in 0..columns * rows {
        let a = (q / columns * across + q % columns) as i32;
        let (b, c, d) = (a + 1, a + 1 + across as i32, a + across as i32);
        for t in [[a, b, c], [a, c, d]] {
            out.push(3);
            t.iter().for_each(|v| out.extend(v.to_le_bytes()));
        }
    }
    out
}

fn best<T>(name: &str, mut run: impl FnMut() -> T) {
    let best = (0..3).map(|_| {
        let start = Instant::now();
        std::hint::black_box(run());
        start.elapsed().as_secs_f64() * 1e3
    });
    println!("{name}: {:.1} ms", best.fold(f64::INFINITY, f64::min));
}

fn main() {
    let path = Path::new("bench.ply");
    let mesh = grid(1000, 500);
    println!("mesh: {} bytes", mesh.len());
    best("read a mesh of 1,000,000 triangles", || parse_mesh(path, &mesh).map(|m| m.mesh.triangle.len()));
    let column = |k: usize| (format!("c{k}"), Column::F32((0..1_000_000).map(|i| (i * (k + 1)) as f32).collect()));
    let table = [Table { name: "t".into(), rows: 1_000_000, columns: (0..3).map(column).collect() }];
    let mut bytes = Vec::new();
    best("write a table of 1,000,000 rows x 3 f32", || {
        bytes.clear();
        write_tables(&mut bytes, &[], &table).map(|()| bytes.len())
    });
    best("read it", || parse_tables(path, &bytes).map(|t| t.tables.len()));
}
