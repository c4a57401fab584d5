//! Stable radix sort of (depth key, slot) pairs.

const DIGIT_BITS: u32 = 11;
const BUCKETS: usize = 1 << DIGIT_BITS;

/// Sorts `pairs` (key in the high half, payload in the low half) by key, keeping the order of
/// equal keys. `spare` is scratch.
pub fn sort_by_key(pairs: &mut Vec<u64>, spare: &mut Vec<u64>) {
    spare.clear();
    spare.resize(pairs.len(), 0);
    for pass in 0..3 {
        let shift = 32 + pass * DIGIT_BITS;
        let digit = |pair: u64| (pair >> shift) as usize & (BUCKETS - 1);
        let mut starts = [0u32; BUCKETS];
        for &pair in pairs.iter() {
            starts[digit(pair)] += 1;
        }
        if starts.iter().any(|&count| count as usize == pairs.len()) {
            continue;
        }
        let mut total = 0;
        for start in &mut starts {
            total += std::mem::replace(start, total);
        }
        for &pair in pairs.iter() {
            let place = &mut starts[digit(pair)];
            spare[*place as usize] = pair;
            *place += 1;
        }
        std::mem::swap(pairs, spare);
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
        let mut state = 1u64;
        let mut pairs: Vec<u64> = (0..5000u64)
            .map(|i| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                ((state >> 33) % 1000 * 4_000_000) << 32 | i
            })
            .collect();
        let mut wanted = pairs.clone();
        wanted.sort_by_key(|pair| pair >> 32);
        sort_by_key(&mut pairs, &mut Vec::new());
        assert_eq!(pairs, wanted);

        break_ties(&mut pairs, std::cmp::Reverse);
        wanted.sort_by_key(|pair| (pair >> 32, std::cmp::Reverse(*pair as u32)));
        assert_eq!(pairs, wanted);
    }

    #[test]
    fn empty_and_single() {
        let mut none = Vec::new();
        sort_by_key(&mut none, &mut Vec::new());
        break_ties(&mut none, |slot| slot);
        let mut one = vec![7 << 32];
        sort_by_key(&mut one, &mut Vec::new());
        assert_eq!(one, [7 << 32]);
    }
}
