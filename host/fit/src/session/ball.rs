//! Light from a photograph of a mirror ball: from the picture to a map by direction.
//!
//! The world is far away against the ball: what a point of the ball shows is the radiance out of ω, where the half
//! vector of ω and of the direction v to the camera is the ball's normal there. Unpolarized: a metal ball polarizes by
//! itself, so nothing is said of the light's polarization. Angles of the map as in [`StokesMap`].

use glam::{DMat3, DVec2, DVec3};
use host_image::{Picture, Samples};
use host_optics::OpticsError;
use host_optics::sky::StokesMap;
use rayon::prelude::*;

/// A mirror ball in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorBall {
    /// Center of the ball's outline, pixels.
    pub center: DVec2,
    /// Radius of the outline, pixels.
    pub radius_px: f64,
    /// Standard deviation of center and radius, pixels.
    pub circle_sigma_px: f64,
    /// K of the camera.
    pub intrinsics: DMat3,
    /// World to camera (x right, y down, z forward).
    pub rotation: DMat3,
    /// Reflectance of the ball, (0, 1], the same from all sides.
    pub reflectance: f64,
    /// Its standard deviation, relative.
    pub reflectance_sigma: f64,
    /// Signal of the picture without light.
    pub black_dn: f64,
    /// Radiance of one DN above black.
    pub radiance_per_dn: f64,
}

/// What a ball shows.
#[derive(Clone, Debug, PartialEq)]
pub struct BallLight {
    /// R, G, B.
    pub bands: [StokesMap; 3],
    /// Standard deviation of the direction each map pixel was read at, radians, from that of the circle; height ×
    /// width, row-major. Infinite in the blind cone behind the ball, where the map repeats what the rim shows.
    pub direction_sigma: Vec<f32>,
    /// Standard deviation of all radiances together, relative.
    pub scale_sigma: f64,
}

/// Cosine at the ball beyond which a picture shows nothing to rely on: a pixel there spans six times what it spans in
/// the middle.
const RIM_COSINE: f64 = 0.15;

impl MirrorBall {
    /// The map, 2·`height` × `height`, and how well it is known. `picture` is linear.
    ///
    /// # Errors
    /// [`OpticsError::Range`] for a circle or reflectance that makes no sense; [`OpticsError::MapSize`] for no rows.
    pub fn unwrap(&self, picture: &Picture, height: usize) -> Result<BallLight, OpticsError> {
        let within = |name, value: f64, low, high| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(OpticsError::Range { name, value, low, high }) }
        };
        within("radius of a mirror ball in pixels", self.radius_px, 2.0, 1e5)?;
        within("reflectance of a mirror ball", self.reflectance, 1e-3, 1.0)?;
        let reach = DVec2::new(picture.width as f64, picture.height as f64);
        within("column of a mirror ball's center", self.center.x, 0.0, reach.x)?;
        within("row of a mirror ball's center", self.center.y, 0.0, reach.y)?;
        let width = 2 * height;
        let axes = StokesMap::new(width, height, vec![[0.0; 3]; width * height])?;
        let eye = Eye::of(self);
        let read: Vec<([f32; 3], f32)> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let (pixel, cosine) = eye.seen_at(axes.center(i / width, i % width));
                let radiance = [0, 1, 2].map(|band| self.radiance(picture, pixel, band));
                // Moving the point by σ turns the normal by σ/(r cos θ), and the mirrored ray by twice that.
                let sigma = 2.0 * self.circle_sigma_px / (self.radius_px * cosine);
                (radiance, if cosine > RIM_COSINE { single(sigma) } else { f32::INFINITY })
            })
            .collect();
        let band = |k: usize| StokesMap::new(width, height, read.iter().map(|(l, _)| [l[k], 0.0, 0.0]).collect());
        Ok(BallLight {
            bands: [band(0)?, band(1)?, band(2)?],
            direction_sigma: read.iter().map(|(_, s)| *s).collect(),
            scale_sigma: self.reflectance_sigma,
        })
    }

    /// Radiance at a place of the picture, bilinear.
    fn radiance(&self, picture: &Picture, pixel: DVec2, band: usize) -> f32 {
        let limit = DVec2::new(picture.width as f64 - 1.0, picture.height as f64 - 1.0);
        let at = (pixel - 0.5).clamp(DVec2::ZERO, limit);
        let (whole, part) = (at.floor(), at - at.floor());
        let sample = |x: f64, y: f64| {
            let index = index(y.min(limit.y)) * picture.width + index(x.min(limit.x));
            let i = index * picture.channels + band.min(picture.channels - 1);
            match &picture.samples {
                Samples::U8(v) => f64::from(v[i]),
                Samples::U16(v) => f64::from(v[i]),
                Samples::F32(v) => f64::from(v[i]),
            }
        };
        let (x, y) = (whole.x, whole.y);
        let upper = sample(x, y) * (1.0 - part.x) + sample(x + 1.0, y) * part.x;
        let lower = sample(x, y + 1.0) * (1.0 - part.x) + sample(x + 1.0, y + 1.0) * part.x;
        let dn = upper * (1.0 - part.y) + lower * part.y;
        single((dn - self.black_dn).max(0.0) * self.radiance_per_dn / self.reflectance)
    }
}

