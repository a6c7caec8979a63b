//! `brewster-camera`: an emulated camera behind a socket, for a host that shall not know the difference.

use anyhow::{Context, bail};
use boards::Board;
use clap::Parser;
#[cfg(unix)]
use firmware_emulator::UnixPort;
use firmware_emulator::{Clock, Source, TcpPort, start};
use signal_hook::consts::{SIGINT, SIGTERM};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// An emulated brewster camera: the real firmware around emulated chips.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Board file; the built-in emulated board where not given.
    #[arg(long, value_name = "FILE")]
    board: Option<PathBuf>,
    /// What the camera looks at: wheel-chart, uniform:S0,DOLP,AOLP_DEG or replay:PATH[?mosaic=imx250mzr].
    #[arg(long, value_name = "SPEC", default_value = "wheel-chart")]
    source: Source,
    /// Listen on a Unix socket at this path.
    #[arg(long, value_name = "PATH", required_unless_present = "tcp", conflicts_with = "tcp")]
    unix: Option<PathBuf>,
    /// Listen on this loopback address, such as 127.0.0.1:7000; port 0 is any free one.
    #[arg(long, value_name = "ADDRESS")]
    tcp: Option<SocketAddr>,
    /// Take the time that wheel and exposures take.
    #[arg(long)]
    real_time: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let board = match &arguments.board {
        Some(file) => Board::read(file)?,
        None => Board::parse(boards::EMULATED_TOML, Path::new("emulated.toml"))?,
    };
    let clock = if arguments.real_time { Clock::real_time() } else { Clock::virtual_time() };
    let (running, listening) = match (arguments.tcp, &arguments.unix) {
        (Some(address), _) => {
            let port = TcpPort::bind(address)?;
            let address = port.address().context("the socket has no address")?;
            (start(&board, &arguments.source, clock, port)?, format!("tcp:{address}"))
        }
        #[cfg(unix)]
        (None, Some(path)) => {
            let listening = format!("unix:{}", path.display());
            (start(&board, &arguments.source, clock, UnixPort::bind(path.clone())?)?, listening)
        }
        _ => bail!("nowhere to listen: give --tcp ADDRESS"),
    };
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, running.stop_flag()).context("no handler for signals")?;
    }
    // Whoever starts this program waits for this line: from here on it answers, and can be told to end.
    println!("listening on {listening}");
    running.wait();
    Ok(())
}
