//! How far maps are from a reference, and pictures from each other.
//!
//! [`compare`] takes maps against [`Reference`] maps (a truth file, or another fit); [`compare_pictures`] takes a picture
//! against a picture (PSNR, SSIM).

mod difference;
mod pictures;
mod reference;
mod report;
mod ssim;

pub use difference::{CompareOptions, Differences, Quantity, compare};
pub use pictures::{BandScore, PictureComparison, PictureOptions, compare_pictures};
pub use reference::Reference;
pub use report::{ClassReport, Comparison, ErrorSummary, ZSummary};
