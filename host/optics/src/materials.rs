//! Refractive indices of named materials at the camera's three bands: 630, 532 and 465 nm.
//!
//! Source: refractiveindex.info database v2026-05-24 (CC0 1.0); the page of each material stands beside it. Extinction
//! below 2e-6 (clear glasses and plastics: an effect of 1e-6 of the reflectance at most) is left out, which makes those
//! materials dielectrics.

use crate::{Ior, OpticsError};

/// A material with its index at R, G, B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Name on the command line, lower case.
    pub name: &'static str,
    /// Page of refractiveindex.info (book, page).
    pub source: &'static str,
    /// (n, k) at 630, 532 and 465 nm.
    pub rgb: [(f64, f64); 3],
}

impl Material {
    /// The index of each band, R, G, B.
    ///
    /// # Errors
    /// [`OpticsError::Index`]; never for the materials of [`ALL`].
    pub fn iors(&self) -> Result<[Ior; 3], OpticsError> {
        let [(nr, kr), (ng, kg), (nb, kb)] = self.rgb;
        Ok([Ior::new(nr, kr)?, Ior::new(ng, kg)?, Ior::new(nb, kb)?])
    }
}

/// The material of this name (case does not matter), if there is one.
#[must_use]
pub fn named(name: &str) -> Option<&'static Material> {
    ALL.iter().find(|m| m.name.eq_ignore_ascii_case(name))
}

const fn clear(name: &'static str, source: &'static str, [r, g, b]: [f64; 3]) -> Material {
    Material { name, source, rgb: [(r, 0.0), (g, 0.0), (b, 0.0)] }
}

const fn metal(name: &'static str, source: &'static str, rgb: [(f64, f64); 3]) -> Material {
    Material { name, source, rgb }
}

/// Every named material.
pub const ALL: &[Material] = &[
    clear("bk7", "BK7, SCHOTT", [1.515_186, 1.519_473, 1.524_012]),
    clear("soda-lime", "soda-lime, Rubin-clear", [1.521_725, 1.526_102, 1.530_638]),
    clear("fused-silica", "SiO2, Malitson", [1.457_1, 1.460_706, 1.464_484]),
    clear("water", "H2O, Daimon-20.0C", [1.332_18, 1.335_382, 1.338_67]),
    clear("acrylic", "poly_methyl_methacrylate, Sultanova", [1.488_817, 1.493_69, 1.499_05]),
    clear("polycarbonate", "polycarbonate, Sultanova", [1.580_709, 1.591_742, 1.604_121]),
    clear("polystyrene", "polystyrene, Sultanova", [1.587_756, 1.598_292, 1.610_087]),
    clear("cellulose", "cellulose, Sultanova", [1.468_435, 1.473_033, 1.478_089]),
    clear("pet", "polyethylene_terephthalate, Zhang", [1.565_27, 1.575_98, 1.588_52]),
    clear("pvc", "polyvinil_chloride, Zhang", [1.540_04, 1.546_074, 1.551_905]),
    clear("sapphire", "Al2O3, Malitson-o (ordinary ray)", [1.766_032, 1.771_698, 1.777_646]),
    clear("calcite", "CaCO3, Ghosh-o (ordinary ray)", [1.655_846, 1.662_836, 1.670_385]),
    clear("diamond", "C, Phillip", [2.410_714, 2.425_037, 2.434_882]),
    metal("gold", "Au, Johnson", [(0.188_361, 3.403_38), (0.543_863, 2.230_87), (1.331_854, 1.869_29)]),
    metal("silver", "Ag, Johnson", [(0.056_909, 4.254_32), (0.054_007, 3.428_99), (0.046_878, 2.802_81)]),
    metal("copper", "Cu, Johnson", [(0.275_269, 3.372_55), (1.115_884, 2.595_58), (1.246_878, 2.456_15)]),
    metal("aluminum", "Al, Rakic", [(1.430_308, 7.508_08), (0.938_777, 6.419_54), (0.686_027, 5.635_08)]),
    metal("iron", "Fe, Johnson", [(2.892_381, 3.065_48), (2.895_357, 2.917_86), (2.646, 2.805)]),
    metal("chromium", "Cr, Johnson", [(3.145_238, 3.312_38), (3.034_286, 3.33), (2.456, 3.21)]),
    metal("nickel", "Ni, Johnson", [(1.99, 4.094_29), (1.877_5, 3.494_64), (1.765, 3.048)]),
    metal("titanium", "Ti, Johnson", [(2.697_857, 3.757_14), (2.479_286, 3.351_07), (2.305, 3.082)]),
];
