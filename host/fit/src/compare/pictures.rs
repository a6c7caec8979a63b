//! A picture against a picture: peak signal to noise ratio and structural similarity, band by band.

use host_image::{Picture, Samples};

use super::ssim::{WINDOW, ssim};
use crate::maps::MapsError;

/// How to compare pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureOptions {
    /// L, the range of the values: 255 and 65535 for integers if not stated; floats must state it.
    pub peak: Option<f64>,
    /// Whether the picture is first scaled by the one factor (for all bands) that minimizes the squared error: for
    /// pictures whose exposure is not known.
    pub align_scale: bool,
}

/// Scores of one band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandScore {
    /// Mean squared error, in squared units of the samples.
    pub mean_squared_error: f64,
    /// 10 log10(L²/MSE), dB; infinite for equal bands.
    pub psnr_db: f64,
    /// Mean SSIM, 1 for equal bands.
    pub ssim: f64,
}

/// Scores of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureComparison {
    /// L.
    pub peak: f64,
    /// What the picture was multiplied by; 1 without alignment.
    pub scale: f64,
    /// One for grey, R, G, B for color.
    pub bands: Vec<BandScore>,
    /// Of the mean squared error over all bands, dB.
    pub psnr_db: f64,
    /// Mean over the bands.
    pub ssim: f64,
}

/// Compares a picture with a reference of the same size. Samples are taken as they are stored: nothing is linearized.
///
/// # Errors
/// [`MapsError::Inconsistent`] for different sizes or channels, less than 11 × 11 pixels, different integer types or a
/// float picture without a stated peak, and a peak that is not positive.
pub fn compare_pictures(
    picture: &Picture,
    reference: &Picture,
    options: PictureOptions,
) -> Result<PictureComparison, MapsError> {
    let wrong = |what: String| Err(MapsError::Inconsistent { what });
    let [found, expected] = [picture, reference].map(|p| (p.width, p.height, p.channels));
    if found != expected || picture.samples.len() != reference.samples.len() {
        return wrong(format!("pictures of (columns, rows, channels) {found:?} and {expected:?}"));
    }
    let (width, height, channels) = found;
    if width.min(height) < WINDOW || picture.samples.len() != width * height * channels {
        return wrong(format!("{width} x {height} pixels; at least {WINDOW} x {WINDOW} are compared"));
    }
    let peak = match (options.peak, &picture.samples, &reference.samples) {
        (Some(peak), ..) => peak,
        (None, Samples::U8(_), Samples::U8(_)) => f64::from(u8::MAX),
        (None, Samples::U16(_), Samples::U16(_)) => f64::from(u16::MAX),
        _ => return wrong("the range of the values is not known from their types; state the peak".into()),
    };
    if !(peak > 0.0 && peak.is_finite()) {
        return wrong(format!("a peak of {peak}"));
    }
    let scale = if options.align_scale { best_scale(picture, reference) } else { 1.0 };
    let score = |channel: usize| {
        let [mut x, y] = [picture, reference].map(|p| band(p, channel));
        x.iter_mut().for_each(|v| *v *= scale);
        let mean_squared_error = x.iter().zip(&y).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / x.len() as f64;
        BandScore { mean_squared_error, psnr_db: psnr_db(mean_squared_error, peak), ssim: ssim(&x, &y, width, peak) }
    };
    let bands: Vec<BandScore> = (0..channels).map(score).collect();
    let mean = |of: fn(&BandScore) -> f64| bands.iter().map(of).sum::<f64>() / bands.len() as f64;
    let (psnr_db, ssim) = (psnr_db(mean(|b| b.mean_squared_error), peak), mean(|b| b.ssim));
    Ok(PictureComparison { peak, scale, bands, psnr_db, ssim })
}

fn psnr_db(mean_squared_error: f64, peak: f64) -> f64 {
    10.0 * (peak * peak / mean_squared_error).log10()
}

/// Σ xy / Σ x² over all samples; 1 for a black picture.
fn best_scale(picture: &Picture, reference: &Picture) -> f64 {
    let mut sums = [0.0, 0.0];
    for channel in 0..picture.channels {
        for (x, y) in band(picture, channel).into_iter().zip(band(reference, channel)) {
            sums[0] += x * y;
            sums[1] += x * x;
        }
    }
    if sums[1] > 0.0 { sums[0] / sums[1] } else { 1.0 }
}

/// Samples of one channel.
fn band(picture: &Picture, channel: usize) -> Vec<f64> {
    fn every<T: Copy + Into<f64>>(samples: &[T], channel: usize, channels: usize) -> Vec<f64> {
        samples.iter().skip(channel).step_by(channels).map(|v| (*v).into()).collect()
    }
    match &picture.samples {
        Samples::U8(v) => every(v, channel, picture.channels),
        Samples::U16(v) => every(v, channel, picture.channels),
        Samples::F32(v) => every(v, channel, picture.channels),
    }
}
