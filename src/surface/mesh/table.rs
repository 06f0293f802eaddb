//! Marching cubes from its rules: how the surface cuts a cell whose corners are inside or outside.
//!
//! On each face of a cell the surface is a set of segments between the cut edges, and inside corners are kept apart
//! from each other where both readings are possible. That depends on the four corners of the face alone, so that the
//! two cells at a face agree, and segments close to loops round the cell. A loop is split by chords whose ends lie on no
//! common face: such a chord belongs to one cell, while segments belong to two. So every edge of the mesh has two
//! triangles, whatever the corners are, and the triangles at a cut edge form one fan.

use std::sync::LazyLock;

/// The edges of a cell: the corner where one begins (bits x, y, z), and its axis.
pub const EDGES: [(usize, usize); 12] =
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 0), (2, 2), (3, 2), (4, 0), (4, 1), (5, 1), (6, 0)];

/// The triangles of each case.
pub struct Table {
    starts: [u16; 257],
    triangles: Vec<[u8; 3]>,
}

/// The table: the same for everyone.
pub static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

impl Table {
    fn new() -> Self {
        let mut table = Self { starts: [0; 257], triangles: Vec::new() };
        for case in 0..256 {
            for polygon in loops(case) {
                split(&polygon, &mut table.triangles);
            }
            table.starts[case + 1] = table.triangles.len() as u16;
        }
        table
    }

    /// The triangles of a cell, each as three of [`EDGES`], counterclockwise from outside the solid; bit `k` of `case`
    /// says that corner `k` is inside.
    #[inline]
    pub fn triangles(&self, case: usize) -> &[[u8; 3]] {
        &self.triangles[self.starts[case] as usize..self.starts[case + 1] as usize]
    }
}

/// The edge between two neighbouring corners.
fn edge_between(a: usize, b: usize) -> usize {
    let (corner, axis) = (a.min(b), (a ^ b).trailing_zeros() as usize);
    EDGES.iter().position(|edge| *edge == (corner, axis)).expect("neighbouring corners have an edge")
}

/// The corners of the six faces, counterclockwise from outside the cell.
fn faces() -> impl Iterator<Item = [usize; 4]> {
    (0..6).map(|face| {
        let (axis, upper) = (face / 2, face % 2);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = upper << axis;
        if upper == 1 { [base, base | u, base | u | v, base | v] } else { [base, base | v, base | u | v, base | u] }
    })
}

/// The closed lines in which the surface meets the faces of a cell, as edges in order.
fn loops(case: usize) -> Vec<Vec<usize>> {
    let inside = |corner: usize| case >> corner & 1 == 1;
    let mut next = [None; 12];
    for face in faces() {
        for k in 0..4 {
            if !inside(face[k]) || inside(face[(k + 1) % 4]) {
                continue;
            }
            // From corner k on it is outside: a segment goes round the run of inside corners that ends here.
            let mut first = k;
            while inside(face[(first + 3) % 4]) {
                first = (first + 3) % 4;
            }
            let entry = edge_between(face[(first + 3) % 4], face[first]);
            next[entry] = Some(edge_between(face[k], face[(k + 1) % 4]));
        }
    }
    let mut loops = Vec::new();
    for start in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = start;
        while let Some(following) = next[edge].take() {
            polygon.push(edge);
            edge = following;
        }
        if !polygon.is_empty() {
            loops.push(polygon);
        }
    }
    loops
}

/// Whether two edges lie on a common face of the cell.
fn share_a_face(a: usize, b: usize) -> bool {
    let on = |edge: usize, axis: usize| (EDGES[edge].1 != axis).then_some(EDGES[edge].0 >> axis & 1);
    (0..3).any(|axis| on(a, axis).is_some() && on(a, axis) == on(b, axis))
}

/// Splits a loop into triangles by chords that lie within the cell.
fn split(polygon: &[usize], out: &mut Vec<[u8; 3]>) {
    let before = out.len();
    let found = split_between(polygon, 0, polygon.len() - 1, out);
    assert!(found && out.len() - before == polygon.len() - 2, "each loop has a triangulation: a test goes through all");
}

