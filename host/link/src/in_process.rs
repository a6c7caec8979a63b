//! Host and camera in one process: two bounded queues of bytes.
//!
//! The host end blocks with a timeout like every transport; the device end never blocks, as firmware wiring wants it.

use crate::transport::ROOM;
use crate::{LinkError, Transport};
use std::collections::VecDeque;
use std::io::Read;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The host has dropped its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gone;

/// The host's end.
#[derive(Debug)]
pub struct HostEnd {
    shared: Arc<Shared>,
}

/// The camera's end.
#[derive(Debug)]
pub struct DeviceEnd {
    shared: Arc<Shared>,
}

/// Two ends of a pipe that holds up to `capacity` bytes (at least 1) each way.
#[must_use]
pub fn pair(capacity: usize) -> (HostEnd, DeviceEnd) {
    let shared = Arc::new(Shared { capacity: capacity.max(1), ..Shared::default() });
    (HostEnd { shared: Arc::clone(&shared) }, DeviceEnd { shared })
}

#[derive(Debug, Default)]
struct Shared {
    capacity: usize,
    queues: Mutex<Queues>,
    /// The device wrote, read or left.
    device_moved: Condvar,
}

#[derive(Debug, Default)]
struct Queues {
    to_host: VecDeque<u8>,
    to_device: VecDeque<u8>,
    host_gone: bool,
    device_gone: bool,
}

impl Shared {
    /// A panic elsewhere cannot leave a queue half changed, so a poisoned lock is as good as any.
    fn queues(&self) -> MutexGuard<'_, Queues> {
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends what fits of `bytes` and says how much that was.
    fn push(&self, queue: &mut VecDeque<u8>, bytes: &[u8]) -> usize {
        let n = bytes.len().min(self.capacity.saturating_sub(queue.len()));
        queue.extend(bytes.iter().take(n));
        n
    }
}

fn pop(queue: &mut VecDeque<u8>, buf: &mut [u8]) -> usize {
    let (mut n, mut rest) = (0, buf);
    // Two pieces at most; reading from a queue in memory cannot fail.
    while let Ok(piece @ 1..) = queue.read(rest) {
        n += piece;
        rest = rest.get_mut(piece..).unwrap_or_default();
    }
    n
}

impl Transport for HostEnd {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        let deadline = Instant::now() + timeout;
        let mut queues = self.shared.queues();
        loop {
            let n = pop(&mut queues.to_host, buf);
            let left = deadline.saturating_duration_since(Instant::now());
            if n > 0 || buf.is_empty() {
                return Ok(n);
            }
            if queues.device_gone {
                return Err(LinkError::Gone);
            }
            if left.is_zero() {
                return Ok(0);
            }
            queues = self.shared.device_moved.wait_timeout(queues, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        let deadline = Instant::now() + timeout;
        let mut rest = bytes;
        let mut queues = self.shared.queues();
        loop {
            if queues.device_gone {
                return Err(LinkError::Gone);
            }
            let n = self.shared.push(&mut queues.to_device, rest);
            rest = rest.get(n..).unwrap_or_default();
            let left = deadline.saturating_duration_since(Instant::now());
            if rest.is_empty() {
                return Ok(());
            }
            if left.is_zero() {
                return Err(LinkError::Timeout { waiting_for: ROOM });
            }
            queues = self.shared.device_moved.wait_timeout(queues, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn describe(&self) -> String {
        "a camera in this process".to_owned()
    }
}

impl DeviceEnd {
    /// Reads what is there into `buf` and returns how many bytes; 0 where there is nothing yet.
    ///
    /// # Errors
    /// [`Gone`] where the host has left and all it sent was read.
    pub fn read(&mut self, buf: &mut [u8]) -> Result<usize, Gone> {
        let mut queues = self.shared.queues();
        let n = pop(&mut queues.to_device, buf);
        if n == 0 && queues.host_gone {
            return Err(Gone);
        }
        self.shared.device_moved.notify_all();
        Ok(n)
    }

    /// Writes what fits of `bytes` and returns how many; 0 where there is no room.
    ///
    /// # Errors
    /// [`Gone`] where the host has left.
    pub fn write(&mut self, bytes: &[u8]) -> Result<usize, Gone> {
        let mut queues = self.shared.queues();
        if queues.host_gone {
            return Err(Gone);
        }
        let n = self.shared.push(&mut queues.to_host, bytes);
        self.shared.device_moved.notify_all();
        Ok(n)
    }
}

impl Drop for HostEnd {
    fn drop(&mut self) {
        self.shared.queues().host_gone = true;
    }
}

impl Drop for DeviceEnd {
    fn drop(&mut self) {
        self.shared.queues().device_gone = true;
        self.shared.device_moved.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(5);

    #[test]
    fn a_full_queue_takes_what_fits_and_wakes_when_it_is_read() {
        let (mut host, mut device) = pair(4);
        assert!(matches!(host.write_all(b"abcdef", SHORT), Err(LinkError::Timeout { waiting_for: ROOM })));
        let mut buf = [0; 8];
        assert_eq!(device.read(&mut buf), Ok(4));
        assert_eq!(&buf[..4], b"abcd");
        assert_eq!(device.read(&mut buf), Ok(0));
        let writer = std::thread::spawn(move || host.write_all(b"ghijklmno", Duration::from_secs(10)).map(|()| host));
        let mut seen = Vec::new();
        while seen.len() < 9 {
            let n = device.read(&mut buf).unwrap();
            seen.extend_from_slice(&buf[..n]);
        }
        assert_eq!(seen, b"ghijklmno");
        assert!(writer.join().unwrap().is_ok());
        assert_eq!(device.write(b"123456").ok(), None, "the writer's end was dropped");
    }

    #[test]
    fn an_end_that_left_is_gone_after_its_last_byte() {
        let (mut host, mut device) = pair(16);
        assert_eq!(device.write(b"bye"), Ok(3));
        drop(device);
        let mut buf = [0; 8];
        assert_eq!(host.read(&mut buf, SHORT).unwrap(), 3);
        assert!(matches!(host.read(&mut buf, SHORT), Err(LinkError::Gone)));
        assert!(matches!(host.write_all(b"x", SHORT), Err(LinkError::Gone)));

        let (mut host, mut device) = pair(16);
        host.write_all(b"bye", SHORT).unwrap();
        drop(host);
        assert_eq!((device.read(&mut buf), device.read(&mut buf)), (Ok(3), Err(Gone)));
    }

    #[test]
    fn silence_is_no_bytes_not_an_error() {
        let (mut host, _device) = pair(16);
        assert_eq!(host.read(&mut [0; 8], SHORT).unwrap(), 0);
    }
}
