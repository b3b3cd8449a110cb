//! Rigid motions and particles as text: one sample a line.

use super::FormatError;
use super::ply::read_bytes;
use pelage_geom::RigidMotion;
use pelage_groom::areas::Particle;
use std::path::Path;

/// Quaternions whose length is off by more than this are errors, not rounding: three decimals are the least that
/// exporters print. Lower rejects short tables; higher lets columns in the wrong order pass.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Columns in the order in which a row is kept.
const COLUMNS: [&str; 8] = ["time_s", "tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// Reads a motion table: lines that start with `#` are comments, the first other line names the columns, in any order:
/// `time_s` (seconds; or `frame`, divided by `fps`), `tx ty tz` (displacement in metres), `qx qy qz qw` (rotation).
/// Further columns are ignored. Displacements come back in scene units of `meters_per_unit` metres, quaternions with
/// length 1.
pub fn read_motion(path: &Path, meters_per_unit: f64, fps: f64) -> Result<RigidMotion, FormatError> {
    let bytes = read_bytes(path)?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|_| FormatError::new(path, "not a text file in UTF-8").hint("save it as CSV in UTF-8"))?;
    parse_motion(path, text, meters_per_unit, fps)
}

fn parse_motion(path: &Path, text: &str, meters_per_unit: f64, fps: f64) -> Result<RigidMotion, FormatError> {
    let (rows, time_name) = rows(path, text, COLUMNS)?;
    let mut motion = RigidMotion::default();
    for (number, v) in rows {
        let wrong = |what: String| FormatError::new(path, what).at(format!("line {number}"));
        let time = if time_name == "frame" { v[0] / fps } else { v[0] };
        if let Some(last) = motion.time.last().filter(|t| **t >= time) {
            let what = format!("column {time_name}: time {time} s does not come after {last} s of the line before");
            return Err(wrong(what).hint("samples must be in the order of time, each time once"));
        }
        let norm = v[4..].iter().map(|x| x * x).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > UNIT_TOLERANCE {
            let what = format!("columns qx, qy, qz, qw: a rotation has length 1, this has {norm}");
            return Err(wrong(what).hint("check the order of the columns (the real part is qw)"));
        }
        motion.time.push(time);
        motion.translation.push(std::array::from_fn(|i| v[1 + i] / meters_per_unit));
        motion.rotation.push(std::array::from_fn(|i| v[4 + i] / norm));
    }
    match motion.time.is_empty() {
        true => Err(FormatError::new(path, "no samples: expected one a line after the header")),
        false => Ok(motion),
    }
}

/// Reads a table of particles, laid out like a motion table: `frame` (or `time_s`, times `fps`, from frame 0) when each
/// leaves, `x y z` where from, scene units, `dx dy dz` where to.
pub fn read_particles(path: &Path, fps: f64) -> Result<Vec<Particle>, FormatError> {
    let bytes = read_bytes(path)?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|_| FormatError::new(path, "not a text file in UTF-8").hint("save it as CSV in UTF-8"))?;
    let (rows, time_name) = rows(path, text, ["time_s", "x", "y", "z", "dx", "dy", "dz"])?;
    let particle = |(k, (number, v)): (usize, (usize, [f64; 7]))| {
        let direction = [v[4], v[5], v[6]];
        if direction == [0.0; 3] {
            let what = "columns dx, dy, dz: a particle needs a direction";
            return Err(FormatError::new(path, what).at(format!("line {number}")));
        }
        let time = if time_name == "frame" { v[0] } else { v[0] * fps };
        Ok(Particle { number: k as u64, time, origin: [v[1], v[2], v[3]], direction })
    };
    rows.into_iter().enumerate().map(particle).collect()
}

