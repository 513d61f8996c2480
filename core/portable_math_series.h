// Constants of exp and log, shared by the functions of one argument and of many.
#pragma once

#include <array>
#include <cstddef>

namespace squint::portable {

// ln 2 in two parts: the first has 42 bits, so that k times it is exact for |k| < 2^11.
inline constexpr double kLn2High = 0x1.62e42fefa3800p-1;
inline constexpr double kLn2Low = 0x1.ef35793c76730p-45;

/// 1/3!, 1/4!, ... 1/14!
inline constexpr auto kFactorials = [] {
    std::array<double, 12> coefficient{};
    double factorial = 2;
    for (int n = 0; n < 12; ++n) coefficient[n] = 1 / (factorial *= n + 3);  // factorials to 18! are exact
    return coefficient;
}();

/// 1/(2 first + 1), 1/(2 first + 3), ...: atanh(s) = s (1 + z/3 + z^2/5 + ...) with z = s^2 <= 0.0295.
template <std::size_t N>
constexpr std::array<double, N> atanh_coefficients(int first) {
    std::array<double, N> coefficient{};
    for (std::size_t n = 0; n < N; ++n) coefficient[n] = 1.0 / static_cast<double>(2 * (first + n) + 1);
    return coefficient;
}
inline constexpr auto kAtanhFrom1 = atanh_coefficients<10>(1);  // leaves z^11 / 23, below 2^-60
inline constexpr auto kAtanhFrom2 = atanh_coefficients<12>(2);  // leaves z^14 / 29, below 2^-75

}  // namespace squint::portable
