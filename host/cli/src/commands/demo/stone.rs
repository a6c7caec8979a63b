//! The second half of the demo: a simulated stone under a polarized sky is photographed, fitted, put under another sun, and
//! compared with what it was made of.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use host_fit::compare::{PictureOptions, Quantity, Reference, compare_pictures};
use host_fit::forward::Body;
use host_fit::maps::{MapPreview, MaterialMaps, Plane};
use host_fit::pipeline::{BodyChoice, FitOptions, PipelineError, Prepared, calibrate_wheels};
use host_fit::relight::{Exposure, RelightOptions, Relit, Sky, Sun, display, frame, relight};
use host_fit::session::{LightSpec, Session};
use host_fit::tiles::{Share, TileStore, merge};
use host_image::Picture;
use host_optics::Ior;
use host_sim::{Scene, SimError};
use serde_json::{Value, json};

use super::session::{TOLERANCE, session};
use crate::commands::{compare, render};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::write_durably;
use crate::report::{Figure, Report};
use crate::scenes::refused;
use crate::terminal::Terminal;

const SCENE: &str = include_str!("stone.toml");
/// Cells along a side of the maps.
const RESOLUTION: usize = 96;
/// Columns of the renderings.
const WIDTH: usize = 480;

/// What is said of it.
pub(super) struct Stone {
    pub(super) facts: Vec<(&'static str, String)>,
    pub(super) text: String,
    pub(super) json: Value,
}

/// Does it all and writes `folder`, which must not be there.
pub(super) fn run(folder: &Path, terminal: &Terminal) -> Result<Stone, Failure> {
    let start = Instant::now();
    let progress = terminal.progress(5, "stone");
    let scene = Scene::parse(SCENE, Path::new("stone.toml")).map_err(|e| simulating(&e))?;
    let mut session = session(&scene).map_err(|e| simulating(&e))?;
    progress.inc(1);
    std::fs::create_dir(folder).map_err(|e| unwritable(&e))?;
    let maps = fit(&mut session, folder).map_err(|e| fitting(&e))?;
    maps.save_exr(&folder.join("material.exr")).map_err(|e| fitting(&e.into()))?;
    progress.inc(1);
    let truth = truth(&scene, &maps);
    let comparison = compare::against(&maps, &Reference::from_maps(&truth, 0))?;
    progress.inc(1);

    // A low sun from another side, which the fit has not seen.
    let sun = Sun { azimuth_deg: 120.0, elevation_deg: 38.0, irradiance: None };
    let light = Sky::Clear(0.8).light(Some(sun), Some(0.7)).map_err(|e| render::failed(&e))?;
    let (fitted, mut made) = (relit(&maps, &light)?, relit(&truth, &light)?);
    progress.inc(1);

    let mut figures = previews(&maps, folder)?;
    let exposed = Exposure::Auto { stops: 0.0 };
    let (picture, white) = display(&fitted, exposed).map_err(|e| Failure::writing(&e))?;
    let (wanted, _) = display(&made, Exposure::White(white)).map_err(|e| Failure::writing(&e))?;
    // Scored where there is an answer: elsewhere both get the same hatch.
    made.sight.clone_from(&fitted.sight);
    let (hatched, _) = display(&made, Exposure::White(white)).map_err(|e| Failure::writing(&e))?;
    let score = compare_pictures(&picture, &hatched, PictureOptions::default()).map_err(|e| fitting(&e.into()))?;
    figures.insert(
        0,
        figure(
            &picture,
            folder,
            "render",
            "Rendering of the fit",
            "Under a sun the fit has not seen. Purple hatch: samples that were refused, nearly all on the seams.",
        )?,
    );
    figures.insert(1, figure(&wanted, folder, "render-truth", "Rendering of the truth", "What it should look like.")?);
    figures.extend(compare::figures(&comparison.differences, folder).map_err(|e| Failure::writing(&e))?);

    let mut facts = Vec::new();
    let all = &comparison.all;
    let scored = all.quantity(Quantity::Normal).map_or(0, |q| q.count);
    facts.push(("stone: fitted", format!("{scored} of {} samples without a reason against them", all.samples)));
    for (name, quantity) in [
        ("stone: normal error", Quantity::Normal),
        ("stone: index error", Quantity::Eta),
        ("stone: alpha error", Quantity::Alpha),
    ] {
        if let Some(q) = all.quantity(quantity) {
            let unit = if quantity == Quantity::Normal { "\u{b0}" } else { "" };
            facts.push((name, format!("median {:.4}{unit}, 95 % {:.4}{unit}", q.median, q.percentile_95)));
        }
    }
    let psnr = format!(
        "PSNR {:.1} dB, SSIM {:.4} against the truth under a new sun, seams left out",
        score.psnr_db, score.ssim
    );
    facts.push(("stone: rendering", psnr));
    let mut report = Report::new(
        "A stone, fitted",
        "Simulated frames of three views under a polarized sky, the material found from them, and how far it is from the truth.",
    );
    facts.iter().for_each(|(name, value)| report.fact(*name, value));
    figures.into_iter().for_each(|figure| report.figure(figure));
    write_durably(&folder.join("report.html"), &report.to_html()).map_err(|e| unwritable(&e))?;
    progress.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    let text = format!(
        "\nA simulated stone under a polarized sky, fitted from three views in {seconds:.1} s and compared with the truth:\n{}",
        compare::table(&comparison)
    );
    let json = json!({
        "comparison": compare::class_json(all),
        "rendering": { "psnr_db": score.psnr_db, "ssim": score.ssim, "white": white },
        "seconds": seconds,
    });
    Ok(Stone { facts, text, json })
}

fn fit(session: &mut Session, folder: &Path) -> Result<MaterialMaps, PipelineError> {
    let options = FitOptions {
        body: BodyChoice::Interface,
        eta: [1.3, 1.9],
        alpha: [0.05, 0.5],
        slope: 0.3,
        tolerance: TOLERANCE,
        wheel_sigma_deg: 0.1,
        resolution: Some(RESOLUTION),
        refine: false,
        tile: 16,
        ..FitOptions::default()
    };
    let wheels = calibrate_wheels(session, options.wheel_sigma_deg)?;
    let prepared = Prepared::new(session, &wheels, options)?;
    let tiles = folder.join("tiles");
    let store = TileStore::open(&tiles, prepared.job()?)?;
    prepared.run(&store, Share::ALL, &AtomicBool::new(false), |_| {})?;
    let mut maps = merge(std::slice::from_ref(&tiles))?;
    maps.attributes.insert("body".into(), "interface".into());
    // Of no use once they are merged; if they stay, they are just more files.
    let _ = std::fs::remove_dir_all(tiles);
    Ok(maps)
}

/// What the stone is made of at the samples of `maps`, exactly.
fn truth(scene: &Scene, maps: &MaterialMaps) -> MaterialMaps {
    let grid = maps.grid;
    let mut truth = MaterialMaps::new(grid, false);
    for plane in Plane::ALL.into_iter().filter(|p| p.name().starts_with("sigma")) {
        truth.plane_mut(plane).fill(0.0);
    }
    for i in 0..grid.samples() {
        let place = grid.position(i % grid.columns, i / grid.columns);
        let Some(point) = scene.sample.at(place.into()) else { continue };
        let Ior::Dielectric(ior) = point.ior[1] else { continue };
        let ([r, g, b], n) = (point.albedo, point.normal);
        for (plane, value) in Plane::ALL.into_iter().zip([r, g, b, ior.eta(), point.alpha, n.x, n.y, n.z]) {
            #[expect(clippy::cast_possible_truncation, reason = "maps are f32")]
            let value = value as f32;
            truth.plane_mut(plane)[i] = value;
        }
    }
    truth
}

fn relit(maps: &MaterialMaps, light: &LightSpec) -> Result<Relit, Failure> {
    let camera = frame(&maps.grid.plane, 50.0, -90.0, None, WIDTH).map_err(|fault| render::failed(&fault.into()))?;
    let options = RelightOptions { body: Body::Interface, refuse: u32::MAX, ..RelightOptions::default() };
    relight(maps, &camera, light, &options).map_err(|e| render::failed(&e))
}

fn previews(maps: &MaterialMaps, folder: &Path) -> Result<Vec<Figure>, Failure> {
    let kinds = [MapPreview::Albedo, MapPreview::Normal, MapPreview::Eta, MapPreview::Alpha, MapPreview::Reasons];
    let one = |kind: MapPreview| {
        let picture = maps.preview(kind, WIDTH).map_err(|e| fitting(&e.into()))?;
        figure(&picture, folder, kind.name(), kind.name(), "As fitted.")
    };
    kinds.into_iter().map(one).collect()
}

fn figure(picture: &Picture, folder: &Path, file: &str, title: &str, caption: &str) -> Result<Figure, Failure> {
    let path = folder.join(format!("{file}.png"));
    picture.write_png(&path).map_err(|e| Failure::writing(&e))?;
    let png = std::fs::read(&path).map_err(|e| unwritable(&e))?;
    Ok(Figure { title: title.into(), caption: caption.into(), png })
}

fn simulating(error: &SimError) -> Failure {
    refused(Path::new("stone.toml"), error)
}

fn fitting(error: &PipelineError) -> Failure {
    Failure::new(Exit::BadInput, format!("the stone of the demo cannot be fitted: {error}"), "")
}

fn unwritable(error: &std::io::Error) -> Failure {
    let advice = "Check the free space and the permissions, or choose another folder with -o.";
    Failure::new(Exit::Output, format!("cannot write the stone's files: {error}"), advice)
}
