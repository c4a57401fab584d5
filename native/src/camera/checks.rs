//! What every camera must hold, and that the pinhole and the fisheye do.

use crate::camera::cone::{box_on_pinhole, box_on_round, eigen, Matrix, Vector};
use crate::camera::curvature::Curved;
use crate::camera::fisheye::Fisheye;
use crate::camera::lens::{Group, Lens, LOW_PASS};
use crate::camera::pinhole::Pinhole;
use crate::camera::window::Window;

const FISHEYE: Fisheye = Fisheye {
    focal: 206.0,
    centre: [360.0, 355.0],
    max_angle: 1.75,
};
const PINHOLE: Pinhole = Pinhole {
    width: 640.0,
    height: 480.0,
    focal: [500.0, 510.0],
    centre: [310.0, 245.0],
};

pub(crate) fn check_jacobian(lens: &impl Lens, p: [f64; 3]) {
    let step = 1e-6;
    let analytic = lens.project(p).jacobian;
    for axis in 0..3 {
        let (mut before, mut after) = (p, p);
        before[axis] -= step;
        after[axis] += step;
        let (a, b) = (lens.project(before), lens.project(after));
        let numeric = [(b.u - a.u) / (2.0 * step), (b.v - a.v) / (2.0 * step)];
        for row in 0..2 {
            let error = (numeric[row] - analytic[row][axis]).abs();
            assert!(error < 1e-4, "{p:?} {row} {axis}: {error}");
        }
    }
}

#[test]
fn jacobians_agree_with_differences() {
    for p in [[0.2, -0.3, 1.0], [0.01, 0.35, 0.7], [-0.1, 0.1, 3.0]] {
        check_jacobian(&PINHOLE, p);
        check_jacobian(&FISHEYE, p);
    }
    for p in [[1.0, 0.5, -0.2], [0.0, 1.0, 0.0], [1e-5, 0.0, 1.0]] {
        check_jacobian(&FISHEYE, p);
    }
}

#[test]
fn chunks_in_view_are_kept_and_chunks_behind_dropped() {
    let window = Window::whole(640, 480);
    let group = |centre, max_scale| Group {
        centre,
        radius: 0.1,
        max_scale,
        near: 0.05,
    };
    assert!(PINHOLE.can_see(&group([0.0, 0.0, 2.0], 0.01), &window));
    assert!(!PINHOLE.can_see(&group([0.0, 0.0, -2.0], 0.01), &window));
    assert!(!PINHOLE.can_see(&group([9.0, 0.0, 2.0], 0.01), &window));
    assert!(PINHOLE.can_see(&group([9.0, 0.0, 2.0], 3.0), &window));
    assert!(FISHEYE.can_see(&group([1.0, 0.0, -0.1], 0.01), &window));
    assert!(!FISHEYE.can_see(&group([0.3, 0.0, -2.0], 0.01), &window));
}

/// Whether the 1/255 ellipse of a round splat of opacity 1 may reach a pixel that is drawn: its
/// box does, and the circle around it.
fn touches(lens: &impl Lens, group: &Group, window: &Window) -> bool {
    let seen = lens.project(group.centre);
    let reach = seen.jacobian.map(|row| {
        let gain = row.iter().map(|v| v * v).sum::<f64>();
        let variance = gain * group.max_scale.powi(2) + LOW_PASS;
        (2.0 * 255f64.ln() * variance).sqrt()
    });
    let inside = |at: f64, reach: f64, start: usize, end: usize| {
        at + reach >= start as f64 + 0.5 && at - reach <= end as f64 - 0.5
    };
    let [first, second] = seen.jacobian;
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (xx, xy, yy) = (dot(first, first), dot(first, second), dot(second, second));
    let widest = 0.5 * (xx + yy) + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
    let variance = widest * group.max_scale.powi(2) + LOW_PASS;
    let circle_px = (2.0 * 255f64.ln() * variance).sqrt();
    let gap = |at: f64, start: usize, end: usize| {
        (start as f64 + 0.5 - at)
            .max(at - end as f64 + 0.5)
            .max(0.0)
    };
    let off_window =
        gap(seen.u, window.left, window.right).hypot(gap(seen.v, window.top, window.bottom));
    let in_circle = lens.circle().is_none_or(|(radius, centre)| {
        // Measured against the box's nearest side only: a lower bound of the true distance.
        let off = ((seen.u - centre[0]).powi(2) + (seen.v - centre[1]).powi(2)).sqrt();
        off - reach[0].min(reach[1]) <= radius
    });
    seen.drawable
        && seen.depth >= group.near
        && inside(seen.u, reach[0], window.left, window.right)
        && inside(seen.v, reach[1], window.top, window.bottom)
        && off_window <= circle_px
        && in_circle
}

