//! Fitted maps under another light, seen from anywhere: paper eq. 6 the other way round.
//!
//! A pixel of the picture sees a point of the sample plane; the material there (bilinear between the maps' samples) is
//! lit by a sky, through [`Tables`], and by the disk of a sun beside it, by its own points ([`Illumination`]). Stokes
//! vectors are in the camera frame of each pixel's own ray ([`host_optics::Frame::camera`]), radiance in the light's unit.
//! There are no shadows and no light from one part of the sample on another, as in the model that was fitted.
//!
//! Error of s0, s1, s2 relative to s0: the sky's is that of its table, which [`Relit::table`] states (median,
//! 95th percentile, worst over the maps' ranges); the sun's is below 1e-3. Where no material is known there is no picture:
//! such pixels are counted, never filled.

mod display;
mod environment;
mod illumination;
mod surface;
mod view;

use glam::DVec2;
use host_image::{Color, ColorPlanes, ImageError, StokesImage, StokesMetadata};
use host_optics::{Masking, OpticsError};
use protocol_polar::Flags;
use rayon::prelude::*;

pub use display::{Exposure, display};
pub use environment::{Sky, Sun, environment};
pub use illumination::Illumination;
pub use view::{ViewFault, frame};

use crate::forward::{Body, Tables, ViewReport};
use crate::maps::{MapsError, MaterialMaps};
use crate::material::BANDS;
use crate::session::homography::project;
use crate::session::{Camera, LightSpec};
use surface::{Found, Surface};

/// How to relight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelightOptions {
    /// What the diffuse part is; that of the fit.
    pub body: Body,
    /// Masking of facets; that of the fit.
    pub masking: Masking,
    /// Error of the sky's table aimed at, relative to s0.
    pub tolerance: f64,
    /// Rays per side of a pixel, 1 to 8: n² rays over its area, averaged.
    pub rays: u8,
    /// Samples with any of these reasons have no answer.
    pub refuse: u32,
}

impl Default for RelightOptions {
    fn default() -> Self {
        Self { body: Body::Lambert, masking: Masking::HeightCorrelated, tolerance: 1e-3, rays: 2, refuse: 0 }
    }
}

/// What a pixel sees, by the most of its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// The sample, with an answer.
    Material,
    /// The sample, where the maps have no answer.
    Unanswered,
    /// Something else than the sample.
    Beyond,
}

