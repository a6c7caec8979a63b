//! Figures of docs/: log-log lines in SVG.

use crate::process;
use anyhow::{Context, Result, anyhow};
use plotters::prelude::*;

/// One line of a figure.
pub(super) struct Line {
    pub(super) name: String,
    /// (x, y), both > 0.
    pub(super) points: Vec<(f64, f64)>,
}

/// Writes `docs/figures/NAME.svg`.
pub(super) fn log_log(name: &str, [title, x, y]: [&str; 3], lines: &[Line]) -> Result<()> {
    let folder = process::root().join("docs/figures");
    std::fs::create_dir_all(&folder)?;
    let path = folder.join(format!("{name}.svg"));
    draw(&path, [title, x, y], lines).map_err(|e| anyhow!("{e}")).with_context(|| path.display().to_string())
}

fn draw(
    path: &std::path::Path,
    [title, x, y]: [&str; 3],
    lines: &[Line],
) -> Result<(), Box<dyn std::error::Error + 'static>> {
    let points = || lines.iter().flat_map(|line| &line.points);
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let low = points().map(pick).fold(f64::INFINITY, f64::min);
        let high = points().map(pick).fold(0.0, f64::max);
        (0.7 * low..1.5 * high).log_scale()
    };
    let root = SVGBackend::new(path, (760, 480)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
    let number = |v: &f64| format!("{v:.0e}");
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .light_line_style(WHITE.mix(0.0))
        .draw()?;
    for (k, line) in lines.iter().enumerate() {
        let color = Palette99::pick(k).to_rgba();
        chart
            .draw_series(LineSeries::new(line.points.iter().copied(), color.stroke_width(2)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        chart.draw_series(line.points.iter().map(|p| Circle::new(*p, 3, color.filled())))?;
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.3)).draw()?;
    root.present()?;
    Ok(())
}
