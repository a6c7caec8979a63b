//! Planes lent to the writer: nothing is copied before it is packed, line by line.

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;

/// Samples of one channel, row-major height × width.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PlaneRef<'a> {
    /// OpenEXR float.
    F32(&'a [f32]),
    /// OpenEXR uint.
    U32(&'a [u32]),
}

/// A plane and how long its rows are.
pub(crate) struct PlaneWriter<'a> {
    plane: PlaneRef<'a>,
    width: usize,
}

impl<'slf, 'a: 'slf> WritableSamples<'slf> for PlaneRef<'a> {
    type Writer = PlaneWriter<'slf>;

    fn sample_type(&self) -> SampleType {
        match self {
            Self::F32(_) => SampleType::F32,
            Self::U32(_) => SampleType::U32,
        }
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'slf self, header: &Header) -> PlaneWriter<'slf> {
        PlaneWriter { plane: *self, width: header.layer_size.x() }
    }
}

impl SamplesWriter for PlaneWriter<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let start = line.location.position.y() * self.width + line.location.position.x();
        let range = start..start + line.location.sample_count;
        let written = match self.plane {
            PlaneRef::F32(v) => v.get(range).map(|samples| line.write_samples_from_slice(samples)),
            PlaneRef::U32(v) => v.get(range).map(|samples| line.write_samples_from_slice(samples)),
        };
        debug_assert!(matches!(written, Some(Ok(()))), "a plane whose length was checked, into a line in memory");
    }
}
