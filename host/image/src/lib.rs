//! Pictures in and out: frames from any camera, Stokes images, and previews that say what their colors mean.
//!
//! Conventions: samples are row-major, height × width, rows run *down*. Stokes vectors are in the picture's frame: x
//! right, y up, angles counter-clockwise ([`FRAME_CONVENTION`]). Every length a file states is bounded before memory is
//! taken for it, and every file is written atomically: whole or not at all.

mod atomic;
mod error;
mod exr_file;
mod layers;
mod npy;
mod picture;
mod preview;
mod stokes_image;

pub use atomic::write_atomically;
pub use error::{ImageError, MAX_PIXELS, NonFinite, first_non_finite};
pub use layers::{Layers, Plane};
pub use picture::{Encoding, Picture, Samples};
pub use preview::{Colors, PlanePreview, PreviewKind, PreviewOptions, aolp_color, dolp_color, plane_preview, preview};
pub use stokes_image::{
    BayerPattern, Color, ColorPlanes, FRAME_CONVENTION, FixedPointFormat, StokesImage, StokesMetadata,
};
