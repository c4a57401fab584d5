//! Nats by which a window speaks for an object at a pose.
//! `tests/twins/likelihood.py` says the same.

use crate::track::appearance::compared::{
    ring, seen, silhouette, Behind, Cut, Drawn, Part, Planes, Seen, Window,
};
use crate::track::appearance::light_fit::{fitted, LightModel, LightPrior, Sample};
use crate::track::appearance::unknown::{Unknown, UnknownModel};
use crate::track::exponential::{exp, ln};

/// The constants of `tracking.likelihood.pose_likelihood`.
#[derive(Clone, Copy)]
pub struct SupportModel {
    pub light: LightModel,
    pub light_sigma: [f64; 3],
    pub foreign: f32,
    pub unknown: UnknownModel,
    pub behind: Behind,
    pub least_px: f64,
    pub least_changed: f32,
    pub least_lit: usize,
    pub residual_sigma: f32,
    pub most_misfit: f32,
}

/// How a pose is compared: where it is drawn, and how exactly it has to be right.
#[derive(Clone, Copy)]
pub struct Terms {
    pub part: Part,
    /// Reach of its surroundings in which another light would show, too.
    pub ring_px: usize,
    /// Reach of the surroundings by which something unknown in front of it is recognised.
    pub reach_px: f32,
    /// Pixels that share one error.
    pub shared_px2: f64,
    pub sigma: f32,
    pub most_misfit: f32,
    pub occluded: f32,
}

/// What is said of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Support {
    pub nats: f64,
    pub samples: f64,
    pub open_fraction: f64,
    pub matched_fraction: f64,
    pub unknown_fraction: f64,
    pub area_px: f64,
}

/// Colours as they are seen, from which a light is fitted: over black as scanned, where they face,
/// as the live picture shows them, and their weights.
struct Lit<'a> {
    rgb: &'a Planes,
    facing: &'a Planes,
    shown: &'a Planes,
    weight: &'a [f32],
}

/// What all comparisons share.
struct Comparison<'a> {
    terms: &'a Terms,
    model: &'a SupportModel,
}

/// What a window says for an object that is drawn at a pose.
#[inline(always)]
pub fn support(window: &Window, drawn: &Drawn, terms: &Terms, model: &SupportModel) -> Support {
    let part = terms.part;
    let cut = Cut::of(window, part);
    let seen = seen(drawn, part, model.light.seen);
    let silhouette = silhouette(&seen, &cut, model.behind);
    let (area_px, open_px) = (total(&seen.alpha), total(&silhouette));
    if open_px < model.least_px {
        return Support {
            open_fraction: open_px / area_px.max(model.least_px),
            area_px,
            ..Support::default()
        };
    }
    let comparison = Comparison { terms, model };
    let unknown = Unknown::around(&cut, &seen.alpha, part, terms.reach_px, &model.unknown);
    let certain = unknown.certain();
    let (ratio, matched_px) =
        comparison.against_absence(&cut, &seen, &silhouette, &unknown, &certain);
    // What is followed is known to be there: a shade that falls on it takes nothing away from it.
    let relit = match window.in_any_light {
        true => {
            let ring = ring(&seen.alpha, &cut.hidden, part, terms.ring_px);
            comparison.relit_nats(&cut, &silhouette, &ring)
        }
        false => 0.0,
    };
    let covered = silhouette.iter().zip(&certain);
    let covered: Vec<f32> = covered
        .map(|(covered, certain)| covered * certain)
        .collect();
    Support {
        nats: ratio - relit.max(0.0),
        samples: open_px / terms.shared_px2,
        open_fraction: open_px / area_px,
        matched_fraction: matched_px / open_px,
        unknown_fraction: total(&covered) / open_px,
        area_px,
    }
}

