//! Options of the command line as the fit takes them.

use std::path::PathBuf;
use std::str::FromStr;

use clap::ValueEnum;
use host_fit::joint;
use host_fit::pipeline::{self, BodyChoice, FitOptions};
use host_fit::tiles::Share;
use host_image::Picture;
use host_optics::materials;

use super::Fit;
use crate::failure::Failure;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// Closed form under unpolarized light, mirror facets; fastest
    Closed,
    /// Closed form under the light's own polarization, mirror facets
    SkyAware,
    /// All parameters of each pixel together, roughness among them
    Joint,
    /// Joint, then index and roughness shared by each region
    JointShared,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Body {
    Lambert,
    /// Light enters and leaves through the surface, partly polarized
    Interface,
    Auto,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Masking {
    HeightCorrelated,
    Separable,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Starts {
    Given,
    Auto,
    All,
}

/// Low and high.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair([f64; 2]);

#[derive(Clone, Copy, Debug)]
pub(super) struct Loss(joint::Loss);

#[derive(Clone, Debug)]
pub(super) enum Regions {
    Clusters,
    One,
    Mask(PathBuf),
}

impl FromStr for Pair {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some([low, high]) if low < high && high.is_finite() => Ok(Self([*low, *high])),
            _ => Err("expected LOW,HIGH with LOW < HIGH".to_owned()),
        }
    }
}

impl FromStr for Loss {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let scale = |t: &str| positive(t).map_err(|_| "expected a scale above 0, such as huber:3".to_owned());
        Ok(Self(match text.split_once(':') {
            None if text == "squares" => joint::Loss::Squares,
            Some(("huber", k)) => joint::Loss::Huber(scale(k)?),
            Some(("tukey", c)) => joint::Loss::Tukey(scale(c)?),
            _ => return Err("expected squares, huber:K or tukey:C".to_owned()),
        }))
    }
}

impl FromStr for Regions {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "clusters" => Self::Clusters,
            "one" => Self::One,
            file => Self::Mask(file.into()),
        })
    }
}

pub(super) fn share(text: &str) -> Result<Share, String> {
    text.parse().map_err(|e: host_fit::maps::MapsError| e.to_string())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
    number.ok_or_else(|| "expected a number above 0".to_owned())
}

pub(super) fn metal(text: &str) -> Result<pipeline::Metal, String> {
    let conducts = |m: &&materials::Material| m.rgb.iter().any(|(_, k)| *k > 0.0);
    let known = || {
        let names: Vec<&str> = materials::ALL.iter().filter(conducts).map(|m| m.name).collect();
        format!("not a metal that is known here; {} are", names.join(", "))
    };
    let found = materials::named(text).filter(conducts).ok_or_else(known)?;
    Ok(pipeline::Metal { name: found.name.to_owned(), index: found.iors().map_err(|e| e.to_string())? })
}

impl Fit {
    /// The fit's own options.
    pub(super) fn options(&self) -> Result<FitOptions, Failure> {
        let usual = FitOptions::default();
        Ok(FitOptions {
            mode: match self.mode {
                Mode::Closed => pipeline::Mode::Closed,
                Mode::SkyAware => pipeline::Mode::SkyAware,
                Mode::Joint => pipeline::Mode::Joint,
                Mode::JointShared => pipeline::Mode::JointShared,
            },
            body: match self.body {
                Body::Lambert => BodyChoice::Lambert,
                Body::Interface => BodyChoice::Interface,
                Body::Auto => BodyChoice::Auto,
            },
            masking: match self.masking {
                Masking::HeightCorrelated => host_optics::Masking::HeightCorrelated,
                Masking::Separable => host_optics::Masking::Separable,
            },
            metals: self.metal.clone(),
            regions: match &self.regions {
                Regions::Clusters => pipeline::Regions::Clusters,
                Regions::One => pipeline::Regions::One,
                Regions::Mask(file) => pipeline::Regions::Mask(Picture::read(file).map_err(|e| Failure::reading(&e))?),
            },
            eta: self.eta.map_or(usual.eta, |p| p.0),
            alpha: self.alpha.map_or(usual.alpha, |p| p.0),
            tolerance: self.tolerance,
            model_sigma: self.model_sigma,
            light_sigma: self.light_sigma,
            rotation_sigma_deg: self.rotation_sigma,
            wheel_sigma_deg: self.wheel_sigma,
            loss: self.loss.0,
            starts: match self.starts {
                Starts::Given => joint::Starts::Given,
                Starts::Auto => joint::Starts::Auto,
                Starts::All => joint::Starts::All,
            },
            resolution: self.resolution,
            refine: self.refine,
            covariance: self.covariance,
            tile: self.tile,
            ..usual
        })
    }
}
