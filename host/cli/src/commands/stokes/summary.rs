//! The result in words and in JSON.

use protocol_polar::Flags;
use serde_json::{Value, json};

use super::analyze::{Analysis, ColorAnalysis};

impl Analysis {
    /// For programs; the file list and the folder are added when it is complete.
    pub(super) fn json(&self, efficiency: f64, warnings: &[String]) -> Value {
        json!({
            "command": "stokes",
            "version": env!("CARGO_PKG_VERSION"),
            "inputs": self.files,
            "width": self.image.width,
            "height": self.image.height,
            "frames": self.angles_deg.len(),
            "angles_deg": self.angles_deg,
            "condition": self.condition,
            "efficiency": efficiency,
            "black_dn": self.black_dn,
            "white_dn": self.white_dn,
            "linearized": self.linearized,
            "colors": self.colors.iter().map(ColorAnalysis::json).collect::<Vec<_>>(),
            "warnings": warnings,
        })
    }

    /// The table of facts: what is printed, and what stands in the report.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let level = |dn: Option<f32>, none: &str| dn.map_or_else(|| none.to_owned(), |v| format!("{v} DN"));
        let mut facts = vec![
            ("frames", format!("{} of {} x {} pixels", self.angles_deg.len(), self.image.width, self.image.height)),
            ("angles", self.angles()),
            ("condition number", format!("{:.2} (1.41 is the best)", self.condition)),
            ("black level", level(self.black_dn, "from the dark picture")),
            ("white level", level(self.white_dn, "none: nothing saturates")),
            ("saturated", self.per_color(|c| c.percent(c.statistics.count(Flags::SATURATED)))),
            ("without a value", self.per_color(|c| c.percent(c.statistics.count(Flags::TOO_FEW)))),
            ("below black", self.per_color(|c| c.percent(c.statistics.count(Flags::BELOW_BLACK)))),
            ("no light (s0 <= 0)", self.per_color(|c| c.percent(c.statistics.no_light))),
            ("DoLP above 1, lit", self.per_color(|c| c.percent(c.statistics.above_one))),
            ("mean s0", self.per_color(|c| format!("{} DN", rounded(c.statistics.mean_s0)))),
            ("mean DoLP", self.per_color(|c| format!("{:.4}", c.statistics.mean_dolp))),
        ];
        if self.colors.iter().any(|c| c.statistics.rms_residual.is_some()) {
            let residual = |c: &ColorAnalysis| {
                let rms = c.statistics.rms_residual.unwrap_or(0.0);
                let share = if c.statistics.mean_s0 > 0.0 { 100.0 * rms / c.statistics.mean_s0 } else { 0.0 };
                format!("{} DN ({share:.2} % of s0)", rounded(rms))
            };
            facts.push(("rms residual", self.per_color(residual)));
        }
        if self.colors.iter().all(|c| c.noise.is_some()) {
            let noise = |f: fn(&host_fit::NoiseStatistics) -> String| {
                self.per_color(|c| c.noise.as_ref().map_or_else(String::new, f))
            };
            facts.push(("median \u{3c3} of DoLP", noise(|n| format!("{:.4}", n.median.dolp))));
            facts.push(("median \u{3c3} of AoLP", noise(|n| format!("{:.2}\u{b0}", n.median.aolp.to_degrees().0))));
            facts.push(("mean DoLP less noise", noise(|n| format!("{:.4}", n.mean_dolp))));
            facts.push(("misfit", self.per_color(|c| c.percent(c.statistics.count(Flags::MISFIT)))));
        }
        facts
    }

    fn angles(&self) -> String {
        if self.files.len() != self.angles_deg.len() {
            let list: Vec<String> = self.angles_deg.iter().map(|a| format!("{a}\u{b0}")).collect();
            return format!("{} in each cell of {}", list.join(" "), self.files.join(", "));
        }
        let list: Vec<String> =
            self.angles_deg.iter().zip(&self.files).map(|(a, f)| format!("{a}\u{b0} {f}")).collect();
        list.join(", ")
    }

    /// One value, or one for each color.
    fn per_color(&self, value: impl Fn(&ColorAnalysis) -> String) -> String {
        match self.colors.as_slice() {
            [one] => value(one),
            several => {
                several.iter().map(|c| format!("{} {}", c.color.name(), value(c))).collect::<Vec<_>>().join(", ")
            }
        }
    }
}

impl ColorAnalysis {
    fn percent(&self, count: usize) -> String {
        let percent = self.statistics.percent(count);
        // "0.00 %" is for none.
        if count > 0 && percent < 0.01 { "<0.01 %".into() } else { format!("{percent:.2} %") }
    }

    fn json(&self) -> Value {
        let s = &self.statistics;
        let flags: serde_json::Map<String, Value> = Flags::NAMES
            .iter()
            .zip(s.flagged)
            .map(|((_, name), count)| (name.replace(' ', "_"), json!(s.percent(count))))
            .collect();
        json!({
            "color": self.color.name(),
            "mean_s0_dn": s.mean_s0,
            "mean_dolp": s.mean_dolp,
            "percent": flags,
            "no_light_percent": s.percent(s.no_light),
            "dolp_above_one_percent": s.percent(s.above_one),
            "rms_residual_dn": s.rms_residual,
            "median_sigma_dolp": self.noise.map(|n| n.median.dolp),
            "median_sigma_aolp_deg": self.noise.map(|n| n.median.aolp.to_degrees().0),
            "mean_dolp_less_noise": self.noise.map(|n| n.mean_dolp),
        })
    }
}

/// Four or five significant digits, without an exponent where people would not write one.
fn rounded(value: f64) -> f64 {
    if value.abs() < f64::MIN_POSITIVE {
        return 0.0;
    }
    #[expect(clippy::cast_possible_truncation, reason = "the logarithm of a float is at most 309")]
    let digits = (4.0 - value.abs().log10().floor()) as i32;
    let scale = 10.0_f64.powi(digits);
    if scale.is_normal() { (value * scale).round() / scale } else { value }
}