impl Comparison<'_> {
    /// Log likelihood ratio of an object against its absence; pixels that it accounts for.
    #[inline(always)]
    fn against_absence(
        &self,
        cut: &Cut,
        seen: &Seen,
        silhouette: &[f32],
        unknown: &Unknown,
        certain: &[f32],
    ) -> (f64, f64) {
        let Comparison { terms, model } = self;
        let count = silhouette.len();
        let mut shown = cut.live.clone();
        for (shown, empty) in shown.iter_mut().zip(&cut.empty) {
            for (shown, (alpha, empty)) in shown.iter_mut().zip(seen.alpha.iter().zip(empty)) {
                *shown -= (1.0 - alpha) * empty;
            }
        }
        // What is in front of the object says nothing of its light.
        let weight = silhouette.iter().zip(&cut.changed).zip(certain);
        let weight: Vec<f32> = weight
            .map(|((covered, changed), certain)| {
                covered * changed.max(model.least_changed) * (1.0 - certain)
            })
            .collect();
        let (gains, light_nats) = self.gains(&Lit {
            rgb: &seen.rgb,
            facing: &seen.facing,
            shown: &shown,
            weight: &weight,
        });
        let apart2 = distances2(&shown, &seen.rgb, &gains);
        let (most, least) = (terms.most_misfit, (-terms.most_misfit).exp());
        let wider = 0.5 / (terms.sigma * terms.sigma);
        let as_foreign = self.as_foreign(cut);
        let is_foreign = unknown.probabilities(model.foreign);
        let is_occluded = unknown.probabilities(terms.occluded);
        // Of one length, as the compiler sees, several pixels are computed at once.
        let (changed, foreign) = (&cut.changed[..count], &as_foreign[..count]);
        let (apart2, room) = (&apart2[..count], &cut.room_misfit[..count]);
        let (is_foreign, is_occluded) = (&is_foreign[..count], &is_occluded[..count]);
        let certain = &certain[..count];
        let (mut nats, mut matched) = (vec![0.0; count], vec![0.0; count]);
        let to = nats.iter_mut().zip(&mut matched).zip(silhouette);
        for (pixel, ((nats, matched), &covered)) in to.enumerate() {
            let misfit = (wider * apart2[pixel]).min(model.most_misfit).min(most);
            let as_object = exp(-misfit);
            let as_room = exp(-room[pixel].min(most));
            // What hides the object would have to look like the room behind it, unless it is known
            // to be there.
            let shown = changed[pixel].max(certain[pixel]);
            let as_occluder = shown * foreign[pixel] + (1.0 - shown) * least;
            let (is_foreign, is_occluded) = (is_foreign[pixel], is_occluded[pixel]);
            let absent = (1.0 - is_foreign) * as_room + is_foreign * foreign[pixel];
            let present = (1.0 - is_occluded) * as_object + is_occluded * as_occluder;
            *nats = covered * (ln(present) - ln(absent));
            *matched = covered * as_object;
        }
        (
            total(&nats) / terms.shared_px2 + light_nats,
            total(&matched),
        )
    }

    /// Nats by which the room in another light accounts better for a place than the room as it was.
    ///
    /// Light does not change in the shape of one object: what surrounds the silhouette is in it, too.
    #[inline(always)]
    fn relit_nats(&self, cut: &Cut, silhouette: &[f32], ring: &[f32]) -> f64 {
        let Comparison { terms, model } = self;
        let Part { width, height, .. } = terms.part;
        let count = silhouette.len();
        let here: Vec<f32> = silhouette.iter().zip(ring).map(|(a, b)| a + b).collect();
        let columns = (0..count).map(|pixel| from_edge_to_edge(pixel % width, width));
        let rows = (0..count).map(|pixel| from_edge_to_edge(pixel / width, height));
        let (gains, light_nats) = self.gains(&Lit {
            rgb: &cut.expected,
            facing: &[columns.collect(), rows.collect(), vec![0.0; count]],
            shown: &cut.live,
            weight: &here,
        });
        let apart2 = distances2(&cut.live, &cut.expected, &gains);
        // A pose that is off makes no room lighter: no tolerance here.
        let exact = 0.5 / (model.residual_sigma * model.residual_sigma);
        let (most, familiar) = (terms.most_misfit, 1.0 - model.foreign);
        let as_foreign = self.as_foreign(cut);
        let (apart2, as_foreign) = (&apart2[..count], &as_foreign[..count]);
        let (room, silhouette) = (&cut.room_misfit[..count], &silhouette[..count]);
        let (mut inside, mut around) = (vec![0.0; count], vec![0.0; count]);
        let to = inside.iter_mut().zip(&mut around).zip(ring);
        for (pixel, ((inside, around), &beside)) in to.enumerate() {
            let misfit = (exact * apart2[pixel]).min(model.most_misfit).min(most);
            let foreign = model.foreign * as_foreign[pixel];
            let relit = ln(familiar * exp(-misfit) + foreign);
            let same = ln(familiar * exp(-room[pixel].min(most)) + foreign);
            *inside = silhouette[pixel] * (relit - same);
            *around = beside * (relit - same);
        }
        // Around an object that is there, the light may have changed as well.
        (total(&inside) + total(&around).min(0.0)) / terms.shared_px2 + light_nats
    }

    /// Likelihoods of pixels as something that is in no scan.
    #[inline(always)]
    fn as_foreign(&self, cut: &Cut) -> Vec<f32> {
        let wider = self.model.residual_sigma / self.terms.sigma;
        let misfits = cut.foreign_misfit.iter();
        misfits
            .map(|misfit| exp(-(wider * wider * misfit).min(self.terms.most_misfit)))
            .collect()
    }

    /// Gains of the likeliest light, and the log of its prior, 0 at most.
    #[inline(always)]
    fn gains(&self, lit: &Lit) -> (Planes, f64) {
        let model = self.model;
        let here: Vec<usize> = (0..lit.weight.len())
            .filter(|&pixel| lit.weight[pixel] > model.light.seen)
            .collect();
        if here.len() < model.least_lit {
            return (std::array::from_fn(|_| vec![1.0; lit.weight.len()]), 0.0);
        }
        let every = (here.len() / model.light.enough_px).max(1);
        let at = |planes: &Planes, pixel: usize| -> [f64; 3] {
            std::array::from_fn(|k| f64::from(planes[k][pixel]))
        };
        let samples: Vec<Sample> = here
            .iter()
            .step_by(every)
            .map(|&pixel| {
                let [x, y, z] = at(lit.facing, pixel);
                Sample {
                    rgb: at(lit.rgb, pixel),
                    sides: [1.0, x, y, z],
                    seen: at(lit.shown, pixel),
                    weight: f64::from(lit.weight[pixel]),
                }
            })
            .collect();
        let sigma2 = f64::from(model.residual_sigma).powi(2);
        let prior = LightPrior {
            sigma: model.light_sigma,
            pixel_information: every as f64 / (sigma2 * self.terms.shared_px2),
        };
        let light = fitted(&samples, &model.light, Some(&prior));
        let [even, x, y, z] = light.by_side.map(|value| value as f32);
        let [low, high] = model.light.range;
        let [along_x, along_y, along_z] = lit.facing;
        let facing = along_x.iter().zip(along_y).zip(along_z);
        let gain: Vec<f32> = facing
            .map(|((&fx, &fy), &fz)| even + x * fx + y * fy + z * fz)
            .collect();
        let mut gains = [(); 3].map(|()| gain.clone());
        for (gains, tint) in gains.iter_mut().zip(light.tint) {
            for gain in gains {
                *gain = (*gain + tint as f32).clamp(low, high);
            }
        }
        (gains, prior.nats(&light))
    }
}

