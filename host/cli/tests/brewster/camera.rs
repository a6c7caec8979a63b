//! Cameras: emulated ones, absent ones, and things that are no cameras.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;

use protocol_polar::{Flags, Stokes};
use protocol_wire::{Deframer, Event, FromDevice, Log, LogLevel};

use crate::world::World;

const USAGE: i32 = 2;
const BAD_INPUT: i32 = 3;
const OUTPUT: i32 = 4;
const DEVICE: i32 = 5;
const REFUSED: i32 = 6;
const NOT_IDENTIFIABLE: i32 = 7;

#[test]
fn the_demo_is_right_about_its_wheel() {
    let w = World::new();
    let result = w.ok(&["--json", "demo", "-o", "d"]).json();
    assert_eq!(result["verified"]["differing"], 0);
    assert!(result["verified"]["worst_of_bound"].as_f64().unwrap() <= 1.0);
    assert!(result["width"].as_u64().unwrap() * result["height"].as_u64().unwrap() >= 1_000_000);
    let mean = result["extra"]["aolp_error_deg"]["mean"].as_f64().unwrap();
    assert!(mean.abs() < 0.1, "{mean}");
    for file in ["stokes.exr", "report.html", "s0.png", "dolp.png", "aolp.png", "aolp-dolp.png", "flags.png"] {
        assert!(w.path("d").join(file).is_file(), "{file}");
    }
    // The stone: found to a hundredth in the index and half a degree, and alike under a sun the fit has not seen.
    let stone = &result["extra"]["stone"];
    let median = |what: &str| stone["comparison"]["quantities"][what]["median"].as_f64().unwrap();
    assert!(median("eta") < 0.01 && median("alpha") < 0.01 && median("normal") < 0.5, "{stone}");
    assert!(stone["rendering"]["psnr_db"].as_f64().unwrap() > 40.0, "{stone}");
    for file in ["material.exr", "render.png", "render-truth.png", "error-normal.png", "report.html"] {
        assert!(w.path("d/stone").join(file).is_file(), "{file}");
    }
    // Up right of the hub the light is polarized up right (rows run down); beyond the rim it is not polarized.
    let image = w.stokes("d");
    let at = |x: f64, y: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a point inside the picture")]
        let i = (y * image.height as f64) as usize * image.width + (x * image.width as f64) as usize;
        let c = &image.colors[0];
        Stokes([c.s0[i].into(), c.s1[i].into(), c.s2[i].into(), 0.0])
    };
    let aspect = image.width as f64 / image.height as f64;
    let (dx, dy) = (0.34 * 60_f64.to_radians().cos() / aspect, 0.34 * 60_f64.to_radians().sin());
    let up_right = at(0.5 + dx, 0.44 - dy);
    assert!((up_right.aolp().to_degrees().0 - 60.0).abs() < 5.0 && up_right.dolp() > 0.85, "{up_right:?}");
    assert!(at(0.02, 0.5).dolp() < 0.1);
}

/// The camera's integers and the host's own estimator, from the same raw frames.
#[test]
fn the_camera_and_the_host_agree_on_the_raw_frames() {
    let w = World::new();
    let angles = "0,45,90,135";
    w.ok(&["capture", "-d", "emulated", "--angles", angles, "--raw", "--verify", "-o", "c"]);
    let flags = ["--black", "256", "--white", "4095", "--extinction-ratio", "9000"];
    w.ok(&[&["stokes", "c/raw", "-o", "h"], &flags[..]].concat());
    let (camera, host) = (w.stokes("c"), w.stokes("h"));
    let bound = camera.metadata.fixed_point.unwrap().error_bound_dn;
    let (a, b) = (&camera.colors[0], &host.colors[0]);
    let mut compared = 0;
    for i in 0..a.s0.len() {
        if a.flags.as_ref().unwrap()[i] & Flags::SATURATED.0 != 0 {
            continue;
        }
        for ((x, y), bound) in [(a.s0[i], b.s0[i]), (a.s1[i], b.s1[i]), (a.s2[i], b.s2[i])].into_iter().zip(bound) {
            // The angles in the names have three decimals: up to 2 · 0.0005° of 8190 DN more.
            assert!(f64::from((x - y).abs()) <= bound + 0.15, "pixel {i}: {x} {y}");
        }
        compared += 1;
    }
    assert!(compared > 1_000_000);
}

#[test]
fn a_set_that_determines_nothing_is_refused_before_anything_is_made() {
    let w = World::new();
    for angles in ["0,180,90", "30,30,30,210", "0,90"] {
        w.refused(
            &["capture", "-d", "emulated", "--angles", angles],
            NOT_IDENTIFIABLE,
            &["not identifiable", "different polarizer angle", "0,60,120"],
        );
    }
    w.refused(&["capture", "-d", "emulated", "--angles", "10,10.5,11"], NOT_IDENTIFIABLE, &["close together"]);
    w.refused(&["capture", "-d", "emulated", "--angles", "0,60,nan"], USAGE, &["nan", "degrees"]);
}