/// The camera and the ball, in ball radii and the camera's axes.
struct Eye {
    intrinsics: DMat3,
    rotation: DMat3,
    ball: DVec3,
}

impl Eye {
    /// An outline of radius r pixels in a camera of focal length f is a cone of half angle ρ, tan ρ = r/f, and the ball
    /// 1/sin ρ away. (Off the axis the outline is an ellipse, longer by 1/cos of the angle off the axis: some per mille
    /// at a few degrees.)
    fn of(ball: &MirrorBall) -> Self {
        let towards = (ball.intrinsics.inverse() * ball.center.extend(1.0)).normalize();
        let focal = (ball.intrinsics.x_axis.x * ball.intrinsics.y_axis.y).sqrt();
        let distance = 1.0 / (ball.radius_px / focal).atan().sin();
        Self { intrinsics: ball.intrinsics, rotation: ball.rotation, ball: towards * distance }
    }

    /// Where in the picture the light out of ω (world) is seen, and the cosine of its angle of incidence at the ball;
    /// no nearer to the rim than [`RIM_COSINE`].
    fn seen_at(&self, direction: DVec3) -> (DVec2, f64) {
        let to_light = self.rotation * direction;
        let axis = -self.ball.normalize();
        let mut to_camera = axis;
        let (mut normal, mut cosine) = (axis, 1.0);
        // v depends on the point by ball radius over distance: the iteration gains that factor each time.
        for _ in 0..40 {
            normal = (to_light + to_camera).try_normalize().unwrap_or_else(|| axis.any_orthonormal_vector());
            cosine = normal.dot(to_camera);
            if cosine < RIM_COSINE {
                let across = (normal - to_camera * cosine).normalize();
                normal = to_camera * RIM_COSINE + across * (1.0 - RIM_COSINE * RIM_COSINE).sqrt();
            }
            let next = -(self.ball + normal).normalize();
            let change = next.distance_squared(to_camera);
            to_camera = next;
            if change < 1e-24 {
                break;
            }
        }
        let p = self.intrinsics * (self.ball + normal);
        (p.truncate() / p.z, cosine)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "radiance is f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number within the picture")]
