//! Requests and their answers against a camera that speaks real frames: the good path and each bad one.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod camera;

use camera::{Camera, Ending, HELD, TAKEN, camera, connect, patient, plug, quick};
use host_link::{Client, LinkError, Options};
use protocol_wire::*;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

fn small() -> Camera {
    camera(8, 8, 4)
}

fn request() -> CaptureRequest {
    CaptureRequest {
        frames: [0.0, 60.0, 120.0]
            .map(|angle_deg| FrameRequest { angle_deg, exposure_ratio: 1.0 })
            .into_iter()
            .collect(),
        exposure: Exposure::Auto,
        word: Word::I16,
        keep_raw: false,
    }
}

/// Changes the header of a sound frame and makes it sound again, at its present length.
fn reseal(frame: &mut [u8], change: impl Fn(&mut Header)) {
    let mut header = Header {
        version: VERSION,
        sequence: u16::from_le_bytes([frame[6], frame[7]]),
        session: u32::from_le_bytes(frame[8..12].try_into().unwrap()),
        key: frame[12..20].try_into().unwrap(),
        length: u32::try_from(frame.len() - HEADER_BYTES).unwrap(),
    };
    change(&mut header);
    seal(frame, header).unwrap();
}

#[test]
fn every_request_gets_its_answer() {
    let (client, running) = connect(small(), patient());
    let mut client = client.unwrap();
    let log = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&log);
    client.on_log(move |line| kept.lock().unwrap().push(line.text.to_string()));

    assert_eq!(client.identity().serial, "BW-0007");
    assert_eq!(client.status().unwrap().uptime_us, 5_000_000);
    let mut news = Vec::new();
    let id = client.capture(request(), |progress| {
        news.push(progress.unwrap().done);
        ControlFlow::Continue(())
    });
    assert_eq!(id.unwrap(), TAKEN);
    assert_eq!(news, [1, 2, 3]);
    assert_eq!(*log.lock().unwrap(), ["wheel homed"]);
    client.calibrate(Calibrate::Clear, |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(client.list().unwrap()[0].id, HELD);
    assert_eq!(client.describe(HELD).unwrap().planes.len(), 2);
    assert_eq!(client.cancel().unwrap().state, State::Idle);
    client.release(HELD).unwrap();
    assert_eq!(client.counters(), host_link::Counters::default(), "nothing went wrong on the way");
    drop(client);
    assert_eq!(running.join().unwrap().messages.len(), 8);
}

#[test]
fn garbage_and_old_frames_before_the_first_answer_are_passed_over() {
    let mut old = Vec::new();
    for sequence in [65_531, 9] {
        let mut frame = vec![0; 256];
        let status = FromDevice::Progress(Progress { stage: Stage::Exposing, done: 1, total: 2 });
        let n = status.encode(sequence ^ 0x100, 999, &mut frame).unwrap();
        old.extend_from_slice(&frame[..n]);
    }
    let fault = move |n: usize, frame: &mut Vec<u8>| {
        if n == 0 {
            let garbage: Vec<u8> =
                (0..3000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).chain(MAGIC).collect();
            *frame = [&old[..], &garbage, frame].concat();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(fault), ..small() }, patient());
    let client = client.unwrap();
    assert_eq!(client.counters().wrong_session, 2);
    assert!(client.counters().skipped_bytes >= 3000);
}

#[test]
fn a_lost_answer_is_asked_for_again() {
    let lose = |n: usize, frame: &mut Vec<u8>| {
        if n == 0 || n == 2 {
            frame.clear();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(lose), ..small() }, quick());
    let mut client = client.unwrap();
    client.status().unwrap();
    assert!(client.counters().repeated >= 2);
}

