//! Stokes fields to look at: height × width, row-major, `[s0, s1, s2]` in DN at the reference exposure, camera frame.

use protocol_polar::{Degrees, Radians, Stokes};
use std::f64::consts::{FRAC_PI_6, PI};

/// DoLP of the chart's rings, from the hub outwards.
const RINGS: [f64; 4] = [0.2, 0.45, 0.7, 0.95];
/// s0 of the steps of the grey wedge, DN.
const WEDGE_DN: [f64; 8] = [50.0, 100.0, 200.0, 400.0, 800.0, 1400.0, 2000.0, 2800.0];
const BACKGROUND_DN: f64 = 1200.0;
const FILM_DN: f64 = 1800.0;
const BLACK_DN: f64 = 4.0;
/// A reflection of a lamp: far beyond any exposure that shows the rest.
const SPOT_DN: f64 = 60_000.0;
/// Of this radius, photosites: small enough not to count in metering.
const SPOT_RADIUS_PX: f64 = 1.8;

/// The same light everywhere.
#[must_use]
pub fn uniform(width: u32, height: u32, s0_dn: f64, dolp: f64, aolp: Degrees) -> Vec<[f32; 3]> {
    vec![linear(s0_dn, dolp, aolp.to_radians()); width as usize * height as usize]
}

/// The polarizer wheel: a disc of twelve sectors of polarizer film, each with its angle of polarization along its own
/// direction, its degree of polarization falling in four rings towards the hub. Around it unpolarized grey, below it a grey
/// wedge of eight steps and a black patch, and three specular spots that clip.
///
/// What a picture of it must show is known without computing: the angle is the direction one looks in from the hub.
#[must_use]
pub fn wheel_chart(width: u32, height: u32) -> Vec<[f32; 3]> {
    let (w, h) = (f64::from(width), f64::from(height));
    let at = |row: u32, column: u32| chart_at(f64::from(column) + 0.5, f64::from(row) + 0.5, w, h);
    (0..height).flat_map(|row| (0..width).map(move |column| at(row, column))).collect()
}

/// The chart at a point: x right, y *down*, photosites.
fn chart_at(x: f64, y: f64, width: f64, height: f64) -> [f32; 3] {
    let (center_x, center_y) = (0.5 * width, 0.44 * height);
    let radius = 0.38 * height.min(width);
    let (right, up) = (x - center_x, center_y - y);
    for (turn, distance) in [(0.07, 1.14), (0.22, 1.14), (0.36, 1.14)] {
        let spot = (radius * distance * (2.0 * PI * turn).cos(), radius * distance * (2.0 * PI * turn).sin());
        if (right - spot.0).hypot(up - spot.1) < SPOT_RADIUS_PX {
            return linear(SPOT_DN, 0.5, Radians(0.0));
        }
    }
    let from_hub = right.hypot(up) / radius;
    if from_hub < 1.0 {
        let sector = (up.atan2(right) / FRAC_PI_6).round() * FRAC_PI_6;
        // The hub is a fifth of the radius; it is unpolarized.
        let ring = RINGS.iter().zip([0.4, 0.6, 0.8, 1.0]).find(|(_, edge)| from_hub < *edge);
        let dolp = if from_hub < 0.2 { 0.0 } else { ring.map_or(0.0, |(dolp, _)| *dolp) };
        return linear(FILM_DN, dolp, Radians(sector).as_axis());
    }
    if (0.88..0.97).contains(&(y / height)) {
        let along = (x / width - 0.1) / 0.8 * 9.0;
        if (0.0..9.0).contains(&along) {
            // Eight steps of grey, then the black patch.
            let step = WEDGE_DN.iter().zip(1_u8..).find(|(_, end)| along < f64::from(*end));
            return linear(step.map_or(BLACK_DN, |(dn, _)| *dn), 0.0, Radians(0.0));
        }
    }
    linear(BACKGROUND_DN, 0.0, Radians(0.0))
}

#[expect(clippy::cast_possible_truncation, reason = "24 bits are far below the noise")]
fn linear(s0: f64, dolp: f64, aolp: Radians) -> [f32; 3] {
    let [s0, s1, s2, _] = Stokes::linear(s0, dolp, aolp).0;
    [s0 as f32, s1 as f32, s2 as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "points inside the picture")]
    fn looking_up_right_from_the_hub_the_light_is_polarized_up_right() {
        let chart = wheel_chart(640, 480);
        let (cx, cy, r) = (320.0, 0.44 * 480.0, 0.38 * 480.0);
        for (ring, dolp) in [0.3, 0.5, 0.7, 0.9].into_iter().zip(RINGS) {
            for k in 0..12 {
                let direction = f64::from(k) * FRAC_PI_6;
                // Rows run down.
                let column = (cx + ring * r * direction.cos()) as usize;
                let row = (cy - ring * r * direction.sin()) as usize;
                let [s0, s1, s2] = chart[row * 640 + column].map(f64::from);
                let seen = Stokes([s0, s1, s2, 0.0]);
                assert!((seen.dolp() - dolp).abs() < 1e-6, "{k} {ring}: {seen:?}");
                let off = seen.aolp().axis_difference(Radians(direction)).0;
                assert!(off.abs() < 1e-6, "{k} {ring}: {off}");
            }
        }
    }

    #[test]
    fn the_spots_are_few_enough_not_to_be_metered() {
        let chart = wheel_chart(1280, 960);
        let spots = chart.iter().filter(|s| s[0] > 10_000.0).count();
        assert!((20..122).contains(&spots), "{spots} photosites; one in 10 000 is 122");
        assert!(chart.iter().any(|s| s[0] < 10.0), "the black patch");
    }
}