/// Triangulates the part of a loop between two of its corners, if it can be.
fn split_between(polygon: &[usize], from: usize, to: usize, out: &mut Vec<[u8; 3]>) -> bool {
    let open = |a: usize, b: usize| b - a < 2 || !share_a_face(polygon[a], polygon[b]);
    let before = out.len();
    if to - from < 2 {
        return true;
    }
    for middle in from + 1..to {
        if open(from, middle)
            && open(middle, to)
            && split_between(polygon, from, middle, out)
            && split_between(polygon, middle, to, out)
        {
            out.push([from, middle, to].map(|corner| polygon[corner] as u8));
            return true;
        }
        out.truncate(before);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    type Side = (u8, u8);

    /// How often each directed side of a triangle occurs.
    fn sides(triangles: &[[u8; 3]]) -> BTreeMap<Side, usize> {
        let mut sides = BTreeMap::new();
        for t in triangles {
            (0..3).for_each(|k| *sides.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1);
        }
        sides
    }

    /// Sides that have no other half in the cell: the loops.
    fn border(case: usize) -> BTreeSet<Side> {
        let sides = sides(TABLE.triangles(case));
        assert!(sides.values().all(|count| *count == 1), "case {case}: a directed side twice");
        sides.keys().filter(|(a, b)| !sides.contains_key(&(*b, *a))).copied().collect()
    }

    #[test]
    fn each_cut_edge_of_a_cell_has_one_fan_of_triangles() {
        for case in 0..256 {
            let cut = |edge: usize| {
                let (corner, axis) = EDGES[edge];
                (case >> corner & 1) != (case >> (corner | 1 << axis) & 1)
            };
            let border = border(case);
            for edge in 0..12 {
                let leaving = border.iter().filter(|(a, _)| usize::from(*a) == edge).count();
                let arriving = border.iter().filter(|(_, b)| usize::from(*b) == edge).count();
                assert_eq!((leaving, arriving), (usize::from(cut(edge)), usize::from(cut(edge))), "case {case}");
            }
        }
    }

    #[test]
    fn sides_within_a_cell_leave_its_faces_alone() {
        for case in 0..256 {
            let border = border(case);
            for (a, b) in sides(TABLE.triangles(case)).into_keys() {
                let chord = !border.contains(&(a, b));
                assert!(!chord || !share_a_face(a.into(), b.into()), "case {case}: chord {a} {b} on a face");
                assert!(chord || share_a_face(a.into(), b.into()), "case {case}: border {a} {b} inside");
            }
        }
    }

    #[test]
    fn neighbours_have_the_same_line_on_their_common_face_and_run_it_both_ways() {
        for axis in 0..3 {
            // The sides of a case on one of its faces, edges named by where they are on the face.
            let on_face = |case: usize, upper: usize| {
                let place = |edge: u8| {
                    let (corner, along) = EDGES[usize::from(edge)];
                    (along != axis && corner >> axis & 1 == upper).then_some((corner & !(1 << axis), along))
                };
                border(case).into_iter().filter_map(move |(a, b)| Some((place(a)?, place(b)?))).collect::<BTreeSet<_>>()
            };
            let corners = |case: usize, upper: usize| {
                (0..8).filter(|c| c >> axis & 1 == upper).map(|c| case >> c & 1).collect::<Vec<_>>()
            };
            for below in 0..256 {
                for above in (0..256).filter(|above| corners(below, 1) == corners(*above, 0)) {
                    let turned: BTreeSet<_> = on_face(above, 0).into_iter().map(|(a, b)| (b, a)).collect();
                    assert_eq!(on_face(below, 1), turned, "{below} under {above} along {axis}");
                }
            }
        }
    }

    #[test]
    fn triangles_look_out_of_the_solid() {
        for corner in 0..8 {
            let [t] = TABLE.triangles(1 << corner) else { panic!("one corner makes one triangle") };
            let middle = |edge: u8| {
                let (from, axis) = EDGES[usize::from(edge)];
                let mut p = [0, 1, 2].map(|k| (from >> k & 1) as f64);
                p[axis] = 0.5;
                crate::math::Vec3::from(p)
            };
            let [a, b, c] = t.map(middle);
            let inside = crate::math::Vec3::from([0, 1, 2].map(|k| (corner >> k & 1) as f64));
            assert!((b - a).cross(&(c - a)).dot(&(a - inside)) > 0.0, "corner {corner}");
        }
    }
}
