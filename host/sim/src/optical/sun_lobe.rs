//! The sun's disk seen in a lobe that may be narrower than the disk: points that follow the lobe and stay within the disk.
//!
//! Polar coordinates about the mirror direction r: a circle of radius s around it meets the disk (radius ρ, center at the
//! distance d from r) in an arc of half angle χ, cos ρ = cos s cos d + sin s sin d cos χ. With v = w²/(w² + s²) GGX is even in v;
//! w = 2α √cos θ_d lies between the lobe's widths along and across the plane of incidence, 2α and 2α cos θ_d.

use super::numbers::real;
use core::f64::consts::PI;
use glam::DVec3;
use host_optics::frames::tangents;

/// Circles in each of the two parts: those wholly inside the disk, and those cut by its edge.
const CIRCLES: usize = 16;
/// Points of a circle or of an arc.
const AZIMUTHS: usize = 24;

/// Directions over the disk of angular radius `radius` around unit `center`, with their solid angles in steradians, for
/// ∫ f dω = Σ w f(ω), f a lobe of width `width` (radians) about unit `mirror`. Good to 4e-3 of the disk's part for α from 1e-6
/// to the disk's radius and θ_d up to 75°.
pub(crate) fn points(center: DVec3, radius: f64, mirror: DVec3, width: f64) -> Vec<(DVec3, f64)> {
    let across = center - mirror * center.dot(mirror);
    let distance = mirror.cross(center).length().atan2(center.dot(mirror));
    let x = across.try_normalize().unwrap_or_else(|| tangents(mirror).0);
    let y = mirror.cross(x);
    let mut out = Vec::with_capacity(2 * CIRCLES * AZIMUTHS);
    let mut circle = |s: f64, weight: f64, half: f64| {
        let step = 2.0 * half / real(AZIMUTHS);
        for k in 0..AZIMUTHS {
            // Midpoints: exact to all orders around a full circle, and of second order on an arc.
            let (sine, cosine) = (step * (real(k) + 0.5) - half).sin_cos();
            out.push((mirror * s.cos() + (x * cosine + y * sine) * s.sin(), weight * step));
        }
    };
    let to_v = |s: f64| width * width / (width * width + s * s);
    let mut part = |from: f64, to: f64, half: &dyn Fn(f64) -> f64| {
        let (v0, v1) = (to_v(from), to_v(to));
        for k in 0..CIRCLES {
            // Midpoints in t after v = v1 + (v0 − v1) (1 − cos πt)/2, which takes the square roots at both ends of an arc away.
            let t = PI * (real(k) + 0.5) / real(CIRCLES);
            let v = v1 + (v0 - v1) * 0.5 * (1.0 - t.cos());
            let dv = (v0 - v1) * 0.5 * t.sin() * PI / real(CIRCLES);
            let s = width * ((1.0 - v) / v).sqrt();
            // s ds = w² dv/(2 v²).
            let solid = if s > 0.0 { s.sin() / s } else { 1.0 } * 0.5 * (width / v).powi(2) * dv;
            circle(s, solid, half(s));
        }
    };
    if distance < radius {
        part(0.0, radius - distance, &|_| PI);
    }
    if distance > 1e-3 * radius {
        let cosine = |s: f64| (radius.cos() - s.cos() * distance.cos()) / (s.sin() * distance.sin());
        part((distance - radius).abs(), distance + radius, &|s| cosine(s).clamp(-1.0, 1.0).acos());
    }
    out
}

/// w of the lobe of roughness `alpha` for the view `wo` and unit `normal`.
pub(crate) fn width(alpha: f64, normal: DVec3, wo: DVec3) -> f64 {
    2.0 * alpha * normal.dot(wo).clamp(1e-3, 1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// The disk's solid angle, wherever the mirror direction lies, and GGX in the plane against its closed form: the share of
    /// 1/(π w²) (1 + s²/w²)⁻² within radius ρ of its center is ρ²/(ρ² + w²).
    #[test]
    fn points_fill_the_disk() {
        let (center, radius) = (DVec3::new(0.6, 0.0, 0.8), 0.005);
        let area = TAU * (1.0 - f64::cos(radius));
        for distance in [0.0, 0.001, 0.004, 0.0049, 0.0051, 0.02] {
            let mirror = (center + DVec3::Y * f64::tan(distance)).normalize();
            let sum: f64 = points(center, radius, mirror, 0.01).iter().map(|(_, w)| w).sum();
            assert!((sum / area - 1.0).abs() < 3e-3, "{distance}: {}", sum / area);
        }
        for width in [2e-6, 1e-4, 1e-3, 1e-2] {
            let lobe = |w: &DVec3| (1.0 + w.distance_squared(center) / (width * width)).powi(-2) / (PI * width * width);
            let sum: f64 = points(center, radius, center, width).iter().map(|(w, solid)| solid * lobe(w)).sum();
            let expected = radius * radius / (radius * radius + width * width);
            assert!((sum / expected - 1.0).abs() < 4e-3, "{width}: {sum} against {expected}");
        }
    }
}
