//! The JSON of captures: `capture.json` of one view, and `views.json` of a whole session.
//!
//! `views.json` is `{"version": 1, "views": [...], "light": {...}, "sample": {...}}`, each view with the keys of a
//! `capture.json`. Keys that are not named here are notes to people. Paths are relative to the file they stand in.
//! Matrices are lists of rows.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

/// `views.json`.
#[derive(Deserialize)]
pub(super) struct SessionDocument {
    pub(super) version: u32,
    pub(super) views: Vec<ViewDocument>,
    pub(super) light: Option<LightDocument>,
    pub(super) sample: Option<SampleDocument>,
}

/// `capture.json`, or one entry of `views`.
#[derive(Deserialize)]
pub(super) struct ViewDocument {
    pub(super) version: Option<u32>,
    #[serde(alias = "name")]
    pub(super) view: Option<String>,
    pub(super) image: Option<ImageDocument>,
    pub(super) sensor: Option<SensorDocument>,
    pub(super) exposure_s: Option<f64>,
    pub(super) camera: CameraDocument,
    pub(super) plane: Option<PlaneDocument>,
    pub(super) polarizer: Option<PolarizerDocument>,
    pub(super) light: Option<LightDocument>,
    #[serde(default)]
    pub(super) sequences: BTreeMap<String, Vec<FrameDocument>>,
    pub(super) stokes: Option<StokesDocument>,
}

#[derive(Deserialize)]
pub(super) struct ImageDocument {
    pub(super) width: usize,
    pub(super) height: usize,
    /// `RGB`, `mono`, or the color filters of a raw mosaic: `RGGB`, `BGGR`, `GRBG`, `GBRG`.
    pub(super) channels: Option<String>,
    pub(super) linear: Option<bool>,
}

#[derive(Deserialize)]
pub(super) struct SensorDocument {
    pub(super) black_level_dn: f64,
    pub(super) white_level_dn: Option<f64>,
    pub(super) gain_e_per_dn: f64,
    pub(super) read_noise_e: f64,
    /// Of R, G and B; a grey sensor sees the sum.
    pub(super) responsivity_dn_per_radiance_s: PerBand,
}

#[derive(Deserialize)]
#[expect(non_snake_case, reason = "the keys of the file")]
pub(super) struct CameraDocument {
    pub(super) model: Option<String>,
    pub(super) axes: Option<String>,
    pub(super) pixel_convention: Option<String>,
    pub(super) K: [[f64; 3]; 3],
    pub(super) R_world_to_camera: Option<[[f64; 3]; 3]>,
    pub(super) t_world_to_camera: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[expect(non_snake_case, reason = "the keys of the file")]
pub(super) struct PlaneDocument {
    pub(super) H_plane_to_pixel: Option<[[f64; 3]; 3]>,
    pub(super) sample_corners_plane: Option<Vec<[f64; 2]>>,
    /// `null` for a corner that is not in front of the camera.
    pub(super) sample_corners_px: Option<Vec<Option<[f64; 2]>>>,
    pub(super) fiducial_centres_plane: Option<Vec<[f64; 2]>>,
    pub(super) fiducial_centres_px: Option<Vec<Option<[f64; 2]>>>,
    pub(super) reference_strip: Option<StripDocument>,
}

/// Black plastic beside the sample.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct StripDocument {
    /// Least and largest x, least and largest y.
    pub(super) rect_plane_x0x1y0y1: [f64; 4],
    /// Its index of refraction; that of the chart casing of the paper's §5 if not given.
    pub(super) eta: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct PolarizerDocument {
    pub(super) angle_convention: Option<String>,
    /// `camera`, `sheet` (in `views.json` the defaults of Stokes images without angles, and of all others) or `ray x
    /// up` (default in `capture.json`).
    pub(super) reference_axis: Option<String>,
    /// k₁/k₂; an ideal polarizer if not given.
    pub(super) extinction_ratio: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct FrameDocument {
    /// Not there for a frame that was planned only.
    pub(super) file: Option<PathBuf>,
    pub(super) nominal_angle_deg: f64,
    /// That of the view if not given.
    pub(super) exposure_s: Option<f64>,
}

/// A Stokes image instead of frames: its path alone, or with its noise.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum StokesDocument {
    Path(PathBuf),
    Full {
        file: PathBuf,
        /// Standard deviation of s0 relative to s0.
        relative_noise: Option<f64>,
    },
}

/// The part of the plane that is the sample.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct SampleDocument {
    /// (least, largest) x.
    pub(super) x: [f64; 2],
    /// (least, largest) y.
    pub(super) y: [f64; 2],
}

/// The light; which keys count depends on `type`. See [`super::LightSpec`].
#[derive(Clone, Deserialize, PartialEq)]
pub(super) struct LightDocument {
    pub(super) r#type: String,
    pub(super) file: Option<PathBuf>,
    pub(super) layout: Option<String>,
    pub(super) scale: Option<f64>,
    pub(super) center_azimuth_deg: Option<f64>,
    #[serde(alias = "radiance_rgb")]
    pub(super) radiance: Option<[f64; 3]>,
    pub(super) zenith_radiance: Option<[f64; 3]>,
    pub(super) base_radiance: Option<[f64; 3]>,
    pub(super) horizon_radiance: Option<[f64; 3]>,
    pub(super) aureole_radiance: Option<[f64; 3]>,
    pub(super) aureole_width_deg: Option<f64>,
    pub(super) polarization: Option<PolarizationDocument>,
    pub(super) sun_azimuth_deg: Option<f64>,
    pub(super) sun_elevation_deg: Option<f64>,
    pub(super) sun_disk: Option<DiskDocument>,
    pub(super) ball: Option<BallDocument>,
}

/// A sentence that starts with `none` or `in the map`, or a formula.
#[derive(Clone, Deserialize, PartialEq)]
#[serde(untagged)]
pub(super) enum PolarizationDocument {
    Words(String),
    Formula {
        /// `rayleigh` or `berry`.
        r#type: String,
        max_dolp: f64,
        splitting_deg: Option<f64>,
    },
}

/// One number for all bands, or R, G, B.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(super) enum PerBand {
    Same(f64),
    Each([f64; 3]),
}

impl PerBand {
    pub(super) fn bands(self) -> [f64; 3] {
        match self {
            Self::Same(value) => [value; 3],
            Self::Each(values) => values,
        }
    }
}

#[derive(Clone, Deserialize, PartialEq)]
pub(super) struct DiskDocument {
    pub(super) radiance: [f64; 3],
    pub(super) angular_radius_deg: f64,
}

/// A photographed mirror ball.
#[derive(Clone, Deserialize, PartialEq)]
#[expect(non_snake_case, reason = "the keys of the file")]
pub(super) struct BallDocument {
    pub(super) center_px: [f64; 2],
    pub(super) radius_px: f64,
    /// Standard deviation of both.
    pub(super) circle_sigma_px: Option<f64>,
    pub(super) K: [[f64; 3]; 3],
    pub(super) R_world_to_camera: [[f64; 3]; 3],
    pub(super) reflectance: f64,
    pub(super) reflectance_sigma: Option<f64>,
    pub(super) black_level_dn: Option<f64>,
    /// Radiance per DN; 1 for a float picture of radiance.
    pub(super) radiance_per_dn: Option<f64>,
}
