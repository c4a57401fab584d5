//! What Python sees of drawings that are reduced to contours and points.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::lens::{with_lens, LensRequest};
use crate::track::appearance::reduction;
use crate::track::appearance::reduction::{Line, OutlineModel, SurfaceModel};
use crate::track::contour as outline;
use crate::track::contour::Drawn;
use crate::track::picture::Picture;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;
type Flat<'py, T> = Bound<'py, PyArray1<T>>;

/// Points (camera axes), normals, widths inside and outside, colours.
type ContourArrays<'py> = (
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f32>,
);

/// Left, top, width and height; pixels, points, normals, widths inside and outside; the picture.
type OutlinedArrays<'py> = (
    [usize; 4],
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, f64>,
    (Flat<'py, f32>, Flat<'py, f32>, Flat<'py, f32>),
);

/// Colours inside the contour; texture points, values and slopes; surface points and colours; area.
type LooksArrays<'py> = (
    Flat<'py, f32>,
    (Flat<'py, f64>, Flat<'py, f32>, Flat<'py, f32>),
    (Flat<'py, f64>, Flat<'py, f32>),
    usize,
);

/// A drawing's arrays: colours, alpha, depth.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct DrawnRequest<'py> {
    rgb: Floats<'py>,
    alpha: Floats<'py>,
    depth: Floats<'py>,
}

impl DrawnRequest<'_> {
    pub(crate) fn drawn(&self, (width, height): (usize, usize)) -> PyResult<Drawn<'_>> {
        let drawn = Drawn {
            rgb: Picture {
                values: self.rgb.as_slice()?,
                width,
                height,
            },
            alpha: Picture {
                values: self.alpha.as_slice()?,
                width,
                height,
            },
            depth: self.depth.as_slice()?,
        };
        check_length("rgb", drawn.rgb.values, 3 * width * height)?;
        check_length("alpha", drawn.alpha.values, width * height)?;
        check_length("depth", drawn.depth, width * height)?;
        Ok(drawn)
    }
}

/// The contour of a drawn silhouette.
#[pyfunction]
#[pyo3(signature = (drawn, *, lens, limit, reach_px))]
pub(crate) fn contour<'py>(
    py: Python<'py>,
    drawn: DrawnRequest<'py>,
    lens: LensRequest,
    limit: usize,
    reach_px: f64,
) -> PyResult<ContourArrays<'py>> {
    let drawn = drawn.drawn(lens.size())?;
    let found = py.detach(|| {
        with_lens!(&lens.lens(), lens => {
            Simd::detect().run(
                #[inline(always)]
                || outline::contour(&drawn, lens, limit, reach_px),
            )
        })
    });
    Ok((
        PyArray1::from_vec(py, found.points.into_flattened()),
        PyArray1::from_vec(py, found.normals.into_flattened()),
        PyArray1::from_vec(py, found.inner),
        PyArray1::from_vec(py, found.outer),
        PyArray1::from_vec(py, found.colours.into_flattened()),
    ))
}

/// How much is kept of an outline.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct OutlineRequest {
    finer: usize,
    trim_px: usize,
    points: [usize; 2],
    around_px2: f64,
    reach_px: f64,
}

/// The outline of a drawing, and its picture at the window's own pixels.
#[pyfunction]
#[pyo3(signature = (drawn, *, lens, kept))]
pub(crate) fn outlined<'py>(
    py: Python<'py>,
    drawn: DrawnRequest<'py>,
    lens: LensRequest,
    kept: OutlineRequest,
) -> PyResult<OutlinedArrays<'py>> {
    let drawn = drawn.drawn(lens.size())?;
    let model = OutlineModel {
        finer: kept.finer.max(1),
        trim_px: kept.trim_px,
        fewest: kept.points[0].min(kept.points[1]),
        most: kept.points[1],
        around_px2: kept.around_px2,
        reach_px: kept.reach_px,
    };
    let found = py.detach(|| {
        with_lens!(&lens.lens(), lens => {
            Simd::detect().run(#[inline(always)] || reduction::outlined(&drawn, lens, &model))
        })
    });
    let contour = found.contour;
    Ok((
        found.part,
        PyArray1::from_vec(py, found.pixels.into_flattened()),
        PyArray1::from_vec(py, contour.points.into_flattened()),
        PyArray1::from_vec(py, contour.normals.into_flattened()),
        PyArray1::from_vec(py, contour.inner),
        PyArray1::from_vec(py, contour.outer),
        (
            PyArray1::from_vec(py, found.rgb),
            PyArray1::from_vec(py, found.alpha),
            PyArray1::from_vec(py, found.depth),
        ),
    ))
}

/// A contour where it lies in a picture.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LineRequest<'py> {
    pixels: Doubles<'py>,
    normals: Doubles<'py>,
    inner_px: Doubles<'py>,
}

/// How many points of a surface are kept.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SurfaceRequest {
    texture_points: usize,
    surface_points: usize,
    least_slope: f32,
}

/// Points on a drawn object, and how it looks there.
#[pyfunction]
#[pyo3(signature = (drawn, line, *, lens, kept))]
pub(crate) fn looks<'py>(
    py: Python<'py>,
    drawn: DrawnRequest<'py>,
    line: LineRequest<'py>,
    lens: LensRequest,
    kept: SurfaceRequest,
) -> PyResult<LooksArrays<'py>> {
    let drawn = drawn.drawn(lens.size())?;
    let inner = line.inner_px.as_slice()?;
    let (pixels, normals) = (line.pixels.as_slice()?, line.normals.as_slice()?);
    check_length("pixels", pixels, 2 * inner.len())?;
    check_length("normals", normals, 2 * inner.len())?;
    let line = Line {
        pixels: pixels.as_chunks().0,
        normals: normals.as_chunks().0,
        inner,
    };
    let model = SurfaceModel {
        most_texture: kept.texture_points,
        most_surface: kept.surface_points,
        least_slope: kept.least_slope,
    };
    let found = py.detach(|| {
        with_lens!(&lens.lens(), lens => {
            Simd::detect().run(#[inline(always)] || reduction::looks(&drawn, lens, line, &model))
        })
    });
    let slopes = found.texture_slopes.into_flattened().into_flattened();
    Ok((
        PyArray1::from_vec(py, found.contour_colours.into_flattened()),
        (
            PyArray1::from_vec(py, found.texture_points.into_flattened()),
            PyArray1::from_vec(py, found.texture_values.into_flattened()),
            PyArray1::from_vec(py, slopes),
        ),
        (
            PyArray1::from_vec(py, found.surface_points.into_flattened()),
            PyArray1::from_vec(py, found.surface_colours.into_flattened()),
        ),
        found.area_px,
    ))
}