/// The camera forgot the capture, its answer was lost, and the repeated request meets a camera that knows nothing.
#[test]
fn a_release_whose_answer_was_lost_is_done() {
    let forget = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            frame.clear();
        } else if n == 2 {
            let mut other = vec![0; 128];
            let refused = FromDevice::Refused(Refused { refusal: Refusal::UnknownCapture(HELD) });
            let sequence = u16::from_le_bytes([frame[6], frame[7]]);
            let length = refused.encode(sequence, 1001, &mut other).unwrap();
            *frame = other[..length].to_vec();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(forget), ..small() }, quick());
    let mut client = client.unwrap();
    client.release(HELD).unwrap();
    assert!(matches!(client.release(CaptureId(5)), Err(LinkError::Refused(Refusal::UnknownCapture(CaptureId(5))))));
}

#[test]
fn frames_of_another_session_are_ignored_and_counted() {
    let mix = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            let mut stale = frame.clone();
            reseal(&mut stale, |header| header.session = 1000);
            stale.append(frame);
            *frame = stale;
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(mix), ..small() }, patient());
    let mut client = client.unwrap();
    client.status().unwrap();
    assert_eq!(client.counters().wrong_session, 1);
}

#[test]
fn a_camera_that_was_restarted_closes_the_session() {
    let restarted = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            let sequence = u16::from_le_bytes([frame[6], frame[7]]);
            let refused = FromDevice::Refused(Refused { refusal: Refusal::WrongSession });
            let mut other = vec![0; 128];
            let old = refused.encode(sequence - 1, 2000, &mut other).unwrap();
            *frame = other[..old].to_vec();
            let new = refused.encode(sequence, 2000, &mut other).unwrap();
            frame.extend_from_slice(&other[..new]);
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(restarted), ..small() }, patient());
    let mut client = client.unwrap();
    assert!(matches!(client.status(), Err(LinkError::Refused(Refusal::WrongSession))));
    assert_eq!(client.counters().wrong_session, 1, "one that answers something else is ignored");
}

#[test]
fn an_answer_to_something_else_is_not_taken() {
    let late = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            let status = Status { state: State::Idle, uptime_us: 1, captures: 0, free_bytes: 0, skipped_bytes: 0 };
            let sequence = u16::from_le_bytes([frame[6], frame[7]]);
            let mut old = vec![0; 128];
            let length = FromDevice::Status(status).encode(sequence - 1, 1001, &mut old).unwrap();
            *frame = [&old[..length], frame].concat();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(late), ..small() }, patient());
    let mut client = client.unwrap();
    assert_eq!(client.status().unwrap().uptime_us, 5_000_000);
    assert_eq!(client.counters().stray, 1);
}

/// A header that promises a long payload, cut off behind it: the answer behind it is found, not waited for.
#[test]
fn an_answer_behind_a_frame_cut_short_is_found() {
    let cut = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            let mut long = vec![0; 100_000];
            long[..20].copy_from_slice(&frame[..20]);
            reseal(&mut long, |_| {});
            *frame = [&long[..200], frame].concat();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(cut), ..small() }, quick());
    let mut client = client.unwrap();
    client.status().unwrap();
    assert_eq!(client.counters().skipped_bytes, 200);
}

#[test]
fn another_version_is_said_so() {
    let newer = |_: usize, frame: &mut Vec<u8>| {
        reseal(frame, |header| header.version = 2);
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(newer), ..small() }, patient());
    assert!(matches!(client, Err(LinkError::Version { theirs: 2, ours: VERSION })));
}

#[test]
fn a_message_the_camera_does_not_know_is_unsupported() {
    let (client, _running) = connect(Camera { unknown: vec![ListCaptures::KEY], ..small() }, patient());
    let error = client.unwrap().list().unwrap_err();
    assert!(
        matches!(error, LinkError::Unsupported { path: "captures/list", key } if key == ListCaptures::KEY.to_bytes())
    );
}

#[test]
fn an_answer_this_program_does_not_know_is_unsupported() {
    let rekey = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            reseal(frame, |header| header.key = [9; 8]);
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(rekey), ..small() }, patient());
    let error = client.unwrap().status().unwrap_err();
    assert!(matches!(error, LinkError::Unsupported { path: "status/get", key: [9, 9, 9, 9, 9, 9, 9, 9] }));
}

