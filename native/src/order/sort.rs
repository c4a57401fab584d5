//! Stable radix sort of (depth key, slot) pairs.

/// Bits sorted by at a time: more for long lists, where a pass costs more than its counts.
const DIGIT_BITS: u32 = 11;
const LONG_DIGIT_BITS: u32 = 13;
const LONG: usize = 16_384;

/// Sorts; keeps its buffers from one list to the next.
#[derive(Default)]
pub struct RadixSort {
    spare: Vec<u64>,
    starts: Vec<u32>,
}

impl RadixSort {
    /// Sorts `pairs` (key in the high half, payload in the low half) by key, keeping the order of
    /// equal keys.
    #[inline(always)]
    pub fn sort_by_key(&mut self, pairs: &mut Vec<u64>) {
        let key = |pair: u64| (pair >> 32) as u32;
        let [low, high] = pairs.iter().fold([u32::MAX, 0], |[low, high], &pair| {
            [low.min(key(pair)), high.max(key(pair))]
        });
        let bits = u32::BITS - high.saturating_sub(low).leading_zeros();
        let most = match pairs.len() < LONG {
            true => DIGIT_BITS,
            false => LONG_DIGIT_BITS,
        };
        let passes = bits.div_ceil(most);
        let digit_bits = bits.div_ceil(passes.max(1));
        self.spare.resize(pairs.len(), 0);
        for pass in 0..passes {
            let digit = |pair: u64| {
                ((key(pair) - low) >> (pass * digit_bits)) as usize & ((1 << digit_bits) - 1)
            };
            self.scatter(pairs, 1 << digit_bits, digit);
            std::mem::swap(pairs, &mut self.spare);
        }
    }

    /// Moves `pairs` to `spare`, by digit.
    #[inline(always)]
    fn scatter(&mut self, pairs: &[u64], buckets: usize, digit: impl Fn(u64) -> usize) {
        self.starts.clear();
        self.starts.resize(buckets, 0);
        for &pair in pairs {
            self.starts[digit(pair)] += 1;
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += std::mem::replace(start, total);
        }
        for &pair in pairs {
            let place = &mut self.starts[digit(pair)];
            self.spare[*place as usize] = pair;
            *place += 1;
        }
    }
}

/// Reorders every run of equal keys by `rank` of the payload.
pub fn break_ties<R: Ord>(pairs: &mut [u64], rank: impl Fn(u32) -> R) {
    let mut first = 0;
    while first < pairs.len() {
        let key = pairs[first] >> 32;
        let length = pairs[first..]
            .iter()
            .take_while(|&&pair| pair >> 32 == key)
            .count();
        if length > 1 {
            pairs[first..first + length].sort_by_key(|&pair| rank(pair as u32));
        }
        first += length;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library_sort() {
        for count in [5000, 40_000] {
            check_sort(count);
        }
    }

    fn check_sort(count: u64) {
        let mut state = 1u64;
        let mut pairs: Vec<u64> = (0..count)
            .map(|i| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                ((state >> 33) % 1000 * 4_000_000) << 32 | i
            })
            .collect();
        let mut wanted = pairs.clone();
        wanted.sort_by_key(|pair| pair >> 32);
        RadixSort::default().sort_by_key(&mut pairs);
        assert_eq!(pairs, wanted);

        break_ties(&mut pairs, std::cmp::Reverse);
        wanted.sort_by_key(|pair| (pair >> 32, std::cmp::Reverse(*pair as u32)));
        assert_eq!(pairs, wanted);
    }

    #[test]
    fn empty_and_single() {
        let mut none = Vec::new();
        RadixSort::default().sort_by_key(&mut none);
        break_ties(&mut none, |slot| slot);
        let mut one = vec![7 << 32];
        RadixSort::default().sort_by_key(&mut one);
        assert_eq!(one, [7 << 32]);
    }
}
