//! The host computes what the camera computed, from the raw frames, and compares: bit for bit with the integers, and
//! against least squares in f64 with the proved bound.

use protocol_polar::fixed::{FixedError, GainQ15, Noise, SensorRange, StokesPlan, Weights};
use protocol_polar::{Analyzer, Degrees, LeastSquares};
use protocol_wire::{CaptureDescription, PlaneKind};
use std::collections::HashMap;

/// Every plane of a capture with its values, as fetched: little-endian, row-major.
pub type Planes = HashMap<PlaneKind, Vec<u8>>;

/// Why a capture cannot be replayed.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum ReplayError {
    /// A plane that is needed was not fetched (raw frames are kept only on request).
    #[error("the capture has no plane {plane:?} to replay")]
    Missing {
        /// The plane.
        plane: PlaneKind,
    },
    /// The description is no recipe this host can compute.
    #[error("the capture's description is no recipe: {0:?}")]
    Recipe(FixedError),
    /// The planes are of different sizes.
    #[error("plane {plane:?} has {found} values, {expected} were expected")]
    Length {
        /// The plane.
        plane: PlaneKind,
        /// Values it should have.
        expected: usize,
        /// Values it has.
        found: usize,
    },
}

/// What the comparison came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReplayReport {
    /// Photosites compared.
    pub photosites: usize,
    /// Photosites where any plane differs from the host's integers in any bit.
    pub differing: usize,
    /// The first of them, (row, column).
    pub first_differing: Option<(usize, usize)>,
    /// Largest |plane − f64 least squares| of s0, s1, s2, in DN; clamped photosites and those without a solution left out.
    pub worst_dn: [f64; 3],
    /// Largest ratio of that to the proved bound of the photosite's own set of frames; at most 1.
    pub worst_of_bound: f64,
}

/// Replays the capture described from its raw planes and compares every photosite.
///
/// # Errors
/// [`ReplayError`].
pub fn replay(description: &CaptureDescription, planes: &Planes) -> Result<ReplayReport, ReplayError> {
    let sensor = &description.sensor;
    let range = SensorRange { bit_depth: sensor.bit_depth, white_level: sensor.white_level_dn };
    let noise = Noise {
        read_dn: sensor.read_noise_e / sensor.gain_e_per_dn,
        electrons_per_dn: sensor.gain_e_per_dn,
        misfit_sigma: description.misfit_sigma,
    };
    let frames: Vec<Analyzer> = description
        .frames
        .iter()
        .map(|frame| Analyzer {
            angle: Degrees(frame.angle_deg).to_radians(),
            throughput: frame.throughput,
            efficiency: frame.efficiency,
        })
        .collect();
    let plan = StokesPlan::new(&frames, description.word.into(), range, noise).map_err(ReplayError::Recipe)?;
    let count = usize::try_from(u64::from(sensor.width) * u64::from(sensor.height)).unwrap_or(usize::MAX);
    let get = |plane: PlaneKind, bytes: usize| {
        let values = planes.get(&plane).ok_or(ReplayError::Missing { plane })?;
        if values.len() != count * bytes {
            return Err(ReplayError::Length { plane, expected: count, found: values.len() / bytes });
        }
        Ok(values.as_slice())
    };
    let raw: Vec<&[u8]> =
        (0..description.frames.len()).map(|k| get(PlaneKind::Raw(slot(k)), 2)).collect::<Result<_, _>>()?;
    let dark = description.calibration.dark_map.then(|| get(PlaneKind::DarkMap, 2)).transpose()?;
    let flat = description.calibration.flat_map.then(|| get(PlaneKind::FlatMap, 2)).transpose()?;
    let width = plan.format().bytes();
    let stokes = [get(PlaneKind::S0, width)?, get(PlaneKind::S1, width)?, get(PlaneKind::S2, width)?];
    let residual = (frames.len() > 3).then(|| get(PlaneKind::Residual, width)).transpose()?;
    let flags = get(PlaneKind::Flags, 1)?;

    let mut sets: HashMap<u16, Option<Set>> = HashMap::new();
    let mut report = ReplayReport { photosites: count, ..ReplayReport::default() };
    let mut samples = vec![0_u16; frames.len()];
    for i in 0..count {
        for (sample, plane) in samples.iter_mut().zip(&raw) {
            *sample = read_u16(plane, i);
        }
        let dark = dark.map_or(sensor.black_level_dn, |map| read_u16(map, i));
        let gain = flat.map_or(GainQ15::ONE, |map| GainQ15(read_u16(map, i)));
        let mask = plan.saturated(&samples);
        let set = sets.entry(mask).or_insert_with(|| Set::new(&plan, mask)).as_ref();
        let own = plan.photosite(set.map(|set| &set.weights), &samples, dark, gain);
        let theirs = stokes.map(|plane| read_signed(plane, i, width));
        let same = own.stokes == theirs
            && flags.get(i) == Some(&own.flags.0)
            && residual.is_none_or(|plane| read_unsigned(plane, i, width) == own.residual);
        if !same {
            report.differing += 1;
            let across = usize::try_from(sensor.width).unwrap_or(1).max(1);
            report.first_differing.get_or_insert((i / across, i % across));
        }
        if let Some(set) = set
            && !own.flags.contains(protocol_polar::Flags::OUT_OF_RANGE)
        {
            set.compare(&mut report, &plan, &samples, dark, gain, theirs);
        }
    }
    Ok(report)
}

