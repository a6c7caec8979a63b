//! One value of every message and of every enum variant. Within a value all fields differ, and no two fields of one type
//! encode alike, so that swapping any two of them moves bytes; numbers stand above 127 where the type allows, because
//! smaller ones look the same in every width.
#![allow(dead_code, reason = "each test binary uses the samples it needs")]

use heapless::Vec;
use protocol_wire::*;

/// The sensor of all samples.
pub(crate) fn sensor() -> SensorInfo {
    SensorInfo {
        model: text("IMX-A"),
        width: 4056,
        height: 3040,
        bit_depth: 12,
        bayer: Bayer::Bggr,
        black_level_dn: 256,
        white_level_dn: 4095,
        gain_e_per_dn: 2.5,
        read_noise_e: 3.75,
        pixel_pitch_um: 1.55,
    }
}

/// Every message the host may send, in the order of its table.
pub(crate) fn from_host() -> std::vec::Vec<FromHost> {
    vec![
        FromHost::Identify(Identify { host: text("brewster 0.1") }),
        FromHost::GetStatus(GetStatus),
        FromHost::StartCapture(StartCapture {
            request: CaptureRequest {
                frames: list([
                    FrameRequest { angle_deg: 0.5, exposure_ratio: 1.0 },
                    FrameRequest { angle_deg: 60.25, exposure_ratio: 0.125 },
                ]),
                exposure: Exposure::Fixed(20_000),
                word: Word::I32,
                keep_raw: true,
            },
        }),
        FromHost::Cancel(Cancel),
        FromHost::Calibrate(Calibrate::Flat { frames: 9 }),
        FromHost::ListCaptures(ListCaptures),
        FromHost::Describe(Describe { id: CaptureId(0x0A0B_0C0D) }),
        FromHost::Fetch(Fetch {
            id: CaptureId(70_000),
            plane: PlaneKind::Raw(200),
            first: 300,
            count: 400,
            credit: 500,
        }),
        FromHost::Grant(Grant { credit: 600 }),
        FromHost::Release(Release { id: CaptureId(80_000) }),
    ]
}

/// Every message the camera may send besides strips, in the order of its table.
pub(crate) fn from_device() -> std::vec::Vec<FromDevice> {
    vec![
        FromDevice::Identity(Identity {
            session: 0xDEAD_BEEF,
            serial: text("BW-0007"),
            board: text("pi-imx"),
            firmware: text("0.1.0"),
            sensor: sensor(),
            default_frames: list([FrameRequest { angle_deg: 45.5, exposure_ratio: 0.5 }]),
            default_word: Word::I32,
        }),
        FromDevice::Status(Status {
            state: State::Capturing(CaptureId(90_000)),
            uptime_us: 10_000_000_001,
            captures: 3,
            free_bytes: 20_000_000_002,
            skipped_bytes: 30_000_000_003,
        }),
        FromDevice::Accepted(Accepted { id: CaptureId(100_000) }),
        FromDevice::Progress(Progress { stage: Stage::Computing, done: 700, total: 800 }),
        FromDevice::Done(Done { id: Some(CaptureId(110_000)) }),
        FromDevice::CaptureList(CaptureList {
            captures: list([
                CaptureSummary { id: CaptureId(120_000), state: CaptureState::Complete, frames: 3, bytes: 130_000_000 },
                CaptureSummary { id: CaptureId(140_000), state: CaptureState::Running, frames: 4, bytes: 150_000_000 },
            ]),
        }),
        FromDevice::Description(description()),
        FromDevice::Released(Released { id: CaptureId(160_000) }),
        FromDevice::Refused(Refused { refusal: Refusal::StorageFull { needed: 170_000_000, free: 180_000_000 } }),
        FromDevice::Log(Log { level: LogLevel::Info, text: text("wheel homed") }),
    ]
}

/// The largest message.
pub(crate) fn description() -> CaptureDescription {
    CaptureDescription {
        id: CaptureId(190_000),
        boot: 0xB007_1234,
        state: CaptureState::Complete,
        sensor: sensor(),
        frames: list([
            FrameInfo {
                asked_deg: 60.0,
                angle_deg: 60.75,
                measured: true,
                throughput: 0.875,
                efficiency: 0.9375,
                exposure_us: 200_000,
                timestamp_us: 40_000_000_004,
            },
            FrameInfo {
                asked_deg: 120.0,
                angle_deg: 119.5,
                measured: false,
                throughput: 1.125,
                efficiency: 0.96875,
                exposure_us: 210_000,
                timestamp_us: 50_000_000_005,
            },
        ]),
        word: Word::I32,
        frac_bits: 16,
        bound_dn: [0.25, 0.375, 0.4375],
        misfit_sigma: 4.5,
        calibration: Calibration { dark_map: true, flat_map: false },
        planes: list([PlaneInfo {
            kind: PlaneKind::Residual,
            value_bytes: 4,
            width: 4056,
            height: 3040,
            strip_rows: 160,
            strips: 1019,
        }]),
    }
}

/// A strip's header.
pub(crate) fn strip() -> StripHeader {
    StripHeader {
        id: CaptureId(220_000),
        plane: PlaneKind::S2,
        index: 900,
        rows: 1000,
        coding: Coding::Raw,
        values_crc: 0xCAFE_F00D,
    }
}

/// Every refusal.
pub(crate) fn refusals() -> std::vec::Vec<Refusal> {
    vec![
        Refusal::Unsupported { key: [1, 2, 3, 4, 5, 6, 7, 200] },
        Refusal::Malformed,
        Refusal::WrongSession,
        Refusal::Busy,
        Refusal::UnknownCapture(CaptureId(230_000)),
        Refusal::UnknownStrip,
        Refusal::TooFewAxes { distinct: 2 },
        Refusal::IllConditioned { condition: 3700.5 },
        Refusal::OutOfRange(text("exposure_ratio")),
        Refusal::WordTooNarrow,
        Refusal::StorageFull { needed: 240_000_000, free: 250_000_000 },
        Refusal::WheelStuck { asked_deg: 30.5, seen_deg: 0.25 },
        Refusal::WheelMissed { asked_deg: 31.5, seen_deg: 29.25 },
        Refusal::WheelFailed(text("no answer at 0x36")),
        Refusal::CameraFailed(text("no frame")),
        Refusal::TooBright,
        Refusal::BadCalibration(text("dark is bright")),
        Refusal::StorageFailed(text("read-only")),
        Refusal::Cancelled,
    ]
}

/// Text of at most the field's length.
pub(crate) fn text<const N: usize>(text: &str) -> heapless::String<N> {
    text.try_into().expect("samples fit their fields")
}

/// A list of at most the field's length.
pub(crate) fn list<T: Clone, const M: usize, const N: usize>(items: [T; M]) -> Vec<T, N> {
    Vec::from_slice(&items).expect("samples fit their fields")
}
