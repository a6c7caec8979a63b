//! Each photosite sees one color. Left out, every photosite sees the mean of the three filtered bands, as on a grey sensor.
//!
//! Bound: the difference itself, over all photosites and all three bands (whichever of them the photosite has).

use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`]; once for all frames of a view.
const COST_NS: f64 = 3.0;

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let Some(pattern) = facts.scene.camera.bayer else {
        return Assessment::new(0.0, COST_NS, "the sensor has no color filters".to_owned());
    };
    let bound = facts.chroma();
    let reason = format!("{} filters, a band differs from their mean by up to {bound:.3}", pattern.name());
    // The mosaic is there even where the light is grey.
    Assessment { applies: true, bound, cost_ns_per_pixel: COST_NS, reason }
}

#[cfg(test)]
mod tests {
    use crate::frames::Exposer;
    use crate::frames::testing::{check_bound, picture, studio};
    use crate::{Effect, EffectSet};
    use host_image::BayerPattern;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(which in 0_usize..4, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.bayer = Some(BayerPattern::ALL[which]);
            check_bound(&scene, Effect::Bayer)?;
        }
    }

    /// Light of one color reaches the photosites the pattern's name says, read row by row from the upper left.
    #[test]
    fn filters_lie_as_the_name_says() {
        let mut scene = studio(1);
        for (pattern, name) in BayerPattern::ALL.into_iter().zip(["RGGB", "BGGR", "GRBG", "GBRG"]) {
            scene.camera.bayer = Some(pattern);
            for (band, letter) in "RGB".char_indices() {
                let mut image = picture(&scene);
                for (k, planes) in image.colors.iter_mut().enumerate() {
                    let level = if k == band { 1.0 } else { 0.0 };
                    planes.s0.fill(level);
                    planes.s1.fill(0.0);
                    planes.s2.fill(0.0);
                }
                let frame = Exposer::new(&scene, 0, &image, EffectSet::NONE.with(Effect::Bayer)).unwrap().dn(0);
                let black = f32::from(scene.camera.black_level_dn);
                let lit = |row: usize, column: usize| frame[row * image.width + column] > black;
                let tile = [lit(0, 0), lit(0, 1), lit(1, 0), lit(1, 1)];
                assert_eq!(tile.to_vec(), name.chars().map(|c| c == letter).collect::<Vec<_>>(), "{name} {letter}");
                assert_eq!(tile, [lit(6, 8), lit(6, 9), lit(7, 8), lit(7, 9)]);
            }
        }
    }
}
