//! The bytes and keys of every message, pinned in golden.txt and in docs/PROTOCOL.md.
//!
//! A failure prints the lines as they would now be. Lines that already stand in a release may not change: a changed
//! message is a new version or a new path.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod samples;

use postcard_schema::Schema;
use postcard_schema::schema::DataModelType;
use protocol_wire::*;
use serde::Serialize;
use std::collections::BTreeSet;

const GOLDEN: &str = include_str!("golden.txt");
const SPECIFICATION: &str = include_str!("../../../docs/PROTOCOL.md");

#[test]
fn keys_are_golden() {
    let lines = keys().into_iter().map(|(path, _, key)| format!("key {path} = {}", hex(&key)));
    assert_golden("key ", lines.collect());
}

#[test]
fn messages_are_golden() {
    let host = samples::from_host();
    let device = samples::from_device();
    let mut lines = Vec::new();
    let mut buffer = vec![0; HEADER_BYTES + MAX_PAYLOAD];
    for message in &host {
        let n = message.encode(0x1234, 0x89AB_CDEF, &mut buffer).unwrap();
        lines.push(format!("message {} = {}", message.path(), hex(&buffer[HEADER_BYTES..n])));
    }
    for message in &device {
        let n = message.encode(0x1234, 0x89AB_CDEF, &mut buffer).unwrap();
        lines.push(format!("message {} = {}", message.path(), hex(&buffer[HEADER_BYTES..n])));
    }
    let fill = |room: &mut [u8]| {
        room[..3].copy_from_slice(&[0x7F, 0x80, 0x81]);
        Ok::<_, FrameError>(3)
    };
    let n = samples::strip().encode(0x1234, 0x89AB_CDEF, &mut buffer, fill).unwrap();
    lines.push(format!("message strip = {}", hex(&buffer[HEADER_BYTES..n])));
    assert_golden("message ", lines);

    let sampled: Vec<_> = host.iter().map(FromHost::path).chain(device.iter().map(FromDevice::path)).collect();
    let known: Vec<_> = FromHost::KEYS.iter().chain(FromDevice::KEYS).map(|(path, _)| *path).collect();
    assert_eq!(sampled, known, "every message has a sample, in the order of its table");
}

#[test]
fn a_whole_frame_is_golden() {
    let mut buffer = [0; 64];
    let message = FromHost::Grant(Grant { credit: 600 });
    let n = message.encode(0x1234, 0x89AB_CDEF, &mut buffer).unwrap();
    assert_golden("frame ", vec![format!("frame {} = {}", message.path(), hex(&buffer[..n]))]);
}

#[test]
fn enum_variants_are_golden() {
    use samples::text;
    let id = CaptureId(260_000);
    let mut lines = Vec::new();
    lines.extend(variants("Refusal", &samples::refusals()));
    lines.extend(variants(
        "PlaneKind",
        &[
            PlaneKind::S0,
            PlaneKind::S1,
            PlaneKind::S2,
            PlaneKind::Flags,
            PlaneKind::Residual,
            PlaneKind::PreviewDolp,
            PlaneKind::PreviewAolp,
            PlaneKind::Raw(201),
            PlaneKind::DarkMap,
            PlaneKind::FlatMap,
        ],
    ));
    lines.extend(variants("Exposure", &[Exposure::Auto, Exposure::Fixed(270_000)]));
    lines.extend(variants("State", &[State::Idle, State::Capturing(id), State::Sending(id), State::Calibrating]));
    let calibrate = [Calibrate::Dark { frames: 7 }, Calibrate::Flat { frames: 8 }, Calibrate::Clear];
    lines.extend(variants("Calibrate", &calibrate));
    lines.extend(variants("Stage", &[Stage::Metering, Stage::Exposing, Stage::Computing, Stage::Calibrating]));
    lines.extend(variants("LogLevel", &[LogLevel::Warning, LogLevel::Info]));
    lines.extend(variants("Bayer", &[Bayer::Mono, Bayer::Rggb, Bayer::Bggr, Bayer::Grbg, Bayer::Gbrg]));
    lines.extend(variants("Word", &[Word::I16, Word::I32]));
    lines.extend(variants("CaptureState", &[CaptureState::Running, CaptureState::Complete]));
    lines.extend(variants("Coding", &[Coding::Raw]));
    lines.extend(
        [Log { level: LogLevel::Warning, text: text("é") }, Log { level: LogLevel::Info, text: text("") }].map(
            // Text is UTF-8 with its length in bytes.
            |log| format!("variant Log {:?} = {}", log.text.as_str(), hex(&encode(&log))),
        ),
    );
    lines.push(format!("variant Done::None = {}", hex(&encode(&Done { id: None }))));
    assert_golden("variant ", lines);
}

