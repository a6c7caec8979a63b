//! What holds for all messages: they come back as they went, and nothing but a message is taken for one.

mod samples;

use proptest::prelude::*;
use protocol_wire::*;
use samples::{list, text};

/// Key and payload of an encoded frame, read back the way a receiver does.
fn payload(frame: &[u8]) -> ([u8; 8], Vec<u8>) {
    let mut deframer = Deframer::new(vec![0; HEADER_BYTES + MAX_PAYLOAD]);
    deframer.space()[..frame.len()].copy_from_slice(frame);
    deframer.commit(frame.len());
    match deframer.next_event() {
        Some(Event::Frame(header, payload)) => {
            assert_eq!((header.sequence, header.session), (0x4321, 0x8765_4321));
            (header.key, payload.to_vec())
        }
        other => panic!("{other:?}"),
    }
}

macro_rules! payload_of {
    ($message:expr) => {{
        let mut buffer = vec![0; 8192];
        let n = $message.encode(0x4321, 0x8765_4321, &mut buffer).unwrap();
        payload(&buffer[..n])
    }};
}

fn all_payloads() -> Vec<([u8; 8], Vec<u8>)> {
    let host = samples::from_host().into_iter().map(|m| payload_of!(m));
    host.chain(samples::from_device().into_iter().map(|m| payload_of!(m))).collect()
}

#[test]
fn every_sample_comes_back() {
    for message in samples::from_host() {
        let (key, bytes) = payload_of!(message);
        assert_eq!(FromHost::decode(key, &bytes), Ok(Some(message)));
        assert_eq!(FromDevice::decode(key, &bytes), Ok(None), "a host's message is none of the camera's");
    }
    for message in samples::from_device() {
        let (key, bytes) = payload_of!(message);
        assert_eq!(FromDevice::decode(key, &bytes), Ok(Some(message)));
        assert_eq!(FromHost::decode(key, &bytes), Ok(None), "a camera's message is none of the host's");
    }
}

#[test]
fn a_truncated_or_lengthened_payload_is_malformed() {
    let decode = |key, bytes: &[u8]| match FromHost::decode(key, bytes) {
        Ok(None) => FromDevice::decode(key, bytes).map(|m| m.is_some()),
        other => other.map(|m| m.is_some()),
    };
    for (key, bytes) in all_payloads() {
        assert_eq!(decode(key, &bytes), Ok(true));
        for cut in 0..bytes.len() {
            assert_eq!(decode(key, &bytes[..cut]), Err(FrameError::Malformed), "{cut} of {} bytes", bytes.len());
        }
        let longer = [&bytes[..], &[0]].concat();
        assert_eq!(decode(key, &longer), Err(FrameError::Malformed));
    }
}

#[test]
fn an_unknown_key_is_no_message() {
    let mut key = Grant::KEY.to_bytes();
    key[3] ^= 1;
    assert_eq!(FromHost::decode(key, &[1]), Ok(None));
    assert_eq!(FromDevice::decode(key, &[1]), Ok(None));
    assert_eq!(Strip::decode(key, &[1]), Ok(None));
}

#[test]
fn what_exceeds_its_bound_is_malformed_not_cut() {
    let refused = Refused::KEY.to_bytes();
    let out_of_range = |length: u8| [&[8, length][..], &vec![b'a'; usize::from(length)]].concat();
    assert!(matches!(FromDevice::decode(refused, &out_of_range(32)), Ok(Some(_))));
    assert_eq!(FromDevice::decode(refused, &out_of_range(33)), Err(FrameError::Malformed));

    let one = postcard::to_slice(
        &CaptureSummary { id: CaptureId(1), state: CaptureState::Running, frames: 3, bytes: 9 },
        &mut [0; 32],
    )
    .unwrap()
    .to_vec();
    let captures = |count: u8| [vec![count], one.repeat(usize::from(count))].concat();
    let key = CaptureList::KEY.to_bytes();
    assert!(matches!(FromDevice::decode(key, &captures(16)), Ok(Some(_))));
    assert_eq!(FromDevice::decode(key, &captures(17)), Err(FrameError::Malformed));

    let not_utf8 = [8, 2, 0xC3, 0x28];
    assert_eq!(FromDevice::decode(refused, &not_utf8), Err(FrameError::Malformed));
}

