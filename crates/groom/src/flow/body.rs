//! A body of source panels, and the strengths that give the flow through them that is asked for.

use super::{Element, Flow, Panel};
use nalgebra::{DMatrix, DVector};
use pelage_geom::Vec3;
use rayon::prelude::*;
use std::fmt;

/// What is wrong with the input of a flow.
#[derive(Clone, Debug, PartialEq)]
pub enum FlowError {
    /// A body without triangles.
    NoPanels,
    /// A triangle that names a vertex which is not there.
    BadVertex {
        /// The triangle.
        triangle: usize,
    },
    /// A triangle without area, or with a position that is not a number.
    NoArea {
        /// The triangle.
        triangle: usize,
    },
    /// A closed mesh whose triangles are clockwise seen from outside.
    InsideOut,
    /// Two panels that lie on each other, or another surface on which the normal velocities contradict each other.
    Singular,
    /// Not one normal velocity a panel.
    WrongCount {
        /// Panels.
        panels: usize,
        /// Normal velocities.
        given: usize,
    },
    /// A velocity at a panel that is not a number: an element or a normal velocity is not.
    NotFinite {
        /// The panel.
        panel: usize,
    },
    /// A grid with no or with too many cells.
    BadGrid {
        /// Nodes it would have, as far as they can be counted.
        nodes: f64,
    },
}

impl fmt::Display for FlowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FlowError::NoPanels => write!(f, "the body has no triangles"),
            FlowError::BadVertex { triangle } => {
                write!(f, "triangle {triangle} of the body names a vertex that is not there")
            }
            FlowError::NoArea { triangle } => write!(f, "triangle {triangle} of the body has no area"),
            FlowError::InsideOut => write!(f, "the triangles of the body face inward"),
            FlowError::Singular => {
                write!(f, "the flow through the panels of the body can't be chosen freely: some lie on each other")
            }
            FlowError::WrongCount { panels, given } => {
                write!(f, "the body has {panels} panels, and {given} normal velocities are given")
            }
            FlowError::NotFinite { panel } => {
                write!(f, "the velocity at panel {panel} of the body is not a finite number")
            }
            FlowError::BadGrid { nodes } => {
                write!(f, "the grid of the flow would have {nodes} nodes: choose larger cells or a smaller box")
            }
        }
    }
}

impl std::error::Error for FlowError {}

/// Panels and the factored matrix of the velocities that they induce on each other.
#[derive(Clone, Debug)]
pub struct Body {
    panel: Vec<Panel>,
    factored: Factored,
}

/// A matrix as the product of a lower triangle with ones on its diagonal and an upper one, its rows in another order.
#[derive(Clone, Debug, PartialEq)]
pub struct Factored {
    /// \[N * N\] both triangles in one, column after column.
    pub matrix: Vec<f64>,
    /// \[N\] the row of the matrix that stands in each.
    pub row: Vec<u32>,
}

impl Body {
    /// Factors the matrix of a closed mesh (triangles counter-clockwise seen from outside): the paper's flow boundary
    /// form S(i, j), the normal velocity at the centre of panel i by a unit strength of panel j (equation 9). N panels
    /// take 8 N^2 bytes and time as N^3: 1,000 panels half a second.
    pub fn new(position: &[[f64; 3]], triangle: &[[u32; 3]]) -> Result<Self, FlowError> {
        if triangle.is_empty() {
            return Err(FlowError::NoPanels);
        }
        let panel = |(t, tri): (usize, &[u32; 3])| {
            if tri.iter().any(|v| *v as usize >= position.len()) {
                return Err(FlowError::BadVertex { triangle: t });
            }
            Panel::new(pelage_geom::mesh::corners(position, *tri)).ok_or(FlowError::NoArea { triangle: t })
        };
        let panel: Vec<Panel> = triangle.iter().enumerate().map(panel).collect::<Result<_, _>>()?;
        if is_inside_out(&panel) {
            return Err(FlowError::InsideOut);
        }
        let factored = influence(&panel).lu();
        let pivot = factored.lu_internal().diagonal().abs();
        // The diagonal is 1/2; a sound body has pivots of 0.1 to 1.
        if pivot.iter().any(|p| !(*p).is_finite() || *p < 1e-10) {
            return Err(FlowError::Singular);
        }
        let mut row = DVector::from_iterator(panel.len(), 0..panel.len() as u32);
        factored.p().permute_rows(&mut row);
        let factored = Factored { matrix: factored.lu_internal().as_slice().to_vec(), row: row.as_slice().to_vec() };
        Ok(Body { panel, factored })
    }

