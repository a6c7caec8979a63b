//! The simulator: what planning saves, and what a tolerance costs.

use super::bench;
use super::figure::{Line, log_log};
use anyhow::{Context, Result};
use std::fmt::Write;

const FIGURE: &str = "simulator-tolerance";

/// The section, and its figure.
pub(super) fn section() -> Result<String> {
    let mut text = String::from("## The simulator\n\n");
    text.push_str(
        "`cargo bench -p host-sim --bench optical -- planning accuracy`, one thread. What planning saves against the same picture \
         with all effects on, evaluated to the same accuracy, at a tolerance of 0.01 and 1024 \u{d7} 1024 pixels; least of five \
         runs in turns, ns per pixel of three bands. `loop` is the pixel loop alone; `warm` has survey, planning, light and tables \
         in it and writes into the memory of an earlier picture; `cold` the same into fresh memory.\n\n",
    );
    let planning = bench("host-sim", "optical", &["planning"])?;
    text.push_str("| scene | kind | planned | all effects | times faster |\n|---|---|---|---|---|\n");
    for row in rows(&planning).filter(|row| row.len() == 5 && row[1] != "survey_and_planning") {
        writeln!(text, "| {} | {} | {} | {} | {} |", row[0].replace('_', " "), row[1], row[2], row[3], row[4])?;
    }
    for row in rows(&planning).filter(|row| row.get(1) == Some(&"survey_and_planning")) {
        writeln!(text, "\nSurvey and planning of {} alone: {} ns per pixel.", row[0].replace('_', " "), row[2])?;
    }
    text.push_str(
        "\nTolerance against time and measured error of a flat rough plane, light and tables included. The reference is adaptive \
         quadrature to 1e-7 under formulas, and the finest cells under the photographed map. Errors are |\u{394}s|/s0; `0 nodes`: \
         no table served, every pixel is evaluated for itself.\n\n",
    );
    let accuracy = bench("host-sim", "optical", &["accuracy"])?;
    text.push_str(
        "| light | \u{3b1} | tolerance | ns/pixel | nodes | rms error | worst error |\n|---|---|---|---|---|---|---|\n",
    );
    let mut lines: Vec<Line> = Vec::new();
    for row in rows(&accuracy).filter(|row| row.len() == 8) {
        writeln!(text, "| {} | {} | {} | {} | {} | {} | {} |", row[0], row[1], row[2], row[3], row[4], row[5], row[6])?;
        let name = format!("{}, \u{3b1} {}", row[0], row[1]);
        let number = |k: usize| row[k].parse::<f64>().with_context(|| format!("{:?} is no number", row[k]));
        let point = (number(3)?, number(6)?.max(1e-9));
        match lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => lines.push(Line { name, points: vec![point] }),
        }
    }
    let words = ["Worst error against time, by tolerance", "ns per pixel of three bands, one thread", "worst |ds|/s0"];
    log_log(FIGURE, words, &lines)?;
    writeln!(text, "\n![worst error against time](figures/{FIGURE}.svg)\n")?;
    Ok(text)
}

/// The cells of a bench's tables.
fn rows(output: &str) -> impl Iterator<Item = Vec<&str>> {
    output.lines().filter(|line| !line.starts_with('#')).map(|line| line.split('\t').collect())
}
