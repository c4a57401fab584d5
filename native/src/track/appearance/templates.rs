//! Small pictures of an object compared with what the live picture shows at some places, all at once.
//! `tracking/templates.py` says the same.

/// Pixels handled together: sums are kept apart for each, so that they fill a register.
const LANES: usize = 8;
/// Fewer pixels than this say nothing.
const LEAST_SHOWN_PX: f32 = 12.0;
const COLOUR_SPREAD: f32 = 1e-4;

/// Pictures as they are compared: `planes` follow one another, `pixels` values each.
struct Planes<const COUNT: usize> {
    values: Vec<f32>,
    pixels: usize,
}

/// Of a place: weight, free, weighted red, green and blue, and weighted squares of those, summed.
const OF_PLACE: usize = 6;
/// Of a template: alpha, red, green and blue over black, and squares of those by alpha, summed.
const OF_TEMPLATE: usize = 5;

impl<const COUNT: usize> Planes<COUNT> {
    fn new(pictures: usize, pixels: usize) -> Self {
        let pixels = pixels.next_multiple_of(LANES);
        Planes {
            values: Vec::with_capacity(pictures * COUNT * pixels),
            pixels,
        }
    }

    /// Adds a plane, filled up with what adds nothing.
    #[inline(always)]
    fn add(&mut self, plane: impl Iterator<Item = f32>) {
        self.values.extend(plane);
        let whole = self.values.len().next_multiple_of(self.pixels);
        self.values.resize(whole, 0.0);
    }

    #[inline(always)]
    fn of(&self, picture: usize) -> [&[f32]; COUNT] {
        let first = picture * COUNT * self.pixels;
        std::array::from_fn(|plane| &self.values[first + plane * self.pixels..][..self.pixels])
    }
}

/// What a few places show: colours, three a pixel, and how much of each pixel is the object's own
/// and free of others.
pub struct Places<'a> {
    pub colours: &'a [f32],
    pub own: &'a [f32],
    pub free: &'a [f32],
}

/// Templates of one elevation: alpha, and colours, three a pixel.
pub struct Templates<'a> {
    pub alpha: &'a [f32],
    pub colours: &'a [f32],
}

/// Overlap 0..1 and correlation -1..1 of every place with every template, place by place.
#[inline(always)]
pub fn compared(places: &Places, templates: &Templates, pixels: usize) -> [Vec<f32>; 2] {
    let seen = planes_of_places(places, pixels);
    let shown = planes_of_templates(templates, pixels);
    let [count, turns] = [places.own.len() / pixels, templates.alpha.len() / pixels];
    let mut overlap = Vec::with_capacity(count * turns);
    let mut correlation = Vec::with_capacity(count * turns);
    for place in 0..count {
        let seen = seen.of(place);
        let own: f32 = seen[0].iter().sum();
        for turn in 0..turns {
            let sums = Sums::of(&seen, &shown.of(turn));
            overlap.push(sums.overlap(own));
            correlation.push(sums.correlation());
        }
    }
    [overlap, correlation]
}

#[inline(always)]
fn planes_of_places(places: &Places, pixels: usize) -> Planes<OF_PLACE> {
    let count = places.own.len() / pixels;
    let mut planes = Planes::new(count, pixels);
    for place in 0..count {
        let own = &places.own[place * pixels..][..pixels];
        let free = &places.free[place * pixels..][..pixels];
        let colours = &places.colours[3 * place * pixels..][..3 * pixels];
        let weight = || own.iter().zip(free).map(|(own, free)| own * free);
        planes.add(weight());
        planes.add(free.iter().copied());
        for channel in 0..3 {
            let colour = colours.iter().skip(channel).step_by(3);
            planes.add(weight().zip(colour).map(|(weight, colour)| weight * colour));
        }
        let squares = colours.chunks_exact(3).map(square);
        planes.add(
            weight()
                .zip(squares)
                .map(|(weight, square)| weight * square),
        );
    }
    planes
}

#[inline(always)]
fn planes_of_templates(templates: &Templates, pixels: usize) -> Planes<OF_TEMPLATE> {
    let count = templates.alpha.len() / pixels;
    let mut planes = Planes::new(count, pixels);
    for turn in 0..count {
        let alpha = &templates.alpha[turn * pixels..][..pixels];
        let colours = &templates.colours[3 * turn * pixels..][..3 * pixels];
        planes.add(alpha.iter().copied());
        for channel in 0..3 {
            let colour = colours.iter().skip(channel).step_by(3);
            planes.add(
                alpha
                    .iter()
                    .zip(colour)
                    .map(|(alpha, colour)| alpha * colour),
            );
        }
        let squares = colours.chunks_exact(3).map(square);
        planes.add(
            alpha
                .iter()
                .zip(squares)
                .map(|(alpha, square)| alpha * square),
        );
    }
    planes
}