/// Maps under a light.
#[derive(Debug)]
pub struct Relit {
    /// s0, s1, s2 of R, G, B; 0 where there is no material, with flag [`Flags::TOO_FEW`].
    pub image: StokesImage,
    /// By pixel, row-major, rows run down.
    pub sight: Vec<Sight>,
    /// What the table of the sky is worth; `None` without a sky.
    pub table: Option<ViewReport>,
    /// Samples of the maps whose index, roughness or slope is outside of what the table covers: they are drawn with the
    /// nearest that is.
    pub held: usize,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RelightError {
    /// Nothing shines onto the front of the sample.
    #[error("no light above the horizon: the sample would be black")]
    NoLight,
    /// The maps have no sample with an answer.
    #[error("the maps have no sample with an answer: 0 of {samples}")]
    NoMaterial {
        /// Samples of the maps.
        samples: usize,
    },
    /// The camera looks past the sample.
    #[error("no pixel of this view sees the sample")]
    NothingSeen,
    /// Rays per side of a pixel.
    #[error("{rays} rays per side of a pixel; 1 to 8 are cast")]
    Rays {
        /// As asked for.
        rays: u8,
    },
    /// Where to look from.
    #[error(transparent)]
    View(#[from] ViewFault),
    /// A sun that lights nothing.
    #[error("the sun at elevation {elevation_deg} degrees is not above the horizon")]
    SunBelowHorizon {
        /// As asked for.
        elevation_deg: f64,
    },
    /// A sky that depends on where the sun is.
    #[error("{what} depends on where the sun is, and that is not given")]
    NoSun {
        /// Which.
        what: &'static str,
    },
    /// A number of the light that makes no sense.
    #[error("{name} is {value}; {expected}")]
    Number {
        /// Which.
        name: &'static str,
        /// As given.
        value: f64,
        /// What would do.
        expected: &'static str,
    },
    /// Maps that contradict themselves.
    #[error(transparent)]
    Maps(#[from] MapsError),
    /// An environment map that cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Outside of the model.
    #[error(transparent)]
    Optics(#[from] OpticsError),
}

impl Relit {
    /// How many pixels see that.
    #[must_use]
    pub fn count(&self, sight: Sight) -> usize {
        self.sight.iter().filter(|s| **s == sight).count()
    }
}

/// The picture of `maps` under `light` as `camera` takes it.
///
/// # Errors
/// [`RelightError`] as its variants say.
pub fn relight(
    maps: &MaterialMaps,
    camera: &Camera,
    light: &LightSpec,
    options: &RelightOptions,
) -> Result<Relit, RelightError> {
    if !(1..=8).contains(&options.rays) {
        return Err(RelightError::Rays { rays: options.rays });
    }
    maps.check()?;
    let surface = Surface::new(maps, options.refuse);
    let ranges = surface.ranges().ok_or(RelightError::NoMaterial { samples: maps.grid.samples() })?;
    let illumination = Illumination::new(light, camera, &maps.grid.plane, &ranges, options)?;
    let [width, height] = camera.size();
    let work = Work { camera, surface: &surface, illumination: &illumination, rays: options.rays };
    let to_plane = camera.plane_to_pixel().inverse();
    let pixel = |i: usize| work.pixel(&to_plane, [i % width, i / width]);
    let pixels: Vec<(Sight, [[f32; 3]; BANDS])> = (0..width * height).into_par_iter().map(pixel).collect();
    if pixels.iter().all(|(sight, _)| *sight == Sight::Beyond) {
        return Err(RelightError::NothingSeen);
    }
    let flags = |(sight, _): &(Sight, _)| if *sight == Sight::Material { 0 } else { Flags::TOO_FEW.0 };
    let planes = |(band, color): (usize, Color)| {
        let plane = |k: usize| pixels.iter().map(|(_, stokes)| stokes[band][k]).collect();
        let flags = Some(pixels.iter().map(flags).collect());
        ColorPlanes { color, s0: plane(0), s1: plane(1), s2: plane(2), flags, residual: None }
    };
    let colors = [Color::R, Color::G, Color::B].into_iter().enumerate().map(planes).collect();
    Ok(Relit {
        image: StokesImage { width, height, colors, metadata: metadata() },
        sight: pixels.iter().map(|(sight, _)| *sight).collect(),
        table: illumination.sky().and_then(|t: &Tables| t.reports().first().copied()),
        held: surface.outside(&ranges),
    })
}

/// All a pixel asks.
struct Work<'a> {
    camera: &'a Camera,
    surface: &'a Surface<'a>,
    illumination: &'a Illumination,
    rays: u8,
}

impl Work<'_> {
    #[expect(clippy::cast_possible_truncation, reason = "pictures are f32")]
    fn pixel(&self, to_plane: &glam::DMat3, [column, row]: [usize; 2]) -> (Sight, [[f32; 3]; BANDS]) {
        let side = f64::from(self.rays);
        let (mut sum, mut counts) = ([[0.0; 3]; BANDS], [0_u32; 3]);
        for k in 0..u32::from(self.rays) * u32::from(self.rays) {
            let (x, y) = (k % u32::from(self.rays), k / u32::from(self.rays));
            let within = DVec2::new((f64::from(x) + 0.5) / side, (f64::from(y) + 0.5) / side);
            let on_plane = *to_plane * (DVec2::new(column as f64, row as f64) + within).extend(1.0);
            let point = on_plane.truncate() / on_plane.z;
            // Rays above the horizon meet the plane behind the camera.
            let ahead = point.is_finite() && project(&self.camera.plane_to_pixel(), point).is_some();
            let sight = match if ahead { self.surface.at(point) } else { Found::Beyond } {
                Found::Beyond => Sight::Beyond,
                Found::Unanswered => Sight::Unanswered,
                Found::Material(material) => {
                    let stokes = self.illumination.reflected(self.camera.towards(point), &material);
                    for (total, more) in sum.iter_mut().flatten().zip(stokes.as_flattened()) {
                        *total += more;
                    }
                    Sight::Material
                }
            };
            counts[sight as usize] += 1;
        }
        let [seen, unanswered, beyond] = counts;
        if seen > 0 && seen >= unanswered.max(beyond) {
            return (Sight::Material, sum.map(|band| band.map(|s| (s / f64::from(seen)) as f32)));
        }
        let sight = if unanswered >= beyond { Sight::Unanswered } else { Sight::Beyond };
        (sight, [[0.0; 3]; BANDS])
    }
}

fn metadata() -> StokesMetadata {
    StokesMetadata {
        unit: "radiance".into(),
        angles_deg: Vec::new(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: "fitted maps under another light".into(),
        camera_serial: None,
        capture_id: None,
        software_version: concat!("brewster ", env!("CARGO_PKG_VERSION")).into(),
    }
}
