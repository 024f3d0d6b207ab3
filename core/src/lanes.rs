//! Sixteen numbers at a time, on the vector unit that the processor has. The operations are those of [`pulp`], whose
//! [`Simd::f32s`] holds sixteen `f32` on every [`VectorUnit`].

use std::fmt;

use pulp::{Scalar512b, Simd};

/// Samples that are computed together.
pub const LANES: usize = 16;

/// Sixteen `f32` in memory, one for each sample of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct F32x16(pub [f32; LANES]);

impl F32x16 {
    /// All zero.
    pub const ZERO: Self = Self([0.0; LANES]);
}

/// A number from 0 to 2^22 rounded down, as it is and as an integer, on any vector unit: `as` would check number by number
/// whether it fits.
#[inline(always)]
pub fn rounded_down(value: f32) -> (f32, u32) {
    // Here floats are a unit apart, so that adding it rounds to the nearest.
    const UNITS: f32 = (1 << 23) as f32;
    let shifted = value + UNITS;
    let nearest = shifted - UNITS;
    let excess = nearest > value;
    let integer = (shifted.to_bits() - UNITS.to_bits()).wrapping_sub(u32::from(excess));
    (if excess { nearest - 1.0 } else { nearest }, integer)
}

/// A vector unit that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dispatch {
    /// x86-64 with AVX-512 (F, BW, CD, DQ and VL).
    Avx512,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// Any processor; the compiler uses what the target always has (SSE2, NEON).
    Portable,
}

impl Dispatch {
    /// The best that this processor has, or what the environment variable `INPLACE_SIMD` (`avx512`,
    /// `avx2`, `portable`) allows at most.
    pub fn detect() -> Self {
        static DETECTED: std::sync::OnceLock<Dispatch> = std::sync::OnceLock::new();
        *DETECTED.get_or_init(|| {
            let wanted = std::env::var("INPLACE_SIMD").unwrap_or_default();
            let allowed = match wanted.as_str() {
                "portable" => 2,
                "avx2" => 1,
                _ => 0,
            };
            let found = [Self::Avx512, Self::Avx2]
                .into_iter()
                .skip(allowed)
                .find(|level| level.is_available());
            found.unwrap_or(Self::Portable)
        })
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::is_available(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx512 | Self::Avx2 => false,
            Self::Portable => true,
        }
    }

    /// Everything that this processor has, the best first.
    pub fn available() -> impl Iterator<Item = Self> {
        [Self::Avx512, Self::Avx2, Self::Portable]
            .into_iter()
            .filter(|level| level.is_available())
    }
}

impl fmt::Display for Dispatch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Portable => "portable",
        })
    }
}

/// A vector unit as the kernels use it: a token which says that the processor has it.
pub trait VectorUnit: Simd {
    /// Vectors that fit in the registers as accumulators of a matrix product.
    const BLOCK: usize;

    /// `a * b + c`.
    #[inline(always)]
    fn mul_add(self, a: Self::f32s, b: Self::f32s, c: Self::f32s) -> Self::f32s {
        self.mul_add_f32s(a, b, c)
    }

    #[inline(always)]
    fn load(self, values: &F32x16) -> Self::f32s {
        pulp::cast(values.0)
    }

    #[inline(always)]
    fn store(self, values: Self::f32s, to: &mut F32x16) {
        to.0 = pulp::cast(values);
    }
}

#[cfg(target_arch = "x86_64")]
impl VectorUnit for pulp::x86::V4 {
    const BLOCK: usize = 8;
}

#[cfg(target_arch = "x86_64")]
impl VectorUnit for pulp::x86::V3_512b {
    const BLOCK: usize = 4;
}

impl VectorUnit for Scalar512b {
    const BLOCK: usize = 2;

    /// Rounds twice: a fused multiply-add without the instruction would be a call.
    #[inline(always)]
    fn mul_add(self, a: Self::f32s, b: Self::f32s, c: Self::f32s) -> Self::f32s {
        self.add_f32s(self.mul_f32s(a, b), c)
    }
}

/// Defines a function that runs a kernel, `fn name<U: VectorUnit>(unit: U, arguments)`, on a given vector unit. It panics
/// where the processor has no such unit.
macro_rules! dispatched {
    ($(#[$doc:meta])* $visibility:vis fn $name:ident = $kernel:ident($($argument:ident: $type:ty),* $(,)?)) => {
        $(#[$doc])*
        $visibility fn $name(dispatch: $crate::lanes::Dispatch, $($argument: $type),*) {
            use $crate::lanes::{Dispatch, VectorUnit};

            // A closure would do if it were sure to be inlined into the function that enables the unit's instructions.
            struct Call<U, A>(U, A);

            impl<U: VectorUnit> pulp::NullaryFnOnce for Call<U, ($($type,)*)> {
                type Output = ();

                #[inline(always)]
                fn call(self) {
                    let Self(unit, ($($argument,)*)) = self;
                    $kernel(unit, $($argument),*);
                }
            }

            let arguments = ($($argument,)*);
            match dispatch {
                #[cfg(target_arch = "x86_64")]
                Dispatch::Avx512 => {
                    let Some(unit) = pulp::x86::V4::try_new() else { panic!("this processor has no AVX-512") };
                    unit.vectorize(Call(unit, arguments));
                }
                #[cfg(target_arch = "x86_64")]
                Dispatch::Avx2 => {
                    let Some(unit) = pulp::x86::V3::try_new() else { panic!("this processor has no AVX2 and FMA") };
                    unit.vectorize(Call(pulp::x86::V3_512b(unit), arguments));
                }
                _ => pulp::NullaryFnOnce::call(Call(pulp::Scalar512b, arguments)),
            }
        }
    };
}
pub(crate) use dispatched;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_down() {
        let quarters = (0..4096).map(|quarter| quarter as f32 / 4.0);
        for value in quarters.chain([1.0 - f32::EPSILON, 1e6 + 0.5, (1_u32 << 22) as f32]) {
            assert_eq!(rounded_down(value), (value.floor(), value as u32), "{value}");
        }
    }
}
