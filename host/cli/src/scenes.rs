//! What commands that simulate scenes share: how exact to be, and refusals in words.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use host_image::ImageError;
use host_sim::simulate::noise_of;
use host_sim::{Scene, SimError};

use crate::exit::Exit;
use crate::failure::Failure;

/// How exact.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tolerance {
    Share(f64),
    /// The camera's noise divided by this.
    Noise(f64),
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected a number above 0 and at most 1, noise, or noise/10".to_owned();
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite()).ok_or_else(wrong);
        match text.strip_prefix("noise") {
            Some("") => Ok(Self::Noise(1.0)),
            Some(part) => part.strip_prefix('/').ok_or_else(wrong).and_then(number).map(Self::Noise),
            None => number(text).and_then(|v| if v <= 1.0 { Ok(Self::Share(v)) } else { Err(wrong()) }),
        }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Share(share) => write!(f, "{share}"),
            Self::Noise(part) => write!(f, "noise/{part}"),
        }
    }
}

/// About twice the noise of one frame at full wells; below it the time of oblique, rough and bumpy scenes grows steeply.
impl Default for Tolerance {
    fn default() -> Self {
        Self::Share(0.005)
    }
}

impl Tolerance {
    /// As a share of s0.
    pub(crate) fn of(self, scene: &Scene) -> f64 {
        match self {
            Self::Share(share) => share,
            Self::Noise(part) => (noise_of(scene) / part).min(1.0),
        }
    }
}

/// A scene that was refused, with what to do.
pub(crate) fn refused(scene: &Path, error: &SimError) -> Failure {
    let advice = match error {
        SimError::Io { .. } => "Check the name and the folder you are in.",
        SimError::UnknownSchema { .. } => "Write the scene for the schema this brewster reads, or use another version.",
        SimError::UnknownKey { .. } => "Correct the key, or take the line out: nothing in a scene is ignored.",
        SimError::Map { source, .. } if matches!(**source, ImageError::Io { .. }) => {
            "Maps are looked for in the scene's own folder: check the name and the file."
        }
        SimError::Map { .. } => "Export the map anew, in a form that is read.",
        SimError::Parse { .. }
        | SimError::UnknownValue { .. }
        | SimError::OutOfRange { .. }
        | SimError::Optics { .. } => "Correct this line of the scene.",
        SimError::NotSimulated { .. } => "Change the scene, or allow more with --tolerance.",
        SimError::NoLight => "Check the light of the scene, and that the view sees the sample.",
        _ => "",
    };
    // This one carries no place of its own.
    let what = match error {
        SimError::NoLight => format!("{}: {error}", scene.display()),
        _ => error.to_string(),
    };
    Failure::new(Exit::BadInput, what, advice)
}
