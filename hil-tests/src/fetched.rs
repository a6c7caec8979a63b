//! A whole capture on the host, and what the integers must be.

use crate::reference::LeastSquaresByCramer;
use host_link::replay::{Planes, ReplayReport, replay};
use host_link::{Client, PlaneBuffer, Transport};
use protocol_polar::fixed::{Noise, SensorRange, StokesPlan};
use protocol_polar::{Analyzer, Degrees, Flags};
use protocol_wire::{CaptureDescription, CaptureId, PlaneKind, Word};
use std::collections::HashMap;

/// A capture with all its planes.
#[derive(Clone, Debug)]
pub struct Fetched {
    /// What the camera says of it.
    pub description: CaptureDescription,
    planes: Planes,
}

impl Fetched {
    /// Fetches every plane of a capture; it stays on the camera.
    #[must_use]
    pub fn fetch<T: Transport>(client: &mut Client<T>, id: CaptureId) -> Self {
        let description = client.describe(id).unwrap();
        let mut planes = Planes::new();
        for info in &description.planes {
            let mut plane = PlaneBuffer::new(&description, info.kind).unwrap();
            client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap();
            planes.insert(info.kind, plane.into_bytes().unwrap());
        }
        Self { description, planes }
    }

    /// One plane's bytes.
    #[must_use]
    pub fn bytes(&self, kind: PlaneKind) -> &[u8] {
        &self.planes[&kind]
    }

    /// s0, s1 or s2 as stored.
    #[must_use]
    pub fn stokes(&self, component: usize) -> Vec<i32> {
        let bytes = self.bytes([PlaneKind::S0, PlaneKind::S1, PlaneKind::S2][component]);
        match self.description.word {
            Word::I16 => bytes.as_chunks().0.iter().map(|b| i16::from_le_bytes(*b).into()).collect(),
            Word::I32 => bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b)).collect(),
        }
    }

    /// s0, s1 or s2 in DN.
    #[must_use]
    pub fn stokes_dn(&self, component: usize) -> Vec<f64> {
        let lsb = 0.5_f64.powi(self.description.frac_bits.into());
        self.stokes(component).into_iter().map(|s| f64::from(s) * lsb).collect()
    }

    /// The flags.
    #[must_use]
    pub fn flags(&self) -> Vec<Flags> {
        self.bytes(PlaneKind::Flags).iter().map(|byte| Flags(*byte)).collect()
    }

    /// Raw frames, in slot order.
    #[must_use]
    pub fn raw(&self) -> Vec<Vec<u16>> {
        let slots = 0..u8::try_from(self.description.frames.len()).unwrap();
        let samples = |slot| self.bytes(PlaneKind::Raw(slot)).as_chunks().0.iter().map(|b| u16::from_le_bytes(*b));
        slots.map(|slot| samples(slot).collect()).collect()
    }

    /// The frames as the camera's arithmetic took them.
    #[must_use]
    pub fn analyzers(&self) -> Vec<Analyzer> {
        let frames = self.description.frames.iter();
        frames
            .map(|frame| Analyzer {
                angle: Degrees(frame.angle_deg).to_radians(),
                throughput: frame.throughput,
                efficiency: frame.efficiency,
            })
            .collect()
    }

    /// The recipe, made anew from the description.
    #[must_use]
    pub fn plan(&self) -> StokesPlan {
        let sensor = &self.description.sensor;
        let range = SensorRange { bit_depth: sensor.bit_depth, white_level: sensor.white_level_dn };
        let noise = Noise {
            read_dn: sensor.read_noise_e / sensor.gain_e_per_dn,
            electrons_per_dn: sensor.gain_e_per_dn,
            misfit_sigma: self.description.misfit_sigma,
        };
        StokesPlan::new(&self.analyzers(), self.description.word.into(), range, noise).unwrap()
    }

    /// How far the stored integers are from least squares by another way: the largest ratio of |stored − exact| to the proved
    /// bound of the photosite's own set of frames, over every photosite that was computed. (Without maps; frames of equal
    /// exposure.)
    #[must_use]
    pub fn worst_of_bound(&self) -> f64 {
        let (plan, analyzers, raw) = (self.plan(), self.analyzers(), self.raw());
        let black = f64::from(self.description.sensor.black_level_dn);
        let (stokes, flags) = ([0, 1, 2].map(|component| self.stokes_dn(component)), self.flags());
        let mut known = HashMap::new();
        let mut worst: f64 = 0.0;
        for (i, flags) in flags.into_iter().enumerate() {
            let samples: Vec<u16> = raw.iter().map(|frame| frame[i]).collect();
            let mask = plan.saturated(&samples);
            let valid = |k: &usize| mask >> k & 1 == 0;
            let (bound, exact) = known.entry(mask).or_insert_with(|| {
                let kept = (0..analyzers.len()).filter(valid).map(|k| &analyzers[k]);
                (plan.weights(mask).ok().map(|weights| weights.bound_dn()), LeastSquaresByCramer::new(kept))
            });
            let Some(bound) = bound else {
                assert!(flags.contains(Flags::TOO_FEW), "photosite {i} of {samples:?}: {flags:?}");
                continue;
            };
            assert!(!flags.contains(Flags::TOO_FEW), "photosite {i} of {samples:?}: {flags:?}");
            if flags.contains(Flags::OUT_OF_RANGE) {
                continue;
            }
            let signals = (0..analyzers.len()).filter(valid).map(|k| (&analyzers[k], f64::from(samples[k]) - black));
            let wanted = exact.solve(signals);
            for component in 0..3 {
                worst = worst.max((stokes[component][i] - wanted[component]).abs() / bound[component]);
            }
        }
        worst
    }

    /// The host's own computation from the raw frames, compared bit for bit.
    #[must_use]
    pub fn replay(&self) -> ReplayReport {
        replay(&self.description, &self.planes).unwrap()
    }
}
