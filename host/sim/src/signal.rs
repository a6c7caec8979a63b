//! What falls on the sensor: Stokes planes in photoelectrons per ms, and which of them a photosite sees.

use host_image::{BayerPattern, StokesImage};

use crate::scene::{Camera, Scene};
use crate::{Effect, EffectSet, SimError};

/// (s0, s1, s2) of one band, each row-major, height × width.
pub(crate) type Band = [Vec<f32>; 3];

/// Light without a polarizer, as the filters pass it.
#[derive(Clone, Debug)]
pub(crate) struct Signal {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// R, G, B behind a mosaic; one band for a grey sensor.
    pub(crate) bands: Vec<Band>,
    /// The mosaic, while there are three bands.
    pub(crate) pattern: Option<BayerPattern>,
}

impl Signal {
    /// Of a [`checked`] Stokes image in radiance; its mosaic only if `effects` has it. An image of one plane stands for three
    /// equal ones.
    pub(crate) fn new(camera: &Camera, image: &StokesImage, effects: EffectSet) -> Self {
        let (width, height) = (image.width, image.height);
        let pattern = camera.bayer.filter(|_| effects.contains(Effect::Bayer));
        let bands = if pattern.is_some() {
            [0, 1, 2].map(|band| colored(camera, image, band)).into()
        } else {
            vec![grey(camera, image)]
        };
        Self { width, height, bands, pattern }
    }

    /// Index of the band a photosite sees.
    pub(crate) fn band(&self, row: usize, column: usize) -> usize {
        self.pattern.map_or(0, |pattern| filter(pattern, row, column))
    }

    /// The photosites' own (s0, s1, s2): one plane each, taken from the band each of them sees.
    pub(crate) fn photosites(&self) -> Band {
        if self.pattern.is_none() {
            return self.bands[0].clone();
        }
        [0, 1, 2].map(|component: usize| {
            let mut plane = Vec::with_capacity(self.width * self.height);
            for row in 0..self.height {
                let line =
                    |column: usize| &self.bands[self.band(row, column)][component][row * self.width..][..self.width];
                let [even, odd] = [line(0), line(1)];
                plane.extend((0..self.width).map(|c| if c % 2 == 0 { even[c] } else { odd[c] }));
            }
            plane
        })
    }
}

/// Refuses an image that contradicts itself, or the scene's camera, and a view there is not.
pub(crate) fn checked(scene: &Scene, view: usize, image: &StokesImage) -> Result<(), SimError> {
    if view >= scene.views.len() {
        return Err(SimError::NoView { view, views: scene.views.len() });
    }
    image.check()?;
    let (expected_width, expected_height) = (usize::from(scene.camera.width_px), usize::from(scene.camera.height_px));
    let (width, height) = (image.width, image.height);
    if (width, height) == (expected_width, expected_height) {
        Ok(())
    } else {
        Err(SimError::ImageSize { width, height, expected_width, expected_height })
    }
}

/// 0, 1, 2 for R, G, B: the filter over the photosite of `row` and `column`.
pub(crate) fn filter(pattern: BayerPattern, row: usize, column: usize) -> usize {
    const R: usize = 0;
    const G: usize = 1;
    const B: usize = 2;
    let tile = match pattern {
        BayerPattern::Rggb => [[R, G], [G, B]],
        BayerPattern::Bggr => [[B, G], [G, R]],
        BayerPattern::Grbg => [[G, R], [B, G]],
        BayerPattern::Gbrg => [[G, B], [R, G]],
    };
    tile[row % 2][column % 2]
}

/// Band 0, 1 or 2 of `image` behind its filter.
pub(crate) fn colored(camera: &Camera, image: &StokesImage, band: usize) -> Band {
    let response = single(camera.response_e_per_ms[band]);
    bands(image)[band].map(|plane| plane.iter().map(|v| v * response).collect())
}

/// The mean of the three filtered bands: what a grey sensor sees.
pub(crate) fn grey(camera: &Camera, image: &StokesImage) -> Band {
    let [wr, wg, wb] = camera.response_e_per_ms.map(|response| single(response / 3.0));
    let [red, green, blue] = bands(image);
    [0, 1, 2].map(|k: usize| {
        let pixels = red[k].iter().zip(green[k]).zip(blue[k]);
        pixels.map(|((r, g), b)| wr * r + wg * g + wb * b).collect()
    })
}

/// The largest ½ (s0 + s1 cos 2φ + s2 sin 2φ) of any photosite behind its filter and any band, e/ms; (cos 2φ, sin 2φ) in
/// `axes`.
pub(crate) fn brightest(camera: &Camera, image: &StokesImage, axes: &[(f64, f64)]) -> f64 {
    let axes: Vec<[f32; 2]> = axes.iter().map(|(c, s)| [single(*c), single(*s)]).collect();
    let mut most = 0.0_f32;
    let mut offer = |[s0, s1, s2]: [f32; 3]| {
        for [c, s] in &axes {
            let value = 0.5 * (s0 + c * s1 + s * s2);
            most = if value > most { value } else { most };
        }
    };
    if camera.bayer.is_some() {
        for ([s0, s1, s2], response) in bands(image).into_iter().zip(camera.response_e_per_ms) {
            let response = single(response);
            let pixels = s0.iter().zip(s1).zip(s2);
            pixels.for_each(|((s0, s1), s2)| offer([s0 * response, s1 * response, s2 * response]));
        }
    } else {
        let [s0, s1, s2] = grey(camera, image);
        s0.iter().zip(&s1).zip(&s2).for_each(|((s0, s1), s2)| offer([*s0, *s1, *s2]));
    }
    f64::from(most)
}

/// Planes (s0, s1, s2) of R, G and B; those of a grey image three times.
fn bands(image: &StokesImage) -> [[&[f32]; 3]; 3] {
    [0, 1, 2].map(|band: usize| {
        let planes = &image.colors[band.min(image.colors.len() - 1)];
        [&planes.s0[..], &planes.s1, &planes.s2]
    })
}

/// The nearest f32.
#[expect(clippy::cast_possible_truncation, reason = "planes are f32; rounding to nearest is meant")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}
