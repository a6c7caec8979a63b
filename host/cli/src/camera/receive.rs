//! Fetching the planes of a capture, through a link that may break.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use host_link::replay::Planes;
use host_link::{LinkError, PlaneBuffer};
use protocol_wire::{CaptureDescription, CaptureId, PlaneKind};

use super::{Opened, link_failure};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::terminal::Terminal;

/// How long to try to reach a camera again that was lost in mid-transfer.
const RETURN: Duration = Duration::from_secs(20);

/// How often the link may break before a single strip has come.
const IN_VAIN: u32 = 5;

/// A capture on this side, every strip verified.
pub(crate) struct Received {
    pub(crate) description: CaptureDescription,
    pub(crate) planes: Planes,
    pub(crate) bytes: usize,
    pub(crate) seconds: f64,
    pub(crate) reconnects: u32,
}

/// The planes to fetch: all of the Stokes image, and the raw frames with their maps if `raw`.
fn wanted_planes(description: &CaptureDescription, raw: bool) -> Vec<PlaneKind> {
    let wanted = |kind: PlaneKind| match kind {
        PlaneKind::S0 | PlaneKind::S1 | PlaneKind::S2 | PlaneKind::Flags | PlaneKind::Residual => true,
        PlaneKind::Raw(_) | PlaneKind::DarkMap | PlaneKind::FlatMap => raw,
        PlaneKind::PreviewDolp | PlaneKind::PreviewAolp => false,
    };
    description.planes.iter().map(|plane| plane.kind).filter(|kind| wanted(*kind)).collect()
}

/// Fetches a whole capture; a broken link is opened again and only what is missing is asked for.
pub(crate) fn receive(opened: &mut Opened, id: CaptureId, raw: bool, terminal: &Terminal) -> Result<Received, Failure> {
    let begun = Instant::now();
    let name = opened.name();
    let description = opened.client.describe(id).map_err(|error| link_failure(&error, &name))?;
    let kinds = wanted_planes(&description, raw);
    if raw && !kinds.iter().any(|kind| matches!(kind, PlaneKind::Raw(_))) {
        return Err(Failure::new(
            Exit::BadInput,
            format!("capture {} was taken without its raw frames", id.0),
            "Fetch it without --raw and --verify, or take it again with them.",
        ));
    }
    let mut buffers = Vec::new();
    for kind in kinds {
        buffers.push(PlaneBuffer::new(&description, kind).map_err(|error| link_failure(&error, &name))?);
    }
    let strips: usize = buffers.iter().map(|buffer| usize::from(buffer.missing())).sum();
    let progress = terminal.progress(strips, "fetching");
    let serial = opened.client.identity().serial.clone();
    let mut reconnects = 0;
    let mut in_vain = 0;
    loop {
        let before: u32 = buffers.iter().map(|buffer| u32::from(buffer.missing())).sum();
        match fetch_missing(opened, &description, &mut buffers, |done| progress.set_position(done as u64)) {
            Ok(()) => break,
            Err(LinkError::Gone) => {
                let after: u32 = buffers.iter().map(|buffer| u32::from(buffer.missing())).sum();
                in_vain = if after < before { 0 } else { in_vain + 1 };
                if in_vain == IN_VAIN {
                    return Err(link_failure(&LinkError::Gone, &name)
                        .map_text(|text| format!("{text}, {IN_VAIN} times in a row before a single strip had come")));
                }
                progress.set_message("waiting");
                return_to(opened, &name)?;
                // It may be another camera, or one that was restarted and has taken another capture since.
                let again = opened.client.describe(id).map_err(|error| link_failure(&error, &name))?;
                if opened.client.identity().serial != serial || again != description {
                    return Err(link_failure(&LinkError::OtherCapture { id }, &name));
                }
                progress.set_message("fetching");
                reconnects += 1;
            }
            Err(error) => return Err(bad_line(&error, opened, &name)),
        }
    }
    progress.finish_and_clear();
    let planes: Planes = buffers
        .into_iter()
        .filter_map(|buffer| Some((buffer.info().kind, buffer.into_bytes()?)))
        .collect::<HashMap<_, _>>();
    let bytes = planes.values().map(Vec::len).sum();
    Ok(Received { description, planes, bytes, seconds: begun.elapsed().as_secs_f64(), reconnects })
}

/// A failure on a line that damages what it carries is the line's.
fn bad_line(error: &LinkError, opened: &Opened, name: &str) -> Failure {
    let counters = opened.client.counters();
    if !matches!(error, LinkError::Timeout { .. }) || counters.damaged + counters.skipped_bytes == 0 {
        return link_failure(error, name);
    }
    Failure::new(
        Exit::Device,
        format!(
            "{name}: the line damages data: {} frames damaged, {} bytes of no frame",
            counters.damaged, counters.skipped_bytes
        ),
        "Try another cable or port. The capture is still on the camera: `brewster fetch` gets it.",
    )
}

fn fetch_missing(
    opened: &mut Opened,
    description: &CaptureDescription,
    buffers: &mut [PlaneBuffer],
    mut progress: impl FnMut(usize),
) -> Result<(), LinkError> {
    let mut before = 0;
    for buffer in buffers {
        opened.client.fetch_plane(description, buffer, |held, _| progress(before + usize::from(held)))?;
        before += usize::from(buffer.info().strips);
    }
    Ok(())
}

/// Opens a new session with a camera that was lost, for as long as it makes sense to wait.
fn return_to(opened: &mut Opened, name: &str) -> Result<(), Failure> {
    let deadline = Instant::now() + RETURN;
    loop {
        match opened.reopen() {
            None => return Err(link_failure(&LinkError::Gone, name)),
            Some(Ok(())) => return Ok(()),
            Some(Err(error)) if Instant::now() > deadline => return Err(link_failure(&error, name)),
            Some(Err(_)) => std::thread::sleep(Duration::from_millis(250)),
        }
    }
}
