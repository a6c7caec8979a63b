//! The same conversation over each transport is the same bytes, both ways.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod camera;

use camera::{HELD, Report, Socket, camera, patient, plug, tcp};
use host_link::tcp::Tcp;
use host_link::{Address, Client, LinkError, Options, PlaneBuffer, Transport};
use protocol_wire::{Calibrate, PlaneKind};
use std::net::TcpListener;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

const LONG: Duration = Duration::from_secs(10);

fn camera_under_test() -> camera::Camera {
    camera(640, 96, 16)
}

/// One conversation.
fn converse(transport: impl Transport) -> Vec<u8> {
    let options = Options { window: 3, ..patient() };
    let mut client = Client::connect_with(transport, "brewster", options).unwrap();
    client.status().unwrap();
    client.calibrate(Calibrate::Dark { frames: 4 }, |_| ControlFlow::Continue(())).unwrap();
    let description = client.describe(HELD).unwrap();
    let mut plane = PlaneBuffer::new(&description, PlaneKind::S0).unwrap();
    client.fetch_plane(&description, &mut plane, |_, _| {}).unwrap();
    client.release(HELD).unwrap();
    plane.into_bytes().unwrap()
}

fn in_process() -> (Vec<u8>, Report) {
    let (host, running) = plug(camera_under_test());
    (converse(host), running.join().unwrap())
}

#[test]
fn tcp_says_what_in_process_says() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let running = std::thread::spawn(move || camera_under_test().run(tcp(listener.accept().unwrap().0)));
    let transport = address.parse::<Address>().unwrap().open(LONG).unwrap();
    assert!(transport.describe().starts_with("TCP 127.0.0.1:"));
    let plane = converse(transport);
    let report = running.join().unwrap();
    let (same_plane, same) = in_process();
    assert_eq!(plane, same_plane);
    assert_eq!(report.heard, same.heard);
    assert_eq!(report.said, same.said);
}

#[cfg(unix)]
#[test]
fn a_unix_socket_says_what_in_process_says() {
    use std::os::unix::net::UnixListener;
    let path = std::env::temp_dir().join(format!("brewster-link-{}.sock", std::process::id()));
    let listener = UnixListener::bind(&path).unwrap();
    let running = std::thread::spawn(move || {
        let stream = listener.accept().unwrap().0;
        stream.set_nonblocking(true).unwrap();
        camera_under_test().run(Socket(stream))
    });
    let transport = Address::Unix(path.clone()).open(LONG).unwrap();
    std::fs::remove_file(&path).unwrap();
    let plane = converse(transport);
    let report = running.join().unwrap();
    let (same_plane, same) = in_process();
    assert_eq!(plane, same_plane);
    assert_eq!(report.heard, same.heard);
    assert_eq!(report.said, same.said);
}

#[test]
fn a_socket_waits_as_long_as_told_and_knows_when_the_other_end_is_gone() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut host = Tcp::connect(&listener.local_addr().unwrap().to_string(), LONG).unwrap();
    let device = listener.accept().unwrap().0;
    let begin = Instant::now();
    let wait = Duration::from_millis(30);
    assert_eq!(host.read(&mut [0; 8], wait).unwrap(), 0);
    assert!(begin.elapsed() >= wait);
    assert_eq!(host.read(&mut [0; 8], Duration::ZERO).unwrap(), 0);

    // Nobody reads: the system's buffers fill up.
    let begin = Instant::now();
    let error = host.write_all(&vec![0; 64 << 20], Duration::from_millis(200)).unwrap_err();
    assert!(matches!(error, LinkError::Timeout { waiting_for: "room to send" }), "{error}");
    assert!(begin.elapsed() < LONG);

    drop(device);
    let error = host.write_all(&[0; 8], wait).and_then(|()| host.write_all(&[0; 8], wait)).unwrap_err();
    assert!(matches!(error, LinkError::Gone), "{error}");
    assert!(matches!(host.read(&mut [0; 8], wait), Err(LinkError::Gone)));
}

#[test]
fn nobody_at_the_address_is_an_io_error() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let error = Tcp::connect(&format!("127.0.0.1:{port}"), LONG).unwrap_err();
    assert!(matches!(&error, LinkError::Io(io) if io.kind() == std::io::ErrorKind::ConnectionRefused), "{error}");
}
