//! A capture, from the wheel to the host: the integers are those of the definition, within the proved bound of exact least
//! squares, and every transport carries the same bytes.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use firmware_emulator::{Camera, Clock, Port, TcpPort, UnixPort, wheel_chart};
use hil_tests::{Bench, Conversation, Fetched, Tap, board, board_of, capture_request, options};
use host_link::tcp::Tcp;
use host_link::unix::Unix;
use host_link::{Client, Transport};
use protocol_polar::{Degrees, Flags, Radians, Stokes};
use protocol_wire::{Exposure, PlaneKind, Word};
use std::ops::ControlFlow;
use std::time::Duration;

const CONTINUE: ControlFlow<()> = ControlFlow::Continue(());

#[test]
fn the_stored_integers_are_the_definition_and_within_the_bound() {
    let board = board_of(320, 240);
    let field = wheel_chart(320, 240);
    let bench = Bench::start(Camera::analytic(&board, field, Clock::virtual_time()).unwrap());
    let mut client = bench.connect();
    let mut clipped = 0;
    for (word, angles) in [
        (Word::I16, &[0.0, 60.0, 120.0][..]),
        (Word::I32, &[0.0, 45.0, 90.0, 135.0]),
        (Word::I16, &[0.0, 36.0, 72.0, 108.0, 144.0]),
    ] {
        let mut request = capture_request(angles, Exposure::Fixed(10_000));
        request.word = word;
        let mut stages = Vec::new();
        let id = client
            .capture(request, |news| {
                stages.extend(news.map(|progress| progress.stage));
                CONTINUE
            })
            .unwrap();
        let fetched = Fetched::fetch(&mut client, id);
        let replayed = fetched.replay();
        assert_eq!((replayed.photosites, replayed.differing), (320 * 240, 0), "{replayed:?}");
        assert!(fetched.description.frames.iter().all(|frame| frame.measured));
        assert!(stages.len() >= angles.len(), "{stages:?}");
        let worst = fetched.worst_of_bound();
        assert!(worst <= 1.0 && worst > 0.4, "{word:?}: at {worst} of the bound");
        clipped += fetched.flags().iter().filter(|flags| flags.contains(Flags::SATURATED)).count();
        client.release(id).unwrap();
        assert_eq!(client.list().unwrap(), []);
    }
    assert!(clipped > 10, "the lamps were to clip: {clipped}");
}

#[test]
fn the_chart_is_seen_as_it_is() {
    let clock = Clock::virtual_time();
    let bench = Bench::start(Camera::analytic(&board(), wheel_chart(1280, 960), clock.clone()).unwrap());
    let mut client = bench.connect();
    let id = client.capture(capture_request(&[0.0, 60.0, 120.0], Exposure::Auto), |_| CONTINUE).unwrap();
    let fetched = Fetched::fetch(&mut client, id);
    let [s0, s1, s2] = [0, 1, 2].map(|component| fetched.stokes_dn(component));
    // Twelve directions from the hub, in the middle of each sector's outermost ring; rows run down.
    for k in 0..12 {
        let direction = f64::from(k) * std::f64::consts::FRAC_PI_6;
        let (x, y) = (640.0 + 328.0 * direction.cos(), 422.4 - 328.0 * direction.sin());
        let mut sum = [0.0; 3];
        for dy in -8..=8_i32 {
            for dx in -8..=8_i32 {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside the picture")]
                let at = ((y as i32 + dy) * 1280 + x as i32 + dx) as usize;
                sum = [sum[0] + s0[at], sum[1] + s1[at], sum[2] + s2[at]];
            }
        }
        let seen = Stokes([sum[0], sum[1], sum[2], 0.0]);
        let off = seen.aolp().axis_difference(Radians(direction)).to_degrees();
        assert!(off.0.abs() < 0.3, "sector {k}: {off:?}");
        assert!((seen.dolp() - 0.95).abs() < 0.01, "sector {k}: {}", seen.dolp());
    }
    assert!(clock.elapsed() > Duration::from_secs(1), "the wheel and the exposures took their (virtual) time");
}

