//! Real photographs through the whole path: replayed as frames of a wheel, computed by the camera, fetched by the host.
//!
//! The pictures lie beside the workspace (`BREWSTER_SHARED`, else `../shared`) and are not part of it; where they are
//! missing these stories say so and pass.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use boards::Board;
use firmware_emulator::{Camera, Clock, Source};
use hil_tests::{Bench, Fetched, board, capture_request};
use host_link::LinkError;
use protocol_polar::{Degrees, Flags, Stokes};
use protocol_wire::{Exposure, Refusal, Word};
use std::ops::ControlFlow;
use std::path::PathBuf;

const CONTINUE: ControlFlow<()> = ControlFlow::Continue(());
const FOUR: [f64; 4] = [0.0, 45.0, 90.0, 135.0];

/// The folder `data/real/<name>`, if it is there.
fn photographs(name: &str) -> Option<PathBuf> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let shared = std::env::var_os("BREWSTER_SHARED").map_or(beside, PathBuf::from);
    let folder = shared.join("data/real").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no ../shared ({} is missing)", folder.display());
    None
}

/// Starts a camera on a mosaic.
fn on_mosaic(board: &Board, file: &std::path::Path) -> Bench {
    let spec = format!("replay:{}?mosaic=imx250mzr", file.display());
    let Source::Replay(source) = spec.parse().unwrap() else { panic!("{spec} is a replay") };
    Bench::start(Camera::replay(board, &source, Clock::virtual_time()).unwrap())
}

/// Captures the mosaic in `word`, and checks that every integer is right.
fn capture(bench: &Bench, word: Word) -> (Fetched, f64) {
    let mut client = bench.connect();
    let mut request = capture_request(&FOUR, Exposure::Auto);
    request.word = word;
    let id = client.capture(request, |_| CONTINUE).unwrap();
    let fetched = Fetched::fetch(&mut client, id);
    let replayed = fetched.replay();
    assert_eq!(replayed.differing, 0, "{replayed:?}");
    let worst = fetched.worst_of_bound();
    assert!(worst <= 1.0, "{worst} of the bound");
    client.release(id).unwrap();
    (fetched, worst)
}

/// Mean light over `width` × `height` photosites from (`left`, `top`), without flagged ones.
fn mean_light(fetched: &Fetched, left: usize, top: usize, width: usize, height: usize) -> Stokes {
    let across = usize::try_from(fetched.description.sensor.width).unwrap();
    let (planes, flags) = ([0, 1, 2].map(|component| fetched.stokes_dn(component)), fetched.flags());
    let mut sum = [0.0; 4];
    for row in top..top + height {
        for at in row * across + left..row * across + left + width {
            if !flags[at].contains(Flags::SATURATED) {
                for component in 0..3 {
                    sum[component] += planes[component][at];
                }
            }
        }
    }
    Stokes(sum)
}

#[test]
fn photographs_of_a_polarization_sensor() {
    let Some(folder) = photographs("imx250mzr") else { return };
    for (name, saturated_share) in
        [("camera", 0.0..0.05), ("carps", 0.05..0.15), ("fruits", 0.0..0.01), ("polarizer", 0.1..0.3)]
    {
        let bench = on_mosaic(&board(), &folder.join(format!("{name}_IMX250MZR.png")));
        let (fetched, narrow) = capture(&bench, Word::I16);
        let (_, wide) = capture(&bench, Word::I32);
        let flags = fetched.flags();
        assert_eq!(flags.len(), 1224 * 1024);
        let count = u32::try_from(flags.iter().filter(|f| f.contains(Flags::SATURATED)).count()).unwrap();
        let share = f64::from(count) / f64::from(1224 * 1024);
        assert!(saturated_share.contains(&share), "{name}: {share} saturated");
        println!("{name}: worst error/bound {narrow:.3} (i16), {wide:.3} (i32); {share:.4} saturated");
    }
}

/// The same pictures from a folder, said to be taken by a camera turned by 17.3°: the weights are no longer powers of two, so
/// that the rounding is seen, and every angle of polarization turns with the camera.
#[test]
fn a_turned_camera_sees_the_light_turned() {
    const TURN_DEG: f64 = 17.3;
    let Some(folder) = photographs("imx250mzr") else { return };
    let file = folder.join("polarizer_IMX250MZR.png");
    let bench = on_mosaic(&board(), &file);
    let (straight, _) = capture(&bench, Word::I16);
    let split = std::env::temp_dir().join(format!("brewster-turned-{}", std::process::id()));
    std::fs::create_dir_all(&split).unwrap();
    let mut table = String::from("[angles_deg]\n");
    for (slot, samples) in straight.raw().iter().enumerate() {
        write_png(&split.join(format!("{slot}.png")), 1224, 1024, samples);
        table += &format!("\"{slot}.png\" = {}\n", FOUR[slot] + TURN_DEG);
    }
    std::fs::write(split.join("angles.toml"), table).unwrap();
    let Source::Replay(source) = format!("replay:{}", split.display()).parse().unwrap() else { panic!("a replay") };
    let bench = Bench::start(Camera::replay(&board(), &source, Clock::virtual_time()).unwrap());
    for word in [Word::I16, Word::I32] {
        let mut client = bench.connect();
        let mut request = capture_request(&FOUR.map(|axis| axis + TURN_DEG), Exposure::Auto);
        request.word = word;
        let id = client.capture(request, |_| CONTINUE).unwrap();
        let turned = Fetched::fetch(&mut client, id);
        assert_eq!(turned.replay().differing, 0);
        let worst = turned.worst_of_bound();
        println!("turned, {word:?}: worst error/bound {worst:.3}");
        assert!(worst <= 1.0 && worst > 0.4, "{word:?}: {worst} of the bound");
        for (x, y) in [(150, 504), (462, 510), (738, 510), (1014, 516)] {
            let (a, b) = (mean_light(&straight, x, y, 80, 80), mean_light(&turned, x, y, 80, 80));
            let by = b.aolp().axis_difference(a.aolp()).to_degrees();
            assert!((by.0 - TURN_DEG).abs() < 0.05, "{word:?} at ({x}, {y}): {by:?}");
        }
    }
    std::fs::remove_dir_all(&split).unwrap();
}

