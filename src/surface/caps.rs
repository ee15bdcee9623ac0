//! Closes the gaps between two cells that see the bodies on their common face differently: at a crack front,
//! where untouched clay joins in one of them what a cut parts in the other.
//!
//! Round the face, the inside corners come in runs between outside corners and split edges; cells differ only
//! within runs, and within them all vertices are shared ones. A cell's contour passes a run from its first
//! edge, by every inner edge whose ends are of different bodies there, to its last. So the contours of the
//! two cells meet again at every edge that both pass, and differ between such edges by polygons of three or
//! four vertices: each is a cap of one or two triangles.

/// One cap: triangles as numbers of the face's edges (edge `i` joins corners `i` and `i + 1`), each with the
/// corner whose body it keeps.
pub(crate) type CapVertex = (u8, u8);

/// What is known of a face, corners in their order round it as the cell that asks sees it from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceView {
    /// Whether corner `i` is inside.
    pub(crate) inside: [bool; 4],
    /// Whether edge `i` is split: it belongs to no run.
    pub(crate) split: [bool; 4],
    /// Whether the ends of edge `i` are of different bodies, in this cell and in the one across.
    pub(crate) parted: [[bool; 4]; 2],
}

impl FaceView {
    /// The caps of the face; empty unless the cells differ.
    pub(crate) fn caps(&self) -> Vec<[CapVertex; 3]> {
        let mut out = Vec::new();
        if self.parted[0] == self.parted[1] {
            return out;
        }
        let is_joint = |i: usize| self.inside[i % 4] && self.inside[(i + 1) % 4] && !self.split[i % 4];
        match (0..4).find(|&i| !is_joint(i)) {
            // One ring without an end.
            None => self.ring(&mut out),
            Some(stop) => {
                // From behind an edge at which runs end, once round.
                let mut first = stop + 1;
                while first < stop + 5 {
                    let mut last = first;
                    while last < stop + 4 && is_joint(last) {
                        last += 1;
                    }
                    if self.inside[first % 4] {
                        self.run(first, last, &mut out);
                    }
                    first = last + 1;
                }
            }
        }
        out
    }

    /// Corners `first..=last` inside and joined: from the edge before the first to the edge behind the last.
    fn run(&self, first: usize, last: usize, out: &mut Vec<[CapVertex; 3]>) {
        let vertex = |edge: usize, keeps: usize| ((edge % 4) as u8, (keeps % 4) as u8);
        let mut paths: [Vec<CapVertex>; 2] = [vec![vertex(first + 3, first)], vec![vertex(first + 3, first)]];
        for edge in first..=last {
            let has = |cell: usize| edge == last || self.parted[cell][edge % 4];
            for cell in 0..2 {
                if has(cell) {
                    paths[cell].push(vertex(edge, edge));
                }
            }
            if has(0) && has(1) {
                fill(&paths, out);
                paths = [vec![vertex(edge, edge)], vec![vertex(edge, edge)]];
            }
        }
    }

    /// All corners inside and joined.
    fn ring(&self, out: &mut Vec<[CapVertex; 3]>) {
        let both = (0..4).find(|&i| self.parted[0][i] && self.parted[1][i]);
        let Some(start) = both else {
            let closed = |cell: usize| -> Vec<CapVertex> {
                (0..4u8).filter(|&i| self.parted[cell][usize::from(i)]).map(|i| (i, i)).collect()
            };
            fill(&[closed(0), vec![]], out);
            fill(&[vec![], closed(1)], out);
            return;
        };
        let vertex = |edge: usize| ((edge % 4) as u8, (edge % 4) as u8);
        let mut paths = [vec![vertex(start)], vec![vertex(start)]];
        for edge in start + 1..=start + 4 {
            for cell in 0..2 {
                if self.parted[cell][edge % 4] {
                    paths[cell].push(vertex(edge));
                }
            }
            if self.parted[0][edge % 4] && self.parted[1][edge % 4] {
                if edge == start + 4 && paths[0][0] == vertex(edge) {
                    // The only edge that both pass: paths end where they began.
                    paths.iter_mut().for_each(|path| path.truncate(path.len() - 1));
                }
                fill(&paths, out);
                paths = [vec![vertex(edge)], vec![vertex(edge)]];
            }
        }
    }
}

/// Fans over what each path has beside its chord: this cell's contour runs along its path, so its cap runs
/// back; the other's the other way about.
fn fill(paths: &[Vec<CapVertex>; 2], out: &mut Vec<[CapVertex; 3]>) {
    for k in 2..paths[0].len() {
        out.push([paths[0][0], paths[0][k], paths[0][k - 1]]);
    }
    for k in 2..paths[1].len() {
        out.push([paths[1][0], paths[1][k - 1], paths[1][k]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(inside: [u8; 4], here: [u8; 4], across: [u8; 4]) -> FaceView {
        FaceView { inside: inside.map(|i| i == 1), split: [false; 4], parted: [here.map(|i| i == 1), across.map(|i| i == 1)] }
    }

    /// Two and two corners, or one and three, give contours that cancel; one each way round gives a square.
    #[test]
    fn rings_are_capped() {
        assert!(view([1; 4], [1, 0, 1, 0], [0; 4]).caps().is_empty());
        assert!(view([1; 4], [1, 1, 0, 0], [0; 4]).caps().is_empty());
        let square = view([1; 4], [1; 4], [0; 4]).caps();
        assert_eq!(square, [[(0, 0), (2, 2), (1, 1)], [(0, 0), (3, 3), (2, 2)]]);
        let back = view([1; 4], [0; 4], [1; 4]).caps();
        assert_eq!(back, [[(0, 0), (1, 1), (2, 2)], [(0, 0), (2, 2), (3, 3)]]);
        assert_eq!(view([1; 4], [1, 1, 1, 0], [1, 0, 1, 0]).caps().len(), 1);
        assert_eq!(view([1; 4], [1, 1, 1, 0], [1, 0, 0, 0]).caps(), [[(0, 0), (2, 2), (1, 1)]]);
    }

    /// A run of two or three corners beside outside ones.
    #[test]
    fn runs_are_capped() {
        // The outside corner is 3: from edge 3, by edge 0, to edge 1 beside corner 2.
        assert_eq!(view([1, 1, 0, 0], [1, 0, 0, 0], [0; 4]).caps(), [[(3, 0), (1, 1), (0, 0)]]);
        assert_eq!(view([1, 1, 1, 0], [1, 1, 0, 0], [0; 4]).caps().len(), 2);
        assert_eq!(view([0, 1, 1, 1], [0, 1, 0, 0], [0, 0, 1, 0]).caps().len(), 2);
        assert!(view([1, 0, 1, 0], [0; 4], [0; 4]).caps().is_empty());
    }
}
