//! Hashes that say which scene and which settings a figure is from.

/// FNV-1a over the bytes of a text, as 16 hexadecimal digits: the same on every machine.
#[must_use]
pub fn of(text: &str) -> String {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
