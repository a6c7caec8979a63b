//! The interface as one table: every message, its path, who sends it.

pub(crate) mod capture;
pub(crate) mod control;
pub(crate) mod strip;

use crate::frame::{FrameError, HEADER_BYTES, Header, VERSION, seal};
use control::{
    Accepted, Calibrate, Cancel, CaptureList, Describe, Done, Fetch, GetStatus, Grant, Identify, Identity,
    ListCaptures, Log, Progress, Refused, Release, Released, StartCapture, Status,
};
use postcard_schema::Schema;
pub use postcard_schema::key::Key;

/// A message's path: hashed with its schema into its key, and shown to people.
pub trait Name: Schema {
    /// Path, such as `capture/start`.
    const PATH: &'static str;
    /// Key on the wire: FNV-1a of path and schema.
    const KEY: Key = Key::for_path::<Self>(Self::PATH);
}

macro_rules! table {
    ($(#[$doc:meta])* $table:ident { $($message:ident($body:ty) = $path:literal,)* }) => {
        $(impl Name for $body { const PATH: &'static str = $path; })*

        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        #[expect(clippy::large_enum_variant, reason = "messages are read one at a time, on the stack, without allocation")]
        pub enum $table {
            $(#[doc = concat!("`", $path, "`")] $message($body),)*
        }

        impl $table {
            /// Path and key of every message of this table, in order.
            pub const KEYS: &'static [(&'static str, Key)] = &[$(($path, <$body as Name>::KEY),)*];

            /// Reads the message that `key` names. `None`: no such message in this build.
            ///
            /// # Errors
            /// [`FrameError::Malformed`] where the payload is not that message and nothing more.
            pub fn decode(key: [u8; 8], payload: &[u8]) -> Result<Option<Self>, FrameError> {
                $(if key == <$body as Name>::KEY.to_bytes() {
                    return match postcard::take_from_bytes(payload) {
                        Ok((body, [])) => Ok(Some(Self::$message(body))),
                        _ => Err(FrameError::Malformed),
                    };
                })*
                Ok(None)
            }

            /// Writes the whole frame into `buffer`; returns its length.
            ///
            /// # Errors
            /// [`FrameError::TooLong`] where the buffer is too small.
            pub fn encode(&self, sequence: u16, session: u32, buffer: &mut [u8]) -> Result<usize, FrameError> {
                let available = buffer.len();
                let too_long = FrameError::TooLong { needed: available + 1, available };
                let room = buffer.get_mut(HEADER_BYTES..).ok_or(too_long)?;
                let (key, length) = match self {
                    $(Self::$message(body) => (<$body as Name>::KEY, postcard::to_slice(body, room).map(|b| b.len())),)*
                };
                let length = u32::try_from(length.map_err(|_| too_long)?).map_err(|_| too_long)?;
                seal(buffer, Header { version: VERSION, sequence, session, key: key.to_bytes(), length })
            }

            /// The message's path, for people.
            #[must_use]
            pub fn path(&self) -> &'static str {
                match self { $(Self::$message(_) => $path,)* }
            }
        }
    };
}

table! {
    /// What the host may say.
    FromHost {
        Identify(Identify) = "identify",
        GetStatus(GetStatus) = "status/get",
        StartCapture(StartCapture) = "capture/start",
        Cancel(Cancel) = "capture/cancel",
        Calibrate(Calibrate) = "calibrate",
        ListCaptures(ListCaptures) = "captures/list",
        Describe(Describe) = "captures/describe",
        Fetch(Fetch) = "strips/fetch",
        Grant(Grant) = "strips/grant",
        Release(Release) = "captures/release",
    }
}

table! {
    /// What the camera may say, besides strips (see [`strip`]).
    FromDevice {
        Identity(Identity) = "identity",
        Status(Status) = "status",
        Accepted(Accepted) = "capture/accepted",
        Progress(Progress) = "capture/progress",
        Done(Done) = "capture/done",
        CaptureList(CaptureList) = "captures",
        Description(capture::CaptureDescription) = "captures/description",
        Released(Released) = "captures/released",
        Refused(Refused) = "refused",
        Log(Log) = "log",
    }
}