/// Squares of the distances of colours, each in its light, from those that are shown.
#[inline(always)]
fn distances2(shown: &Planes, rgb: &Planes, gains: &Planes) -> Vec<f32> {
    let mut apart2 = vec![0.0; shown[0].len()];
    for ((shown, rgb), gains) in shown.iter().zip(rgb).zip(gains) {
        let pixels = shown.iter().zip(rgb).zip(gains);
        for (to, ((shown, rgb), gain)) in apart2.iter_mut().zip(pixels) {
            let apart = shown - rgb * gain;
            *to += apart * apart;
        }
    }
    apart2
}

/// -1 at the first of some pixels, 1 at the last.
#[inline(always)]
fn from_edge_to_edge(index: usize, count: usize) -> f32 {
    2.0 * index as f32 / (count - 1).max(1) as f32 - 1.0
}

/// The sum, in as many parts as are added at once.
#[inline(always)]
fn total(values: &[f32]) -> f64 {
    const PARTS: usize = 16;
    let mut parts = [0.0; PARTS];
    let (even, rest) = values.as_chunks::<PARTS>();
    for values in even {
        for (part, value) in parts.iter_mut().zip(values) {
            *part += f64::from(*value);
        }
    }
    let rest = rest.iter().map(|&value| f64::from(value));
    parts.into_iter().chain(rest).sum()
}
