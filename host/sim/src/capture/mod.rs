//! Effects of the capture: light, wheel, polarizer and lens. Those of the first four change the analyzer of a whole frame and
//! cost nothing per pixel.

pub(crate) mod backlash;
pub(crate) mod beam_shift;
pub(crate) mod extinction;
pub(crate) mod light_drift;
pub(crate) mod psf;
pub(crate) mod sheet_axis;
pub(crate) mod vignetting;
pub(crate) mod wheel_error;
