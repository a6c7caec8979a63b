//! Lines that break while a capture is fetched.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::Path;

use boards::Board;
use firmware_emulator::{Clock, Running, Source, TcpPort, start};

use crate::world::World;

/// A camera on loopback.
fn camera() -> (Running, SocketAddr) {
    let board = Board::parse(boards::EMULATED_TOML, Path::new("emulated.toml")).unwrap();
    let port = TcpPort::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let address = port.address().unwrap();
    (start(&board, &Source::default(), Clock::virtual_time(), port).unwrap(), address)
}

/// A line to `camera` whose n-th connection ends after `limit(n)` bytes towards the host. Gives its name for `--device`.
fn line(camera: SocketAddr, limit: impl Fn(usize) -> usize + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let name = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for (n, host) in listener.incoming().enumerate() {
            let (mut host, mut device) = (host.unwrap(), TcpStream::connect(camera).unwrap());
            let (mut from_host, mut to_device) = (host.try_clone().unwrap(), device.try_clone().unwrap());
            let upwards = std::thread::spawn(move || {
                std::io::copy(&mut from_host, &mut to_device).ok();
                to_device.shutdown(Shutdown::Both).ok(); // the host has left
            });
            let (mut left, mut buffer) = (limit(n), [0; 4096]);
            while left > 0 {
                let Ok(got @ 1..) = device.read(&mut buffer) else { break };
                let passed = got.min(left);
                left -= passed;
                if host.write_all(&buffer[..passed]).is_err() {
                    break;
                }
            }
            for end in [&host, &device] {
                end.shutdown(Shutdown::Both).ok();
            }
            upwards.join().unwrap();
        }
    });
    name
}

#[test]
fn a_fetch_goes_on_after_a_broken_line_and_gives_up_one_that_brings_nothing() {
    let w = World::new();
    let (_running, address) = camera();
    let direct = format!("tcp:{address}");
    w.ok(&["capture", "-d", &direct, "--keep", "-o", "whole"]);

    // Enough for identity and description, never for a strip.
    let useless = line(address, |_| 20_000);
    w.refused(&["fetch", "1", "-d", &useless, "-o", "nothing"], 5, &["5 times in a row", "brewster fetch"]);

    let broken = line(address, |n| if n < 2 { 2_000_000 } else { usize::MAX });
    let result = w.ok(&["--json", "fetch", "1", "-d", &broken, "-o", "again"]).json();
    assert_eq!((result["reconnects"].as_u64(), result["released"].as_bool()), (Some(2), Some(true)));
    let (whole, again) = (w.stokes("whole"), w.stokes("again"));
    assert!(whole.colors == again.colors, "the same planes over a line that broke twice");
    assert!(w.ok(&["fetch", "-d", &direct]).stdout.contains("holds no captures"));
}
