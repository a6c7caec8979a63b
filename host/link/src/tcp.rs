//! A camera behind a TCP port: the emulator, or a port forwarded to it.

use crate::socket::{self, Socket};
use crate::{LinkError, Transport};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// A TCP connection.
#[derive(Debug)]
pub struct Tcp {
    stream: TcpStream,
    peer: String,
}

impl Tcp {
    /// Connects to `host:port`, to the first of its addresses that answers within `timeout`.
    ///
    /// # Errors
    /// [`LinkError::Io`] with what the last address said.
    pub fn connect(host_port: &str, timeout: Duration) -> Result<Self, LinkError> {
        let mut last = std::io::Error::from(std::io::ErrorKind::AddrNotAvailable);
        for address in host_port.to_socket_addrs().map_err(LinkError::Io)? {
            match TcpStream::connect_timeout(&address, timeout) {
                Ok(stream) => {
                    // Commands are small and waited for.
                    stream.set_nodelay(true)?;
                    return Ok(Self { stream, peer: host_port.to_owned() });
                }
                Err(error) => last = error,
            }
        }
        Err(LinkError::Io(last))
    }
}

impl Socket for TcpStream {
    fn limit_read(&self, timeout: Duration) -> std::io::Result<()> {
        self.set_read_timeout(Some(timeout))
    }

    fn limit_write(&self, timeout: Duration) -> std::io::Result<()> {
        self.set_write_timeout(Some(timeout))
    }
}

impl Transport for Tcp {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        socket::read(&mut self.stream, buf, timeout)
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        socket::write_all(&mut self.stream, bytes, timeout)
    }

    fn describe(&self) -> String {
        format!("TCP {}", self.peer)
    }
}
