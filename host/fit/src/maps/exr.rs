//! Maps as one OpenEXR file: channels `albedo.R`, `eta`, `normal.X`, `sigma.eta`, ...; uint channels `freedom`, `views`,
//! `reasons`; the covariance, where it is kept, as `covariance.00` ... `covariance.66` (row and column, upper triangle).
//!
//! Attributes `brewster:schema`, `convention`, `grid` (columns, rows, left, right, bottom, top), `reasons` (the names of
//! the bits, from bit 0, with commas between), and those of [`MaterialMaps::attributes`].

use std::path::Path;

use host_image::{ImageError, Layers};

use super::{COVARIANCES, Grid, MapsError, MaterialMaps, Plane, PlaneRect};

const SCHEMA: &str = "material 1";
const CONVENTION: &str =
    "rows run down, toward smaller plane y; normals in the world, x right, y up, z from the plane; NaN: not fitted";
const INTEGERS: [&str; 3] = ["freedom", "views", "reasons"];
/// Attributes of our own.
const OWN: [&str; 4] = ["schema", "convention", "grid", "reasons"];

impl MaterialMaps {
    /// Saves as one OpenEXR file: lossless, atomic, the same maps give the same bytes.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`] before a file is touched; [`MapsError::Image`].
    pub fn save_exr(&self, path: &Path) -> Result<(), MapsError> {
        self.check()?;
        if let Some(name) = self.reason_names.iter().find(|n| n.is_empty() || n.contains(',')) {
            return Err(MapsError::Inconsistent { what: format!("a reason called {name:?}") });
        }
        if let Some(name) = OWN.into_iter().find(|n| self.attributes.contains_key(*n)) {
            return Err(MapsError::Inconsistent { what: format!("an attribute called {name}, which has a meaning") });
        }
        let mut layers = Layers::new(self.grid.columns, self.grid.rows);
        for (name, plane) in float_names(!self.covariance.is_empty()).iter().zip(self.float_planes()) {
            layers.lend_f32(name, plane);
        }
        for (name, plane) in INTEGERS.into_iter().zip(self.integer_planes()) {
            layers.lend_u32(name, plane);
        }
        let PlaneRect { left, right, bottom, top } = self.grid.plane;
        let grid = format!("{} {} {left} {right} {bottom} {top}", self.grid.columns, self.grid.rows);
        let own = [SCHEMA.to_owned(), CONVENTION.to_owned(), grid, self.reason_names.join(",")];
        layers.attributes = self.attributes.clone();
        layers.attributes.extend(OWN.into_iter().map(str::to_owned).zip(own));
        Ok(layers.save(path)?)
    }

    /// Loads what [`MaterialMaps::save_exr`] saved, with the same bits.
    ///
    /// # Errors
    /// [`MapsError::Image`]: missing channels and attributes, another schema, files cut short;
    /// [`MapsError::Inconsistent`] for a grid that makes no sense.
    pub fn load_exr(path: &Path) -> Result<Self, MapsError> {
        let mut layers = Layers::load(path)?;
        let schema = layers.required("schema")?;
        if schema != SCHEMA {
            let what = format!("brewster:schema {schema:?}; {SCHEMA:?} is read");
            return Err(ImageError::Unsupported { path: path.into(), what }.into());
        }
        let convention = layers.required("convention")?;
        if convention != CONVENTION {
            let what = format!("brewster:convention {convention:?}; {CONVENTION:?} is read");
            return Err(ImageError::Unsupported { path: path.into(), what }.into());
        }
        let grid = grid(layers.required("grid")?).filter(|g| (g.columns, g.rows) == (layers.width, layers.height));
        let Some(grid) = grid else {
            let what = format!("attribute brewster:grid is {:?}", layers.required("grid")?);
            return Err(ImageError::Malformed { path: path.into(), what }.into());
        };
        let covariance = layers.channels.contains_key("covariance.00");
        let mut maps = Self::new(grid, false);
        let names = layers.required("reasons")?;
        maps.reason_names = names.split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect();
        if covariance {
            maps.covariance = vec![Vec::new(); COVARIANCES];
        }
        for (name, plane) in float_names(covariance).iter().zip(maps.float_planes_mut()) {
            *plane = layers.take_f32(name)?;
        }
        for (name, plane) in INTEGERS.into_iter().zip(maps.integer_planes_mut()) {
            *plane = layers.take_u32(name)?;
        }
        maps.attributes = layers.attributes;
        for name in OWN {
            maps.attributes.remove(name);
        }
        Ok(maps)
    }
}

/// In the order of the planes.
fn float_names(covariance: bool) -> Vec<String> {
    let triangle = (0..7).flat_map(|i| (i..7).map(move |j| format!("covariance.{i}{j}")));
    let covariances = triangle.filter(|_| covariance);
    Plane::ALL.iter().map(|p| p.name().to_owned()).chain(covariances).collect()
}

fn grid(text: &str) -> Option<Grid> {
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let [columns, rows, edges @ ..] = words.as_slice() else { return None };
    let edges: Vec<f64> = edges.iter().map(|e| e.parse().ok()).collect::<Option<_>>()?;
    let [left, right, bottom, top] = *edges.as_slice() else { return None };
    Grid::new(columns.parse().ok()?, rows.parse().ok()?, PlaneRect { left, right, bottom, top }).ok()
}
