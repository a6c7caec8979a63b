//! The light a sample was seen under, as it is known: measured or modeled, three bands.
//!
//! Radiance and (Q, U) by direction are [`host_optics::Light`]; beside them the same light prefiltered on a map, which is
//! what integrals use, and small sources (the sun's disk) that no map should hold. The unit of radiance is the unit of the
//! Stokes images; how well the two are known to agree is the light's relative scale uncertainty.

use glam::DVec3;
use host_optics::prefilter::{Pyramid, Rgb, Sources, irradiance};
use host_optics::sky::{StokesMap, SunDisk};
use host_optics::{Light, OpticsError};
use std::fmt;

/// Known light in three bands.
pub struct KnownLight {
    bands: [Box<dyn Light + Send + Sync>; 3],
    pyramid: Pyramid,
    sources: Sources,
    disk: Option<SunDisk>,
    scale_uncertainty: f64,
}

impl KnownLight {
    /// Columns and rows over the sphere at which a formula is sampled unless told otherwise: lobes down to α = 0.01 do not
    /// see its texels (0.35°).
    pub const FORMULA_SIZE: [usize; 2] = [1024, 512];

    /// Three maps, their texels exactly.
    ///
    /// # Errors
    /// None that a [`StokesMap`] can cause.
    pub fn of_maps(bands: [StokesMap; 3]) -> Result<Self, OpticsError> {
        let pyramid = Pyramid::of_maps(&bands)?;
        let [r, g, b] = bands;
        Ok(Self::new([Box::new(r), Box::new(g), Box::new(b)], pyramid))
    }

    /// Three bands of anything, sampled on an equirectangular map of `size` (columns, rows over the sphere) for integrals.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] for a size without texels.
    pub fn sampled<L: Light + Send + Sync + 'static>(size: [usize; 2], bands: [L; 3]) -> Result<Self, OpticsError> {
        let pyramid = Pyramid::sample(size, &bands)?;
        let [r, g, b] = bands;
        Ok(Self::new([Box::new(r), Box::new(g), Box::new(b)], pyramid))
    }

    fn new(bands: [Box<dyn Light + Send + Sync>; 3], pyramid: Pyramid) -> Self {
        Self { bands, pyramid, sources: Sources::default(), disk: None, scale_uncertainty: 0.0 }
    }

    /// With the sun's disk beside the sky: unpolarized, `radiance` in R, G and B.
    #[must_use]
    pub fn with_sun(mut self, disk: SunDisk, radiance: [f64; 3]) -> Self {
        self.sources = Sources { points: disk.points(), radiance };
        self.disk = Some(disk);
        self
    }

    /// The same light taken for unpolarized, whatever is known of its Q and U.
    #[must_use]
    pub fn unpolarized(self) -> Self {
        if !self.pyramid.polarized() {
            return self;
        }
        let bands = self.bands.map(|band| -> Box<dyn Light + Send + Sync> { Box::new(Depolarized(band)) });
        let pyramid = self.pyramid.unpolarized();
        Self { bands, pyramid, ..self }
    }

    /// With a relative standard uncertainty of its scale against the images (0.01 is 1 %).
    #[must_use]
    pub fn with_scale_uncertainty(self, relative: f64) -> Self {
        Self { scale_uncertainty: relative, ..self }
    }

    /// Relative standard uncertainty of the scale of the light against the images.
    #[must_use]
    pub fn scale_uncertainty(&self) -> f64 {
        self.scale_uncertainty
    }

    /// Whether any Q or U of it differs from 0.
    #[must_use]
    pub fn polarized(&self) -> bool {
        self.pyramid.polarized()
    }

    /// (L, Q, U) of R, G, B out of unit `direction` in [`host_optics::Frame::sky`], the sun's disk included; black below the
    /// world horizon.
    #[must_use]
    pub fn stokes(&self, direction: DVec3) -> Rgb {
        if direction.z <= 0.0 {
            return [[0.0; 3]; 3];
        }
        let mut out = self.bands.each_ref().map(|b| b.stokes(direction));
        if self.disk.is_some_and(|d| d.stokes(direction)[0] > 0.0) {
            for (s, l) in out.iter_mut().zip(self.sources.radiance) {
                s[0] += l;
            }
        }
        out
    }

    /// E of R, G, B on a plane with unit `normal`, the sun included.
    #[must_use]
    pub fn irradiance(&self, normal: DVec3) -> [f64; 3] {
        irradiance(&self.pyramid, &self.sources, None, normal)
    }

    /// The light prefiltered, without the sun's disk.
    #[must_use]
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// The sun's disk by its points.
    #[must_use]
    pub fn sources(&self) -> &Sources {
        &self.sources
    }
}

impl fmt::Debug for KnownLight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KnownLight")
            .field("polarized", &self.polarized())
            .field("disk", &self.disk)
            .field("scale_uncertainty", &self.scale_uncertainty)
            .finish_non_exhaustive()
    }
}

/// Light without its polarization.
struct Depolarized(Box<dyn Light + Send + Sync>);

impl Light for Depolarized {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let [l, ..] = self.0.stokes(direction);
        [l, 0.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_optics::sky::{MoonSpencer, Polarized, Rayleigh};

    #[test]
    fn light_is_one_thing_by_direction_and_by_integral() {
        let sky = Polarized {
            light: MoonSpencer { zenith: 2.0 },
            pattern: Rayleigh::new(DVec3::new(1.0, 0.0, 0.5), 0.7).unwrap(),
        };
        let disk = SunDisk::new(DVec3::new(1.0, 0.0, 0.5), 0.02, 1.0).unwrap();
        let light = KnownLight::sampled([256, 128], [sky; 3]).unwrap().with_sun(disk, [30.0, 20.0, 10.0]);
        let up = light.irradiance(DVec3::Z);
        for (e, radiance) in up.iter().zip([30.0, 20.0, 10.0]) {
            let exact = 7.0 / 9.0 * core::f64::consts::PI * 2.0 + radiance * disk.irradiance(DVec3::Z);
            assert!((e / exact - 1.0).abs() < 1e-3, "{e} {exact}");
        }
        let sun = DVec3::new(1.0, 0.0, 0.5).normalize();
        assert!(light.stokes(sun)[0][0] > 31.0 && light.stokes(-sun).as_flattened().iter().all(|x| x.abs() < 1e-12));
        assert!(light.polarized() && light.stokes(DVec3::Y)[0][0].abs() < 1e-12);
        let side = DVec3::new(-0.1, 0.9, 0.4).normalize();
        assert!(light.stokes(side)[1][1].abs() > 0.01);
        let plain = light.unpolarized().with_scale_uncertainty(0.02);
        assert!(!plain.polarized() && plain.stokes(side)[1][1].abs() < 1e-12 && plain.scale_uncertainty() > 0.019);
        assert!((plain.irradiance(DVec3::Z)[0] / up[0] - 1.0).abs() < 1e-6);
    }
}