#[test]
fn a_buffer_too_small_is_said_so() {
    for message in samples::from_device() {
        let mut buffer = vec![0; 8192];
        let n = message.encode(1, 2, &mut buffer).unwrap();
        assert!(
            matches!(message.encode(1, 2, &mut buffer[..n - 1]), Err(FrameError::TooLong { available, .. }) if available == n - 1)
        );
        assert_eq!(message.encode(1, 2, &mut buffer[..n]), Ok(n), "an exact fit fits");
    }
    let no_room = samples::strip().encode(1, 2, &mut [0; HEADER_BYTES + 4], |_| Ok::<_, FrameError>(0));
    assert!(matches!(no_room, Err(FrameError::TooLong { .. })));
}

fn plane() -> impl Strategy<Value = PlaneKind> {
    use PlaneKind::*;
    let fixed = [S0, S1, S2, Flags, Residual, PreviewDolp, PreviewAolp];
    prop_oneof![prop::sample::select(fixed.to_vec()), any::<u8>().prop_map(Raw)]
}

fn requests() -> impl Strategy<Value = CaptureRequest> {
    let frame =
        (any::<f64>(), any::<f64>()).prop_map(|(angle_deg, exposure_ratio)| FrameRequest { angle_deg, exposure_ratio });
    let exposure = prop_oneof![Just(Exposure::Auto), any::<u32>().prop_map(Exposure::Fixed)];
    let word = prop::sample::select(vec![Word::I16, Word::I32]);
    (prop::collection::vec(frame, 0..=16), exposure, word, any::<bool>()).prop_map(
        |(frames, exposure, word, keep_raw)| CaptureRequest {
            frames: frames.into_iter().collect(),
            exposure,
            word,
            keep_raw,
        },
    )
}

fn descriptions() -> impl Strategy<Value = CaptureDescription> {
    let frame =
        (any::<[f64; 4]>(), any::<bool>(), any::<u32>(), any::<u64>()).prop_map(|(x, measured, e, t)| FrameInfo {
            asked_deg: x[0],
            angle_deg: x[1],
            measured,
            throughput: x[2],
            efficiency: x[3],
            exposure_us: e,
            timestamp_us: t,
        });
    let info = (plane(), any::<[u32; 2]>(), any::<[u16; 2]>(), any::<u8>()).prop_map(|(kind, [w, h], [r, n], b)| {
        PlaneInfo { kind, value_bytes: b, width: w, height: h, strip_rows: r, strips: n }
    });
    let frames = prop::collection::vec(frame, 0..=16);
    let planes = prop::collection::vec(info, 0..=MAX_PLANES);
    (any::<u32>(), frames, planes, any::<[f64; 4]>(), any::<[bool; 2]>(), "[a-zé]{0,16}").prop_map(
        |(id, frames, planes, x, c, model)| CaptureDescription {
            id: CaptureId(id),
            sensor: SensorInfo { model: text(&model), ..samples::sensor() },
            frames: frames.into_iter().collect(),
            bound_dn: [x[0], x[1], x[2]],
            misfit_sigma: x[3],
            calibration: Calibration { dark_map: c[0], flat_map: c[1] },
            planes: planes.into_iter().collect(),
            ..samples::description()
        },
    )
}