/// An 8-bit grey PNG.
fn write_png(path: &std::path::Path, width: u32, height: u32, samples: &[u16]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_compression(png::Compression::Fastest);
    let bytes: Vec<u8> = samples.iter().map(|sample| u8::try_from(*sample).unwrap()).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

/// The sheets are labelled with their axes from the vertical, clockwise: the light behind them is at 90° minus the label.
/// What they were measured at by the pictures' own publisher's definitions, 83.4, 43.7, 175.2 and 135.4°, is the reference.
#[test]
fn four_labelled_polarizers_read_as_they_lie() {
    let Some(folder) = photographs("imx250mzr") else { return };
    let bench = on_mosaic(&board(), &folder.join("polarizer_IMX250MZR.png"));
    let (fetched, _) = capture(&bench, Word::I16);
    for ((x, y), wanted) in [((190, 544), 83.4), ((502, 550), 43.7), ((778, 550), 175.2), ((1054, 556), 135.4)] {
        let light = mean_light(&fetched, x - 40, y - 40, 80, 80);
        let off = light.aolp().axis_difference(Degrees(wanted).to_radians()).to_degrees();
        println!("polarizer at ({x}, {y}): {:.2}°, DoLP {:.3}", light.aolp().to_degrees().0, light.dolp());
        assert!(off.0.abs() < 1.0, "({x}, {y}): {off:?} from {wanted}°");
        assert!((0.35..0.6).contains(&light.dolp()), "({x}, {y}): {}", light.dolp());
    }
}

#[test]
fn water_is_more_polarized_towards_the_brewster_angle() {
    let Some(folder) = photographs("piermont_water") else { return };
    // 23, 23, 27, 33.5, 38, 45, 51 and 51° from the nadir; the DoLP that others found in the same superpixels.
    let runs = [
        "0_theta23.0",
        "1_theta23.0",
        "2_theta27.0",
        "3_theta33.5",
        "4_theta38.0",
        "5_theta45.0",
        "6_theta51.0",
        "7_theta51.0",
    ];
    let wanted = [0.088, 0.091, 0.169, 0.237, 0.305, 0.421, 0.508, 0.517];
    let mut before = 0.0;
    for (run, wanted) in runs.iter().zip(wanted) {
        let bench = on_mosaic(&board(), &folder.join(format!("narrow_run{run}.png")));
        let (fetched, worst) = capture(&bench, Word::I16);
        let sensor = &fetched.description.sensor;
        // The brightest sample of a run is just above or below 4096 DN.
        assert_eq!((sensor.width, sensor.height), (64, 1024));
        assert!((12..=13).contains(&sensor.bit_depth), "{}", sensor.bit_depth);
        let light = mean_light(&fetched, 0, 412, 64, 200);
        println!(
            "run {run}: DoLP {:.4}, AoLP {:.2}°, worst error/bound {worst:.3}",
            light.dolp(),
            light.aolp().to_degrees().0
        );
        assert!((light.dolp() - wanted).abs() < 0.002, "run {run}: {} for {wanted}", light.dolp());
        assert!(light.dolp() > before - 0.005, "run {run}: {} after {before}", light.dolp());
        assert!(light.aolp().axis_difference(Degrees(0.0).to_radians()).to_degrees().0.abs() < 6.5, "run {run}");
        before = light.dolp();
    }
}

#[test]
fn an_axis_that_was_not_photographed_is_refused_by_name() {
    let Some(folder) = photographs("imx250mzr") else { return };
    let bench = on_mosaic(&board(), &folder.join("fruits_IMX250MZR.png"));
    let mut client = bench.connect();
    let refused = client.capture(capture_request(&[0.0, 60.0, 120.0], Exposure::Auto), |_| CONTINUE);
    let Err(LinkError::Refused(Refusal::WheelFailed(why))) = refused else { panic!("{refused:?}") };
    assert_eq!(why, "no picture at 60°, but at 0, 45, 90, 135");
    // Half a degree off is the same picture, and it is told which.
    let id = client.capture(capture_request(&[0.4, 45.0, 90.0], Exposure::Auto), |_| CONTINUE).unwrap();
    assert!(client.describe(id).unwrap().frames[0].angle_deg.abs() < 1e-12);
}