/// Rows of a table with their lines, and what it calls its first column: `time_s` or `frame`.
type Rows<const N: usize> = (Vec<(usize, [f64; N])>, &'static str);

fn rows<const N: usize>(path: &Path, text: &str, names: [&'static str; N]) -> Result<Rows<N>, FormatError> {
    let wrong = |line: usize, what: String| FormatError::new(path, what).at(format!("line {line}"));
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text
        .split(['\n', '\r'])
        .zip(LineNumbers::new(text))
        .map(|(line, number)| (number, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let Some((number, header)) = lines.next() else {
        return Err(FormatError::new(path, "no lines: expected a header and one sample a line"));
    };
    let columns = columns(header, &names).map_err(|what| {
        let all = names[1..].join(", ");
        wrong(number, what).hint(format!("expected columns time_s (or frame), {all}, separated by commas"))
    })?;
    let cells_of_header = header.split(',').count();
    let mut out = Vec::new();
    for (number, line) in lines {
        let cells: Vec<&str> = line.split(',').map(unquote).collect();
        if cells.len() != cells_of_header {
            return Err(wrong(number, format!("{} values, the header has {cells_of_header} columns", cells.len())));
        }
        let mut v = [0.0; N];
        for (value, (cell, name)) in v.iter_mut().zip(&columns) {
            let text = cells[*cell];
            *value = match text.parse::<f64>() {
                Ok(x) if x.is_finite() => x,
                Ok(_) => return Err(wrong(number, format!("column {name}: '{text}' is not a finite number"))),
                Err(_) => return Err(wrong(number, format!("column {name}: '{text}' is not a number"))),
            };
        }
        out.push((number, v));
    }
    Ok((out, columns[0].1))
}

/// For each of `names` where it stands and what the header calls it.
fn columns(header: &str, names: &[&'static str]) -> Result<Vec<(usize, &'static str)>, String> {
    let cells: Vec<String> = header.split(',').map(|c| unquote(c).to_ascii_lowercase()).collect();
    let read = |c: &String| names.contains(&c.as_str()) || c == "frame";
    if let Some((k, name)) = cells.iter().enumerate().find(|(k, c)| read(c) && cells[..*k].contains(c)) {
        return Err(format!("column '{name}' stands twice (the second is column {})", k + 1));
    }
    let find = |name: &'static str| cells.iter().position(|c| c == name).map(|k| (k, name));
    names
        .iter()
        .map(|name| {
            let or_frame = if *name == "time_s" { find("frame") } else { None };
            find(name).or(or_frame).ok_or_else(|| format!("no column '{name}'"))
        })
        .collect()
}

fn unquote(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

/// Line numbers of the pieces of a text that was split at every `\n` and every `\r`: `\r\n` ends one line.
struct LineNumbers<'a> {
    rest: &'a [u8],
    number: usize,
    first: bool,
}

impl<'a> LineNumbers<'a> {
    fn new(text: &'a str) -> Self {
        LineNumbers { rest: text.as_bytes(), number: 1, first: true }
    }
}

impl Iterator for LineNumbers<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        if !std::mem::take(&mut self.first) {
            let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r'))?;
            let half = self.rest[end] == b'\r' && self.rest.get(end + 1) == Some(&b'\n');
            self.number += usize::from(!half);
            self.rest = &self.rest[end + 1..];
        }
        Some(self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<RigidMotion, FormatError> {
        parse_motion(Path::new("m.csv"), text, 0.01, 24.0)
    }

    fn error(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    const HEAD: &str = "time_s,tx,ty,tz,qx,qy,qz,qw\n";

    #[test]
    fn columns_in_any_order_in_scene_units() {
        let m = parse("# made by hand\n\nqw, extra ,qx,qy,qz,tz,ty,tx,frame,time_s\n1,7,0,0,0,0.3,0.2,0.1,12,0.5\n")
            .unwrap();
        assert_eq!(m.time, [0.5]);
        assert_eq!(m.translation, [[0.1 / 0.01, 0.2 / 0.01, 0.3 / 0.01]]);
        assert_eq!(m.rotation, [[0.0, 0.0, 0.0, 1.0]]);
    }

    #[test]
    fn frames_become_seconds_and_quaternions_units() {
        let m = parse("frame,tx,ty,tz,qx,qy,qz,qw\r\n-12,0,0,0,0,0,0.6,0.8005\r\n12,0,0,0,0,0,0,-1\r\n").unwrap();
        assert_eq!(m.time, [-0.5, 0.5]);
        let n: f64 = m.rotation[0].iter().map(|x| x * x).sum();
        assert!((n - 1.0).abs() < 1e-15);
        assert_eq!(m.rotation[1][3], -1.0);
    }

    #[test]
    fn lines_and_columns_are_named() {
        let row = "0,0,0,0,0,0,0,1\n";
        assert!(error("").contains("no lines"));
        assert!(error("# only this\n").contains("no lines"));
        assert!(error(HEAD).contains("no samples"));
        assert!(error("time_s,tx,ty,tz,qx,qy,qz\n").contains("(line 1): no column 'qw'"));
        assert!(error("t,tx,ty,tz,qx,qy,qz,qw\n").contains("no column 'time_s'"));
        assert!(error("tx,tx,ty,tz,qx,qy,qz,qw\n").contains("stands twice"));
        assert!(error(&format!("# c\r\n{HEAD}{row}1,0,0,0,0,0,0\n")).contains("(line 4): 7 values, the header has 8"));
        assert!(error(&format!("{HEAD}0,0,up,0,0,0,0,1\n")).contains("(line 2): column ty: 'up' is not a number"));
        assert!(error(&format!("{HEAD}0,0,0,nan,0,0,0,1\n")).contains("column tz: 'nan' is not a finite"));
        assert!(
            error(&format!("{HEAD}{row}\n{row}")).contains("(line 4): column time_s: time 0 s does not come after 0 s")
        );
        assert!(error(&format!("{HEAD}0,0,0,0,0,0,0,0\n")).contains("this has 0"));
        assert!(error(&format!("{HEAD}0,0,0,0,0,0,0,1.002\n")).contains("length 1, this has 1.002"));
        assert!(parse(&format!("{HEAD}0,0,0,0,0,0,0,0.9995\n")).is_ok());
    }
}
