//! Sixteen numbers at a time, on whatever vector unit the processor has.

use std::fmt;

/// Samples that are computed together.
pub const LANES: usize = 16;

/// Sixteen `f32` in memory, one for each sample of a group.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Group(pub [f32; LANES]);

impl Group {
    /// All zero.
    pub const ZERO: Self = Self([0.0; LANES]);
}

/// A vector unit that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dispatch {
    /// x86-64 with AVX-512F.
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
            Self::Avx512 => is_x86_feature_detected!("avx512f"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
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

/// Sixteen `f32` in registers.
pub trait Vector: Copy {
    /// Vectors that fit in the registers as accumulators of a matrix product.
    const BLOCK: usize;

    fn splat(value: f32) -> Self;
    fn load(group: &Group) -> Self;
    fn store(self, group: &mut Group);
    fn add(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// `self * factor + term`.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self` where `gate` is above zero, else zero.
    fn where_positive(self, gate: Self) -> Self;
    /// Sum of the lanes.
    fn sum(self) -> f32;
}

/// Arrays that the compiler turns into what vectors the target always has.
#[derive(Clone, Copy)]
pub struct Portable([f32; LANES]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|lane| f(self.0[lane], other.0[lane])))
    }
}

impl Vector for Portable {
    const BLOCK: usize = 2;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn load(group: &Group) -> Self {
        Self(group.0)
    }
    #[inline(always)]
    fn store(self, group: &mut Group) {
        group.0 = self.0;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // A fused multiply-add without the instruction would be a call.
        self.mul(factor).add(term)
    }
    #[inline(always)]
    fn where_positive(self, gate: Self) -> Self {
        self.zip(gate, |a, g| if g > 0.0 { a } else { 0.0 })
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        let mut halves = self.0;
        for width in [8, 4, 2, 1] {
            for lane in 0..width {
                halves[lane] += halves[lane + width];
            }
        }
        halves[0]
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    //! Every method is inlined into a function that enables the features (see `dispatched!`), which is
    //! called only where the processor was found to have them.

    use std::arch::x86_64::*;

    use super::{Group, Vector};

    #[derive(Clone, Copy)]
    pub struct Avx512(__m512);

    impl Vector for Avx512 {
        const BLOCK: usize = 8;

        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: only reached where AVX-512F was detected.
            Self(unsafe { _mm512_set1_ps(value) })
        }
        #[inline(always)]
        fn load(group: &Group) -> Self {
            // SAFETY: as above; a group is 64 bytes at a multiple of 64.
            Self(unsafe { _mm512_load_ps(group.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, group: &mut Group) {
            // SAFETY: as above.
            unsafe { _mm512_store_ps(group.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: as above.
            Self(unsafe { _mm512_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: as above.
            Self(unsafe { _mm512_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: as above.
            Self(unsafe { _mm512_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            // SAFETY: as above.
            Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn where_positive(self, gate: Self) -> Self {
            // SAFETY: as above.
            unsafe {
                let mask = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(gate.0, _mm512_setzero_ps());
                Self(_mm512_maskz_mov_ps(mask, self.0))
            }
        }
        #[inline(always)]
        fn sum(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_add_ps(self.0) }
        }
    }

    #[derive(Clone, Copy)]
    pub struct Avx2(__m256, __m256);

    impl Vector for Avx2 {
        const BLOCK: usize = 4;

        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: only reached where AVX2 and FMA were detected.
            let half = unsafe { _mm256_set1_ps(value) };
            Self(half, half)
        }
        #[inline(always)]
        fn load(group: &Group) -> Self {
            let start = group.0.as_ptr();
            // SAFETY: as above; a group is 64 bytes at a multiple of 64.
            unsafe { Self(_mm256_load_ps(start), _mm256_load_ps(start.add(8))) }
        }
        #[inline(always)]
        fn store(self, group: &mut Group) {
            let start = group.0.as_mut_ptr();
            // SAFETY: as above.
            unsafe {
                _mm256_store_ps(start, self.0);
                _mm256_store_ps(start.add(8), self.1);
            }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: as above.
            unsafe { Self(_mm256_add_ps(self.0, other.0), _mm256_add_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: as above.
            unsafe { Self(_mm256_mul_ps(self.0, other.0), _mm256_mul_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: as above.
            unsafe { Self(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            // SAFETY: as above.
            unsafe {
                Self(
                    _mm256_fmadd_ps(self.0, factor.0, term.0),
                    _mm256_fmadd_ps(self.1, factor.1, term.1),
                )
            }
        }
        #[inline(always)]
        fn where_positive(self, gate: Self) -> Self {
            // SAFETY: as above.
            unsafe {
                let zero = _mm256_setzero_ps();
                let low = _mm256_cmp_ps::<_CMP_GT_OQ>(gate.0, zero);
                let high = _mm256_cmp_ps::<_CMP_GT_OQ>(gate.1, zero);
                Self(_mm256_and_ps(low, self.0), _mm256_and_ps(high, self.1))
            }
        }
        #[inline(always)]
        fn sum(self) -> f32 {
            let mut group = Group::ZERO;
            self.store(&mut group);
            super::Portable(group.0).sum()
        }
    }
}

/// Defines a function that runs a generic kernel, `fn name<V: Vector>(arguments)`, on a given vector unit.
macro_rules! dispatched {
    ($(#[$doc:meta])* $visibility:vis fn $name:ident = $kernel:ident($($argument:ident: $type:ty),* $(,)?)) => {
        $(#[$doc])*
        $visibility fn $name(dispatch: $crate::field::kernels::lanes::Dispatch, $($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f")]
            fn on_avx512($($argument: $type),*) {
                $kernel::<$crate::field::kernels::lanes::Avx512>($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn on_avx2($($argument: $type),*) {
                $kernel::<$crate::field::kernels::lanes::Avx2>($($argument),*)
            }
            use $crate::field::kernels::lanes::Dispatch;
            match dispatch {
                #[cfg(target_arch = "x86_64")]
                Dispatch::Avx512 => {
                    assert!(dispatch.is_available());
                    // SAFETY: the processor has AVX-512F, as was just checked.
                    unsafe { on_avx512($($argument),*) }
                }
                #[cfg(target_arch = "x86_64")]
                Dispatch::Avx2 => {
                    assert!(dispatch.is_available());
                    // SAFETY: the processor has AVX2 and FMA, as was just checked.
                    unsafe { on_avx2($($argument),*) }
                }
                _ => $kernel::<$crate::field::kernels::lanes::Portable>($($argument),*),
            }
        }
    };
}
pub(super) use dispatched;