#[test]
fn a_sound_frame_that_is_not_what_its_key_says_is_malformed() {
    let lengthen = |n: usize, frame: &mut Vec<u8>| {
        if n == 1 {
            frame.push(0);
            reseal(frame, |_| {});
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(lengthen), ..small() }, patient());
    assert!(matches!(client.unwrap().status(), Err(LinkError::Malformed { path: "status" })));
}

#[test]
fn a_refusal_comes_back_with_its_reason() {
    let reason = Refusal::WheelStuck { asked_deg: 60.0, seen_deg: 1.5 };
    let (client, _running) = connect(Camera { ending: Ending::Refused(reason.clone()), ..small() }, patient());
    let error = client.unwrap().capture(request(), |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, LinkError::Refused(refusal) if refusal == reason));
}

#[test]
fn a_silent_camera_is_a_timeout_that_says_what_was_awaited() {
    let mute = |_: usize, frame: &mut Vec<u8>| {
        frame.clear();
        true
    };
    let begin = Instant::now();
    let (client, _running) = connect(Camera { fault: Box::new(mute), ..small() }, quick());
    assert!(matches!(client, Err(LinkError::Timeout { waiting_for: "identity" })));
    assert!(begin.elapsed() >= quick().reply * u32::from(quick().attempts));

    let mute_later = |n: usize, frame: &mut Vec<u8>| {
        if n > 0 {
            frame.clear();
        }
        true
    };
    let (client, _running) = connect(Camera { fault: Box::new(mute_later), ..small() }, quick());
    let error = client.unwrap().capture(request(), |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, LinkError::Timeout { waiting_for: "capture/accepted" }), "{error}");
}

#[test]
fn a_capture_whose_end_is_not_reported_is_found_complete() {
    let (client, _running) = connect(Camera { ending: Ending::Unreported, ..small() }, quick());
    let mut pauses = 0;
    let id = client.unwrap().capture(request(), |news| {
        pauses += u32::from(news.is_none());
        ControlFlow::Continue(())
    });
    assert_eq!(id.unwrap(), TAKEN);
    assert!(pauses > 0, "the caller was told of the silence");
}

#[test]
fn a_capture_without_news_ends_in_a_timeout() {
    let (client, _running) = connect(Camera { ending: Ending::Never, ..small() }, quick());
    let error = client.unwrap().capture(request(), |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, LinkError::Timeout { waiting_for: "capture/done" }));
}

#[test]
fn breaking_off_cancels_the_capture() {
    let (client, running) = connect(Camera { ending: Ending::Never, ..small() }, quick());
    let mut client = client.unwrap();
    let error = client.capture(request(), |_| ControlFlow::Break(())).unwrap_err();
    assert!(matches!(error, LinkError::Refused(Refusal::Cancelled)));
    assert_eq!(client.status().unwrap().state, State::Idle);
    drop(client);
    let cancels = running.join().unwrap().messages.iter().filter(|m| matches!(m, FromHost::Cancel(_))).count();
    assert_eq!(cancels, 1);
}

#[test]
fn a_long_exposure_is_waited_for() {
    let (client, _running) = connect(Camera { ending: Ending::Never, ..small() }, quick());
    let begin = Instant::now();
    let long = CaptureRequest { exposure: Exposure::Fixed(300_000), ..request() };
    let error = client.unwrap().capture(long, |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, LinkError::Timeout { .. }));
    assert!(begin.elapsed() >= quick().work + Duration::from_millis(300));
}

#[test]
fn an_unplugged_camera_is_gone() {
    let (client, _running) = connect(Camera { fault: Box::new(|n, _| n < 1), ..small() }, patient());
    let mut client = client.unwrap();
    client.status().unwrap();
    assert!(matches!(client.status(), Err(LinkError::Gone)));
}

#[test]
fn the_name_given_to_the_camera_is_cut_between_characters() {
    let (host, running) = plug(small());
    let long = "ångström-é".repeat(5);
    drop(Client::connect_with(host, &long, Options::default()).unwrap());
    let messages = running.join().unwrap().messages;
    assert!(
        matches!(&messages[..], [FromHost::Identify(i)] if i.host.len() >= 31 && long.starts_with(i.host.as_str()))
    );
}
