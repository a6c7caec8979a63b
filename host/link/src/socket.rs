//! What stream sockets of all families share: blocking reads and writes with a deadline.

use crate::LinkError;
use crate::transport::ROOM;
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// A stream socket whose timeouts can be set.
pub(crate) trait Socket: Read + Write {
    fn limit_read(&self, timeout: Duration) -> std::io::Result<()>;
    fn limit_write(&self, timeout: Duration) -> std::io::Result<()>;
}

/// The systems take a timeout of zero for "none".
const SHORTEST: Duration = Duration::from_millis(1);

/// As [`crate::Transport::read`].
pub(crate) fn read(socket: &mut impl Socket, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
    if buf.is_empty() {
        return Ok(0);
    }
    socket.limit_read(timeout.max(SHORTEST))?;
    match socket.read(buf) {
        Ok(0) => Err(LinkError::Gone),
        Ok(n) => Ok(n),
        Err(error) if is_pause(error.kind()) => Ok(0),
        Err(error) => Err(error.into()),
    }
}

/// As [`crate::Transport::write_all`].
pub(crate) fn write_all(socket: &mut impl Socket, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
    let deadline = Instant::now() + timeout;
    let mut rest = bytes;
    while !rest.is_empty() {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(LinkError::Timeout { waiting_for: ROOM });
        }
        socket.limit_write(left.max(SHORTEST))?;
        match socket.write(rest) {
            Ok(0) => return Err(LinkError::Gone),
            Ok(n) => rest = rest.get(n..).unwrap_or_default(),
            Err(error) if is_pause(error.kind()) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// A timeout is one kind on Windows and another elsewhere.
fn is_pause(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
