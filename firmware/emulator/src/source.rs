//! What the camera looks at, as people write it:
//!
//! - `wheel-chart` (the default)
//! - `uniform:S0,DOLP,AOLP_DEG`, S0 in DN at the reference exposure
//! - `replay:PATH`, a folder, with options behind `?`: `mosaic=imx250mzr`, `prefix=NAME`, `black=DN`, `white=DN`,
//!   `bit_depth=BITS`, joined by `&`

use crate::{EmulatorError, Mosaic, ReplaySource};
use protocol_polar::Degrees;
use std::str::FromStr;

const KINDS: &str = "expected `wheel-chart`, `uniform:S0,DOLP,AOLP_DEG` or `replay:PATH`";
const UNIFORM: &str = "expected `uniform:S0,DOLP,AOLP_DEG` with S0 >= 0 in DN, DOLP in 0 to 1, AOLP_DEG in degrees";
const OPTIONS: &str = "expected `mosaic=imx250mzr`, `prefix=NAME`, `black=DN`, `white=DN` or `bit_depth=BITS`";

/// What the camera looks at.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Source {
    /// The polarizer wheel of [`crate::wheel_chart`].
    #[default]
    WheelChart,
    /// The same light everywhere.
    Uniform {
        /// DN at the reference exposure.
        s0_dn: f64,
        /// Degree of polarization.
        dolp: f64,
        /// Angle of polarization.
        aolp: Degrees,
    },
    /// Photographs.
    Replay(ReplaySource),
}

impl FromStr for Source {
    type Err = EmulatorError;

    fn from_str(spec: &str) -> Result<Self, EmulatorError> {
        let wrong = |expected: String| EmulatorError::Source { spec: spec.to_owned(), expected };
        match spec.split_once(':').unwrap_or((spec, "")) {
            ("wheel-chart", "") => Ok(Self::WheelChart),
            ("uniform", rest) => uniform(rest).ok_or_else(|| wrong(UNIFORM.to_owned())),
            ("replay", rest) if !rest.is_empty() => replay(rest).map(Self::Replay).map_err(wrong),
            _ => Err(wrong(KINDS.to_owned())),
        }
    }
}

fn uniform(rest: &str) -> Option<Source> {
    let numbers: Vec<f64> = rest.split(',').map(|number| number.trim().parse().ok()).collect::<Option<_>>()?;
    let [s0_dn, dolp, aolp_deg] = numbers[..] else { return None };
    let sound = (0.0..1e9).contains(&s0_dn) && (0.0..=1.0).contains(&dolp) && aolp_deg.is_finite();
    sound.then_some(Source::Uniform { s0_dn, dolp, aolp: Degrees(aolp_deg) })
}

fn replay(rest: &str) -> Result<ReplaySource, String> {
    let (path, options) = rest.split_once('?').unwrap_or((rest, ""));
    let mut source = ReplaySource { path: path.into(), ..ReplaySource::default() };
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let (key, value) = option.split_once('=').unwrap_or((option, ""));
        let number = || value.parse().map_err(|_| format!("`{key}={value}` is no number of DN"));
        match key {
            "mosaic" if value == "imx250mzr" => source.mosaic = Some(Mosaic::Imx250mzr),
            "mosaic" => return Err(format!("mosaic `{value}` is not known, expected `imx250mzr`")),
            "prefix" => value.clone_into(&mut source.prefix),
            "black" => source.black_level_dn = Some(number()?),
            "white" => source.white_level_dn = Some(number()?),
            "bit_depth" => {
                let depth = value.parse().map_err(|_| format!("`bit_depth={value}` is no number of bits"))?;
                source.bit_depth = Some(depth);
            }
            _ => return Err(format!("option `{key}` is not known, {OPTIONS}")),
        }
    }
    Ok(source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_read_as_documented() {
        let uniform = Source::Uniform { s0_dn: 2000.0, dolp: 0.5, aolp: Degrees(-30.0) };
        let mosaic = ReplaySource {
            path: "a b/c.png".into(),
            mosaic: Some(Mosaic::Imx250mzr),
            black_level_dn: Some(3),
            white_level_dn: Some(250),
            bit_depth: Some(8),
            ..ReplaySource::default()
        };
        let folder = ReplaySource { path: "shots".into(), prefix: "six_".into(), ..ReplaySource::default() };
        for (spec, source) in [
            ("wheel-chart", Source::default()),
            ("uniform:2000, 0.5,-30", uniform),
            ("replay:a b/c.png?mosaic=imx250mzr&black=3&white=250&bit_depth=8", Source::Replay(mosaic)),
            ("replay:shots?prefix=six_", Source::Replay(folder)),
        ] {
            assert_eq!(spec.parse::<Source>().unwrap(), source, "{spec}");
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_what_would_be_right() {
        for (spec, hint) in [
            ("", "wheel-chart"),
            ("wheel", "wheel-chart"),
            ("wheel-chart:3", "wheel-chart"),
            ("uniform", "S0,DOLP,AOLP_DEG"),
            ("uniform:1,2,3", "DOLP in 0 to 1"),
            ("uniform:1,nan,3", "DOLP in 0 to 1"),
            ("uniform:1,0.5", "AOLP_DEG"),
            ("replay:", "replay:PATH"),
            ("replay:x?mosaic=bayer", "imx250mzr"),
            ("replay:x?black=many", "number of DN"),
            ("replay:x?colour=red", "mosaic=imx250mzr"),
        ] {
            let said = spec.parse::<Source>().unwrap_err().to_string();
            assert!(said.contains(hint) && said.contains(&format!("`{spec}`")), "{spec:?}: {said}");
        }
    }
}