#[inline(always)]
fn square(colour: &[f32]) -> f32 {
    colour[0] * colour[0] + colour[1] * colour[1] + colour[2] * colour[2]
}

/// Sums over the pixels of a place and a template.
#[derive(Default)]
struct Sums {
    shared: f32,
    free: f32,
    live: [f32; 3],
    drawn: [f32; 3],
    both: f32,
    live_power: f32,
    drawn_power: f32,
}

impl Sums {
    #[inline(always)]
    fn of(seen: &[&[f32]; OF_PLACE], shown: &[&[f32]; OF_TEMPLATE]) -> Sums {
        let mut sums = [[0.0f32; LANES]; 11];
        let mut at = 0;
        while at < seen[0].len() {
            let seen: [&[f32; LANES]; OF_PLACE] =
                seen.map(|plane| plane[at..at + LANES].try_into().expect("so many pixels"));
            let shown: [&[f32; LANES]; OF_TEMPLATE] =
                shown.map(|plane| plane[at..at + LANES].try_into().expect("so many pixels"));
            let [weight, free, red, green, blue, squares] = seen;
            let [alpha, drawn_red, drawn_green, drawn_blue, drawn_squares] = shown;
            for lane in 0..LANES {
                sums[0][lane] += weight[lane] * alpha[lane];
                sums[1][lane] += free[lane] * alpha[lane];
                sums[2][lane] += red[lane] * alpha[lane];
                sums[3][lane] += green[lane] * alpha[lane];
                sums[4][lane] += blue[lane] * alpha[lane];
                sums[5][lane] += weight[lane] * drawn_red[lane];
                sums[6][lane] += weight[lane] * drawn_green[lane];
                sums[7][lane] += weight[lane] * drawn_blue[lane];
                sums[8][lane] += red[lane] * drawn_red[lane]
                    + green[lane] * drawn_green[lane]
                    + blue[lane] * drawn_blue[lane];
                sums[9][lane] += squares[lane] * alpha[lane];
                sums[10][lane] += weight[lane] * drawn_squares[lane];
            }
            at += LANES;
        }
        let [shared, free, red, green, blue, r, g, b, both, live_power, drawn_power] =
            sums.map(|lanes| lanes.iter().sum());
        Sums {
            shared,
            free,
            live: [red, green, blue],
            drawn: [r, g, b],
            both,
            live_power,
            drawn_power,
        }
    }

    /// Share of what is the object's own or the template's that is both.
    #[inline(always)]
    fn overlap(&self, own: f32) -> f32 {
        let either = self.free + own - self.shared;
        match either > LEAST_SHOWN_PX {
            true => self.shared / either,
            false => 0.0,
        }
    }

    /// Of colours about their means, where the place's weight meets the template's alpha.
    #[inline(always)]
    fn correlation(&self) -> f32 {
        if self.shared <= LEAST_SHOWN_PX {
            return 0.0;
        }
        let share = 1.0 / self.shared;
        let [live, drawn] = [self.live, self.drawn].map(|sums| sums.map(|sum| share * sum));
        let (mut both, mut live_power, mut drawn_power) = (
            share * self.both,
            share * self.live_power,
            share * self.drawn_power,
        );
        for channel in 0..3 {
            both -= live[channel] * drawn[channel];
            live_power -= live[channel] * live[channel];
            drawn_power -= drawn[channel] * drawn[channel];
        }
        both / (live_power.max(COLOUR_SPREAD) * drawn_power.max(COLOUR_SPREAD)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_wholly_like_itself_and_unlike_its_negative() {
        let pixels = 64;
        let colours: Vec<f32> = (0..3 * pixels)
            .map(|k| (k * 7 % 11) as f32 / 11.0)
            .collect();
        let negative: Vec<f32> = colours.iter().map(|colour| 1.0 - colour).collect();
        let ones = vec![1.0; pixels];
        let places = Places {
            colours: &colours,
            own: &ones,
            free: &ones,
        };
        for (drawn, wanted) in [(&colours, 1.0), (&negative, -1.0)] {
            let templates = Templates {
                alpha: &ones,
                colours: drawn,
            };
            let [overlap, correlation] = compared(&places, &templates, pixels);
            assert!((overlap[0] - 1.0).abs() < 1e-5);
            assert!((correlation[0] - wanted).abs() < 1e-4, "{correlation:?}");
        }
    }
}
