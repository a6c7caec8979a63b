//! Planes strip by strip: what is lost, doubled, damaged or cut off on the way, and in the camera's own storage.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod camera;

use camera::{Camera, HELD, Report, camera, connect, patient, quick};
use host_link::in_process::HostEnd;
use host_link::{Client, LinkError, Options, PlaneBuffer};
use proptest::prelude::*;
use protocol_wire::*;
use std::thread::JoinHandle;
use std::time::Duration;

/// 23 strips of two rows (the last of one).
fn plane_camera() -> Camera {
    camera(31, 45, 2)
}

const STRIPS: u16 = 23;
/// The camera's frames before the first strip: identity and description.
const BEFORE_STRIPS: usize = 2;

/// Index of a strip, read off the encoded frame (capture, plane and index are one byte each here).
fn index_of(frame: &[u8]) -> u8 {
    frame[HEADER_BYTES + 2]
}

fn begin(camera: Camera, options: Options) -> (Client<HostEnd>, CaptureDescription, PlaneBuffer, JoinHandle<Report>) {
    let (client, running) = connect(camera, options);
    let mut client = client.unwrap();
    let description = client.describe(HELD).unwrap();
    let plane = PlaneBuffer::new(&description, PlaneKind::S0).unwrap();
    (client, description, plane, running)
}

#[test]
fn a_plane_comes_as_it_was_and_each_strip_once() {
    let want = plane_camera().planes;
    let (mut client, description, mut plane, running) = begin(plane_camera(), patient());
    assert_eq!(plane.bytes(), None);
    let mut steps = Vec::new();
    client.fetch_plane(&description, &mut plane, |done, all| steps.push((done, all))).unwrap();
    assert_eq!(steps, (1..=STRIPS).map(|done| (done, STRIPS)).collect::<Vec<_>>());
    assert_eq!(plane.bytes(), Some(&want[0][..]));
    client.fetch_plane(&description, &mut plane, |_, _| panic!("there is nothing left to fetch")).unwrap();
    assert_eq!(plane.into_bytes().as_ref(), Some(&want[0]));

    let mut flags = PlaneBuffer::new(&description, PlaneKind::Flags).unwrap();
    client.fetch_plane(&description, &mut flags, |_, _| {}).unwrap();
    assert_eq!(flags.bytes(), Some(&want[1][..]));
    assert_eq!(client.counters(), host_link::Counters::default());
    drop(client);
    let report = running.join().unwrap();
    assert_eq!(report.strips_sent, (0..STRIPS).chain(0..STRIPS).collect::<Vec<_>>());
    assert!(report.most_credit <= quick().window, "{} strips were on their way", report.most_credit);
}

#[test]
fn lost_bytes_cost_only_the_strips_they_hit() {
    let lose = |n: usize, frame: &mut Vec<u8>| {
        match n.checked_sub(BEFORE_STRIPS) {
            Some(3) => drop(frame.drain(40..60)),
            Some(7) => frame.clear(),
            Some(9) => drop(frame.drain(..10)),
            _ => {}
        }
        true
    };
    let want = plane_camera().planes;
    let (mut client, description, mut plane, running) =
        begin(Camera { fault: Box::new(lose), ..plane_camera() }, patient());
    client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap();
    assert_eq!(plane.bytes(), Some(&want[0][..]));
    drop(client);
    let sent = running.join().unwrap().strips_sent;
    assert_eq!(sent[..usize::from(STRIPS)], (0..STRIPS).collect::<Vec<_>>());
    assert_eq!(sent[usize::from(STRIPS)..], [3, 7, 9], "only what was lost is sent again");
}

