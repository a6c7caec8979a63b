//! From drawn pictures to the plane: places, covariances, flags, refinement.

use glam::{DVec2, DVec3};
use host_fit::maps::{Grid, PlaneRect};
use host_fit::register::{Interpolation, Refused, Registration};
use host_fit::session::{ViewData, homography};
use host_image::{Picture, Samples};
use protocol_polar::Flags;
use serde_json::json;

use crate::drawn::{ANGLES, POSES, Random, SIZE, draw, drawn, light, open, pose, session, view};

/// The pattern comes back where it was drawn: the misfit against its gradient is a distance in the picture.
#[test]
fn patterns_land_where_they_should() {
    let (_folder, session) = drawn(DVec2::ZERO);
    let grid = Grid::nodes(&session.sample, 230, 210);
    let registration = Registration::new(&session, grid, Interpolation::Cubic).unwrap();
    let mut worst = [DVec3::ZERO; 2];
    let mut seen = [0; 2];
    let mut pulls = [(glam::DMat2::ZERO, DVec2::ZERO); 2];
    for (r, c) in grid.squares(48) {
        let tile = registration.tile(r, c).unwrap();
        for i in 0..tile.len() {
            let (row, col) = (tile.rows.start + i / tile.cols.len(), tile.cols.start + i % tile.cols.len());
            let p = grid.node(row, col);
            for (v, o) in tile.node(i).iter().enumerate() {
                // The oblique view's picture cuts two corners off.
                let Some(o) = o else { continue };
                seen[v] += 1;
                let exact = DVec3::from_array(light(p));
                let found = DVec3::from_array(o.stokes[1].map(f64::from));
                let h = registration.homography(v);
                assert!((o.direction - session.views[v].camera.towards(p)).length() < 1e-15 && o.view == v);
                let at = homography::project(&h, p).unwrap();
                // Beyond the outer pixels' middles there is nothing to interpolate.
                if at.cmpgt(DVec2::splat(2.0)).all() && at.x < 318.0 && at.y < 238.0 {
                    worst[v] = worst[v].max((found - exact).abs());
                }
                // Gradient of s0 in the picture, and the motion that explains the misfit best.
                let by = |d: DVec2| (light(p + d)[0] - light(p - d)[0]) / 2e-6;
                let gradient = homography::jacobian(&h, p).inverse().transpose()
                    * DVec2::new(by(DVec2::X * 1e-6), by(DVec2::Y * 1e-6));
                pulls[v].0 += glam::DMat2::from_cols(gradient * gradient.x, gradient * gradient.y);
                pulls[v].1 += gradient * (found.x - exact.x);
            }
        }
    }
    for (v, (matrix, right)) in pulls.into_iter().enumerate() {
        let motion = matrix.inverse() * right;
        println!("view {v}: moved by {:.1e} px, worst s0, s1, s2 {:.5}", motion.length(), worst[v]);
        assert!(seen[v] > 230 * 210 * 9 / 10);
        assert!(motion.length() < 0.01 && worst[v].max_element() < 5e-4);
    }
}

