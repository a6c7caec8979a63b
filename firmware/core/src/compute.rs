//! One strip: frames out of the camera, planes into the store.

use crate::hardware::{CameraError, CaptureStore, FrameSource, StoreError};
use crate::kernel::polar_form::polar_form;
use crate::kernel::{Dark, StripInput, StripOutput, stokes_i16, stokes_i32};
use crate::memory::Memory;
use heapless::Vec;
use protocol_polar::fixed::{StokesPlan, Word};
use protocol_polar::{Flags, MAX_FRAMES};
use protocol_wire::{Calibration, CaptureId, MAX_PLANES, PlaneInfo, PlaneKind, SensorInfo};

/// Where a strip lies on the sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub strip: u16,
    pub first_row: u32,
    pub rows: u16,
    pub width: usize,
}

impl Area {
    /// Strip number `strip` of a sensor cut in strips of `strip_rows` rows.
    pub(crate) fn new(sensor: &SensorInfo, strip_rows: u16, strip: u16) -> Self {
        let first_row = u32::from(strip) * u32::from(strip_rows);
        let left = sensor.height.saturating_sub(first_row).min(strip_rows.into());
        let width = usize::try_from(sensor.width).unwrap_or(0);
        Self { strip, first_row, rows: u16::try_from(left).unwrap_or(strip_rows), width }
    }

    pub(crate) fn photosites(&self) -> usize {
        self.width * usize::from(self.rows)
    }

    /// Place of the strip in a map of the whole sensor.
    pub(crate) fn range(&self) -> core::ops::Range<usize> {
        let start = usize::try_from(self.first_row).unwrap_or(0) * self.width;
        start..start + self.photosites()
    }
}

/// Why a strip could not be had.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ComputeError {
    Camera(CameraError),
    Store(StoreError),
    /// A buffer or a plan of another size than the strip: cannot happen with memory that was checked.
    Memory,
}

impl From<CameraError> for ComputeError {
    fn from(error: CameraError) -> Self {
        Self::Camera(error)
    }
}

impl From<StoreError> for ComputeError {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

/// Side of the square of photosites that becomes one preview value: a power of two of at most 16 (strips are cut in
/// multiples of 16 rows), so that the preview is at most about 640 wide.
#[must_use]
pub(crate) fn preview_step(sensor: &SensorInfo) -> u16 {
    let mut step = 2;
    while step < 16 && sensor.width / u32::from(step) > 640 {
        step *= 2;
    }
    step
}

/// What decides which planes a capture has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contents {
    pub word: Word,
    pub frames: usize,
    pub keep_raw: bool,
    pub calibration: Calibration,
}

/// The planes of a capture, in the order they are stored.
pub(crate) fn planes(sensor: &SensorInfo, strip_rows: u16, contents: Contents) -> Vec<PlaneInfo, MAX_PLANES> {
    let Contents { word, frames, keep_raw, calibration } = contents;
    let strips = u16::try_from(sensor.height.div_ceil(strip_rows.max(1).into())).unwrap_or(u16::MAX);
    let full = |kind, value_bytes| PlaneInfo {
        kind,
        value_bytes,
        width: sensor.width,
        height: sensor.height,
        strip_rows,
        strips,
    };
    let value_bytes = if word == Word::I16 { 2 } else { 4 };
    let mut planes = Vec::new();
    let mut add = |plane| {
        planes.push(plane).ok();
    }; // MAX_PLANES counts them all
    for kind in [PlaneKind::S0, PlaneKind::S1, PlaneKind::S2] {
        add(full(kind, value_bytes));
    }
    add(full(PlaneKind::Flags, 1));
    if frames > 3 {
        add(full(PlaneKind::Residual, value_bytes));
    }
    let step = preview_step(sensor);
    for kind in [PlaneKind::PreviewDolp, PlaneKind::PreviewAolp] {
        let height = sensor.height / u32::from(step);
        let strip_rows = strip_rows / step;
        let strips = u16::try_from(height.div_ceil(strip_rows.max(1).into())).unwrap_or(u16::MAX);
        add(PlaneInfo { kind, value_bytes: 1, width: sensor.width / u32::from(step), height, strip_rows, strips });
    }
    if keep_raw {
        for slot in (0_u8..).take(frames) {
            add(full(PlaneKind::Raw(slot), 2));
        }
        if calibration.dark_map {
            add(full(PlaneKind::DarkMap, 2));
        }
        if calibration.flat_map {
            add(full(PlaneKind::FlatMap, 2));
        }
    }
    planes
}

