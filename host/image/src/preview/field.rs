//! A Stokes image made small: averages of Stokes vectors, never of angles.

use protocol_polar::Flags;

use crate::{Color, StokesImage};

/// One Stokes vector per preview pixel; row-major height × width.
pub(super) struct Field {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<Pixel>,
}

/// The mean of one block of photosites.
#[derive(Clone, Copy, Default)]
pub(super) struct Pixel {
    /// s0, s1, s2; `None` where no photosite of the block has a value.
    pub(super) stokes: Option<[f64; 3]>,
    /// Mean residual of the photosites that have a value.
    pub(super) residual: Option<f64>,
    /// All flags of the block.
    pub(super) flags: Flags,
}

/// Weighted sums of one block.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    stokes: [f64; 3],
    residual: f64,
    flags: Flags,
}

impl Field {
    /// Averages blocks of equal size so that at most `max_width` columns remain. A raw mosaic is averaged over whole
    /// 2 × 2 cells at least; R, G, B count 1 : 2 : 1 as they do in such a cell. Photosites flagged `TOO_FEW` hold no
    /// value and are left out. Blocks at the right and lower edge may be smaller.
    pub(super) fn new(image: &StokesImage, max_width: usize) -> Self {
        let mosaic = image.metadata.bayer.is_some() && image.colors.iter().all(|c| c.color == Color::Y);
        let cell = if mosaic { 2 } else { 1 };
        let block = cell * image.width.div_ceil(cell).div_ceil(max_width.max(1));
        let (width, height) = (image.width.div_ceil(block), image.height.div_ceil(block));
        let mut sums = vec![Sums::default(); width * height];
        for planes in &image.colors {
            let weight = if planes.color == Color::G { 2.0 } else { 1.0 };
            let rows =
                planes.s0.chunks(image.width).zip(planes.s1.chunks(image.width)).zip(planes.s2.chunks(image.width));
            for (y, ((s0, s1), s2)) in rows.enumerate() {
                let start = y * image.width;
                let flags = planes.flags.as_deref().and_then(|f| f.get(start..start + image.width));
                let residual = planes.residual.as_deref().and_then(|r| r.get(start..start + image.width));
                let row = y / block * width;
                for (x, ((s0, s1), s2)) in s0.iter().zip(s1).zip(s2).enumerate() {
                    let Some(sum) = sums.get_mut(row + x / block) else { continue };
                    let flag = Flags(flags.and_then(|f| f.get(x)).copied().unwrap_or(0));
                    sum.flags = sum.flags.with(flag);
                    if !flag.contains(Flags::TOO_FEW) {
                        let r = residual.and_then(|r| r.get(x)).copied().unwrap_or(0.0);
                        sum.add(weight, [*s0, *s1, *s2], r);
                    }
                }
            }
        }
        let has_residual = image.colors.iter().all(|c| c.residual.is_some());
        let pixels = sums.iter().map(|s| s.mean(has_residual)).collect();
        Self { width, height, pixels }
    }
}

impl Sums {
    fn add(&mut self, weight: f64, stokes: [f32; 3], residual: f32) {
        self.weight += weight;
        for (sum, s) in self.stokes.iter_mut().zip(stokes) {
            *sum += weight * f64::from(s);
        }
        self.residual += weight * f64::from(residual);
    }

    fn mean(&self, has_residual: bool) -> Pixel {
        let value = self.weight > 0.0;
        Pixel {
            stokes: value.then(|| self.stokes.map(|s| s / self.weight)),
            residual: (value && has_residual).then(|| self.residual / self.weight),
            flags: self.flags,
        }
    }
}