#[test]
fn the_last_strip_lost_is_asked_for_after_a_silence() {
    let lose = |n: usize, frame: &mut Vec<u8>| {
        if n == BEFORE_STRIPS + usize::from(STRIPS) - 1 {
            frame.truncate(50);
        }
        true
    };
    let want = plane_camera().planes;
    let (mut client, description, mut plane, running) =
        begin(Camera { fault: Box::new(lose), ..plane_camera() }, quick());
    client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap();
    assert_eq!(plane.bytes(), Some(&want[0][..]));
    drop(client);
    let again = &running.join().unwrap().strips_sent[usize::from(STRIPS)..];
    assert!(!again.is_empty() && again.iter().all(|index| *index == STRIPS - 1), "{again:?}");
}

#[test]
fn a_strip_that_comes_twice_is_taken_once() {
    let double = |n: usize, frame: &mut Vec<u8>| {
        if n >= BEFORE_STRIPS {
            frame.extend_from_within(..);
        }
        true
    };
    let want = plane_camera().planes;
    let (mut client, description, mut plane, _running) =
        begin(Camera { fault: Box::new(double), ..plane_camera() }, patient());
    let mut calls = 0;
    client.fetch_plane(&description, &mut plane, |_, _| calls += 1).unwrap();
    assert_eq!((plane.bytes(), calls), (Some(&want[0][..]), STRIPS));
    // The last copy may still be on its way when the plane is whole.
    assert!(client.counters().duplicate_strips >= u64::from(STRIPS) - 1);
}

#[test]
fn values_without_their_crc_are_asked_for_again_and_then_given_up() {
    let want = plane_camera().planes;
    let twice = Camera { rotten: [(4, 2)].into(), ..plane_camera() };
    let (mut client, description, mut plane, _running) = begin(twice, patient());
    client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap();
    assert_eq!(plane.bytes(), Some(&want[0][..]));
    assert_eq!(client.counters().corrupt_strips, 2);

    let always = Camera { rotten: [(4, u8::MAX)].into(), ..plane_camera() };
    let (mut client, description, mut plane, _running) = begin(always, patient());
    let error = client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap_err();
    assert!(matches!(error, LinkError::CorruptStrip { plane: PlaneKind::S0, index: 4 }), "{error}");
    assert_eq!((plane.missing(), plane.bytes()), (1, None), "the other strips are kept");
}

#[test]
fn an_unplugged_fetch_goes_on_with_the_missing_strips_only() {
    let want = plane_camera().planes;
    let unplug = |n: usize, frame: &mut Vec<u8>| {
        if n == BEFORE_STRIPS + 4 {
            frame.clear(); // strip 4 is lost before
        }
        if n == BEFORE_STRIPS + 11 {
            frame.truncate(60);
        }
        n < BEFORE_STRIPS + 11
    };
    let (mut client, description, mut plane, _running) =
        begin(Camera { fault: Box::new(unplug), ..plane_camera() }, patient());
    assert!(matches!(client.fetch_plane(&description, &mut plane, |_, _| {}), Err(LinkError::Gone)));
    assert_eq!(plane.missing(), STRIPS - 10);

    let (client, running) = connect(Camera { session: 1002, ..plane_camera() }, patient());
    let mut client = client.unwrap();
    let again = client.describe(HELD).unwrap();
    client.fetch_plane(&again, &mut plane, |_, _| {}).unwrap();
    assert_eq!(plane.bytes(), Some(&want[0][..]));
    drop(client);
    let resumed: Vec<u16> = [4].into_iter().chain(11..STRIPS).collect();
    assert_eq!(running.join().unwrap().strips_sent, resumed);
}

#[test]
fn another_capture_of_the_same_name_is_not_mixed_in() {
    let (_client, _, mut plane, _running) = begin(plane_camera(), patient());
    let mut other = plane_camera();
    other.description.bound_dn = [0.5; 3];
    let (mut client, description, _, _running) = begin(other, patient());
    let error = client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap_err();
    assert!(matches!(error, LinkError::OtherCapture { id: HELD }));
}