/// Bytes of all strips of `planes`.
pub(crate) fn total_bytes(planes: &[PlaneInfo]) -> u64 {
    planes.iter().map(|p| u64::from(p.width) * u64::from(p.height) * u64::from(p.value_bytes)).sum()
}

/// What a strip is computed with.
pub(crate) struct Recipe<'a> {
    pub id: CaptureId,
    pub plan: &'a StokesPlan,
    pub keep_raw: bool,
    pub black_level: u16,
    pub calibration: Calibration,
    pub preview_step: u16,
}

/// Reads the strip from every slot, computes, and stores every plane of it. Returns how many photosites are a misfit.
pub(crate) fn compute_strip(
    recipe: &Recipe,
    area: Area,
    camera: &mut impl FrameSource,
    store: &mut impl CaptureStore,
    memory: &mut Memory,
) -> Result<u32, ComputeError> {
    let n = area.photosites();
    let frames = recipe.plan.frame_count();
    let mut inputs: Vec<&[u16], MAX_FRAMES> = Vec::new();
    for (slot, samples) in (0_u8..).zip(memory.samples.chunks_exact_mut(n).take(frames)) {
        camera.read_rows(slot, area.first_row, samples)?;
        if recipe.keep_raw {
            store_values(store, recipe.id, PlaneKind::Raw(slot), area.strip, samples, memory.bytes)?;
        }
        inputs.push(samples).map_err(|_| ComputeError::Memory)?;
    }
    let dark = match (recipe.calibration.dark_map, memory.dark.get(area.range())) {
        (true, Some(values)) => Dark::Map(values),
        _ => Dark::Level(recipe.black_level),
    };
    let flat = if recipe.calibration.flat_map { memory.flat.get(area.range()) } else { None };
    if recipe.keep_raw {
        if let Dark::Map(map) = dark {
            store_values(store, recipe.id, PlaneKind::DarkMap, area.strip, map, memory.bytes)?;
        }
        if let Some(map) = flat {
            store_values(store, recipe.id, PlaneKind::FlatMap, area.strip, map, memory.bytes)?;
        }
    }
    let input = StripInput { frames: &inputs, dark, flat };
    let flags = memory.flags.get_mut(..n).ok_or(ComputeError::Memory)?;
    let table = &mut *memory.weights;
    match recipe.plan.format().word {
        Word::I16 => {
            let residual = memory.narrow_residual.get_mut(..n).ok_or(ComputeError::Memory)?;
            let stokes = thirds(memory.narrow, n)?;
            let output = StripOutput { stokes, residual, flags };
            stokes_i16(recipe.plan, table, input, output).map_err(|_| ComputeError::Memory)?;
            let planes = memory.narrow.get(..3 * n).ok_or(ComputeError::Memory)?;
            let residual = memory.narrow_residual.get(..n).ok_or(ComputeError::Memory)?;
            store_stokes(recipe, area, store, planes, residual, memory.bytes)?;
            let at = |i: usize| planes.get(i).map_or(0, |s| i32::from(*s));
            store_preview(recipe, area, store, at, memory.bytes)?;
        }
        Word::I32 => {
            let residual = memory.wide_residual.get_mut(..n).ok_or(ComputeError::Memory)?;
            let stokes = thirds(memory.wide, n)?;
            let output = StripOutput { stokes, residual, flags };
            stokes_i32(recipe.plan, table, input, output).map_err(|_| ComputeError::Memory)?;
            let planes = memory.wide.get(..3 * n).ok_or(ComputeError::Memory)?;
            let residual = memory.wide_residual.get(..n).ok_or(ComputeError::Memory)?;
            store_stokes(recipe, area, store, planes, residual, memory.bytes)?;
            // 32-bit planes have 14 more fractional bits.
            let at = |i: usize| planes.get(i).map_or(0, |s| s >> 14);
            store_preview(recipe, area, store, at, memory.bytes)?;
        }
    }
    let flags = memory.flags.get(..n).ok_or(ComputeError::Memory)?;
    store.write(recipe.id, PlaneKind::Flags, area.strip, flags, crc32fast::hash(flags))?;
    Ok(flags.iter().map(|f| u32::from(Flags(*f).contains(Flags::MISFIT))).sum())
}

