//! The light of a rendering on the command line.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use host_fit::relight::{Sky, Sun, environment};
use host_fit::session::{LightSpec, Pictures, Session, SessionError};

use super::arguments::{finite, list, positive};
use super::failed;
use crate::exit::Exit;
use crate::failure::Failure;

/// One sky at most, and a sun beside it.
#[derive(Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightArgs {
    /// Environment map (OpenEXR, equirectangular, zenith up): R, G, B as seen from inside, or polarized s0.R ... s2.B
    #[arg(long, value_name = "MAP", conflicts_with_all = ["sky", "light", "rayleigh"])]
    env: Option<PathBuf>,
    /// Azimuth in the middle of the map, degrees counter-clockwise from the sample's x axis
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true, value_parser = finite)]
    env_center: f64,
    /// Radiance per number of the map
    #[arg(long, value_name = "SCALE", default_value_t = 1.0, value_parser = positive)]
    env_scale: f64,
    /// The light of a capture: its views.json, capture.json or folder
    #[arg(long, value_name = "CAPTURE", conflicts_with_all = ["sky", "rayleigh"])]
    light: Option<PathBuf>,
    /// An analytic sky: uniform, overcast or clear, and its radiance [default: 1]
    #[arg(long, value_name = "KIND[:RADIANCE]")]
    sky: Option<SkyArg>,
    /// Polarize the sky as single scattering does, up to this degree (a clear sky has about 0.7)
    #[arg(long, value_name = "DOLP", requires = "sky", value_parser = finite)]
    rayleigh: Option<f64>,
    /// A sun: azimuth (counter-clockwise from x) and elevation in degrees, and irradiance on a plane that faces it
    ///
    /// Without an irradiance it has five times that of the sky on the ground, or pi without a sky. With 0 there is no disk,
    /// only the place of the sun in the sky.
    #[arg(long, value_name = "AZ,EL[,E]", allow_hyphen_values = true, value_parser = sun)]
    sun: Option<Sun>,
}

/// `clear:0.8`.
#[derive(Clone, Copy)]
struct SkyArg(Sky);

impl FromStr for SkyArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, radiance) = text.split_once(':').unwrap_or((text, "1"));
        let radiance = positive(radiance)?;
        match kind {
            "uniform" => Ok(Self(Sky::Uniform(radiance))),
            "overcast" => Ok(Self(Sky::Overcast(radiance))),
            "clear" => Ok(Self(Sky::Clear(radiance))),
            _ => Err("expected uniform, overcast or clear, such as clear:0.8".to_owned()),
        }
    }
}

fn sun(text: &str) -> Result<Sun, String> {
    let numbers = list(text, 2, 3, "azimuth,elevation or azimuth,elevation,irradiance")?;
    let [azimuth_deg, elevation_deg, rest @ ..] = numbers.as_slice() else {
        return Err("expected azimuth,elevation".to_owned());
    };
    Ok(Sun { azimuth_deg: *azimuth_deg, elevation_deg: *elevation_deg, irradiance: rest.first().copied() })
}

impl LightArgs {
    /// The light, read and checked.
    pub(super) fn light(&self) -> Result<LightSpec, Failure> {
        let given = match (&self.env, &self.light, self.sky) {
            (Some(map), ..) => environment(map, self.env_center, self.env_scale),
            (_, Some(capture), _) => Ok(open(capture)?.light),
            (_, _, Some(SkyArg(sky))) => return sky.light(self.sun, self.rayleigh).map_err(|e| failed(&e)),
            _ if self.sun.is_some() => return Sky::Black.light(self.sun, None).map_err(|e| failed(&e)),
            _ => {
                let advice =
                    "Add --sky clear --sun 120,40, or --env MAP.exr, or --sun alone; see brewster render --help.";
                return Err(Failure::new(Exit::Usage, "a rendering needs a light", advice));
            }
        };
        let light = given.map_err(|e| failed(&e))?;
        match &self.sun {
            None => Ok(light),
            Some(sun) => light.with_sun(sun).map_err(|e| failed(&e)),
        }
    }

    /// As it was asked for.
    pub(super) fn words(&self) -> String {
        let sky = match (&self.env, &self.light, self.sky) {
            (Some(map), ..) => format!("map {}", map.display()),
            (_, Some(capture), _) => format!("that of {}", capture.display()),
            (_, _, Some(SkyArg(Sky::Uniform(l)))) => format!("uniform sky of radiance {l}"),
            (_, _, Some(SkyArg(Sky::Overcast(l)))) => format!("overcast sky of radiance {l} at the zenith"),
            (_, _, Some(SkyArg(Sky::Clear(l)))) => format!("clear sky of radiance {l}"),
            _ => "no sky".to_owned(),
        };
        let rayleigh = self.rayleigh.map_or(String::new(), |p| format!(", polarized up to {p}"));
        let sun = self.sun.map_or(String::new(), |s| {
            format!(", sun at azimuth {}\u{b0}, elevation {}\u{b0}", s.azimuth_deg, s.elevation_deg)
        });
        format!("{sky}{rayleigh}{sun}")
    }
}

/// A capture, or a view's own file in one.
pub(super) fn open(path: &std::path::Path) -> Result<Session, Failure> {
    let own = path.file_name().is_some_and(|name| name == "capture.json");
    let place = if own { path.parent().and_then(std::path::Path::parent).unwrap_or(path) } else { path };
    let place = if place.as_os_str().is_empty() { std::path::Path::new(".") } else { place };
    Session::open(place, &Pictures::Best).map_err(|error| match &error {
        SessionError::Image(image) => Failure::reading(image),
        SessionError::Io { .. } => {
            Failure::new(Exit::BadInput, error.to_string(), "Check the name and the folder you are in.")
        }
        _ => Failure::new(Exit::BadInput, error.to_string(), "Correct this in the capture's file."),
    })
}
