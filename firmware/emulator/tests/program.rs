//! The program as people start it: it says where it listens, answers there, and leaves cleanly when told to.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a program that does not start is a failed test")]

use protocol_wire::{Deframer, Event, FromDevice, FromHost, Identify};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brewster-camera"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Starts it and returns what it says first.
fn started(arguments: &[&str]) -> (Child, String) {
    let mut child = program(arguments).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    (child, line.trim().to_owned())
}

/// Asks who is there.
fn identify(mut stream: impl Read + Write) -> (u32, u32) {
    let mut frame = [0; 128];
    let length = FromHost::Identify(Identify { host: "test".try_into().unwrap() }).encode(1, 0, &mut frame).unwrap();
    stream.write_all(&frame[..length]).unwrap();
    let mut deframer = Deframer::new(vec![0; 4096]);
    loop {
        let n = stream.read(deframer.space()).unwrap();
        assert!(n > 0, "the camera hung up");
        deframer.commit(n);
        if let Some(Event::Frame(header, payload)) = deframer.next_event() {
            let Ok(Some(FromDevice::Identity(identity))) = FromDevice::decode(header.key, payload) else {
                panic!("another answer: {header:?}")
            };
            return (identity.sensor.width, identity.sensor.height);
        }
    }
}

fn terminate(mut child: Child) {
    let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(killed.success() && child.wait().unwrap().success());
}

#[test]
fn it_answers_on_tcp() {
    let (child, line) = started(&["--tcp", "127.0.0.1:0", "--source", "uniform:1000,0.5,30"]);
    let address = line.strip_prefix("listening on tcp:").unwrap();
    assert_eq!(identify(TcpStream::connect(address).unwrap()), (1280, 960));
    terminate(child);
}

#[test]
fn it_answers_on_a_unix_socket_and_removes_it() {
    let path = std::env::temp_dir().join(format!("brewster-camera-{}.sock", std::process::id()));
    let path_text = path.to_str().unwrap();
    let (child, line) = started(&["--unix", path_text]);
    assert_eq!(line, format!("listening on unix:{path_text}"));
    assert_eq!(identify(UnixStream::connect(&path).unwrap()), (1280, 960));
    let second = program(&["--unix", path_text]).output().unwrap();
    assert!(!second.status.success(), "the socket is in use");
    terminate(child);
    assert!(!path.exists());
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    for (arguments, hint) in [
        (&["--tcp", "0.0.0.0:0"][..], "not a loopback address"),
        (&["--tcp", "127.0.0.1:0", "--source", "moon"], "wheel-chart"),
        (&["--tcp", "127.0.0.1:0", "--source", "replay:/nonexistent"], "/nonexistent"),
        (&["--tcp", "127.0.0.1:0", "--board", "/nonexistent.toml"], "/nonexistent.toml"),
        (&[], "--unix"),
    ] {
        let output = program(arguments).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && said.contains(hint), "{arguments:?}: {said}");
    }
}
