//! What the camera and the link say, in words.

use host_link::LinkError;
use protocol_wire::Refusal;

use crate::exit::Exit;
use crate::failure::Failure;

/// A link error; `camera` is its name on the command line.
pub(crate) fn link_failure(error: &LinkError, camera: &str) -> Failure {
    let device = |advice: &str| Failure::new(Exit::Device, format!("{camera}: {error}"), advice);
    match error {
        LinkError::Refused(refusal) => refused(refusal),
        LinkError::Gone => device(
            "Check the cable and the power. What the camera has taken it keeps: `brewster fetch` gets it when the camera is \
             back.",
        ),
        LinkError::Timeout { waiting_for: "identity" } => device(
            "Another program may have the camera (it serves one host at a time), or something else answers there. Check that \
             it is a brewster camera and try again; captures it has taken are kept (`brewster fetch`).",
        ),
        LinkError::Usb(_) => {
            device("USB cannot be used on this machine as it is. Without a camera: --device emulated.")
        }
        LinkError::Timeout { .. } => device(
            "The camera may be busy with a long exposure, or the line loses data. Try again; captures it has taken are kept \
             (`brewster fetch`).",
        ),
        LinkError::Version { theirs, ours } => device(if theirs > ours {
            "Update this program: the camera's firmware is newer."
        } else {
            "Update the camera's firmware: this program is newer."
        }),
        LinkError::Unsupported { .. } => {
            device("The camera's firmware and this program are different builds: update both.")
        }
        LinkError::Malformed { .. } => {
            device("Something else than a brewster camera answers there, or the builds differ.")
        }
        LinkError::NoCamera { .. } => device(
            "Connect the camera and switch it on; `brewster devices` lists what is there. Without a camera: --device emulated.",
        ),
        LinkError::SeveralCameras(_) => device("Say which one with --device usb:SERIAL."),
        LinkError::Permission { .. } => device("Add the rule, then unplug the camera and plug it in again."),
        LinkError::InUse => device("Close the other program, or wait until it is done."),
        LinkError::CorruptStrip { .. } => device("The camera's storage is damaged there. Take the capture again."),
        LinkError::OtherCapture { .. } => device("The camera was restarted in between: start again."),
        LinkError::Io(source) if source.kind() == std::io::ErrorKind::ConnectionRefused => {
            device("Nothing listens there: start the camera, or `brewster-camera --tcp ADDRESS` for an emulated one.")
        }
        LinkError::Io(source) if source.kind() == std::io::ErrorKind::NotFound => {
            device("There is no such socket: start the camera, or `brewster-camera --unix PATH` for an emulated one.")
        }
        _ => device("Check the camera and its address; `brewster devices` lists what is there."),
    }
}

/// A refusal: what happened, and what to do.
fn refused(refusal: &Refusal) -> Failure {
    let deg = |angle: &f64| format!("{angle:.2}\u{b0}");
    let (what, advice) = match refusal {
        Refusal::Unsupported { .. } => (
            "the camera does not know this command".to_owned(),
            "Its firmware and this program are different builds: update both.",
        ),
        Refusal::Malformed => {
            ("the camera could not read the command".into(), "Update firmware and program to one build.")
        }
        Refusal::WrongSession => (
            "the camera was restarted, or another program has opened it".into(),
            "Try again; captures it has taken are kept (`brewster fetch`).",
        ),
        Refusal::Busy => {
            ("the camera is busy with another capture".into(), "Wait until it is done, and `brewster fetch` it.")
        }
        Refusal::UnknownCapture(id) => {
            (format!("the camera holds no capture {}", id.0), "`brewster fetch` without a number lists what it holds.")
        }
        Refusal::UnknownStrip => ("the capture has no such plane".into(), "Take it again with what you need."),
        Refusal::TooFewAxes { distinct } => {
            return Failure::new(
                Exit::NotIdentifiable,
                format!(
                    "not identifiable: {distinct} different polarizer angle{} where three are needed (angles 180 degrees \
                     apart are the same)",
                    if *distinct == 1 { "" } else { "s" }
                ),
                "Ask for three angles or more, such as --angles 0,60,120.",
            );
        }
        Refusal::IllConditioned { condition } => {
            return Failure::new(
                Exit::NotIdentifiable,
                format!(
                    "not identifiable: the polarizer angles are so close together that noise would be multiplied by \
                     {condition:.0}"
                ),
                "Spread the angles over 180 degrees: 0, 60, 120 is the best set of three.",
            );
        }
        Refusal::OutOfRange(name) => {
            (format!("out of this camera's range: {name}"), "`brewster capture --help` says what can be asked for.")
        }
        Refusal::WordTooNarrow => (
            "16-bit planes cannot hold this sensor's samples".into(),
            "Use --word i32: sensors of more than 14 bits need it.",
        ),
        Refusal::StorageFull { needed, free } => (
            format!(
                "the camera's storage is full: the capture needs {:.1} MB, {:.1} MB are free",
                *needed as f64 / 1e6,
                *free as f64 / 1e6
            ),
            "Fetch and release older captures (`brewster fetch`), or leave out --raw and --verify.",
        ),
        Refusal::WheelStuck { asked_deg, seen_deg } => (
            format!("the wheel does not move: asked for {}, the encoder stays at {}", deg(asked_deg), deg(seen_deg)),
            "Check the servo's power and cable, and that nothing blocks the wheel.",
        ),
        Refusal::WheelMissed { asked_deg, seen_deg } => (
            format!("the wheel did not arrive: asked for {}, the encoder says {}", deg(asked_deg), deg(seen_deg)),
            "Check gear, set screw and magnet: something slips or blocks.",
        ),
        Refusal::WheelFailed(what) => {
            (format!("the wheel fails: {what}"), "Check servo, encoder and wiring; docs has the drawings.")
        }
        Refusal::CameraFailed(what) => {
            (format!("the camera module fails: {what}"), "Check its cable, and what it is given.")
        }
        Refusal::TooBright => (
            "more than half of the picture clips at the shortest exposure".into(),
            "Close the iris, or put a neutral filter in front of the lens.",
        ),
        Refusal::BadCalibration(what) => {
            (format!("the calibration picture cannot be used: {what}"), "Mend that and repeat.")
        }
        Refusal::StorageFailed(what) => (
            format!("the camera's storage fails: {what}"),
            "Fetch what it holds (`brewster fetch`); check its card and free space.",
        ),
        Refusal::Cancelled => ("the capture was cancelled".into(), "Nothing of it is kept."),
    };
    Failure::new(Exit::Refused, what, advice)
}
