//! The sample plane as a grid: how [`Grid`] fits a session's sample.

use std::ops::Range;

use glam::DVec2;

use crate::maps::{Grid, PlaneRect};
use crate::session::{Sample, Session, homography};

impl Grid {
    /// Node registered: the outer nodes lie on the sample's edges. At least 2 × 2.
    #[must_use]
    pub fn nodes(sample: &Sample, rows: usize, columns: usize) -> Self {
        let (rows, columns) = (rows.max(2), columns.max(2));
        let PlaneRect { left, right, bottom, top } = sample.rect();
        let (x, y) = (0.5 * (right - left) / (columns - 1) as f64, 0.5 * (top - bottom) / (rows - 1) as f64);
        let plane = PlaneRect { left: left - x, right: right + x, bottom: bottom - y, top: top + y };
        Self { columns, rows, plane }
    }

    /// Cell registered: nodes are the middles of rows × columns cells that fill the sample. At least 1 × 1.
    #[must_use]
    pub fn cells(sample: &Sample, rows: usize, columns: usize) -> Self {
        Self { columns: columns.max(1), rows: rows.max(1), plane: sample.rect() }
    }

    /// Cells of as much area in the plane as a pixel of the view that sees the sample's middle largest.
    #[must_use]
    pub fn finest(session: &Session) -> Self {
        let sample = &session.sample;
        let middle = DVec2::new(0.5 * (sample.x[0] + sample.x[1]), 0.5 * (sample.y[0] + sample.y[1]));
        let scale = |view: &crate::session::ViewCapture| {
            homography::jacobian(&view.camera.plane_to_pixel(), middle).determinant().abs().sqrt()
        };
        let px_per_unit = session.views.iter().map(scale).fold(1.0, f64::max);
        let count = |[a, b]: [f64; 2]| whole(((b - a) * px_per_unit).round());
        Self::cells(sample, count(sample.y), count(sample.x))
    }

    /// The sample in cells as near to squares as can be, `longest` along its longer side.
    #[must_use]
    pub fn with_side(sample: &Sample, longest: usize) -> Self {
        let size = [sample.x, sample.y].map(|[a, b]| b - a);
        let unit = size[0].max(size[1]) / longest as f64;
        let [columns, rows] = size.map(|s| whole((s / unit).round()));
        Self::cells(sample, rows, columns)
    }

    /// (x, y) of a node, units of the plane.
    #[must_use]
    pub fn node(&self, row: usize, column: usize) -> DVec2 {
        DVec2::from_array(self.position(column, row))
    }

    /// From a column to the next, and from a row to the next (negative), units of the plane.
    #[must_use]
    pub fn step(&self) -> DVec2 {
        let PlaneRect { left, right, bottom, top } = self.plane;
        DVec2::new((right - left) / self.columns as f64, (bottom - top) / self.rows as f64)
    }

    /// The grid in squares of at most `side` nodes a side: (rows, columns) of each, row by row.
    pub fn squares(&self, side: usize) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + use<> {
        let (rows, cols, side) = (self.rows, self.columns, side.max(1));
        (0..rows)
            .step_by(side)
            .flat_map(move |r| (0..cols).step_by(side).map(move |c| (r..(r + side).min(rows), c..(c + side).min(cols))))
    }

    /// The same extent with at most `most` nodes a side.
    pub(super) fn thinned(&self, most: usize) -> Self {
        Self { columns: self.columns.min(most), rows: self.rows.min(most), plane: self.plane }
    }
}

impl Sample {
    fn rect(&self) -> PlaneRect {
        let ([left, right], [bottom, top]) = (self.x, self.y);
        PlaneRect { left, right, bottom, top }
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of cells, positive and whole")]
fn whole(count: f64) -> usize {
    count.clamp(1.0, 1e5) as usize
}
