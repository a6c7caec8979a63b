//! Pictures of the maps for people, each with a legend.

use host_image::{Colors, Picture, PlanePreview, plane_preview};

use super::{MapsError, MaterialMaps, Plane, Spread};

/// What to look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapPreview {
    /// ρ_d as a color; white is the 95th percentile of the brightest band.
    Albedo,
    /// Index of refraction.
    Eta,
    /// GGX α.
    Alpha,
    /// Normals.
    Normal,
    /// Mean σ of ρ_d over the bands.
    SigmaAlbedo,
    /// σ of η.
    SigmaEta,
    /// σ of α.
    SigmaAlpha,
    /// σ of the normal.
    SigmaNormal,
    /// χ² over degrees of freedom.
    Misfit,
    /// Reasons against the answer.
    Reasons,
}

impl MapPreview {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Albedo,
        Self::Eta,
        Self::Alpha,
        Self::Normal,
        Self::SigmaAlbedo,
        Self::SigmaEta,
        Self::SigmaAlpha,
        Self::SigmaNormal,
        Self::Misfit,
        Self::Reasons,
    ];

    /// A short name for files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Eta => "eta",
            Self::Alpha => "alpha",
            Self::Normal => "normal",
            Self::SigmaAlbedo => "sigma-albedo",
            Self::SigmaEta => "sigma-eta",
            Self::SigmaAlpha => "sigma-alpha",
            Self::SigmaNormal => "sigma-normal",
            Self::Misfit => "misfit",
            Self::Reasons => "reasons",
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::Albedo => "Diffuse albedo",
            Self::Eta => "Index of refraction",
            Self::Alpha => "Roughness (GGX alpha)",
            Self::Normal => "Normal",
            Self::SigmaAlbedo => "Sigma of the diffuse albedo",
            Self::SigmaEta => "Sigma of the index",
            Self::SigmaAlpha => "Sigma of the roughness",
            Self::SigmaNormal => "Sigma of the normal",
            Self::Misfit => "Chi-squared by freedom",
            Self::Reasons => "Reasons",
        }
    }
}

impl MaterialMaps {
    /// Draws one preview of at most `max_width` columns and its legend: 8-bit RGB. Numbers are shown from the 5th to the
    /// 95th percentile, σ and misfit from 0.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`], [`MapsError::Image`].
    pub fn preview(&self, kind: MapPreview, max_width: usize) -> Result<Picture, MapsError> {
        self.check()?;
        let number = |plane: Plane, unit| {
            let (min, max) = range(self.plane(plane));
            Colors::Scalar { values: self.plane(plane), min, max, unit }
        };
        let sigma = |plane: Plane, unit| from_zero(self.plane(plane), unit);
        let three = |planes: [Plane; 3]| planes.map(|p| self.plane(p));
        let albedo = three([Plane::AlbedoR, Plane::AlbedoG, Plane::AlbedoB]);
        let made: Vec<f32> = match kind {
            MapPreview::SigmaAlbedo => {
                let [r, g, b] = three([Plane::SigmaAlbedoR, Plane::SigmaAlbedoG, Plane::SigmaAlbedoB]);
                r.iter().zip(g).zip(b).map(|((r, g), b)| (r + g + b) / 3.0).collect()
            }
            MapPreview::Misfit => {
                let by_freedom = |(chi2, freedom): (&f32, &u32)| {
                    #[expect(clippy::cast_precision_loss, reason = "degrees of freedom are few")]
                    let freedom = *freedom as f32;
                    if freedom > 0.0 { chi2 / freedom } else { f32::NAN }
                };
                self.plane(Plane::Chi2).iter().zip(&self.freedom).map(by_freedom).collect()
            }
            _ => Vec::new(),
        };
        let colors = match kind {
            MapPreview::Albedo => {
                let white = albedo.iter().map(|band| range(band).1).fold(0.0, f64::max);
                Colors::Reflectance { values: albedo, white }
            }
            MapPreview::Eta => number(Plane::Eta, "eta"),
            MapPreview::Alpha => number(Plane::Alpha, "alpha"),
            MapPreview::Normal => Colors::Normal { values: three([Plane::NormalX, Plane::NormalY, Plane::NormalZ]) },
            MapPreview::SigmaEta => sigma(Plane::SigmaEta, "sigma of eta"),
            MapPreview::SigmaAlpha => sigma(Plane::SigmaAlpha, "sigma of alpha"),
            MapPreview::SigmaNormal => sigma(Plane::SigmaNormal, "degrees, rms"),
            MapPreview::SigmaAlbedo => from_zero(&made, "sigma, mean of bands"),
            MapPreview::Misfit => from_zero(&made, "chi-squared/freedom"),
            MapPreview::Reasons => Colors::Categories { sets: &self.reasons, names: &self.reason_names },
        };
        let (width, height) = (self.grid.columns, self.grid.rows);
        let preview = PlanePreview { title: kind.title(), width, height, max_width, colors, notes: Vec::new() };
        Ok(plane_preview(&preview)?)
    }
}

/// 5th and 95th percentile; widened where they coincide, (0, 1) of nothing.
fn range(values: &[f32]) -> (f64, f64) {
    let Some(spread) = Spread::of(values.iter().copied()) else { return (0.0, 1.0) };
    let (low, high) = (f64::from(spread.low), f64::from(spread.high));
    let room = (1e-3 * high.abs()).max(1e-6);
    if high - low > room { (low, high) } else { (low - room, high + room) }
}

fn from_zero<'a>(values: &'a [f32], unit: &'a str) -> Colors<'a> {
    Colors::Scalar { values, min: 0.0, max: range(values).1.max(1e-6), unit }
}