#[test]
fn every_transport_carries_the_same_bytes() {
    let in_process = {
        let bench = Bench::start(small_camera());
        converse(bench.cable())
    };
    let tcp = {
        let port = TcpPort::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let address = port.address().unwrap().to_string();
        let _running = small_camera().spawn(port).unwrap();
        converse(Tcp::connect(&address, Duration::from_secs(5)).unwrap())
    };
    let unix = {
        let path = std::env::temp_dir().join(format!("brewster-{}.sock", std::process::id()));
        let port = UnixPort::bind(path.clone()).unwrap();
        let running = small_camera().spawn(port).unwrap();
        let said = converse(Unix::connect(&path).unwrap());
        drop(running);
        assert!(!path.exists(), "the socket's file goes with the camera");
        said
    };
    assert!(in_process.camera.len() > 320 * 240 * 2 * 6, "{} bytes", in_process.camera.len());
    assert_eq!(in_process.host, tcp.host);
    assert!(in_process.camera == tcp.camera, "{} and {} bytes", in_process.camera.len(), tcp.camera.len());
    assert!(in_process == unix);
}

#[test]
fn only_this_machine_is_let_in() {
    let refused = TcpPort::bind("0.0.0.0:0".parse().unwrap()).unwrap_err();
    assert!(refused.to_string().contains("not a loopback address"), "{refused}");
    let mut port = TcpPort::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    assert!(port.link().is_none());
}

fn small_camera() -> Camera<impl firmware_core::Wheel + Send + 'static, impl firmware_core::FrameSource + Send + 'static>
{
    Camera::analytic(&board_of(320, 240), wheel_chart(320, 240), Clock::virtual_time()).unwrap()
}

fn converse(transport: impl Transport) -> Conversation {
    let (tap, said) = Tap::new(transport);
    let mut client = Client::connect_with(tap, "story", options()).unwrap();
    let id = client.capture(capture_request(&[0.0, 60.0, 120.0], Exposure::Auto), |_| CONTINUE).unwrap();
    let fetched = Fetched::fetch(&mut client, id);
    assert_eq!(fetched.bytes(PlaneKind::S1).len(), 320 * 240 * 2);
    assert!((fetched.description.frames[1].asked_deg - Degrees(60.0).0).abs() < 1e-12);
    client.release(id).unwrap();
    client.status().unwrap();
    drop(client);
    let said = said.lock().unwrap();
    said.clone()
}

/// The preview planes of light at 30° and DoLP 0.6, from either word, strips that end in the middle of a square included.
#[test]
fn previews_show_the_light() {
    let field = firmware_emulator::uniform(330, 250, 3000.0, 0.6, Degrees(30.0));
    let bench = Bench::start(Camera::analytic(&board_of(330, 250), field, Clock::virtual_time()).unwrap());
    let mut client = bench.connect();
    for word in [Word::I16, Word::I32] {
        let mut request = capture_request(&[0.0, 60.0, 120.0], Exposure::Auto);
        request.word = word;
        let id = client.capture(request, |_| CONTINUE).unwrap();
        let fetched = Fetched::fetch(&mut client, id);
        let (dolp, aolp) = (fetched.bytes(PlaneKind::PreviewDolp), fetched.bytes(PlaneKind::PreviewAolp));
        assert_eq!((dolp.len(), aolp.len()), (165 * 125, 165 * 125));
        // 256 units are a DoLP of 1, and 180°. Noise: four photosites to a square.
        let mean = |plane: &[u8]| plane.iter().map(|v| f64::from(*v)).sum::<f64>() / plane.len() as f64;
        assert!((mean(dolp) - (0.6 * 256.0 - 0.5)).abs() < 1.0, "{word:?}: {}", mean(dolp));
        assert!((mean(aolp) - (30.0 / 180.0 * 256.0 - 0.5)).abs() < 1.0, "{word:?}: {}", mean(aolp));
        assert!(dolp.iter().all(|v| (130..180).contains(v)) && aolp.iter().all(|v| (35..50).contains(v)));
    }
}