/// The rule of docs/PROTOCOL.md ("Keys"), applied by hand: FNV-1a of the path, then of the schema's tags and names.
#[test]
fn keys_follow_the_documented_hash() {
    let fnv1a = |parts: &[&[u8]]| {
        let hash = parts
            .concat()
            .iter()
            .fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3));
        hash.to_le_bytes()
    };
    assert_eq!(fnv1a(&[b"status/get", &[0xBF]]), GetStatus::KEY.to_bytes());
    assert_eq!(fnv1a(&[b"strips/grant", &[0x7F], b"credit", &[0x83]]), Grant::KEY.to_bytes());
    assert_eq!(fnv1a(&[b"captures/describe", &[0x7F], b"id", &[0x9D, 0xD3]]), Describe::KEY.to_bytes());
    assert_eq!(fnv1a(&[b"capture/done", &[0x7F], b"id", &[0x6D, 0x9D, 0xD3]]), Done::KEY.to_bytes());
    let calibrate: [&[u8]; 13] = [
        b"calibrate",
        &[0xE9],
        b"Dark",
        &[0x67],
        b"frames",
        &[0x3D],
        b"Flat",
        &[0x67],
        b"frames",
        &[0x3D],
        b"Clear",
        &[0xB5],
        b"",
    ];
    assert_eq!(fnv1a(&calibrate), Calibrate::KEY.to_bytes());
    let log: [&[u8]; 10] =
        [b"log", &[0x7F], b"level", &[0xE9], b"Warning", &[0xB5], b"Info", &[0xB5], b"text", &[0x25]];
    assert_eq!(fnv1a(&log), Log::KEY.to_bytes());
}

#[test]
fn no_two_messages_share_a_key() {
    let keys = keys();
    let distinct: BTreeSet<_> = keys.iter().map(|(_, _, key)| key).collect();
    assert_eq!(distinct.len(), keys.len());
}

#[test]
fn the_specification_lists_every_key_and_no_other() {
    let rows: Vec<_> =
        keys().iter().map(|(path, sender, key)| format!("| `{path}` | {sender} | `{}` |", hex(key))).collect();
    let missing: Vec<_> = rows.iter().filter(|row| !SPECIFICATION.contains(row.as_str())).collect();
    assert!(missing.is_empty(), "docs/PROTOCOL.md lacks rows beginning\n{missing:#?}");
    let senders = ["| host | `", "| camera | `"];
    let listed = SPECIFICATION.lines().filter(|line| senders.iter().any(|sender| line.contains(sender))).count();
    assert_eq!(listed, rows.len(), "docs/PROTOCOL.md lists keys that no longer exist");
}

#[test]
fn the_specification_states_the_limits_in_force() {
    for (name, value) in [
        ("Protocol version", usize::from(VERSION)),
        ("Header, bytes", HEADER_BYTES),
        ("Largest payload, bytes", MAX_PAYLOAD),
        ("Frames of a capture", protocol_polar::MAX_FRAMES),
        ("Captures listed", MAX_CAPTURES),
        ("Planes of a capture", MAX_PLANES),
    ] {
        let row = format!("| {name} | {value} |");
        assert!(SPECIFICATION.contains(&row), "docs/PROTOCOL.md lacks {row:?}");
    }
}

/// Path, sender and key of every message.
fn keys() -> Vec<(&'static str, &'static str, [u8; 8])> {
    let host = FromHost::KEYS.iter().map(|(path, key)| (*path, "host", key.to_bytes()));
    let device = FromDevice::KEYS.iter().map(|(path, key)| (*path, "camera", key.to_bytes()));
    host.chain(device).chain([(StripHeader::PATH, "camera", StripHeader::KEY.to_bytes())]).collect()
}

/// A line for each variant, after a check that the samples are all the variants there are, in order.
fn variants<T: Serialize + Schema + std::fmt::Debug>(name: &str, samples: &[T]) -> Vec<String> {
    let DataModelType::Enum(declared) = T::SCHEMA.ty else { panic!("{name} is an enum") };
    let declared: Vec<_> = declared.iter().map(|variant| variant.name).collect();
    let debug: Vec<_> = samples.iter().map(|sample| format!("{sample:?}")).collect();
    let sampled: Vec<_> = debug.iter().map(|text| text.split([' ', '(', '{']).next().unwrap()).collect();
    assert_eq!(sampled, declared, "variants of {name}");
    samples.iter().zip(sampled).map(|(s, v)| format!("variant {name}::{v} = {}", hex(&encode(s)))).collect()
}

fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    let mut buffer = [0; 4096];
    postcard::to_slice(value, &mut buffer).unwrap().to_vec()
}

/// Compares `lines` with the lines of golden.txt that begin with `prefix`.
fn assert_golden(prefix: &str, lines: Vec<String>) {
    let kept: Vec<_> = GOLDEN.lines().filter(|line| line.starts_with(prefix)).collect();
    let changed: Vec<_> = lines.iter().filter(|line| !kept.contains(&line.as_str())).map(String::as_str).collect();
    assert!(changed.is_empty(), "not in golden.txt:\n{}", changed.join("\n"));
    assert_eq!(kept, lines, "golden.txt has more lines, or another order");
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
