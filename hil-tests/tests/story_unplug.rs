//! Cables are pulled, power is cut, lines are noisy, and hosts come that should not: no capture is lost and none is
//! believed that is not whole.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use boards::Board;
use firmware_core::{FrameSource, Wheel};
use firmware_emulator::{Camera, Clock, TcpPort, uniform};
use hil_tests::{Bench, Cut, Faults, Faulty, Fetched, board_of, capture_request, options};
use host_link::in_process::HostEnd;
use host_link::tcp::Tcp;
use host_link::{Client, LinkError, Options, PlaneBuffer, Transport};
use protocol_polar::Degrees;
use protocol_wire::{
    CaptureId, CaptureRequest, Deframer, Event, Exposure, FromDevice, FromHost, GetStatus, HEADER_BYTES, Header,
    Identify, Name, PlaneKind, Progress, Refusal, Stage, State, VERSION, seal,
};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

const CONTINUE: ControlFlow<()> = ControlFlow::Continue(());
const LONG: Duration = Duration::from_secs(10);

fn request() -> CaptureRequest {
    capture_request(&[0.0, 60.0, 120.0], Exposure::Fixed(10_000))
}

fn camera_of(board: &Board, clock: &Clock) -> Camera<impl Wheel + Send + 'static, impl FrameSource + Send + 'static> {
    let field = uniform(board.sensor.width_px, board.sensor.height_px, 2000.0, 0.6, Degrees(25.0));
    Camera::analytic(board, field, clock.clone()).unwrap()
}

/// A camera of 320 x 240, and its clock.
fn bench() -> (Bench, Clock) {
    let clock = Clock::virtual_time();
    (Bench::start(camera_of(&board_of(320, 240), &clock)), clock)
}

/// A camera in real time with a wheel that is quick enough for a story and slow enough to be interrupted.
fn brisk() -> Board {
    let mut board = board_of(320, 240);
    (board.wheel.servo.slew_deg_per_s, board.wheel.servo.settle_ms) = (3000.0, 10);
    board
}

fn until_idle(client: &mut Client<HostEnd>) {
    let limit = Instant::now() + LONG;
    while client.status().unwrap().state != State::Idle {
        assert!(Instant::now() < limit, "still at work");
    }
}

#[test]
fn a_capture_goes_on_without_its_host() {
    let (bench, _) = bench();
    // Identity and the answer to the request pass; the cable is pulled among the reports that follow.
    let cable = bench.cable_through(|wire| Cut::new(wire, 450));
    let mut client = Client::connect_with(cable, "story", options()).unwrap();
    let mut reports = 0;
    let lost = client.capture(request(), |news| {
        reports += usize::from(news.is_some());
        CONTINUE
    });
    assert!(matches!(lost, Err(LinkError::Gone)), "{lost:?}");
    assert!((1..8).contains(&reports), "in the middle of the capture, after {reports} reports");
    let mut client = bench.connect();
    until_idle(&mut client);
    let [held] = client.list().unwrap()[..] else { panic!("one capture is held") };
    assert_eq!(Fetched::fetch(&mut client, held.id).replay().differing, 0);
}

#[test]
fn a_transfer_goes_on_where_it_was_cut() {
    let (bench, _) = bench();
    let id = bench.connect().capture(request(), |_| CONTINUE).unwrap();
    let strip_bytes = 320 * 32 * 2;
    let cable = bench.cable_through(|wire| Cut::new(wire, 4 * strip_bytes));
    let mut client = Client::connect_with(cable, "story", options()).unwrap();
    let description = client.describe(id).unwrap();
    let mut plane = PlaneBuffer::new(&description, PlaneKind::S1).unwrap();
    assert_eq!(plane.info().strips, 8);
    let cut = client.fetch_plane(&description, &mut plane, |_, _| {});
    assert!(matches!(cut, Err(LinkError::Gone)), "{cut:?}");
    let missing = plane.missing();
    assert!((1..8).contains(&missing) && plane.bytes().is_none(), "{missing} strips are missing");
    // The host comes back and asks for the rest only.
    let mut client = bench.connect();
    assert_eq!(client.list().unwrap().len(), 1, "kept, though its host had gone");
    let again = client.describe(id).unwrap();
    assert_eq!(again, description);
    let mut strips = 0;
    client.fetch_plane(&again, &mut plane, |_, _| strips += 1).unwrap();
    assert_eq!(strips, missing);
    assert_eq!(client.counters().duplicate_strips, 0);
    let whole = Fetched::fetch(&mut client, id);
    assert!(plane.bytes() == Some(whole.bytes(PlaneKind::S1)));
    assert_eq!(whole.replay().differing, 0);
    assert_eq!(client.list().unwrap().len(), 1, "not forgotten before it is released");
    client.release(id).unwrap();
    assert_eq!(client.list().unwrap(), []);
    let unknown = client.describe(id);
    assert!(matches!(unknown, Err(LinkError::Refused(Refusal::UnknownCapture(at))) if at == id), "{unknown:?}");
}