/// The scatter of what was resampled, over many draws, is the covariance that is carried: interpolated, and averaged.
#[test]
fn the_covariance_is_carried_through_resampling() {
    let folder = tempfile::tempdir().unwrap();
    let pose = pose(POSES[0].0, POSES[0].1);
    let mut random = Random(77);
    draw(folder.path(), "a", pose, DVec2::ZERO, &mut |_| 0.0);
    let mut session = open(folder.path(), &session(&[view("a", pose)])).unwrap();
    let ViewData::Frames(clean) = session.views[0].data.clone() else { panic!() };
    for (side, kernel) in [(90, Interpolation::Bilinear), (90, Interpolation::Cubic), (24, Interpolation::Cubic)] {
        let grid = Grid::cells(&session.sample, side, side);
        let (mut scatter, mut stated) = ([0.0_f64; 6], [0.0_f64; 6]);
        let mut count = 0.0;
        let exact = Registration::new(&session, grid, kernel).unwrap().tile(0..side, 0..side).unwrap();
        for _ in 0..if side > 50 { 1 } else { 12 } {
            let mut noisy = clean.clone();
            for picture in &mut noisy.pictures {
                let Samples::F32(samples) = &mut picture.samples else { panic!() };
                for x in samples {
                    // Read noise 4 e- and shot noise at 2 e-/DN, and the twelfth the estimator takes for rounding.
                    let variance = 4.0 + f64::from(*x - 100.0) / 2.0 + 1.0 / 12.0;
                    *x += (variance.sqrt() * random.normal()) as f32;
                }
            }
            session.views[0].data = ViewData::Frames(noisy);
            let tile = Registration::new(&session, grid, kernel).unwrap().tile(0..side, 0..side).unwrap();
            for i in 0..tile.len() {
                let (found, exact) = (tile.node(i)[0].unwrap(), exact.node(i)[0].unwrap());
                for band in 0..3 {
                    count += 1.0;
                    let d = [0, 1, 2].map(|k| f64::from(found.stokes[band][k] - exact.stokes[band][k]));
                    for (e, (j, k)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
                        scatter[e] += d[j] * d[k];
                        stated[e] += f64::from(exact.covariance[band][e]);
                    }
                }
            }
            session.views[0].data = ViewData::Frames(clean.clone());
        }
        println!(
            "{side} {kernel:?}: scatter/stated {:.3} {:.3} {:.3}",
            scatter[0] / stated[0],
            scatter[3] / stated[3],
            scatter[5] / stated[5]
        );
        for (e, (s, t)) in scatter.iter().zip(stated).enumerate() {
            assert!(
                (s - t).abs() < 0.05 * stated[0].min(stated[3]),
                "{side} {kernel:?} {e}: {} {}",
                s / count,
                t / count
            );
        }
    }
}

#[test]
fn refinement_finds_a_known_shift_and_leaves_a_sound_pose() {
    let moved = DVec2::new(0.56, -0.42);
    for (moved, left) in [(moved, 0.03), (DVec2::ZERO, 1e-9)] {
        let (_folder, session) = drawn(moved);
        let mut registration =
            Registration::new(&session, Grid::nodes(&session.sample, 200, 200), Interpolation::Cubic).unwrap();
        let pose = registration.homography(0);
        let [found] = registration.refine(1).unwrap().try_into().unwrap();
        println!("moved by {:.2}: {found:?}", moved.length());
        let h = registration.homography(0);
        for p in [(0.0, 0.0), (0.4, 0.4), (-0.4, 0.3), (-0.3, -0.4)].map(DVec2::from) {
            let off = homography::project(&h, p).unwrap() - homography::project(&pose, p).unwrap() - moved;
            assert!(off.length() < left, "{p}: {off}");
        }
        assert_eq!(found.outcome, if moved == DVec2::ZERO { Err(Refused::NotSignificant) } else { Ok(()) });
    }
}

/// A sample without texture says so by not moving.
#[test]
fn noise_is_not_taken_for_texture() {
    let (_folder, mut session) = drawn(DVec2::ZERO);
    let mut random = Random(9);
    for view in &mut session.views {
        let ViewData::Frames(frames) = &mut view.data else { panic!() };
        for picture in &mut frames.pictures {
            let Samples::F32(samples) = &mut picture.samples else { panic!() };
            samples.iter_mut().for_each(|x| *x = (600.0 + 16.0 * random.normal()) as f32);
        }
    }
    let mut registration =
        Registration::new(&session, Grid::nodes(&session.sample, 200, 200), Interpolation::Cubic).unwrap();
    assert_eq!(registration.refine(1).unwrap()[0].outcome, Err(Refused::NotSignificant));
}

