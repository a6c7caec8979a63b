//! The lens blurs: a Gaussian of standard deviation σ pixels, cut at 4σ, the picture's edge going on outside it. Linear and the
//! same at every angle, so it is applied to the Stokes planes, once for all frames.
//!
//! Bound: the light of a photosite becomes a weighted mean in which it keeps the weight w of the kernel's middle. With u the
//! largest difference to a pixel within the kernel, a component changes by at most (1 − w) u s0.

use rayon::prelude::*;

use crate::signal::{Band, Signal, single};
use crate::{Assessment, Facts};

/// Measured for σ = 1, see [`Assessment::cost_ns_per_pixel`]; once for all frames of a view and proportional to σ.
const COST_NS: f64 = 8.0;

/// Blurs every band by σ > 0 pixels.
pub(crate) fn blur(signal: &mut Signal, sigma: f64) {
    let kernel: Vec<f32> = half_kernel(sigma).into_iter().map(single).collect();
    let (width, height) = (signal.width, signal.height);
    for band in &mut signal.bands {
        *band = blurred(band, &kernel, width, height);
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let sigma = facts.scene.camera.psf_sigma_px;
    if sigma <= 0.0 {
        return Assessment::new(0.0, COST_NS, "the lens is perfect".to_owned());
    }
    let kernel = half_kernel(sigma);
    let unevenness = facts.unevenness(kernel.len() - 1);
    // A kernel of one weight blurs nothing but for rounding.
    let spread = (1.0 - kernel[0] * kernel[0]).max(0.0);
    let reason = format!("σ {sigma:.2} px spreads {spread:.3}, pixels within it differ by up to {unevenness:.3}");
    Assessment::new(spread * unevenness, COST_NS * sigma, reason)
}

/// Weights at 0, 1, 2, ... pixels, normalized over both sides.
fn half_kernel(sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil();
    let weights: Vec<f64> =
        (0..=128_u8).map(f64::from).take_while(|x| *x <= reach).map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect();
    let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.into_iter().map(|w| w / sum).collect()
}

fn blurred(band: &Band, kernel: &[f32], width: usize, height: usize) -> Band {
    band.each_ref().map(|plane| {
        let mut across = vec![0.0; plane.len()];
        across.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(width)).for_each(|(out, row)| {
            for (column, v) in out.iter_mut().enumerate() {
                *v = kernel[0] * row[column];
                for (step, weight) in kernel.iter().enumerate().skip(1) {
                    *v += weight * (row[column.saturating_sub(step)] + row[(column + step).min(width - 1)]);
                }
            }
        });
        let line = |row: usize| &across[row * width..][..width];
        let mut down = vec![0.0; plane.len()];
        down.par_chunks_exact_mut(width).enumerate().for_each(|(row, out)| {
            out.iter_mut().zip(line(row)).for_each(|(v, x)| *v = kernel[0] * x);
            for (step, weight) in kernel.iter().enumerate().skip(1) {
                let pair = line(row.saturating_sub(step)).iter().zip(line((row + step).min(height - 1)));
                out.iter_mut().zip(pair).for_each(|(v, (a, b))| *v += weight * (a + b));
            }
        });
        down
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn the_bound_holds(sigma in 0.05..3.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.psf_sigma_px = sigma;
            check_bound(&scene, Effect::Psf)?;
        }
    }

    /// A point keeps its power and spreads with variance σ² in x and y.
    #[test]
    fn a_point_becomes_a_gaussian_of_the_same_power() {
        let (size, sigma) = (41_usize, 1.7);
        let mut point = vec![0.0; size * size];
        point[20 * size + 20] = 1.0;
        let mut signal =
            Signal { width: size, height: size, bands: vec![[point.clone(), point.clone(), point]], pattern: None };
        blur(&mut signal, sigma);
        let plane = &signal.bands[0][0];
        let power: f64 = plane.iter().map(|v| f64::from(*v)).sum();
        let moment = |of: fn(usize, usize) -> usize| -> f64 {
            let term = |(i, v): (usize, &f32)| f64::from(*v) * (of(i, size) as f64 - 20.0).powi(2);
            plane.iter().enumerate().map(term).sum()
        };
        assert!((power - 1.0).abs() < 1e-5, "{power}");
        for variance in [moment(|i, size| i % size), moment(|i, size| i / size)] {
            // Cut at 4σ, a Gaussian loses 0.1 % of its variance.
            assert!((variance / (sigma * sigma) - 1.0).abs() < 3e-3, "{variance}");
        }
    }
}
