//! What a file's cases showed: per check the worst error, its bound and where it stands.

use std::fmt;

/// What the errors of a check are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Measure {
    Worst,
    Median,
    Rms,
}

/// One check of a family.
#[derive(Clone, Debug)]
struct Check {
    what: &'static str,
    bound: f64,
    measure: Measure,
    worst: f64,
    at: String,
    errors: Vec<f64>,
}

/// The checks of one file, in the order in which they were first made.
#[derive(Clone, Debug, Default)]
pub(super) struct Report {
    checks: Vec<Check>,
}

impl Report {
    /// `found` must be within `bound` of `expected`, in units of `scale`. 0 against 0 is right on any scale; what is not a
    /// number is infinitely wrong.
    pub(super) fn see(&mut self, what: &'static str, bound: f64, [found, expected, scale]: [f64; 3], at: &str) {
        self.error(what, bound, relative(found, expected, scale), at);
    }

    /// All of `found` must be within `bound` of `expected`, in units of `scale`.
    pub(super) fn all(
        &mut self,
        what: &'static str,
        bound: f64,
        found: &[f64],
        expected: &[f64],
        scale: f64,
        at: &str,
    ) {
        if found.len() != expected.len() {
            self.error(what, bound, f64::INFINITY, at);
        }
        for (found, expected) in found.iter().zip(expected) {
            self.see(what, bound, [*found, *expected, scale], at);
        }
    }

    /// A statement that must hold.
    pub(super) fn holds(&mut self, what: &'static str, true_here: bool, at: &str) {
        self.error(what, 0.0, if true_here { 0.0 } else { 1.0 }, at);
    }

    /// An error that must not exceed `bound`.
    pub(super) fn error(&mut self, what: &'static str, bound: f64, error: f64, at: &str) {
        self.note(Check { what, bound, measure: Measure::Worst, worst: error, at: at.to_owned(), errors: vec![error] });
    }

    /// An error whose median over the file must not exceed `bound`.
    pub(super) fn typical(&mut self, what: &'static str, bound: f64, error: f64) {
        let check =
            Check { what, bound, measure: Measure::Median, worst: error, at: "median".into(), errors: vec![error] };
        self.note(check);
    }

    /// Errors whose root mean square over the file must not exceed `bound`.
    pub(super) fn rms(&mut self, what: &'static str, bound: f64, error: f64) {
        self.note(Check { what, bound, measure: Measure::Rms, worst: error, at: "rms".into(), errors: vec![error] });
    }

    /// Takes in the checks of other cases of the file.
    pub(super) fn merge(mut self, other: Self) -> Self {
        for check in other.checks {
            self.note(check);
        }
        self
    }

    /// Checks that fail, with the factor by which they do.
    pub(super) fn failures(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.checks.iter().filter(|check| !check.passes()).map(|check| (check.what, check.error() / check.bound))
    }

    /// How many values were compared.
    pub(super) fn values(&self) -> usize {
        self.checks.iter().map(|check| check.errors.len()).sum()
    }

    fn note(&mut self, new: Check) {
        match self.checks.iter_mut().find(|check| check.what == new.what) {
            None => self.checks.push(new),
            Some(check) => {
                if new.worst > check.worst || new.worst.is_nan() {
                    check.worst = new.worst;
                    check.at = new.at;
                }
                check.errors.extend(new.errors);
            }
        }
    }
}

impl Check {
    fn error(&self) -> f64 {
        match self.measure {
            Measure::Worst => self.worst,
            Measure::Rms => {
                let count: f64 = self.errors.iter().map(|_| 1.0).sum();
                (self.errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt()
            }
            Measure::Median => {
                let mut sorted = self.errors.clone();
                sorted.sort_by(f64::total_cmp);
                sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY)
            }
        }
    }

    fn passes(&self) -> bool {
        self.error() <= self.bound
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for check in &self.checks {
            let (verdict, error, count) =
                (if check.passes() { "ok  " } else { "FAIL" }, check.error(), check.errors.len());
            writeln!(
                f,
                "  {verdict} {error:9.2e} of {:7.0e}  {} ({count} values, {})",
                check.bound, check.what, check.at
            )?;
        }
        Ok(())
    }
}

/// |found − expected| in units of |scale|.
pub(super) fn relative(found: f64, expected: f64, scale: f64) -> f64 {
    let miss = (found - expected).abs();
    if miss.is_nan() {
        f64::INFINITY
    } else if miss > 0.0 {
        miss / scale.abs()
    } else {
        0.0
    }
}
