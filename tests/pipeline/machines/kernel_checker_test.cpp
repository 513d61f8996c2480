// Every kernel alone, on random inputs, on every SIMD target: the model's own lines give the same words.
#include "tests/pipeline/machines/kernel_checker.h"

#include "pipeline/machines/lanes/lane_renderer.h"

#include <gtest/gtest.h>

namespace squint::lanes {
namespace {

constexpr int kDraws = 12;

TEST(Kernels, EachAloneHasTheModelsBitsOnEveryTarget) {
    int runs = 0;
    for (const KernelCase& c : kernel_cases()) {
        ASSERT_FALSE(what_needs_the_model(c.plan)) << c.name;
        for (const std::string& target : target_names()) {
            KernelChecker checker(c, find_target(target), 1);
            for (const KernelCheck& check : checker.checks())
                for (int i = 0; i < kDraws; ++i, ++runs) {
                    check.draw();
                    check.run();
                    const std::string difference = check.difference();
                    EXPECT_EQ(difference, "") << c.name << ", " << target << ", " << check.kernel;
                    if (!difference.empty()) break;
                }
        }
    }
    EXPECT_GT(runs, 2000);
}

}  // namespace
}  // namespace squint::lanes
