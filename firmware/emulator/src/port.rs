//! Where hosts come from: a jack that links are plugged into, a Unix socket, a TCP port on loopback.
//!
//! One host at a time: a second one on a socket waits until the first has left.

use crate::EmulatorError;
use firmware_core::{ByteLink, LinkGone};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
#[cfg(unix)]
use std::os::unix::fs::{FileTypeExt, MetadataExt};
#[cfg(unix)]
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

/// Gives the link to the host that is connected.
pub trait Port: Send {
    /// Kind of link.
    type Link: ByteLink;

    /// The present host's, if there is one.
    fn link(&mut self) -> Option<&mut Self::Link>;
}

/// The camera's side of [`jack`].
#[derive(Debug)]
pub struct Jack<L> {
    plugs: Receiver<L>,
    link: Option<L>,
}

/// A jack and what plugs links into it: each replaces the one before.
#[must_use]
pub fn jack<L>() -> (Sender<L>, Jack<L>) {
    let (sender, plugs) = channel();
    (sender, Jack { plugs, link: None })
}

impl<L: ByteLink + Send> Port for Jack<L> {
    type Link = L;

    fn link(&mut self) -> Option<&mut L> {
        if let Some(newest) = self.plugs.try_iter().last() {
            self.link = Some(newest);
        }
        self.link.as_mut()
    }
}

/// A TCP port on loopback.
pub type TcpPort = SocketPort<TcpListener>;

/// A Unix socket; its file goes with it.
#[cfg(unix)]
pub type UnixPort = SocketPort<UnixListener>;

/// Something that listens; see [`TcpPort`] and [`UnixPort`].
#[derive(Debug)]
pub struct SocketPort<L: Listen> {
    listener: L,
    host: Option<SocketLink<L::Stream>>,
    /// To be removed at the end.
    file: Option<(PathBuf, FileIdentity)>,
}

/// A connected socket that never blocks.
#[derive(Debug)]
pub struct SocketLink<S> {
    stream: S,
    gone: bool,
}

/// A listening socket.
pub trait Listen: Send {
    /// What a connection is.
    type Stream: Read + Write + Send;

    /// The next connection, set not to block; an error of kind `WouldBlock` where there is none.
    ///
    /// # Errors
    /// What the system says.
    fn next(&self) -> std::io::Result<Self::Stream>;
}

impl Listen for TcpListener {
    type Stream = TcpStream;

    fn next(&self) -> std::io::Result<TcpStream> {
        let (stream, _) = self.accept()?;
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        Ok(stream)
    }
}

#[cfg(unix)]
impl Listen for UnixListener {
    type Stream = UnixStream;

    fn next(&self) -> std::io::Result<UnixStream> {
        let (stream, _) = self.accept()?;
        stream.set_nonblocking(true)?;
        Ok(stream)
    }
}

impl TcpPort {
    /// Listens on a loopback address; port 0 is any free one.
    ///
    /// # Errors
    /// [`EmulatorError::NotLoopback`]; [`EmulatorError::Io`] where the port is taken.
    pub fn bind(address: SocketAddr) -> Result<Self, EmulatorError> {
        if !address.ip().is_loopback() {
            return Err(EmulatorError::NotLoopback(address));
        }
        let io = |source| EmulatorError::Io { path: address.to_string().into(), source };
        let listener = TcpListener::bind(address).map_err(io)?;
        listener.set_nonblocking(true).map_err(io)?;
        Ok(Self { listener, host: None, file: None })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the system says.
    pub fn address(&self) -> std::io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

#[cfg(unix)]
impl UnixPort {
    /// Listens on a socket at `path`. The file of a camera that ended without removing it is replaced.
    ///
    /// # Errors
    /// [`EmulatorError::Io`] where something else is there, or a camera still listens.
    pub fn bind(path: PathBuf) -> Result<Self, EmulatorError> {
        let left_over = || {
            let is_socket = std::fs::symlink_metadata(&path).is_ok_and(|file| file.file_type().is_socket());
            let refuses =
                || UnixStream::connect(&path).is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused);
            is_socket && refuses()
        };
        let bound = match UnixListener::bind(&path) {
            Err(error) if error.kind() == ErrorKind::AddrInUse && left_over() => {
                std::fs::remove_file(&path).and_then(|()| UnixListener::bind(&path))
            }
            other => other,
        };
        let listening = bound.and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
        match listening {
            Ok(listener) => Ok(Self { listener, host: None, file: identity(&path).map(|found| (path, found)) }),
            Err(source) => Err(EmulatorError::Io { path, source }),
        }
    }
}

impl<L: Listen> Port for SocketPort<L> {
    type Link = SocketLink<L::Stream>;

    fn link(&mut self) -> Option<&mut Self::Link> {
        if self.host.as_ref().is_none_or(|host| host.gone) {
            let was_there = self.host.take().is_some();
            // Between two hosts there is a moment with none, so that the camera closes the first one's session.
            if !was_there {
                self.host = self.listener.next().ok().map(|stream| SocketLink { stream, gone: false });
            }
        }
        self.host.as_mut()
    }
}

/// Device and inode.
type FileIdentity = (u64, u64);

#[cfg(unix)]
fn identity(path: &Path) -> Option<FileIdentity> {
    let file = std::fs::symlink_metadata(path).ok()?;
    Some((file.dev(), file.ino()))
}

#[cfg(not(unix))]
fn identity(_: &Path) -> Option<FileIdentity> {
    None
}

impl<L: Listen> Drop for SocketPort<L> {
    fn drop(&mut self) {
        // Only the file that was made here: another camera may have put its own in its place.
        if let Some((path, _)) = self.file.as_ref().filter(|(path, made)| identity(path).as_ref() == Some(made)) {
            std::fs::remove_file(path).ok(); // somebody else may just have removed it
        }
    }
}

impl<S> SocketLink<S> {
    fn outcome(&mut self, result: std::io::Result<usize>) -> Result<usize, LinkGone> {
        match result {
            Ok(1..) => result.map_err(|_| LinkGone),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
            _ => {
                self.gone = true;
                Err(LinkGone)
            }
        }
    }
}

impl<S: Read + Write> ByteLink for SocketLink<S> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        if bytes.is_empty() {
            return Ok(0);
        }
        let result = self.stream.read(bytes);
        self.outcome(result)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        if bytes.is_empty() {
            return Ok(0);
        }
        let result = self.stream.write(bytes);
        self.outcome(result)
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_socket_is_left_alone() {
        let path = std::env::temp_dir().join(format!("brewster-port-{}", std::process::id()));
        std::fs::write(&path, "precious").unwrap();
        assert!(UnixPort::bind(path.clone()).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"precious");
        std::fs::remove_file(&path).unwrap();

        // The file of a camera that crashed is replaced; a newer camera's file is not taken along.
        drop(UnixListener::bind(&path).unwrap());
        let old = UnixPort::bind(path.clone()).unwrap();
        std::fs::remove_file(&path).unwrap();
        let new = UnixPort::bind(path.clone()).unwrap();
        drop(old);
        assert!(path.exists());
        drop(new);
        assert!(!path.exists());
    }
}