    /// It again from its mesh and its factored matrix; `None` if these do not belong together.
    pub fn again(position: &[[f64; 3]], triangle: &[[u32; 3]], factored: Factored) -> Option<Self> {
        let n = triangle.len();
        let fits = factored.matrix.len() == n * n
            && factored.row.len() == n
            && factored.row.iter().all(|r| (*r as usize) < n)
            && triangle.iter().flatten().all(|v| (*v as usize) < position.len());
        let panel = |tri: &[u32; 3]| Panel::new(pelage_geom::mesh::corners(position, *tri));
        let panel: Vec<Panel> = if fits { triangle.iter().map(panel).collect::<Option<_>>()? } else { return None };
        Some(Body { panel, factored })
    }

    /// Its factored matrix.
    pub fn factored(&self) -> &Factored {
        &self.factored
    }

    /// The panels, one a triangle.
    pub fn panels(&self) -> &[Panel] {
        &self.panel
    }

    /// \[N\] strengths with which the flow of elements and panels leaves panel i at the speed `normal_velocity[i]`
    /// along its normal, at its centre (equation 8). Negative speeds go in.
    pub fn solve(&self, elements: &[Element], normal_velocity: &[f64]) -> Result<Vec<f64>, FlowError> {
        if normal_velocity.len() != self.panel.len() {
            return Err(FlowError::WrongCount { panels: self.panel.len(), given: normal_velocity.len() });
        }
        let flow = Flow { elements, ..Flow::default() };
        let wanted = |(p, v): (&Panel, &f64)| v - flow.by_elements(p.centre).dot(&p.normal);
        let wanted: Vec<f64> = self.panel.iter().zip(normal_velocity).map(wanted).collect();
        if let Some(panel) = wanted.iter().position(|x| !x.is_finite()) {
            return Err(FlowError::NotFinite { panel });
        }
        let Factored { matrix, row } = &self.factored;
        let n = row.len();
        let mut right: Vec<f64> = row.iter().map(|r| wanted[*r as usize]).collect();
        // Down through the lower triangle, up through the upper one, column by column.
        for j in 0..n {
            let (above, below) = right.split_at_mut(j + 1);
            let x = above[j];
            below.iter_mut().zip(&matrix[j * n + j + 1..]).for_each(|(b, m)| *b -= m * x);
        }
        for j in (0..n).rev() {
            let column = &matrix[j * n..j * n + j + 1];
            let x = right[j] / column[j];
            right[j] = x;
            right[..j].iter_mut().zip(column).for_each(|(b, m)| *b -= m * x);
        }
        Ok(right)
    }

    /// The flow of some elements and of strengths that were solved for with them.
    pub fn flow<'a>(&'a self, elements: &'a [Element], strength: &'a [f64]) -> Flow<'a> {
        Flow { elements, panels: &self.panel, strength }
    }
}

/// True for a closed mesh of negative volume: the flow within it can't go through it as it likes.
fn is_inside_out(panel: &[Panel]) -> bool {
    let area: f64 = panel.iter().map(|p| p.area).sum();
    let facing = panel.iter().fold(Vec3::zeros(), |s, p| s + p.normal * p.area);
    let origin = panel[0].centre;
    let volume: f64 = panel.iter().map(|p| (p.centre - origin).dot(&p.normal) * p.area).sum();
    facing.norm() < 1e-6 * area && volume < 0.0
}

