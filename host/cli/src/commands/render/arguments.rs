//! Numbers of the command line.

/// Any finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| "expected a number".to_owned())
}

/// A number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

/// `least` to `most` numbers with commas between.
pub(super) fn list(text: &str, least: usize, most: usize, expected: &str) -> Result<Vec<f64>, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| finite(t).ok()).collect();
    numbers.filter(|n| (least..=most).contains(&n.len())).ok_or_else(|| format!("expected {expected}"))
}