#[test]
fn words_that_make_no_sense() {
    let w = World::new();
    w.refused(&["capture", "-d", "cable"], USAGE, &["tcp:HOST:PORT", "emulated"]);
    w.refused(&["capture", "-d", "emulated:moon"], USAGE, &["wheel-chart"]);
    w.refused(&["capture", "-d", "emulated", "--exposure", "0"], USAGE, &["auto"]);
    w.refused(&["capture", "-d", "tcp:127.0.0.1:1", "--board", "x.toml"], USAGE, &["--board"]);
    w.refused(&["capture", "-d", "emulated:replay:nowhere"], BAD_INPUT, &["nowhere"]);
    std::fs::write(w.path("b.toml"), "schema = 1\n[board]\nname = 3\n").unwrap();
    w.refused(&["capture", "-d", "emulated", "--board", "b.toml"], BAD_INPUT, &["b.toml"]);
}

#[test]
fn calibration_pictures_are_looked_at() {
    let w = World::new();
    w.ok(&["calibrate", "flat", "-d", "emulated:uniform:3000,0,0", "--frames", "4"]);
    w.refused(&["calibrate", "dark", "-d", "emulated:uniform:3000,0,0"], REFUSED, &["dark picture is bright", "cap"]);
    w.refused(&["calibrate", "flat", "-d", "emulated:uniform:0.01,0,0"], REFUSED, &["too dark"]);
    w.refused(&["calibrate", "flat", "--frames", "17"], USAGE, &["17"]);
}

#[test]
fn a_folder_that_cannot_be_used_is_said_before_anything_moves() {
    let w = World::new();
    std::fs::create_dir(w.path("mine")).unwrap();
    std::fs::write(w.path("mine/thesis.tex"), "").unwrap();
    w.refused(&["demo", "-o", "mine"], OUTPUT, &["mine", "not empty"]);
    w.refused(&["capture", "-d", "emulated", "-o", "mine", "--force"], OUTPUT, &["thesis.tex"]);
}

#[test]
fn nobody_is_there() {
    let w = World::new();
    w.refused(&["capture", "-d", "unix:nothing.sock"], DEVICE, &["nothing.sock", "brewster-camera"]);
    // A port that was free a moment ago.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    w.refused(&["capture", "-d", &format!("tcp:127.0.0.1:{port}")], DEVICE, &["brewster-camera"]);
    w.refused(&["capture", "-d", "usb:NO-SUCH-CAMERA"], DEVICE, &["usb"]);
    assert!(w.ok(&["devices"]).stdout.contains("emulated"));
}

/// Answers one host with `behavior` and gives the address.
fn impostor(behavior: impl FnOnce(TcpStream) + Send + 'static) -> (String, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    (address, std::thread::spawn(move || behavior(listener.accept().unwrap().0)))
}

#[test]
fn something_else_answers() {
    let w = World::new();
    let (address, thread) = impostor(|mut stream| {
        stream.write_all(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n").unwrap();
        stream.read_to_end(&mut Vec::new()).ok(); // until the host gives up
    });
    w.refused(&["capture", "-d", &address], DEVICE, &["identity", "something else answers"]);
    thread.join().unwrap();

    let (address, thread) = impostor(drop);
    w.refused(&["capture", "-d", &address], DEVICE, &["gone", "brewster fetch"]);
    thread.join().unwrap();
}

#[test]
fn a_camera_of_another_version_says_which() {
    let w = World::new();
    let (address, thread) = impostor(|mut stream| {
        let mut deframer = Deframer::new(vec![0; 4096]);
        let sequence = loop {
            let n = stream.read(deframer.space()).unwrap();
            deframer.commit(n);
            if let Some(Event::Frame(header, _)) = deframer.next_event() {
                break header.sequence;
            }
        };
        let log = Log { level: LogLevel::Info, text: "from the future".try_into().unwrap() };
        let mut frame = vec![0; 4096];
        let n = FromDevice::Log(log).encode(sequence, 7, &mut frame).unwrap();
        frame.truncate(n);
        // The version stands in byte 4; the header's CRC has to be right again.
        frame[4] = 9;
        let crc = crc32fast::hash(&frame[..28]);
        frame[28..32].copy_from_slice(&crc.to_le_bytes());
        stream.write_all(&frame).unwrap();
        stream.read_to_end(&mut Vec::new()).ok();
    });
    w.refused(&["capture", "-d", &address], DEVICE, &["version 9", "version 1", "Update this program"]);
    thread.join().unwrap();
}
