//! From a fetched capture to a folder a person can use; and only then may the camera forget it.

use std::path::Path;

use host_fit::Statistics;
use host_image::StokesImage;
use host_link::LinkError;
use host_link::replay::{ReplayReport, replay};
use protocol_polar::Flags;
use serde_json::{Value, json};

use super::{Opened, Received};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures;
use crate::report::Report;
use crate::terminal::{Outcome, Terminal};

/// What a user may say about that.
#[derive(clap::Args)]
pub(crate) struct DeliveryArgs {
    /// Compute every integer anew on this side, from the raw frames, and compare bit for bit
    #[arg(long)]
    pub(crate) verify: bool,
    /// Also write the raw frames
    #[arg(long)]
    pub(crate) raw: bool,
    /// Leave the capture on the camera
    #[arg(long)]
    pub(crate) keep: bool,
}

impl DeliveryArgs {
    /// Whether the capture must have its raw frames.
    pub(crate) fn needs_raw(&self) -> bool {
        self.verify || self.raw
    }
}

/// What to do with a fetched capture.
pub(crate) struct Delivery<'a> {
    /// The command, for the record.
    pub(crate) command: &'static str,
    /// Title and first sentence of the report.
    pub(crate) title: (&'a str, &'a str),
    /// The user's wishes.
    pub(crate) args: &'a DeliveryArgs,
    /// Further facts: what is printed and stands in the report, and in JSON under `extra`.
    pub(crate) extra: Option<Extra<'a>>,
}

