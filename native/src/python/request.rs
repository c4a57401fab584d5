//! How Python asks for a picture: the lens, what to draw, and where the arrays come from.
//!
//! Both descriptions are dictionaries made in `scenes.render.native`, which has checked them; the
//! checks here only keep a wrong call from reading out of bounds.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::machine::pool::Pools;
use crate::machine::simd::Simd;
use crate::project::posed::{PosedCloud, View};
use crate::project::scope::Scope;
use crate::project::tile_box::TILE;
use crate::python::check::check_length;
use crate::python::cloud::PreparedCloud;
use crate::python::lens::LensRequest;
use crate::render::job::{Background, Job, Picture, MAX_SIDE};

/// What to draw, and on what.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct DrawRequest<'py> {
    background: [f32; 3],
    /// Flat, instead of one colour.
    backdrop: Option<PyReadonlyArray1<'py, f32>>,
    /// Left, top, width, height.
    region: Option<[usize; 4]>,
    tile_mask: Option<PyReadonlyArray1<'py, bool>>,
    near: f64,
    antialias: bool,
    sh_degree: usize,
    exact_above: f64,
    pub(crate) threads: usize,
    /// The object whose share of each pixel is drawn instead of colours.
    pub(crate) marked: Option<u32>,
}

impl DrawRequest<'_> {
    pub(crate) fn view(&self, lens: &LensRequest) -> PyResult<View> {
        let (width, height) = lens.size();
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(PyValueError::new_err(format!(
                "camera: {width}×{height} px, wanted 1 to {MAX_SIDE} each way"
            )));
        }
        if self.sh_degree > 3 || !(self.near > 0.0 && self.near.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "sh_degree {} (wanted 0 to 3), near {} m (wanted finite, above 0)",
                self.sh_degree, self.near
            )));
        }
        Ok(View {
            width,
            height,
            near: self.near,
            antialias: self.antialias,
            sh_degree: self.sh_degree,
            exact_above: self.exact_above,
        })
    }

    pub(crate) fn scope(&self, view: &View) -> PyResult<Scope> {
        if let Some([left, top, wide, high]) = self.region {
            if left.saturating_add(wide) > view.width || top.saturating_add(high) > view.height {
                return Err(PyValueError::new_err(format!(
                    "region: {:?}, wanted one within {}×{} px",
                    self.region, view.width, view.height
                )));
            }
        }
        let tiles = self.tile_mask.as_ref();
        let tiles = tiles.map(|mask| mask.as_slice()).transpose()?;
        let wanted = view.width.div_ceil(TILE) * view.height.div_ceil(TILE);
        if let Some(tiles) = tiles {
            check_length("tile_mask", tiles, wanted)?;
        }
        Ok(Scope::new([view.width, view.height], self.region, tiles))
    }

    /// The job of a call: these options, the engine's instructions and threads.
    pub(crate) fn job<'a>(
        &'a self,
        view: View,
        scope: &'a Scope,
        simd: Simd,
        pool: &'a ThreadPool,
    ) -> PyResult<Job<'a>> {
        Ok(Job {
            view,
            scope,
            background: self.background(&view)?,
            simd,
            pool,
        })
    }

    pub(crate) fn background(&self, view: &View) -> PyResult<Background<'_>> {
        let Some(backdrop) = &self.backdrop else {
            return Ok(Background::Plain(self.background));
        };
        let values = backdrop.as_slice()?;
        check_length("background", values, 3 * view.width * view.height)?;
        Ok(Background::Picture(values))
    }
}

/// A background that outlives the call it came with.
pub(crate) enum KeptBackground {
    Plain([f32; 3]),
    Picture(Vec<f32>),
}

impl KeptBackground {
    pub(crate) fn of(background: &Background) -> KeptBackground {
        match background {
            Background::Plain(colour) => KeptBackground::Plain(*colour),
            Background::Picture(values) => KeptBackground::Picture(values.to_vec()),
        }
    }

    pub(crate) fn borrow(&self) -> Background<'_> {
        match self {
            KeptBackground::Plain(colour) => Background::Plain(*colour),
            KeptBackground::Picture(values) => Background::Picture(values),
        }
    }
}

/// Poses of `count` clouds, twelve values (3×4, row by row) each.
pub(crate) fn pose_rows(
    poses: &[f64],
    count: usize,
) -> PyResult<impl Iterator<Item = [f64; 12]> + '_> {
    check_length("camera_from_object", poses, 12 * count)?;
    let rows = poses.chunks_exact(12);
    Ok(rows.map(|row| std::array::from_fn(|entry| row[entry])))
}

/// Clouds with their poses.
pub(crate) fn posed_clouds<'a>(
    clouds: &'a [Bound<'_, PreparedCloud>],
    poses: &[f64],
) -> PyResult<Vec<PosedCloud<'a>>> {
    let poses = pose_rows(poses, clouds.len())?;
    let objects = clouds.iter().zip(poses).enumerate();
    Ok(objects
        .map(|(index, (cloud, pose))| PosedCloud::new(&cloud.get().cloud, &pose, index))
        .collect())
}

pub(crate) fn pool_of(pools: &Pools, threads: usize) -> PyResult<Arc<ThreadPool>> {
    pools
        .get(threads)
        .map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))
}

/// Flat arrays of a picture: rgb, alpha, depth, ids.
pub(crate) type PictureArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
);

/// Arrays of zeros for a picture.
pub(crate) fn picture_arrays<'py>(py: Python<'py>, view: &View) -> PictureArrays<'py> {
    let pixels = view.width * view.height;
    (
        PyArray1::zeros(py, 3 * pixels, false),
        PyArray1::zeros(py, pixels, false),
        PyArray1::zeros(py, pixels, false),
        PyArray1::zeros(py, pixels, false),
    )
}

/// Lends a picture's arrays to `draw`; fails if they are in use or of another size.
pub(crate) fn with_picture<R>(
    (rgb, alpha, depth, ids): &PictureArrays<'_>,
    view: &View,
    draw: impl FnOnce(&mut Picture) -> R,
) -> PyResult<R> {
    let mut rgb = rgb.try_readwrite()?;
    let mut alpha = alpha.try_readwrite()?;
    let mut depth = depth.try_readwrite()?;
    let mut ids = ids.try_readwrite()?;
    let pixels = view.width * view.height;
    check_length("rgb", rgb.as_slice()?, 3 * pixels)?;
    check_length("alpha", alpha.as_slice()?, pixels)?;
    check_length("depth", depth.as_slice()?, pixels)?;
    check_length("ids", ids.as_slice()?, pixels)?;
    Ok(draw(&mut Picture {
        rgb: rgb.as_slice_mut()?,
        alpha: alpha.as_slice_mut()?,
        depth: depth.as_slice_mut()?,
        ids: ids.as_slice_mut()?,
    }))
}
