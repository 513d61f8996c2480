// exp, log, pow, sin, cos ... with the same bits on every CPU: only + - * / sqrt, and -ffp-contract=off.
// Those of libm differ in the last bit between CPUs (docs/conventions.md#numbers).
#pragma once

#include <span>

namespace squint::portable {

double exp(double x);                      // relative error below 2^-50 for |x| < 700; 0 and infinity beyond
double expm1(double x);                    // relative error below 2^-50
double log(double x);                      // x > 0; relative error below 2^-50
double log1p(double x);                    // x > -1
double pow(double base, double exponent);  // base >= 0
double sin(double x);                      // |x| < 1e6
double cos(double x);
double tan(double x);

/// The same for many numbers, with SIMD, bit for bit as for each alone.  `result` is as long as `x`, and may
/// be the same memory.
void expm1_each(std::span<const double> x, std::span<double> result);
void log1p_each(std::span<const double> x, std::span<double> result);

}  // namespace squint::portable