fn index(whole: f64) -> usize {
    whole.max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_image::Encoding;
    use host_optics::Light;

    /// Smooth radiance by direction: 1 + ½ ω·a + ¼ (ω·b)², another a and b for each band.
    fn radiance(w: DVec3, band: usize) -> f64 {
        let (a, b) = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)][band];
        1.0 + 0.5 * w.dot(a) + 0.25 * w.dot(b).powi(2)
    }

    /// A ball of radius 1 as a ray tracer draws it: for each pixel the ray, the sphere, the mirrored ray. By camera at
    /// 12 radii.
    #[expect(clippy::cast_possible_truncation, reason = "radiance is f32")]
    fn photograph(ball: DVec3, intrinsics: DMat3, rotation: DMat3, reflectance: f64) -> Picture {
        let (width, height) = (400, 360);
        let mut samples = vec![0.0; width * height * 3];
        for i in 0..width * height {
            let pixel = DVec3::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5, 1.0);
            let d = (intrinsics.inverse() * pixel).normalize();
            let along = d.dot(ball);
            let square = along * along - ball.length_squared() + 1.0;
            if square > 0.0 {
                let normal = d * (along - square.sqrt()) - ball;
                let w = rotation.transpose() * (d - 2.0 * d.dot(normal) * normal);
                for band in 0..3 {
                    samples[3 * i + band] = (reflectance * radiance(w, band)) as f32;
                }
            }
        }
        Picture { width, height, channels: 3, samples: Samples::F32(samples), encoding: Encoding::Linear }
    }

    #[test]
    fn a_synthetic_ball_gives_its_surroundings_back() {
        let intrinsics = DMat3::from_cols(DVec3::X * 1800.0, DVec3::Y * 1800.0, DVec3::new(200.0, 180.0, 1.0));
        // Looking down and to the north, a little rolled.
        let rotation = DMat3::from_rotation_z(0.1) * DMat3::from_rotation_x(1.9);
        let at = DVec3::new(0.0, 0.0, 12.0);
        let picture = photograph(at, intrinsics, rotation, 0.6);
        let ball = MirrorBall {
            center: DVec2::new(200.0, 180.0),
            radius_px: 1800.0 * (1.0_f64 / 12.0).asin().tan(),
            circle_sigma_px: 0.3,
            intrinsics,
            rotation,
            reflectance: 0.6,
            reflectance_sigma: 0.02,
            black_dn: 0.0,
            radiance_per_dn: 1.0,
        };
        let found = ball.unwrap(&picture, 64).unwrap();
        let mut seen = 0;
        for (i, sigma) in found.direction_sigma.iter().enumerate() {
            let w = found.bands[0].center(i / 128, i % 128);
            for (k, band) in found.bands.iter().enumerate() {
                if sigma.is_finite() {
                    let error = (band.stokes(w)[0] - radiance(w, k)).abs();
                    assert!(error < 3e-3, "{w}: {error}");
                }
            }
            seen += usize::from(sigma.is_finite());
        }
        // What is left out is a cone of 17° (the rim) and twice the 5° of a ball this near, behind the ball.
        assert!(seen * 100 > found.direction_sigma.len() * 93, "{seen}");
        // In the middle of the ball 0.3 px of 150 is 2 · 0.3/150 rad.
        let least = found.direction_sigma.iter().copied().fold(f32::INFINITY, f32::min);
        assert!((f64::from(least) - 0.6 / ball.radius_px).abs() < 2e-5, "{least}");

        // A circle that is off by its σ turns the light by what is stated.
        let off = MirrorBall { center: ball.center + DVec2::new(0.3, 0.0), ..ball };
        let turned = off.unwrap(&picture, 64).unwrap();
        for (i, sigma) in found.direction_sigma.iter().enumerate().filter(|(_, s)| **s < 0.02) {
            let w = found.bands[0].center(i / 128, i % 128);
            // No more than gradient 1 per radian.
            let change = (turned.bands[1].stokes(w)[0] - found.bands[1].stokes(w)[0]).abs();
            assert!(change < 1.2 * f64::from(*sigma), "{change} {sigma}");
        }
        assert!(MirrorBall { reflectance: 0.0, ..ball }.unwrap(&picture, 8).is_err());
    }
}