#[test]
fn a_power_cut_loses_only_what_was_not_finished() {
    let (board, clock) = (brisk(), Clock::real_time());
    let bench = Bench::start(camera_of(&board, &clock));
    let mut client = bench.connect();
    let id = client.capture(request(), |_| CONTINUE).unwrap();
    let before = Fetched::fetch(&mut client, id);
    // A second one is under way when the power goes.
    let cable = bench.cable_through(|wire| Cut::new(wire, 400));
    let mut client = Client::connect_with(cable, "story", options()).unwrap();
    let slow = capture_request(&[0.0, 30.0, 60.0, 90.0, 120.0, 150.0], Exposure::Fixed(30_000));
    assert!(matches!(client.capture(slow, |_| CONTINUE), Err(LinkError::Gone)));
    let store = bench.power_cut();
    assert_eq!(store.len(), 2, "the second had its place");
    let bench = Bench::start(camera_of(&board, &clock).with_store(store));
    let mut client = bench.connect();
    let listed: Vec<CaptureId> = client.list().unwrap().iter().map(|held| held.id).collect();
    assert_eq!(listed, [id]);
    let after = Fetched::fetch(&mut client, id);
    assert!(after.bytes(PlaneKind::S0) == before.bytes(PlaneKind::S0) && after.description == before.description);
    let next = client.capture(request(), |_| CONTINUE).unwrap();
    assert!(!listed.contains(&next), "{next:?} names another capture: {listed:?}");
}

#[test]
fn a_noisy_line_costs_time_never_truth() {
    let (bench, _) = bench();
    let noise = Faults::none(11);
    let cable = bench.cable_through(|wire| Faulty::new(wire, &noise));
    let quick = Options { reply: Duration::from_millis(60), attempts: 50, ..options() };
    let mut client = Client::connect_with(cable, "story", quick).unwrap();
    let id = client.capture(request(), |_| CONTINUE).unwrap();
    noise.at_rate(150);
    let fetched = Fetched::fetch(&mut client, id);
    noise.repair();
    let counters = client.counters();
    assert!(noise.struck() > 5 && counters.repeated > 0, "{} struck, {counters:?}", noise.struck());
    assert_eq!(fetched.replay().differing, 0, "{counters:?}");
}

#[test]
fn garbage_and_a_torn_command_are_skipped() {
    let (bench, clock) = bench();
    let mut cable = bench.cable();
    cable.write_all(&[0xC5; 3000], LONG).unwrap();
    cable.write_all(b"GET / HTTP/1.1\r\nHost: camera\r\n\r\n", LONG).unwrap();
    // A sound header whose payload never comes.
    let mut torn = [0; 512];
    let length = FromHost::Identify(Identify { host: "torn".try_into().unwrap() }).encode(1, 0, &mut torn).unwrap();
    cable.write_all(&torn[..length - 3], LONG).unwrap();
    // The line falls silent (the camera's clock is virtual, so silence must be given to it).
    std::thread::sleep(Duration::from_millis(50));
    clock.wait(Duration::from_secs(2));
    let mut client = Client::connect_with(cable, "story", options()).unwrap();
    let skipped = client.status().unwrap().skipped_bytes;
    assert!(skipped > 3000, "{skipped}");
    assert!(client.capture(request(), |_| CONTINUE).is_ok());
}

/// Reads frames until `pick` takes one.
fn answer<R>(cable: &mut HostEnd, pick: impl Fn(Header, &[u8]) -> Option<R>) -> R {
    let mut deframer = Deframer::new(vec![0; 4096]);
    let limit = Instant::now() + LONG;
    while Instant::now() < limit {
        let n = cable.read(deframer.space(), Duration::from_millis(20)).unwrap();
        deframer.commit(n);
        while let Some(event) = deframer.next_event() {
            if let Event::Frame(header, payload) = event
                && let Some(found) = pick(header, payload)
            {
                return found;
            }
        }
    }
    panic!("no answer");
}

#[test]
fn a_host_of_another_version_is_told_so() {
    let (bench, _) = bench();
    let mut cable = bench.cable();
    let theirs = Header { version: VERSION + 1, sequence: 77, session: 0, key: Identify::KEY.to_bytes(), length: 4 };
    let mut frame = [0; HEADER_BYTES + 4];
    seal(&mut frame, theirs).unwrap();
    cable.write_all(&frame, LONG).unwrap();
    let refusal = answer(&mut cable, |header, payload| match FromDevice::decode(header.key, payload) {
        Ok(Some(FromDevice::Refused(refused))) if header.sequence == 77 => Some((header.version, refused.refusal)),
        _ => None,
    });
    assert_eq!(refusal, (VERSION, Refusal::Unsupported { key: theirs.key }));
    // One of our version that has not said who it is gets an answer too.
    let mut frame = [0; 64];
    let length = FromHost::GetStatus(GetStatus).encode(78, 9, &mut frame).unwrap();
    cable.write_all(&frame[..length], LONG).unwrap();
    let refusal = answer(&mut cable, |header, payload| match FromDevice::decode(header.key, payload) {
        Ok(Some(FromDevice::Refused(refused))) if header.sequence == 78 => Some(refused.refusal),
        _ => None,
    });
    assert_eq!(refusal, Refusal::WrongSession);
    assert!(Client::connect_with(cable, "story", options()).is_ok());
}

