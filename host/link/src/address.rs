//! Where a camera is, as people write it: `usb`, `usb:SERIAL`, `tcp:HOST:PORT`, `unix:PATH`.

use crate::tcp::Tcp;
use crate::usb::Usb;
use crate::{LinkError, Transport};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

/// Where a camera is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// On USB; with this serial number, or the only one.
    Usb(Option<String>),
    /// Behind a TCP port, `host:port`.
    Tcp(String),
    /// Behind a Unix socket.
    Unix(PathBuf),
}

impl FromStr for Address {
    type Err = LinkError;

    fn from_str(text: &str) -> Result<Self, LinkError> {
        let wrong = |expected| Err(LinkError::Address { text: text.to_owned(), expected });
        let (kind, rest) = text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest)));
        match (kind, rest) {
            ("usb", None) => Ok(Self::Usb(None)),
            ("usb", Some("")) => wrong("a serial number after `usb:`"),
            ("usb", Some(serial)) => Ok(Self::Usb(Some(serial.to_owned()))),
            ("tcp", Some(host_port)) => match host_port.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0) => {
                    Ok(Self::Tcp(host_port.to_owned()))
                }
                _ => wrong("tcp:HOST:PORT with a port of 1 to 65535"),
            },
            ("unix", Some(path)) if !path.is_empty() => Ok(Self::Unix(PathBuf::from(path))),
            ("unix", _) => wrong("unix:PATH"),
            ("tcp", None) => wrong("tcp:HOST:PORT"),
            _ => wrong("usb, usb:SERIAL, tcp:HOST:PORT or unix:PATH"),
        }
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Usb(None) => f.write_str("usb"),
            Self::Usb(Some(serial)) => write!(f, "usb:{serial}"),
            Self::Tcp(host_port) => write!(f, "tcp:{host_port}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

impl Address {
    /// Opens the transport there; sockets within `timeout`.
    ///
    /// # Errors
    /// As the transports say.
    pub fn open(&self, timeout: Duration) -> Result<Box<dyn Transport>, LinkError> {
        Ok(match self {
            Self::Usb(serial) => Box::new(Usb::open(serial.as_deref())?),
            Self::Tcp(host_port) => Box::new(Tcp::connect(host_port, timeout)?),
            #[cfg(unix)]
            Self::Unix(path) => Box::new(crate::unix::Unix::connect(path)?),
            #[cfg(not(unix))]
            Self::Unix(_) => return Err(LinkError::Io(std::io::ErrorKind::Unsupported.into())),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_shown_the_same() {
        for text in ["usb", "usb:BW-0007", "usb:a:b", "tcp:localhost:7700", "tcp:[::1]:7700", "unix:/run/camera.sock"] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
        assert_eq!("tcp:[::1]:7700".parse::<Address>().unwrap(), Address::Tcp("[::1]:7700".to_owned()));
    }

    #[test]
    fn a_wrong_address_says_what_would_be_right() {
        for (text, hint) in [
            ("", "usb, usb:SERIAL, tcp:HOST:PORT or unix:PATH"),
            ("serial:/dev/ttyUSB0", "usb, usb:SERIAL"),
            ("usb:", "serial number"),
            ("tcp", "tcp:HOST:PORT"),
            ("tcp:7700", "tcp:HOST:PORT"),
            ("tcp:localhost:", "1 to 65535"),
            ("tcp:localhost:0", "1 to 65535"),
            ("tcp:localhost:65536", "1 to 65535"),
            ("tcp::80", "tcp:HOST:PORT"),
            ("unix:", "unix:PATH"),
        ] {
            let said = text.parse::<Address>().unwrap_err().to_string();
            assert!(said.contains(hint) && said.contains(&format!("`{text}`")), "{text:?}: {said}");
        }
    }
}
