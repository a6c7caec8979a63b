//! A picture against a picture: PSNR, SSIM, and where they differ.

use std::path::Path;

use host_fit::compare::{PictureOptions, compare_pictures};
use host_image::{Color, Colors, Encoding, ImageError, Picture, PlanePreview, Samples, StokesImage, plane_preview};
use serde_json::{Value, json};

use super::{Compare, refused};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::photographs::encoding_words;
use crate::pictures;
use crate::report::{Figure, Report};
use crate::terminal::{Outcome, Terminal};

impl Compare {
    pub(super) fn pictures(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let [picture, reference] = [read(&self.file)?, read(&self.reference)?];
        let linear = |p: &Picture| matches!(p.encoding, Encoding::Linear | Encoding::Unstated);
        if linear(&picture) != linear(&reference) {
            let words = [&picture, &reference].map(|p| encoding_words(p.encoding));
            return Err(Failure::new(
                Exit::BadInput,
                format!("the samples are coded differently: {} against {}", words[0], words[1]),
                "Compare two linear files (stokes.exr, OpenEXR), or two pictures for the screen (PNG).",
            ));
        }
        let floats = matches!(picture.samples, Samples::F32(_)) || matches!(reference.samples, Samples::F32(_));
        let peak = self.peak.or_else(|| floats.then(|| largest(&reference)).filter(|p| *p > 0.0));
        let options = PictureOptions { peak, align_scale: self.align_scale };
        let score = compare_pictures(&picture, &reference, options).map_err(|e| refused(&e))?;

        let folder = OutputFolder::prepare(&self.output, "compare")?;
        let figure =
            difference(&picture, &reference, score.scale, &folder).map_err(|e| pictures::failed(&folder, &e))?;
        let origin = match (self.peak, floats) {
            (Some(_), _) => "",
            (None, true) => ", the reference's largest value",
            (None, false) => ", of the integer type",
        };
        let mut facts = vec![
            ("size".to_owned(), format!("{} x {} pixels, {} bands", picture.width, picture.height, picture.channels)),
            ("peak".to_owned(), format!("{}{origin}", score.peak)),
        ];
        if self.align_scale {
            facts.push(("scaled by".to_owned(), format!("{:.6}", score.scale)));
        }
        facts.push(("PSNR".to_owned(), format!("{:.2} dB", score.psnr_db)));
        facts.push(("SSIM".to_owned(), format!("{:.4}", score.ssim)));
        let names: &[&str] = if score.bands.len() == 3 { &["R", "G", "B"] } else { &["grey"] };
        for (name, band) in names.iter().zip(&score.bands) {
            let rms = band.mean_squared_error.sqrt();
            let value = format!("PSNR {:.2} dB, SSIM {:.4}, rms difference {rms:.4e}", band.psnr_db, band.ssim);
            facts.push((format!("band {name}"), value));
        }
        let (file, by) = (self.file.display(), self.reference.display());
        let mut report = Report::new("A picture against another", format!("{file} against {by}."));
        facts.iter().for_each(|(name, value)| report.fact(name, value));
        report.figure(figure);
        pictures::write_report(&report, &folder)?;
        // JSON has no infinity: equal pictures have no PSNR.
        let finite = |v: f64| v.is_finite().then_some(v);
        let bands = score.bands.iter().map(
            |b| json!({ "mean_squared_error": b.mean_squared_error, "psnr_db": finite(b.psnr_db), "ssim": b.ssim }),
        );
        let json = json!({
            "command": "compare",
            "version": env!("CARGO_PKG_VERSION"),
            "kind": "pictures",
            "file": self.file,
            "reference": self.reference,
            "peak": score.peak,
            "scale": score.scale,
            "psnr_db": finite(score.psnr_db),
            "ssim": score.ssim,
            "bands": bands.collect::<Vec<_>>(),
            "warnings": terminal.warnings(),
        });
        let json = folder.commit(json)?;
        let output = json.get("output").and_then(Value::as_str).unwrap_or_default().to_owned();
        let mut text: String = facts.iter().map(|(name, value)| format!("{name:<20} {value}\n")).collect();
        let page = Path::new(&output).join("report.html");
        text.push_str(&format!("\n{output}\n  {:<40} the difference: open it in a browser\n", page.display()));
        Ok(Outcome { text, brief: format!("{output}\n"), json })
    }
}

/// A picture; of a Stokes image s0.
fn read(path: &Path) -> Result<Picture, Failure> {
    let failed = |e: &ImageError| Failure::reading(e);
    match StokesImage::load_exr(path) {
        Ok(image) => Ok(intensity(&image)),
        Err(ImageError::Missing { .. } | ImageError::Unsupported { .. } | ImageError::Malformed { .. }) => {
            Picture::read(path).map_err(|e| failed(&e))
        }
        Err(other) => Err(failed(&other)),
    }
}

fn intensity(image: &StokesImage) -> Picture {
    let pixels = image.width * image.height;
    let bands: Vec<&[f32]> = image.colors.iter().map(|c| c.s0.as_slice()).collect();
    let samples = (0..pixels).flat_map(|i| bands.iter().map(move |band| band[i])).collect();
    let channels = if image.colors.first().is_some_and(|c| c.color == Color::Y) { 1 } else { 3 };
    let samples = Samples::F32(samples);
    Picture { width: image.width, height: image.height, channels, samples, encoding: Encoding::Linear }
}

fn largest(picture: &Picture) -> f64 {
    values(picture).into_iter().map(f64::from).fold(0.0, f64::max)
}

fn values(picture: &Picture) -> Vec<f32> {
    match &picture.samples {
        Samples::U8(v) => v.iter().map(|x| f32::from(*x)).collect(),
        Samples::U16(v) => v.iter().map(|x| f32::from(*x)).collect(),
        Samples::F32(v) => v.clone(),
    }
}

/// `difference.png`: the mean over the bands of picture · scale − reference.
fn difference(picture: &Picture, reference: &Picture, scale: f64, folder: &OutputFolder) -> Result<Figure, ImageError> {
    #[expect(clippy::cast_possible_truncation, reason = "a picture of it, in f32")]
    let off = |(a, b): (&[f32], &[f32])| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(*a) * scale - f64::from(*b)).sum();
        (sum / a.len() as f64) as f32
    };
    let (a, b) = (values(picture), values(reference));
    let bands = picture.channels;
    let values: Vec<f32> = a.chunks_exact(bands).zip(b.chunks_exact(bands)).map(off).collect();
    let end = super::maps::end_of_scale(&values);
    let colors = Colors::Signed { values: &values, max: end, unit: "picture - reference" };
    let (width, height) = (picture.width, picture.height);
    let preview = PlanePreview { title: "Difference", width, height, max_width: 1024, colors, notes: Vec::new() };
    let path = folder.path().join("difference.png");
    plane_preview(&preview)?.write_png(&path)?;
    let png = std::fs::read(&path).map_err(|source| ImageError::Io { path, source })?;
    let caption = "Mean over the bands, picture minus reference; the scale ends at the 95th percentile.";
    Ok(Figure { title: "Difference".into(), caption: caption.into(), png })
}
