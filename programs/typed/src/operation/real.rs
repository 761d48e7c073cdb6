//! Reals: IEEE 754 binary32 and binary64, rounded to nearest even, with one NaN.

use crate::operation::RealFunction;

/// A format of reals. Every value that leaves an operation is packed by [`Float::pack`], which knows one NaN only.
pub(crate) trait Float: Copy + PartialOrd {
    /// The value of stored bits.
    fn unpack(stored: u64) -> Self;
    /// The bits of a value; every NaN has those of the canonical one.
    fn pack(self) -> u64;
    /// a + b
    fn add(self, other: Self) -> Self;
    /// a − b
    fn subtract(self, other: Self) -> Self;
    /// a · b
    fn multiply(self, other: Self) -> Self;
    /// a / b
    fn divide(self, other: Self) -> Self;
    /// −a
    fn negate(self) -> Self;
    /// |a|
    fn absolute(self) -> Self;
    /// aᵇ
    fn power(self, other: Self) -> Self;
    /// A function of one real.
    fn function(self, function: RealFunction) -> Self;
    /// The nearest value.
    fn from_integer(number: i128) -> Self;
    /// The nearest whole number, half to even.
    fn round(self) -> Self;
    /// Towards 0, saturating; NaN becomes 0.
    fn truncate(self) -> i128;
}

/// The bits of the canonical NaN: out of the way of numbers, which need not wait for the test.
#[cold]
#[inline(never)]
fn rare(nan: u64) -> u64 {
    nan
}

macro_rules! float {
    ($float:ident, $bits:ident, $nan:literal, $power:ident, $sin:ident, $cos:ident, $tan:ident, $asin:ident, $acos:ident, $atan:ident, $exp:ident, $log:ident, $log10:ident) => {
        impl Float for $float {
            #[inline]
            fn unpack(stored: u64) -> Self {
                Self::from_bits(stored as $bits)
            }

            #[inline]
            fn pack(self) -> u64 {
                if self.is_nan() {
                    return rare($nan);
                }
                u64::from(self.to_bits())
            }

            #[inline]
            fn add(self, other: Self) -> Self {
                self + other
            }

            #[inline]
            fn subtract(self, other: Self) -> Self {
                self - other
            }

            #[inline]
            fn multiply(self, other: Self) -> Self {
                self * other
            }

            #[inline]
            fn divide(self, other: Self) -> Self {
                self / other
            }

            #[inline]
            fn negate(self) -> Self {
                -self
            }

            #[inline]
            fn absolute(self) -> Self {
                self.abs()
            }

            fn power(self, other: Self) -> Self {
                libm::$power(self, other)
            }

            fn function(self, function: RealFunction) -> Self {
                match function {
                    RealFunction::SquareRoot => self.sqrt(),
                    RealFunction::Sine => libm::$sin(self),
                    RealFunction::Cosine => libm::$cos(self),
                    RealFunction::Tangent => libm::$tan(self),
                    RealFunction::ArcSine => libm::$asin(self),
                    RealFunction::ArcCosine => libm::$acos(self),
                    RealFunction::ArcTangent => libm::$atan(self),
                    RealFunction::Exponential => libm::$exp(self),
                    RealFunction::NaturalLogarithm => libm::$log(self),
                    RealFunction::Logarithm => libm::$log10(self),
                    RealFunction::Floor => self.floor(),
                    RealFunction::Ceiling => self.ceil(),
                    RealFunction::Round => self.round(),
                }
            }

            fn from_integer(number: i128) -> Self {
                number as Self
            }

            fn round(self) -> Self {
                self.round_ties_even()
            }

            fn truncate(self) -> i128 {
                self as i128
            }
        }
    };
}

float!(f32, u32, 0x7fc0_0000, powf, sinf, cosf, tanf, asinf, acosf, atanf, expf, logf, log10f);
float!(f64, u64, 0x7ff8_0000_0000_0000, pow, sin, cos, tan, asin, acos, atan, exp, log, log10);

/// a ∘ b of two stored reals.
pub(crate) fn binary<F: Float>(operands: &[u64], function: fn(F, F) -> F) -> u64 {
    function(F::unpack(operands[0]), F::unpack(operands[1])).pack()
}

/// A function of a stored real.
pub(crate) fn unary<F: Float>(operands: &[u64], function: impl Fn(F) -> F) -> u64 {
    function(F::unpack(operands[0])).pack()
}