/// The matrix, its columns in parallel.
fn influence(panel: &[Panel]) -> DMatrix<f64> {
    let n = panel.len();
    let mut matrix = DMatrix::zeros(n, n);
    matrix.as_mut_slice().par_chunks_mut(n).enumerate().for_each(|(j, column)| {
        for (i, (s, p)) in column.iter_mut().zip(panel).enumerate() {
            // The own centre, or that of a panel on this one, is just outside.
            let own = i == j || (p.centre - panel[j].centre).norm_squared() < 1e-18 * p.area;
            let v: Vec3 = if own { panel[j].velocity_at_centre() } else { panel[j].velocity(p.centre) };
            *s = v.dot(&p.normal);
        }
    });
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::shapes::cube_sphere;

    fn elements() -> Vec<Element> {
        vec![
            Element::Stream { velocity: Vec3::new(0.0, -1.0, 0.3) },
            Element::Source { at: Vec3::new(0.0, 0.5, 2.0), strength: 3.0, core: 0.1 },
            Element::Filament {
                points: vec![Vec3::new(-2.0, 0.0, -1.0), Vec3::new(2.0, 0.5, -1.0)],
                strength: -2.0,
                core: 0.1,
            },
        ]
    }

    #[test]
    fn the_flow_through_every_panel_is_what_is_asked_and_can_be_asked_again() {
        let mesh = cube_sphere(4, 1.0);
        let body = Body::new(&mesh.position, &mesh.triangle).expect("a body");
        let mut elements = elements();
        for round in 0..2 {
            let asked: Vec<f64> = body.panels().iter().map(|p| 0.3 * p.centre.y - 0.1 * f64::from(round)).collect();
            let strength = body.solve(&elements, &asked).expect("strengths");
            let flow = body.flow(&elements, &strength);
            for (i, (p, a)) in body.panels().iter().zip(&asked).enumerate() {
                assert!((flow.velocity_at_panel(i).dot(&p.normal) - a).abs() < 1e-10);
                let outside = flow.velocity(p.centre + p.normal * 1e-8);
                assert!((outside.dot(&p.normal) - a).abs() < 1e-6);
            }
            elements.remove(1);
        }
    }

    #[test]
    fn a_body_is_the_same_again_from_its_parts() {
        let mesh = cube_sphere(3, 2.0);
        let body = Body::new(&mesh.position, &mesh.triangle).expect("a body");
        let again = Body::again(&mesh.position, &mesh.triangle, body.factored().clone()).expect("the same body");
        let asked: Vec<f64> = (0..body.panels().len()).map(|i| (i % 5) as f64).collect();
        assert_eq!(body.solve(&elements(), &asked), again.solve(&elements(), &asked));
        let short = Factored { row: vec![0; 3], ..body.factored().clone() };
        assert!(Body::again(&mesh.position, &mesh.triangle, short).is_none());
    }

    #[test]
    fn strengths_are_linear_in_what_is_asked() {
        let mesh = cube_sphere(3, 2.0);
        let body = Body::new(&mesh.position, &mesh.triangle).expect("a body");
        let n = body.panels().len();
        let asked: Vec<f64> = (0..n).map(|i| (i % 7) as f64 - 3.0).collect();
        let all = body.solve(&elements(), &asked).expect("strengths");
        let by_map = body.solve(&[], &asked).expect("strengths");
        let by_each: Vec<Vec<f64>> =
            elements().into_iter().map(|e| body.solve(&[e], &vec![0.0; n]).expect("strengths")).collect();
        for i in 0..n {
            let sum = by_map[i] + by_each.iter().map(|s| s[i]).sum::<f64>();
            assert!((all[i] - sum).abs() < 1e-10);
        }
    }

    #[test]
    fn bad_bodies_are_named() {
        let position = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(Body::new(&position, &[]).err(), Some(FlowError::NoPanels));
        let e = Body::new(&position, &[[0, 1, 2], [0, 1, 9]]).err();
        assert_eq!(e, Some(FlowError::BadVertex { triangle: 1 }));
        assert_eq!(Body::new(&position, &[[0, 1, 3]]).err(), Some(FlowError::NoArea { triangle: 0 }));
        let one = Body::new(&position, &[[0, 1, 2]]).expect("a panel");
        assert_eq!(one.solve(&[], &[]).err(), Some(FlowError::WrongCount { panels: 1, given: 0 }));
        assert_eq!(one.solve(&[], &[f64::NAN]).err(), Some(FlowError::NotFinite { panel: 0 }));
        let mesh = cube_sphere(2, 1.0);
        let turned: Vec<[u32; 3]> = mesh.triangle.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert_eq!(Body::new(&mesh.position, &turned).err(), Some(FlowError::InsideOut));
        let twice = [mesh.triangle.clone(), mesh.triangle.clone()].concat();
        assert_eq!(Body::new(&mesh.position, &twice).err(), Some(FlowError::Singular));
        assert!(FlowError::NoArea { triangle: 3 }.to_string().contains("triangle 3"));
    }
}