#[test]
fn a_second_host_waits_for_the_first() {
    let port = TcpPort::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let address = port.address().unwrap().to_string();
    let _running = camera_of(&board_of(64, 64), &Clock::virtual_time()).spawn(port).unwrap();
    let quick = Options { reply: Duration::from_millis(50), attempts: 2, ..options() };
    let tcp = || Tcp::connect(&address, LONG).unwrap();
    let mut first = Client::connect_with(tcp(), "first", options()).unwrap();
    let shut_out = Client::connect_with(tcp(), "second", quick);
    assert!(matches!(shut_out, Err(LinkError::Timeout { waiting_for: "identity" })), "{shut_out:?}");
    assert_eq!(first.status().unwrap().state, State::Idle, "the first is not disturbed");
    let waiting = tcp();
    let patient = std::thread::spawn(move || Client::connect_with(waiting, "third", options()));
    let id = first.capture(request(), |_| CONTINUE).unwrap();
    drop(first);
    let mut third = patient.join().unwrap().unwrap();
    assert_eq!(third.list().unwrap()[0].id, id);
}

#[test]
fn a_full_store_is_told_before_anything_moves() {
    let clock = Clock::virtual_time();
    let mut board = board_of(256, 240);
    board.memory.budget_mb = 1;
    let bench = Bench::start(camera_of(&board, &clock));
    let mut client = bench.connect();
    // Six 16-bit planes of 61 440 values and the flags do not fit twice.
    let id = client.capture(request(), |_| CONTINUE).unwrap();
    let before = clock.elapsed();
    let full = client.capture(request(), |_| CONTINUE);
    let Err(LinkError::Refused(Refusal::StorageFull { needed, free })) = full else { panic!("{full:?}") };
    assert!(needed > free && free < 1_000_000, "{needed} {free}");
    assert_eq!(clock.elapsed(), before, "no motion, no exposure");
    client.release(id).unwrap();
    assert!(client.capture(request(), |_| CONTINUE).is_ok());
}

#[test]
fn a_cancelled_capture_leaves_nothing() {
    let bench = Bench::start(camera_of(&brisk(), &Clock::real_time()));
    let mut client = bench.connect();
    let free = client.status().unwrap().free_bytes;
    let slow = capture_request(&[0.0, 30.0, 60.0, 90.0, 120.0, 150.0], Exposure::Fixed(30_000));
    let mut reports: Vec<Progress> = Vec::new();
    let cancelled = client.capture(slow, |news| {
        reports.extend(news);
        ControlFlow::Break(())
    });
    assert!(matches!(cancelled, Err(LinkError::Refused(Refusal::Cancelled))), "{cancelled:?} after {reports:?}");
    assert!(reports.iter().all(|report| report.stage == Stage::Exposing && report.done < 6), "{reports:?}");
    assert_eq!(client.list().unwrap(), []);
    assert_eq!(client.status().unwrap().free_bytes, free);
    assert!(client.capture(request(), |_| CONTINUE).is_ok());
}

/// A camera that lost its memory takes the same capture of the same light under the same name: its strips do not complete
/// the first one, however alike everything else is.
#[test]
fn strips_of_another_start_do_not_complete_a_capture() {
    let (board, clock) = (board_of(320, 240), Clock::virtual_time());
    let bench = Bench::start(camera_of(&board, &clock));
    let mut client = bench.connect();
    let id = client.capture(request(), |_| CONTINUE).unwrap();
    let mut plane = PlaneBuffer::new(&client.describe(id).unwrap(), PlaneKind::S0).unwrap();
    drop(bench.power_cut());

    let mut camera = camera_of(&board, &Clock::virtual_time());
    camera.setup.boot = 2;
    let bench = Bench::start(camera);
    let mut client = bench.connect();
    assert_eq!(client.capture(request(), |_| CONTINUE).unwrap(), id, "the name comes again");
    let again = client.describe(id).unwrap();
    let error = client.fetch_plane(&again, &mut plane, |_, _| {}).unwrap_err();
    assert!(matches!(error, LinkError::OtherCapture { .. }), "{error}");
    let mut own = PlaneBuffer::new(&again, PlaneKind::S0).unwrap();
    client.fetch_plane(&again, &mut own, |_, _| {}).unwrap();
}
