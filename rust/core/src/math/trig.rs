//! Sine and cosine of all lanes at once, bit for bit the same in every width.

use super::Real;

/// Reduction to |r| <= pi/4 by a three-part pi/2 (Cody and Waite), then the fdlibm polynomials.
#[inline(always)]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    let quarter = round(x * T::splat(std::f64::consts::FRAC_2_PI));
    let r = ((x - quarter * T::splat(HALF_PI[0])) - quarter * T::splat(HALF_PI[1])) - quarter * T::splat(HALF_PI[2]);
    let (sine, cosine) = polynomials(r);
    // Quarter turns modulo 4, in {-2, -1, 0, 1, 2}.
    let turn = quarter - T::splat(4.0) * round(quarter * T::splat(0.25));
    let odd = T::splat(0.5).lt(turn.abs()) & turn.abs().lt(T::splat(1.5));
    let (s, c) = (T::select(odd, cosine, sine), T::select(odd, sine, cosine));
    let half = T::splat(1.5).lt(turn.abs());
    let sine_negative = half | turn.lt(T::splat(-0.5));
    let cosine_negative = half | (T::splat(0.5).lt(turn) & turn.lt(T::splat(1.5)));
    (T::select(sine_negative, -s, s), T::select(cosine_negative, -c, c))
}

/// Nearest whole number, for |x| below 2^51: adding 1.5 * 2^52 leaves no bits for a fraction.
#[inline(always)]
fn round<T: Real>(x: T) -> T {
    let shift = T::splat(6_755_399_441_055_744.0);
    (x + shift) - shift
}

#[inline(always)]
fn polynomials<T: Real>(r: T) -> (T, T) {
    let z = r * r;
    let sine = r + r * z * horner(z, &SINE);
    let cosine = T::splat(1.0) - (T::splat(0.5) * z - z * z * horner(z, &COSINE));
    (sine, cosine)
}

/// Arctangent: |x| > 1 by its inverse, then |w| <= tan(pi / 8) by one addition theorem, then the fdlibm polynomial.
#[inline(always)]
pub fn atan<T: Real>(x: T) -> T {
    let one = T::splat(1.0);
    let size = x.abs();
    let large = one.lt(size);
    let y = T::select(large, one / size, size);
    let middle = T::splat(TAN_EIGHTH).lt(y);
    let w = T::select(middle, (y - one) / (y + one), y);
    let z = w * w;
    let series = w - w * z * horner(z, &ARCTANGENT);
    let quarter = T::splat(std::f64::consts::FRAC_PI_4);
    let angle = T::select(middle, quarter + series, series);
    let angle = T::select(large, T::splat(std::f64::consts::FRAC_PI_2) - angle, angle);
    T::select(x.lt(T::zero()), -angle, angle)
}

#[inline(always)]
fn horner<T: Real, const N: usize>(z: T, coefficients: &[f64; N]) -> T {
    let mut sum = T::splat(coefficients[N - 1]);
    for k in (0..N - 1).rev() {
        sum = sum * z + T::splat(coefficients[k]);
    }
    sum
}

/// pi/2 in three parts; the first two have 33 bits, so that products with whole numbers below 2^20 are
/// exact.
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// tan(pi / 8).
const TAN_EIGHTH: f64 = std::f64::consts::SQRT_2 - 1.0;

const ARCTANGENT: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library_to_two_units_in_the_last_place() {
        for k in -400_000..400_000 {
            let x = f64::from(k) * 0.002_512_3;
            let (s, c) = sin_cos(x);
            assert!((s - x.sin()).abs() <= 2.3e-16 && (c - x.cos()).abs() <= 2.3e-16, "at {x}: {s} {c}");
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert!(sin_cos(f64::NAN).0.is_nan());
    }

    #[test]
    fn arctangent_agrees_with_the_library_to_two_units_in_the_last_place() {
        for k in -40_000..40_000 {
            let x = (f64::from(k) * 1e-3).sinh();
            assert!((atan(x) - x.atan()).abs() <= 4.5e-16, "at {x}: {}", atan(x));
        }
        assert_eq!(atan(0.0), 0.0);
        assert_eq!(atan(f64::INFINITY), std::f64::consts::FRAC_PI_2);
    }
}