#[test]
fn a_plane_that_is_not_there_is_an_error_before_anything_is_asked() {
    let (_client, mut description, _, _running) = begin(plane_camera(), patient());
    let error = PlaneBuffer::new(&description, PlaneKind::S2).unwrap_err();
    assert!(matches!(error, LinkError::NoPlane { id: HELD, plane: PlaneKind::S2 }));
    description.planes[0].strips += 1;
    let error = PlaneBuffer::new(&description, PlaneKind::S0).unwrap_err();
    assert!(matches!(error, LinkError::BadPlane { plane: PlaneKind::S0, .. }));
}

#[test]
fn a_strip_that_contradicts_its_plane_is_malformed() {
    // The camera's idea of the plane is other than the one it described.
    let reshape = |n: usize, frame: &mut Vec<u8>| {
        if n == BEFORE_STRIPS + 1 {
            let sequence = u16::from_le_bytes([frame[6], frame[7]]);
            let header = StripHeader {
                id: HELD,
                plane: PlaneKind::S0,
                index: STRIPS,
                rows: 2,
                coding: Coding::Raw,
                values_crc: 0,
            };
            frame.resize(128, 0);
            let n = header.encode(sequence, 1001, frame, |_| Ok::<_, FrameError>(0)).unwrap();
            frame.truncate(n);
        }
        true
    };
    let (mut client, description, mut plane, _running) =
        begin(Camera { fault: Box::new(reshape), ..plane_camera() }, patient());
    let error = client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap_err();
    assert!(matches!(error, LinkError::Malformed { path: "strip" }));
}

#[test]
fn a_fetch_that_brings_nothing_new_ends() {
    let lose = |n: usize, frame: &mut Vec<u8>| {
        if n >= BEFORE_STRIPS && index_of(frame) == 6 {
            frame.clear();
        }
        true
    };
    let (mut client, description, mut plane, _running) =
        begin(Camera { fault: Box::new(lose), ..plane_camera() }, quick());
    let error = client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap_err();
    assert!(matches!(error, LinkError::Timeout { waiting_for: "strip" }), "{error}");
    assert_eq!(plane.missing(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Bytes lost, changed and added anywhere in the camera's stream: the plane comes right or not at all.
    #[test]
    fn no_damage_makes_a_wrong_plane(hits in prop::collection::btree_map(0..60_usize, (0..3_u8, any::<u16>(), 1..200_u8), 0..20)) {
        let fault = move |n: usize, frame: &mut Vec<u8>| {
            if let Some((kind, at, amount)) = hits.get(&n) {
                let at = usize::from(*at) % frame.len();
                match kind {
                    0 => drop(frame.drain(at..(at + usize::from(*amount)).min(frame.len()))),
                    1 => frame[at] ^= amount,
                    _ => drop(frame.splice(at..at, vec![*amount; usize::from(*amount)])),
                }
            }
            true
        };
        let camera = Camera { fault: Box::new(fault), ..plane_camera() };
        let want = camera.planes[0].clone();
        let (host, _running) = camera::plug(camera);
        let options = Options { reply: Duration::from_millis(15), attempts: 8, ..quick() };
        let mut client = Client::connect_with(host, "test", options).unwrap();
        let description = client.describe(HELD).unwrap();
        let mut plane = PlaneBuffer::new(&description, PlaneKind::S0).unwrap();
        match client.fetch_plane(&description, &mut plane, |_, _| {}) {
            Ok(()) => prop_assert_eq!(plane.bytes(), Some(&want[..])),
            Err(error) => prop_assert!(matches!(error, LinkError::Timeout { .. }), "{}", error),
        }
    }

    /// Whatever a camera that is none sends, the client neither panics nor takes it for one.
    #[test]
    fn noise_is_never_a_camera(noise in prop::collection::vec(any::<u8>(), 0..3000)) {
        let (host, mut device) = host_link::in_process::pair(1 << 16);
        device.write(&noise).unwrap();
        let options = Options { reply: Duration::from_millis(1), attempts: 2, ..quick() };
        let error = Client::connect_with(host, "test", options).unwrap_err();
        prop_assert!(matches!(error, LinkError::Timeout { waiting_for: "identity" }), "{}", error);
    }
}
