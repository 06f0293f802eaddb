//! `W` numbers and their arithmetic, one small loop an operation, which the compiler turns into one instruction when `W` is
//! the register's width.

use std::ops::{Add, Div, Mul, Sub};

use crate::math::Vec3;

/// One number for each of `W` points.
#[derive(Clone, Copy, Debug)]
pub struct Lanes<const W: usize>(pub [f64; W]);

impl<const W: usize> Lanes<W> {
    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Self([x; W])
    }

    #[inline(always)]
    pub fn zip(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| operation(self.0[i], other.0[i])))
    }

    /// `yes` where `self > other`, else `no` (also where either is not a number).
    #[inline(always)]
    pub fn where_greater(self, other: Self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| if self.0[i] > other.0[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    pub fn where_less(self, other: Self, yes: Self, no: Self) -> Self {
        other.where_greater(self, yes, no)
    }

    /// A bit for each lane, the first one lowest: set where `self < other`. Of finite numbers. Read off the sign of the
    /// difference, which takes few instructions at every width; a comparison does not.
    #[inline(always)]
    pub fn bits_where_less(self, other: Self) -> u32 {
        let difference = self - other;
        let sign = |lane: usize| (difference.0[lane].to_bits() >> 63) as u32;
        (0..W).fold(0, |bits, lane| bits | sign(lane) << lane)
    }

    // Unlike those of `f64`, these are one instruction each; where `self` is not a number, it stays so.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |x, y| if y > x { y } else { x })
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |x, y| if y < x { y } else { x })
    }

    #[inline(always)]
    pub fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    /// Of all lanes, halves first.
    #[inline(always)]
    pub fn sum(mut self) -> f64 {
        let mut width = W;
        while width > 1 {
            width /= 2;
            for lane in 0..width {
                self.0[lane] += self.0[lane + width];
            }
        }
        self.0[0]
    }
}

macro_rules! lane_operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<const W: usize> $operator for Lanes<W> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, f64::$method)
            }
        }
    )*};
}
lane_operators!(Add add, Sub sub, Mul mul, Div div);

#[inline(always)]
pub fn splat<const W: usize>(v: &Vec3) -> [Lanes<W>; 3] {
    [Lanes::splat(v.x), Lanes::splat(v.y), Lanes::splat(v.z)]
}

#[inline(always)]
pub fn sub<const W: usize>(a: [Lanes<W>; 3], b: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn dot<const W: usize>(a: [Lanes<W>; 3], b: [Lanes<W>; 3]) -> Lanes<W> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