proptest! {
    #[test]
    fn requests_come_back(request in requests()) {
        let message = FromHost::StartCapture(StartCapture { request });
        let (key, bytes) = payload_of!(message);
        prop_assert_eq!(FromHost::decode(key, &bytes), Ok(Some(message)));
    }

    #[test]
    fn descriptions_come_back(description in descriptions()) {
        let message = FromDevice::Description(description);
        let (key, bytes) = payload_of!(message);
        prop_assert_eq!(FromDevice::decode(key, &bytes), Ok(Some(message)));
    }

    #[test]
    fn fetches_and_status_come_back(id: u32, plane in plane(), n: [u16; 3], t: [u64; 3], captures: u8) {
        let fetch = FromHost::Fetch(Fetch { id: CaptureId(id), plane, first: n[0], count: n[1], credit: n[2] });
        let (key, bytes) = payload_of!(fetch);
        prop_assert_eq!(FromHost::decode(key, &bytes), Ok(Some(fetch)));
        let status = FromDevice::Status(Status {
            state: State::Sending(CaptureId(id)), uptime_us: t[0], captures, free_bytes: t[1], skipped_bytes: t[2],
        });
        let (key, bytes) = payload_of!(status);
        prop_assert_eq!(FromDevice::decode(key, &bytes), Ok(Some(status)));
    }

    #[test]
    fn strips_come_back(
        id: u32, plane in plane(), n: [u16; 2], values_crc: u32,
        coded in prop::collection::vec(any::<u8>(), 0..3000),
    ) {
        let header =
            StripHeader { id: CaptureId(id), plane, index: n[0], rows: n[1], coding: Coding::Raw, values_crc };
        let mut buffer = vec![0; 4096];
        let length = header.encode(0x4321, 0x8765_4321, &mut buffer, |room| {
            room[..coded.len()].copy_from_slice(&coded);
            Ok::<_, FrameError>(coded.len())
        }).unwrap();
        let (key, bytes) = payload(&buffer[..length]);
        prop_assert_eq!(Strip::decode(key, &bytes), Ok(Some(Strip { header, coded: &coded })));
    }

    /// Whatever stands behind a known key is that message or malformed. (That it returns at all is the point.)
    #[test]
    fn random_payloads_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        for (_, key) in FromHost::KEYS {
            prop_assert!(!matches!(FromHost::decode(key.to_bytes(), &bytes), Ok(None)));
        }
        for (_, key) in FromDevice::KEYS {
            prop_assert!(!matches!(FromDevice::decode(key.to_bytes(), &bytes), Ok(None)));
        }
        prop_assert!(!matches!(Strip::decode(StripHeader::KEY.to_bytes(), &bytes), Ok(None)));
    }

    /// A real message with a few bytes changed still never panics, and what is read encodes to no more bytes than it was
    /// read from (numbers have one shortest form; longer forms are read but not written).
    #[test]
    fn damaged_payloads_never_grow(which in 0..20_usize, hits in prop::collection::vec((any::<u16>(), any::<u8>()), 1..4)) {
        let (key, mut bytes) = all_payloads().swap_remove(which);
        for (at, value) in hits {
            if let Some(byte) = bytes.get_mut(usize::from(at) % 512) {
                *byte = value;
            }
        }
        if let Ok(Some(message)) = FromHost::decode(key, &bytes) {
            prop_assert!(payload_of!(message).1.len() <= bytes.len());
        }
        if let Ok(Some(message)) = FromDevice::decode(key, &bytes) {
            prop_assert!(payload_of!(message).1.len() <= bytes.len());
        }
    }
}

#[test]
fn the_largest_description_fits_a_small_buffer() {
    let frame = FrameInfo { exposure_us: u32::MAX, timestamp_us: u64::MAX, ..samples::description().frames[0] };
    let plane = PlaneInfo {
        kind: PlaneKind::Raw(255),
        value_bytes: 4,
        width: u32::MAX,
        height: u32::MAX,
        strip_rows: u16::MAX,
        strips: u16::MAX,
    };
    let message = FromDevice::Description(CaptureDescription {
        frames: list([frame; 16]),
        planes: list([plane; MAX_PLANES]),
        ..samples::description()
    });
    let mut buffer = [0; 2048];
    assert!(message.encode(1, 2, &mut buffer).is_ok());
}