pub(crate) fn random() -> impl FnMut() -> f64 {
    let mut state = 3u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub(crate) fn check_culling(lens: &impl Lens, window: &Window) {
    let mut next = random();
    let mut culled = 0;
    for _ in 0..200_000 {
        let group = Group {
            centre: [8.0 * next() - 4.0, 8.0 * next() - 4.0, 6.0 * next() - 3.0],
            radius: 0.0,
            max_scale: 10f64.powf(3.0 * next() - 3.0),
            near: 0.05,
        };
        let is_kept = lens.can_see(&group, window);
        assert!(is_kept || !touches(lens, &group, window), "{group:?}");
        culled += usize::from(!is_kept);
    }
    assert!(culled > 20_000, "{culled}");
}

#[test]
fn nothing_that_touches_the_picture_is_culled() {
    check_culling(&PINHOLE, &Window::whole(640, 480));
    check_culling(&FISHEYE, &Window::whole(720, 720));
    for (left, top) in [(0, 0), (300, 310), (600, 40)] {
        let window = Window {
            left,
            top,
            right: left + 40,
            bottom: top + 90,
            is_part: true,
        };
        check_culling(&PINHOLE, &window);
        check_culling(&FISHEYE, &window);
    }
}

pub(crate) fn check_rays(lens: &impl Lens) {
    let mut next = random();
    for _ in 0..1000 {
        let (u, v) = (700.0 * next(), 700.0 * next());
        let seen = lens.project(lens.ray(u, v));
        assert!((seen.u - u).abs() + (seen.v - v).abs() < 1e-9, "{u} {v}");
    }
}

#[test]
fn rays_are_projected_where_they_came_from() {
    check_rays(&PINHOLE);
    check_rays(&FISHEYE);
}

pub(crate) fn check_bend(lens: &impl Curved, p: [f64; 3]) {
    let step = 1e-5;
    let analytic = lens.bend(p);
    for axis in 0..3 {
        let (mut before, mut after) = (p, p);
        before[axis] -= step;
        after[axis] += step;
        let (a, b) = (lens.project(before), lens.project(after));
        let slopes = [(b.u - a.u) / (2.0 * step), (b.v - a.v) / (2.0 * step)];
        for (row, slope) in slopes.into_iter().enumerate() {
            assert!((slope - analytic.centre[row][axis]).abs() < 1e-4);
            for column in 0..3 {
                let slope = (b.jacobian[row][column] - a.jacobian[row][column]) / (2.0 * step);
                let error = (slope - analytic.jacobian[row][column][axis]).abs();
                assert!(error < 2e-4, "{p:?} {row} {column} {axis}: {error}");
            }
        }
        let slope = (b.depth - a.depth) / (2.0 * step);
        assert!((slope - analytic.depth[axis]).abs() < 1e-8);
    }
}

#[test]
fn bends_agree_with_differences() {
    for p in [[0.2, -0.3, 1.0], [0.01, 0.35, 0.7], [-0.1, 0.1, 3.0]] {
        check_bend(&PINHOLE, p);
        check_bend(&FISHEYE, p);
    }
    check_bend(&PINHOLE, [3.0, -4.0, 1.5]);
    for p in [[1.0, 0.5, -0.2], [0.0, 1.0, 0.0], [1.2e-3, 0.0, 1.0]] {
        check_bend(&FISHEYE, p);
    }
}

#[test]
fn the_axis_is_not_special() {
    for s in [0.0, 1e-9, 1e-4, 0.9e-3, 1.1e-3, 1e-2] {
        let bend = FISHEYE.bend([s, 0.0, 2.0]);
        let xxx = bend.jacobian[0][0][0] / FISHEYE.focal;
        let wanted = -2.0 * s / 8.0;
        assert!(
            (xxx - wanted).abs() <= 1e-3 * wanted.abs() + 1e-12,
            "{s}: {xxx}"
        );
        assert!((bend.jacobian[0][0][2] / FISHEYE.focal + 0.25).abs() < 1e-4);
    }
}

/// Sees behind itself.
const WIDE_FISHEYE: Fisheye = Fisheye {
    max_angle: 2.6,
    ..FISHEYE
};

#[test]
fn boxes_hold_the_points_of_their_ellipsoids() {
    let mut next = random();
    let mut bounded = [0, 0];
    for _ in 0..2000 {
        let mean: Vector = std::array::from_fn(|_| 4.0 * next() - 2.0);
        let factor: Matrix = std::array::from_fn(|_| std::array::from_fn(|_| 1.2 * (next() - 0.5)));
        let planes: Matrix = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                mean[r] * mean[c] - (0..3).map(|k| factor[r][k] * factor[c][k]).sum::<f64>()
            })
        });
        if eigen(&planes).0.iter().all(|&v| v <= 0.0) {
            continue;
        }
        let boxes = [
            (mean[2] > 0.05)
                .then(|| box_on_pinhole(&PINHOLE.focal, &PINHOLE.centre, &planes, &mean)),
            Some(box_on_round(&WIDE_FISHEYE, &planes, &mean)),
        ];
        for _ in 0..50 {
            let ball: Vector = std::array::from_fn(|_| next() - 0.5);
            let length = ball.iter().map(|v| v * v).sum::<f64>().sqrt();
            let p: Vector = std::array::from_fn(|r| {
                mean[r] + (0..3).map(|k| factor[r][k] * ball[k] / length).sum::<f64>()
            });
            let seen = [
                (p[2] > 0.0).then(|| PINHOLE.project(p)),
                Some(WIDE_FISHEYE.project(p)),
            ];
            for (kind, (found, seen)) in boxes.iter().zip(seen).enumerate() {
                let (Some([x, y]), Some(seen)) = (found, seen) else {
                    continue;
                };
                bounded[kind] += usize::from(x[0].is_finite() && x[1] - x[0] < 600.0);
                assert!(
                    x[0] - 1e-6 <= seen.u && seen.u <= x[1] + 1e-6,
                    "{mean:?} {x:?}"
                );
                assert!(
                    y[0] - 1e-6 <= seen.v && seen.v <= y[1] + 1e-6,
                    "{mean:?} {y:?}"
                );
            }
        }
    }
    assert!(bounded.iter().all(|&count| count > 5000), "{bounded:?}");
}