/// The weights of one set of valid frames, and the f64 solver for the same set.
struct Set {
    weights: Weights,
    solver: LeastSquares,
    kept: Vec<usize>,
}

impl Set {
    fn new(plan: &StokesPlan, dropped: u16) -> Option<Self> {
        let weights = plan.weights(dropped).ok()?;
        let kept: Vec<usize> = (0..plan.frame_count()).filter(|k| dropped >> k & 1 == 0).collect();
        let frames: Vec<Analyzer> = kept.iter().filter_map(|k| plan.frames().get(*k).copied()).collect();
        let sigma: Vec<f64> = frames.iter().map(|frame| frame.throughput.sqrt()).collect();
        Some(Self { weights, solver: LeastSquares::weighted(&frames, &sigma).ok()?, kept })
    }

    fn compare(
        &self,
        report: &mut ReplayReport,
        plan: &StokesPlan,
        samples: &[u16],
        dark: u16,
        gain: GainQ15,
        theirs: [i32; 3],
    ) {
        let signals: Vec<f64> =
            self.kept.iter().filter_map(|k| samples.get(*k)).map(|x| f64::from(*x) - f64::from(dark)).collect();
        let exact = self.solver.solve(&signals);
        let lsb = plan.format().lsb_dn();
        let flat_rounding = if gain == GainQ15::ONE { 0.0 } else { 0.5 * lsb };
        let bounds = self.weights.bound_dn().map(|bound| bound * gain.to_f64() + flat_rounding);
        for (((worst, exact), theirs), bound) in report.worst_dn.iter_mut().zip(exact).zip(theirs).zip(bounds) {
            let off = (f64::from(theirs) * lsb - exact * gain.to_f64()).abs();
            *worst = worst.max(off);
            report.worst_of_bound = report.worst_of_bound.max(off / bound);
        }
    }
}

fn slot(k: usize) -> u8 {
    u8::try_from(k).unwrap_or(u8::MAX)
}

fn read_u16(bytes: &[u8], i: usize) -> u16 {
    bytes.get(2 * i..).and_then(|rest| rest.first_chunk()).map_or(0, |b| u16::from_le_bytes(*b))
}

fn read_i32(bytes: &[u8], i: usize) -> i32 {
    bytes.get(4 * i..).and_then(|rest| rest.first_chunk()).map_or(0, |b| i32::from_le_bytes(*b))
}

fn read_signed(bytes: &[u8], i: usize, width: usize) -> i32 {
    if width == 2 { read_u16(bytes, i).cast_signed().into() } else { read_i32(bytes, i) }
}

fn read_unsigned(bytes: &[u8], i: usize, width: usize) -> u32 {
    if width == 2 { read_u16(bytes, i).into() } else { read_i32(bytes, i).cast_unsigned() }
}
