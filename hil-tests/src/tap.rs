//! A transport that keeps every byte that passes.

use host_link::{LinkError, Transport};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// All that was said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Conversation {
    /// By the host.
    pub host: Vec<u8>,
    /// By the camera.
    pub camera: Vec<u8>,
}

/// Keeps what passes through a transport.
#[derive(Debug)]
pub struct Tap<T> {
    inner: T,
    said: Arc<Mutex<Conversation>>,
}

impl<T> Tap<T> {
    /// Taps `inner`; the other half of the answer is what was said so far.
    #[must_use]
    pub fn new(inner: T) -> (Self, Arc<Mutex<Conversation>>) {
        let said = Arc::default();
        (Self { inner, said: Arc::clone(&said) }, said)
    }
}

impl<T: Transport> Transport for Tap<T> {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        let n = self.inner.read(buf, timeout)?;
        self.said.lock().unwrap().camera.extend_from_slice(&buf[..n]);
        Ok(n)
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        self.inner.write_all(bytes, timeout)?;
        self.said.lock().unwrap().host.extend_from_slice(bytes);
        Ok(())
    }

    fn describe(&self) -> String {
        self.inner.describe()
    }
}