/// Facts that a command computes from the image.
pub(crate) type Extra<'a> = &'a dyn Fn(&StokesImage) -> (Vec<(&'static str, String)>, Value);

/// Verifies, writes and releases.
pub(crate) fn deliver(
    opened: &mut Opened,
    received: &Received,
    folder: OutputFolder,
    delivery: &Delivery,
    terminal: &Terminal,
) -> Result<Outcome, Failure> {
    let identity = opened.client.identity().clone();
    let image = received.image(&identity.serial, &format!("{}, sensor {}", identity.board, identity.sensor.model));
    let verdict = delivery.args.verify.then(|| verify(received)).transpose()?;
    let statistics = statistics(&image);
    warn_of_findings(&statistics, terminal);

    let figures = pictures::write(&image, &folder, None, terminal)?;
    if delivery.args.raw {
        write_raw(received, &folder)?;
    }
    let mut facts = facts(received, &identity, &statistics, verdict.as_ref());
    let (more, extra_json) = delivery.extra.map(|extra| extra(&image)).unwrap_or_default();
    facts.extend(more);

    let mut report = Report::new(delivery.title.0, delivery.title.1);
    terminal.warnings().into_iter().for_each(|text| report.warning(text));
    facts.iter().for_each(|(name, value)| report.fact(*name, value));
    figures.into_iter().for_each(|figure| report.figure(figure));
    pictures::write_report(&report, &folder)?;

    let mut json = json(received, &identity, &statistics, verdict.as_ref(), delivery, terminal);
    if let Some(object) = json.as_object_mut().filter(|_| delivery.extra.is_some()) {
        object.insert("extra".into(), extra_json);
    }
    let mut json = folder.commit(json)?;

    // All is on this side under its final name: now the camera may forget it.
    let mut released = false;
    if !delivery.args.keep {
        // Not one of the same name that the camera has taken after a restart.
        let id = received.description.id;
        let same = opened
            .client
            .describe(id)
            .and_then(|held| if held == received.description { Ok(()) } else { Err(LinkError::OtherCapture { id }) });
        match same.and_then(|()| opened.client.release(id)) {
            Ok(()) => released = true,
            Err(error) => terminal.warn(format!(
                "the files are complete, but the camera still holds capture {}: {error}",
                received.description.id.0
            )),
        }
    }
    if let Some(object) = json.as_object_mut() {
        object.insert("released".into(), json!(released));
    }
    let output = json.get("output").and_then(Value::as_str).unwrap_or_default().to_owned();
    let mut text: String = facts.iter().map(|(name, value)| format!("{name:<20} {value}\n")).collect();
    text.push_str(&pictures::places(&output, image.colors.iter().any(|c| c.residual.is_some())));
    if delivery.args.raw {
        text.push_str(&format!("  {:<40} the frames the sensor gave\n", Path::new(&output).join("raw").display()));
    }
    Ok(Outcome { text, brief: format!("{output}\n"), json })
}

fn verify(received: &Received) -> Result<ReplayReport, Failure> {
    let report = replay(&received.description, &received.planes).map_err(|error| {
        Failure::new(
            Exit::BadInput,
            format!("cannot verify: {error}"),
            "Take the capture with --verify, which keeps raw frames.",
        )
    })?;
    if report.differing > 0 || report.worst_of_bound > 1.0 {
        let (row, column) = report.first_differing.unwrap_or_default();
        return Err(Failure::new(
            Exit::Device,
            format!(
                "the camera's integers are not what its raw frames give: {} of {} photosites differ, the first at row {row}, \
                 column {column}; largest error {:.2} of the proved bound",
                report.differing, report.photosites, report.worst_of_bound
            ),
            "This is a defect of firmware or camera. The capture is still on the camera; report it with its raw frames \
             (`brewster fetch --raw`).",
        ));
    }
    Ok(report)
}

fn statistics(image: &StokesImage) -> Statistics {
    let Some(planes) = image.colors.first() else { return Statistics::default() };
    Statistics::gather([&planes.s0, &planes.s1, &planes.s2], planes.flags.as_deref(), planes.residual.as_deref())
}

fn warn_of_findings(statistics: &Statistics, terminal: &Terminal) {
    let percent = |flag| statistics.percent(statistics.count(flag));
    if percent(Flags::TOO_FEW) > 1.0 {
        terminal.warn(format!(
            "{:.1} % of the photosites are saturated in so many frames that they have no value: expose less",
            percent(Flags::TOO_FEW)
        ));
    }
    if percent(Flags::MISFIT) > 1.0 {
        terminal.warn(format!(
            "{:.1} % of the photosites do not follow the polarizer model: something moved, the light changed, or the wheel \
             slipped",
            percent(Flags::MISFIT)
        ));
    }
    if statistics.percent(statistics.no_light) > 99.9 {
        terminal.warn("there is no light in this capture (s0 <= 0 everywhere): is the lens capped?");
    }
}

fn facts(
    received: &Received,
    identity: &protocol_wire::Identity,
    statistics: &Statistics,
    verdict: Option<&ReplayReport>,
) -> Vec<(&'static str, String)> {
    let d = &received.description;
    let percent = |flag: Flags| format!("{:.3} %", statistics.percent(statistics.count(flag)));
    let angles: Vec<String> = d.frames.iter().map(|frame| format!("{:.2}\u{b0}", frame.angle_deg)).collect();
    let measured = if d.frames.iter().all(|frame| frame.measured) { "measured" } else { "commanded" };
    let exposures: Vec<String> =
        d.frames.iter().map(|frame| format!("{:.3}", f64::from(frame.exposure_us) / 1e3)).collect();
    let same = exposures.windows(2).all(|pair| matches!(pair, [a, b] if a == b));
    let exposures = if same { exposures.into_iter().take(1).collect() } else { exposures };
    let bits = if d.word == protocol_wire::Word::I16 { 16 } else { 32 };
    let [b0, b1, b2] = d.bound_dn;
    let map = |has: bool, name: &str| if has { name.to_owned() } else { format!("no {name}") };
    let mut facts = vec![
        ("camera", format!("{} ({}), firmware {}", identity.board, identity.serial, identity.firmware)),
        ("capture", d.id.0.to_string()),
        ("frames", format!("{} of {} x {} photosites", d.frames.len(), d.sensor.width, d.sensor.height)),
        ("angles", format!("{} ({measured})", angles.join(", "))),
        ("exposure", format!("{} ms", exposures.join(", "))),
        (
            "corrections",
            format!("{}, {}", map(d.calibration.dark_map, "dark map"), map(d.calibration.flat_map, "flat field")),
        ),
        (
            "fixed point",
            format!(
                "{bits} bits, {} of them fractional; proved error at most {b0:.3}, {b1:.3}, {b2:.3} DN where no sample was \
                 dropped{}",
                d.frac_bits,
                if d.calibration.flat_map { ", times the flat gain" } else { "" }
            ),
        ),
        ("saturated", percent(Flags::SATURATED)),
        ("without a value", percent(Flags::TOO_FEW)),
        (
            "misfit",
            if d.frames.len() > 3 {
                percent(Flags::MISFIT)
            } else {
                "not seen with three frames; four or more show it".into()
            },
        ),
        ("mean s0", format!("{:.1} DN", statistics.mean_s0)),
        ("mean DoLP", format!("{:.4}", statistics.mean_dolp)),
        (
            "received",
            format!(
                "{:.2} MB in {:.2} s, every strip verified{}",
                received.bytes as f64 / 1e6,
                received.seconds,
                if received.reconnects == 0 { String::new() } else { format!("; {} reconnects", received.reconnects) }
            ),
        ),
    ];
    if let Some(verdict) = verdict {
        facts.push((
            "verified",
            format!(
                "all {} photosites bit-identical with the host's replay; largest error against f64 least squares {:.3} DN, \
                 {:.0} % of the proved bound",
                verdict.photosites,
                verdict.worst_dn.iter().copied().fold(0.0, f64::max),
                100.0 * verdict.worst_of_bound
            ),
        ));
    }
    facts
}

fn json(
    received: &Received,
    identity: &protocol_wire::Identity,
    statistics: &Statistics,
    verdict: Option<&ReplayReport>,
    delivery: &Delivery,
    terminal: &Terminal,
) -> Value {
    let d = &received.description;
    let flags: serde_json::Map<String, Value> = Flags::NAMES
        .iter()
        .zip(statistics.flagged)
        .map(|((_, name), count)| (name.replace(' ', "_"), json!(statistics.percent(count))))
        .collect();
    json!({
        "command": delivery.command,
        "version": env!("CARGO_PKG_VERSION"),
        "camera": { "serial": identity.serial, "board": identity.board, "firmware": identity.firmware },
        "capture": d.id.0,
        "width": d.sensor.width,
        "height": d.sensor.height,
        "angles_deg": d.frames.iter().map(|frame| frame.angle_deg).collect::<Vec<_>>(),
        "angles_measured": d.frames.iter().all(|frame| frame.measured),
        "exposure_us": d.frames.iter().map(|frame| frame.exposure_us).collect::<Vec<_>>(),
        "word_bits": if d.word == protocol_wire::Word::I16 { 16 } else { 32 },
        "frac_bits": d.frac_bits,
        "bound_dn": d.bound_dn,
        "black_level_dn": d.sensor.black_level_dn,
        "white_level_dn": d.sensor.white_level_dn,
        "efficiency": d.frames.iter().map(|frame| frame.efficiency).collect::<Vec<_>>(),
        "dark_map": d.calibration.dark_map,
        "flat_map": d.calibration.flat_map,
        "mean_s0_dn": statistics.mean_s0,
        "mean_dolp": statistics.mean_dolp,
        "percent": flags,
        "received_bytes": received.bytes,
        "received_seconds": received.seconds,
        "reconnects": received.reconnects,
        "verified": verdict.map(|v| json!({
            "photosites": v.photosites,
            "differing": v.differing,
            "worst_dn": v.worst_dn,
            "worst_of_bound": v.worst_of_bound,
        })),
        "warnings": terminal.warnings(),
    })
}

/// `raw/pol_060.130deg.png` and so on: names from which `brewster stokes` reads the angles. The second frame at the very
/// same angle is `pol_060.130deg_2.png`.
fn write_raw(received: &Received, folder: &OutputFolder) -> Result<(), Failure> {
    let raw = folder.path().join("raw");
    std::fs::create_dir(&raw).map_err(|error| pictures::unwritable(folder, &error))?;
    for (slot, frame) in (0_u8..).zip(&received.description.frames) {
        let Some(picture) = received.raw(slot) else { continue };
        let name = format!("pol_{:07.3}deg", frame.angle_deg.rem_euclid(180.0));
        let mut path = raw.join(format!("{name}.png"));
        let mut number = 2;
        while path.exists() {
            path = raw.join(format!("{name}_{number}.png"));
            number += 1;
        }
        picture.write_png(&path).map_err(|error| Failure::writing(&error))?;
    }
    Ok(())
}
