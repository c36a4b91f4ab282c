//! Pseudo-random numbers, identical on every machine: SplitMix64 (Steele, Lea and Flood, *Fast
//! Splittable Pseudorandom Number Generators*, 2014).

/// Step of the counter of SplitMix64.
pub const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// A number of the sequence by the value of its counter before the step.
pub fn mix(counter: u64) -> u64 {
    let mut z = counter.wrapping_add(STEP);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Numbers that depend on other numbers alone, for random access.
#[derive(Debug)]
pub struct Draws(u64);

impl Draws {
    /// The sequence of some numbers.
    pub fn new<const N: usize>(numbers: [u64; N]) -> Self {
        let seed = numbers
            .into_iter()
            .fold(0, |seed, number| mix(seed ^ number));
        Self(seed)
    }

    /// The next number, from 0 up to but not including 1, with 53 bits.
    pub fn next(&mut self) -> f64 {
        self.0 = mix(self.0);
        (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
    }
}

/// Uniform pseudo-random numbers from a seed, identical on every machine (SplitMix64, Steele and
/// others 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Starts the sequence of a seed.
    #[must_use]
    pub fn new(seed: u32) -> Self {
        Self(u64::from(seed))
    }

    /// The next number, from 0 up to but not including 1.
    #[expect(
        clippy::should_implement_trait,
        reason = "an endless sequence, not an iterator"
    )]
    pub fn next(&mut self) -> f32 {
        let z = mix(self.0);
        self.0 = self.0.wrapping_add(STEP);
        (z >> 40) as f32 / (1_u32 << 24) as f32
    }
}