#[test]
fn clipped_samples_and_missing_pixels_are_flagged() {
    let (_folder, mut session) = drawn(DVec2::ZERO);
    let ViewData::Frames(frames) = &mut session.views[0].data else { panic!() };
    let at = |k: usize, x: usize, y: usize, pictures: &mut Vec<Picture>| {
        let Samples::F32(samples) = &mut pictures[k].samples else { panic!() };
        samples[3 * (y * SIZE[0] + x)] = 4000.0;
    };
    // One frame of four clipped at one pixel, two at another; in red.
    at(0, 160, 120, &mut frames.pictures);
    at(0, 140, 100, &mut frames.pictures);
    at(1, 140, 100, &mut frames.pictures);
    let h = session.views[0].camera.plane_to_pixel().inverse();
    let grid = |x: f64, y: f64| {
        let p = h * DVec3::new(x, y, 1.0);
        let p = p.truncate() / p.z;
        let plane = PlaneRect { left: p.x - 5e-4, right: p.x + 5e-4, bottom: p.y - 5e-4, top: p.y + 5e-4 };
        Grid { rows: 1, columns: 1, plane }
    };
    let measured = |x: f64, y: f64| {
        let registration = Registration::new(&session, grid(x, y), Interpolation::Bilinear).unwrap();
        let tile = registration.tile(0..1, 0..1).unwrap();
        (tile.node(0)[0], tile.flags(0)[0])
    };
    let (one, flags) = measured(160.5, 120.5);
    assert!(flags.pixels.contains(Flags::SATURATED) && one.unwrap().covariance[0][0].is_finite());
    let (two, flags) = measured(140.5, 100.5);
    assert!(flags.pixels.contains(Flags::TOO_FEW));
    let two = two.unwrap();
    assert!(two.covariance[0][0].is_infinite() && two.covariance[1][0].is_finite() && two.covariance[2][0].is_finite());
    let (outside, flags) = measured(-3.0, 50.0);
    assert!(outside.is_none() && flags.outside && !flags.behind);
    let too_many = Registration::new(&session, grid(10.0, 10.0), Interpolation::Bilinear).unwrap().tile(0..2, 0..1);
    assert!(too_many.is_err());
}

/// A raw mosaic: each color comes from its own photosites, in the plane it was drawn in.
#[test]
fn mosaics_are_not_mixed() {
    let (folder, _) = drawn(DVec2::ZERO);
    let pose = pose(POSES[1].0, POSES[1].1);
    for angle in ANGLES {
        let color = Picture::read(&folder.path().join(format!("b_{angle}.exr"))).unwrap();
        let Samples::F32(samples) = &color.samples else { panic!() };
        // Red once, green twice, blue three times as bright: what a photosite sees is its own color alone.
        let factor = |i: usize| [[1.0, 2.0], [2.0, 3.0]][i / SIZE[0] % 2][i % SIZE[0] % 2];
        let raw = (0..SIZE[0] * SIZE[1]).map(|i| 100.0 + factor(i) * (samples[3 * i] - 100.0)).collect();
        let picture = Picture { channels: 1, samples: Samples::F32(raw), ..color };
        picture.write_exr(&folder.path().join(format!("raw_{angle}.exr"))).unwrap();
    }
    let mut raw = view("raw", pose);
    raw["image"] = json!({ "width": SIZE[0], "height": SIZE[1], "channels": "RGGB" });
    raw["sensor"]["responsivity_dn_per_radiance_s"] = json!([500, 1000, 1500]);
    let session = open(folder.path(), &session(&[raw])).unwrap();
    let grid = Grid::cells(&session.sample, 60, 60);
    let tile = Registration::new(&session, grid, Interpolation::Cubic).unwrap().tile(10..50, 10..50).unwrap();
    for i in 0..tile.len() {
        let exact = light(grid.node(10 + i / 40, 10 + i % 40));
        for band in tile.node(i)[0].unwrap().stokes {
            for (found, exact) in band.iter().zip(exact) {
                assert!((f64::from(*found) - exact).abs() < 0.02, "{found} {exact}");
            }
        }
    }
}
