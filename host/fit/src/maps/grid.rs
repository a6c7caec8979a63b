//! Where the samples of a map lie on the sample's plane.
//!
//! Plane coordinates are the world's x and y (z = 0). Samples are row-major; rows run *down*, toward smaller y, columns
//! toward larger x. Each sample stands in the middle of a cell; the rectangle is that of the cells' outer edges.

use super::MapsError;

/// Most samples of a grid, that of a picture.
const MAX_SAMPLES: usize = 400_000_000;

/// A rectangle of the plane, in the plane's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneRect {
    /// Smallest x.
    pub left: f64,
    /// Largest x.
    pub right: f64,
    /// Smallest y.
    pub bottom: f64,
    /// Largest y: that of the upper edge of row 0.
    pub top: f64,
}

/// rows × columns cells that fill a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Columns, > 0.
    pub columns: usize,
    /// Rows, > 0.
    pub rows: usize,
    /// Outer edges of the cells.
    pub plane: PlaneRect,
}

impl Grid {
    /// Cells that fill `plane`.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`] for no or too many (400 million) samples and for a rectangle without an area.
    pub fn new(columns: usize, rows: usize, plane: PlaneRect) -> Result<Self, MapsError> {
        let samples = columns.checked_mul(rows);
        let PlaneRect { left, right, bottom, top } = plane;
        let finite = [left, right, bottom, top].iter().all(|v| v.is_finite());
        if !samples.is_some_and(|n| (1..=MAX_SAMPLES).contains(&n)) || !finite || left >= right || bottom >= top {
            return Err(MapsError::Inconsistent {
                what: format!("a grid of {columns} x {rows} samples over {plane:?}"),
            });
        }
        Ok(Self { columns, rows, plane })
    }

    /// Samples of which the outermost stand *on* the edges of `nodes`, as in renderers' node registered maps.
    ///
    /// # Errors
    /// As [`Grid::new`]; also for a single column or row, which has no extent.
    pub fn from_nodes(columns: usize, rows: usize, nodes: PlaneRect) -> Result<Self, MapsError> {
        if columns < 2 || rows < 2 {
            return Err(MapsError::Inconsistent { what: format!("{columns} x {rows} samples from edge to edge") });
        }
        let half = |from: f64, to: f64, count: usize| 0.5 * (to - from) / (count - 1) as f64;
        let (x, y) = (half(nodes.left, nodes.right, columns), half(nodes.bottom, nodes.top, rows));
        let plane =
            PlaneRect { left: nodes.left - x, right: nodes.right + x, bottom: nodes.bottom - y, top: nodes.top + y };
        Self::new(columns, rows, plane)
    }

    /// How many samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.columns * self.rows
    }

    /// Plane coordinates (x, y) of a sample.
    #[must_use]
    pub fn position(&self, column: usize, row: usize) -> [f64; 2] {
        [self.x(column as f64 + 0.5), self.y(row as f64 + 0.5)]
    }

    /// Column and row, in fractions of a cell and counted from the first sample, of plane coordinates; also outside.
    #[must_use]
    pub fn locate(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let PlaneRect { left, right, bottom, top } = self.plane;
        let across = (x - left) / (right - left);
        let down = (top - y) / (top - bottom);
        [across * self.columns as f64 - 0.5, down * self.rows as f64 - 0.5]
    }

    /// Whether every sample of `self` lies on that of `other`, to a millionth of a cell.
    #[must_use]
    pub fn coincides(&self, other: &Self) -> bool {
        let on = |column: usize, row: usize| {
            let [c, r] = other.locate(self.position(column, row));
            (c - column as f64).abs() < 1e-6 && (r - row as f64).abs() < 1e-6
        };
        (self.columns, self.rows) == (other.columns, other.rows) && on(0, 0) && on(self.columns - 1, self.rows - 1)
    }

    /// The cells `columns` × `rows` from (`column`, `row`) on.
    pub(crate) fn part(&self, [column, row]: [usize; 2], [columns, rows]: [usize; 2]) -> Self {
        let plane = PlaneRect {
            left: self.x(column as f64),
            right: self.x((column + columns) as f64),
            bottom: self.y((row + rows) as f64),
            top: self.y(row as f64),
        };
        Self { columns, rows, plane }
    }

    /// x of a column edge.
    fn x(&self, column: f64) -> f64 {
        self.plane.left + column * (self.plane.right - self.plane.left) / self.columns as f64
    }

    /// y of a row edge.
    fn y(&self, row: f64) -> f64 {
        self.plane.top - row * (self.plane.top - self.plane.bottom) / self.rows as f64
    }
}

impl std::fmt::Display for Grid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let PlaneRect { left, right, bottom, top } = self.plane;
        let (columns, rows) = (self.columns, self.rows);
        write!(f, "{columns} x {rows} over x {left} to {right}, y {bottom} to {top}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: PlaneRect = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };

    #[test]
    fn rows_run_down_and_nodes_stand_on_the_edges() {
        let nodes = Grid::from_nodes(256, 256, UNIT).unwrap();
        let near = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).abs() < 1e-12 && (y - v).abs() < 1e-12;
        assert!(near(nodes.position(0, 0), [-0.5, 0.5]));
        assert!(near(nodes.position(255, 255), [0.5, -0.5]));
        assert!(near(nodes.position(1, 0), [-0.5 + 1.0 / 255.0, 0.5]));
        let cells = Grid::new(4, 2, UNIT).unwrap();
        assert!(near(cells.position(0, 1), [-0.375, -0.25]));
        assert!(near(cells.locate([-0.375, -0.25]), [0.0, 1.0]));
        assert!(near(cells.part([2, 1], [2, 1]).position(1, 0), cells.position(3, 1)));
    }

    #[test]
    fn grids_of_one_size_need_not_coincide() {
        let (nodes, cells) = (Grid::from_nodes(256, 256, UNIT).unwrap(), Grid::new(256, 256, UNIT).unwrap());
        assert!(nodes.coincides(&nodes) && !nodes.coincides(&cells));
        assert!(!cells.coincides(&Grid::new(256, 255, UNIT).unwrap()));
    }

    #[test]
    fn grids_without_samples_or_area_are_refused() {
        for (columns, rows) in [(0, 1), (1, 0), (usize::MAX, 2), (30_000, 30_000)] {
            assert!(matches!(Grid::new(columns, rows, UNIT), Err(MapsError::Inconsistent { .. })));
        }
        for plane in [PlaneRect { left: 0.5, ..UNIT }, PlaneRect { top: f64::NAN, ..UNIT }] {
            assert!(Grid::new(2, 2, plane).is_err() && Grid::from_nodes(2, 2, plane).is_err());
        }
        assert!(Grid::from_nodes(1, 5, UNIT).is_err());
    }
}
