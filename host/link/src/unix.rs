//! A camera behind a Unix socket: the emulator on the same machine.

use crate::socket::{self, Socket};
use crate::{LinkError, Transport};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A connection to a Unix stream socket.
#[derive(Debug)]
pub struct Unix {
    stream: UnixStream,
    path: PathBuf,
}

impl Unix {
    /// Connects to the socket at `path`.
    ///
    /// # Errors
    /// [`LinkError::Io`] with what the system said.
    pub fn connect(path: &Path) -> Result<Self, LinkError> {
        let stream = UnixStream::connect(path).map_err(LinkError::Io)?;
        Ok(Self { stream, path: path.to_owned() })
    }
}

impl Socket for UnixStream {
    fn limit_read(&self, timeout: Duration) -> std::io::Result<()> {
        self.set_read_timeout(Some(timeout))
    }

    fn limit_write(&self, timeout: Duration) -> std::io::Result<()> {
        self.set_write_timeout(Some(timeout))
    }
}

impl Transport for Unix {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        socket::read(&mut self.stream, buf, timeout)
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        socket::write_all(&mut self.stream, bytes, timeout)
    }

    fn describe(&self) -> String {
        format!("Unix socket {}", self.path.display())
    }
}
