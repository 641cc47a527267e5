//! The exponential function in operations that every processor does alike, and that the compiler makes
//! vectors of: the one of the system's library does not round alike on all of them.

/// Below this the result is taken for nothing: it is less than 2⁻¹⁰²¹.
const LEAST: f64 = -708.0;

/// ln 2 in two parts: products of the first with whole numbers of up to eleven bits are exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3FE6_2E42_FEE0_0000);
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Adding this leaves no bits for a fraction: what remains is the nearest whole number, which lies in the
/// lowest bits.
const TO_WHOLE: f64 = 6_755_399_441_055_744.0;

/// eˣ for x ≤ 0, to some 2⁻⁵²: 2ᵏ eʳ with |r| ≤ ½ ln 2, of which the series is summed up to r¹³ / 13!
/// (less than 2⁻⁵⁴ are left out).
#[inline(always)]
pub(super) fn exp_of_negative(x: f64) -> f64 {
    let shifted = x.max(LEAST) * std::f64::consts::LOG2_E + TO_WHOLE;
    let whole = shifted - TO_WHOLE;
    let r = (x.max(LEAST) - whole * LN_2_HIGH) - whole * LN_2_LOW;
    let mut series = SERIES[0];
    for term in &SERIES[1..] {
        series = series * r + term;
    }
    // The whole number, moved to where the exponent lies.
    let power = f64::from_bits((shifted.to_bits().wrapping_add(1023)) << 52);
    if x < LEAST { 0.0 } else { series * power }
}

/// 1/13! … 1/0!.
const SERIES: [f64; 14] = {
    let mut series = [1.0; 14];
    let mut factorial = 1.0;
    let mut n = 0;
    while n < 13 {
        n += 1;
        factorial *= n as f64;
        series[13 - n] = 1.0 / factorial;
    }
    series
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_library_s_to_the_last_bits() {
        assert_eq!(exp_of_negative(0.0).to_bits(), 1.0_f64.to_bits());
        let mut worst = 0.0_f64;
        for at in 0..200_000 {
            let x = -(f64::from(at) / 200_000.0).powi(3) * 707.9;
            worst = worst.max((exp_of_negative(x) / x.exp() - 1.0).abs());
        }
        assert!(worst < 4e-16, "{worst}");
        for x in [-708.1, -1e9, f64::MIN, f64::NEG_INFINITY] {
            assert_eq!(exp_of_negative(x).to_bits(), 0.0_f64.to_bits());
        }
    }
}
