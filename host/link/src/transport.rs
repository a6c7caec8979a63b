//! The byte pipe every client stands on.

use crate::LinkError;
use std::time::Duration;

/// A pipe of bytes to one camera. It may lose or damage bytes; frames find that out.
pub trait Transport: Send {
    /// Reads what is there into `buf` and returns how many bytes; waits up to `timeout` for the first. 0: nothing came.
    ///
    /// # Errors
    /// [`LinkError::Gone`] where the other end has ended, and whatever else the system reports.
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError>;

    /// Writes all of `bytes`.
    ///
    /// # Errors
    /// [`LinkError::Timeout`] where the other end does not take them within `timeout` (some of them may be sent),
    /// [`LinkError::Gone`], and whatever else the system reports.
    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError>;

    /// Where the other end is, for people.
    fn describe(&self) -> String;
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        (**self).read(buf, timeout)
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        (**self).write_all(bytes, timeout)
    }

    fn describe(&self) -> String {
        (**self).describe()
    }
}

/// What a transport waits for when the other end does not take its bytes.
pub(crate) const ROOM: &str = "room to send";