fn thirds<T>(values: &mut [T], n: usize) -> Result<[&mut [T]; 3], ComputeError> {
    let (a, rest) = values.split_at_mut_checked(n).ok_or(ComputeError::Memory)?;
    let (b, rest) = rest.split_at_mut_checked(n).ok_or(ComputeError::Memory)?;
    let c = rest.get_mut(..n).ok_or(ComputeError::Memory)?;
    Ok([a, b, c])
}

fn store_stokes<S: LittleEndian, R: LittleEndian>(
    recipe: &Recipe,
    area: Area,
    store: &mut impl CaptureStore,
    stokes: &[S],
    residual: &[R],
    bytes: &mut [u8],
) -> Result<(), ComputeError> {
    let kinds = [PlaneKind::S0, PlaneKind::S1, PlaneKind::S2];
    for (kind, plane) in kinds.into_iter().zip(stokes.chunks_exact(area.photosites())) {
        store_values(store, recipe.id, kind, area.strip, plane, bytes)?;
    }
    if recipe.plan.frame_count() > 3 {
        store_values(store, recipe.id, PlaneKind::Residual, area.strip, residual, bytes)?;
    }
    Ok(())
}

/// Averages each square of photosites and stores its DoLP and AoLP, one byte each. `at` reads the three planes, one after
/// the other, scaled to 16 bits.
fn store_preview(
    recipe: &Recipe,
    area: Area,
    store: &mut impl CaptureStore,
    at: impl Fn(usize) -> i32,
    bytes: &mut [u8],
) -> Result<(), ComputeError> {
    let step = usize::from(recipe.preview_step);
    let (across, down) = (area.width / step, usize::from(area.rows) / step);
    if across * down == 0 {
        return Ok(()); // a last strip lower than one square
    }
    let mean_shift = 2 * step.trailing_zeros();
    let (dolp, rest) = bytes.split_at_mut_checked(across * down).ok_or(ComputeError::Memory)?;
    let aolp = rest.get_mut(..across * down).ok_or(ComputeError::Memory)?;
    for (i, (dolp, aolp)) in dolp.iter_mut().zip(aolp.iter_mut()).enumerate() {
        let corner = (i / across * step) * area.width + i % across * step;
        let mean = [0, 1, 2].map(|plane| {
            let first = plane * area.photosites() + corner;
            let square = (0..step).flat_map(|row| (0..step).map(move |column| (row, column)));
            square.map(|(row, column)| at(first + row * area.width + column)).sum::<i32>() >> mean_shift
        });
        let polar = polar_form(mean);
        [_, *dolp] = polar.dolp_q16.to_le_bytes();
        [_, *aolp] = polar.aolp_turn16.to_le_bytes();
    }
    store.write(recipe.id, PlaneKind::PreviewDolp, area.strip, dolp, crc32fast::hash(dolp))?;
    store.write(recipe.id, PlaneKind::PreviewAolp, area.strip, aolp, crc32fast::hash(aolp))?;
    Ok(())
}

/// A value as it goes over the wire.
trait LittleEndian: Copy {
    const BYTES: usize;
    fn put(self, bytes: &mut [u8]);
}

macro_rules! little_endian {
    ($($t:ty),*) => {$(impl LittleEndian for $t {
        const BYTES: usize = size_of::<$t>();
        fn put(self, bytes: &mut [u8]) {
            bytes.copy_from_slice(&self.to_le_bytes());
        }
    })*};
}
little_endian!(i16, u16, i32, u32);

fn store_values<T: LittleEndian>(
    store: &mut impl CaptureStore,
    id: CaptureId,
    kind: PlaneKind,
    strip: u16,
    values: &[T],
    bytes: &mut [u8],
) -> Result<(), ComputeError> {
    let bytes = bytes.get_mut(..values.len() * T::BYTES).ok_or(ComputeError::Memory)?;
    for (to, value) in bytes.chunks_exact_mut(T::BYTES).zip(values) {
        value.put(to);
    }
    store.write(id, kind, strip, bytes, crc32fast::hash(bytes))?;
    Ok(())
}
