#include "studies/search/word_lengths.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace squint::search {
namespace {

constexpr std::size_t kTogether = 4;  // trials asked for at once; fixed, so that threads change nothing

bool cheaper(const Trial& a, const Trial& b) {
    return std::pair(a.cost, a.bits) < std::pair(b.cost, b.bits);
}

class Descent {
  public:
    Descent(const Problem& problem, const Options& options)
        : problem_(problem), random_{options.seed}, options_(options) {}

    Found run() {
        Found found;
        found.top = tried({problem_.most}, Phase::top, {-1})[0];
        found.feasible = passes(found.top);
        found.lengths = problem_.most, found.trial = found.top;
        if (!found.feasible) return found;
        found.alone = each_alone();
        weights_.assign(problem_.most.size(), 1.0);
        for (restart_ = 0; restart_ <= options_.restarts; ++restart_) {
            const Lengths ceiling = restart_ == 0 ? ceiling_over(found.alone) : above(found.lengths, 2);
            const Lengths end = lowered(raised(restart_ == 0 ? found.alone : shaken(found.lengths), ceiling));
            const Trial& trial = known_.at(end);
            found.costs.push_back(passes(trial) ? trial.cost : INFINITY);
            if (passes(trial) && cheaper(trial, found.trial)) found.lengths = end, found.trial = trial;
        }
        return found;
    }

    Found back_off(const Lengths& from) {
        Found found;
        phase_ = Phase::back_off;
        weights_.assign(problem_.most.size(), 1.0);
        Lengths ceiling = problem_.most;
        for (std::size_t v = 0; v < from.size(); ++v) ceiling[v] = std::max(ceiling[v], from[v]);
        found.top = tried({ceiling}, phase_, {-1})[0];
        found.lengths = passes(found.top) ? raised(from, ceiling) : ceiling;
        found.trial = known_.at(found.lengths);
        found.feasible = passes(found.trial);
        return found;
    }

  private:
    bool passes(const Trial& trial) const { return trial.error <= problem_.most_error; }

    // Tries vectors, each once.
    std::vector<Trial> tried(const std::vector<Lengths>& vectors, Phase phase,
                             const std::vector<int>& variables) {
        std::vector<Lengths> fresh;
        std::vector<Step> steps;
        for (std::size_t i = 0; i < vectors.size(); ++i)
            if (!known_.contains(vectors[i]) &&
                std::find(fresh.begin(), fresh.end(), vectors[i]) == fresh.end())
                fresh.push_back(vectors[i]), steps.push_back({phase, restart_, variables[i]});
        if (!fresh.empty()) {
            const std::vector<Trial> trials = problem_.evaluate(fresh, steps);
            for (std::size_t i = 0; i < fresh.size(); ++i) known_.emplace(fresh[i], trials[i]);
        }
        std::vector<Trial> out;
        for (const Lengths& vector : vectors) out.push_back(known_.at(vector));
        return out;
    }

    // The least length of each variable that passes while all others have the most.
    Lengths each_alone() {
        const std::size_t n = problem_.most.size();
        Lengths fails(n, -1), enough = problem_.most;
        for (;;) {
            std::vector<Lengths> vectors;
            std::vector<int> of;
            for (std::size_t v = 0; v < n; ++v)
                if (enough[v] - fails[v] > 1) {
                    vectors.push_back(problem_.most), of.push_back(static_cast<int>(v));
                    vectors.back()[v] = (enough[v] + fails[v]) / 2;
                }
            if (vectors.empty()) return enough;
            const std::vector<Trial> trials = tried(vectors, Phase::alone, of);
            for (std::size_t i = 0; i < of.size(); ++i) {
                const auto v = static_cast<std::size_t>(of[i]);
                (passes(trials[i]) ? enough : fails)[v] = vectors[i][v];
            }
        }
    }

    Lengths above(Lengths lengths, int bits) const {
        for (std::size_t v = 0; v < lengths.size(); ++v)
            lengths[v] = std::min(lengths[v] + bits, problem_.most[v]);
        return lengths;
    }

    // Together the variables need a few bits more than each alone: min+1 stops where that many bits for every
    // variable are enough.
    Lengths ceiling_over(const Lengths& alone) {
        for (int bits = 0;; ++bits) {
            Lengths ceiling = above(alone, bits);
            if (ceiling == problem_.most || passes(tried({ceiling}, Phase::raise, {-1})[0])) return ceiling;
        }
    }

    // Takes a bit or two from a random third of the variables; draws new weights for what follows.
    Lengths shaken(Lengths lengths) {
        for (std::size_t v = 0; v < lengths.size(); ++v) {
            const int bits = random_.below(6) - 3;
            if (bits > 0 && v < problem_.shaken) lengths[v] = std::max(0, lengths[v] - bits);
            weights_[v] = 0.5 + 1.5 * random_.unit();
        }
        return lengths;
    }

    static Lengths changed(Lengths lengths, std::size_t variable, int by) {
        lengths[variable] += by;
        return lengths;
    }

    /// The worth of a bit: how much penalty it removes for each unit of cost; infinite where there is no
    /// picture without it.
    static double worth(const Trial& with, const Trial& without) {
        if (std::isinf(without.penalty)) return std::isinf(with.penalty) ? 0 : INFINITY;
        return (without.penalty - with.penalty) / std::max(with.bits - without.bits, 1e-9);
    }

    // Lazily: the worth of a bit hardly changes while other variables grow, so only the most promising ones
    // are tried again at the current vector (Minoux 1978).
    Lengths raised(Lengths here, const Lengths& ceiling) {
        const std::size_t n = here.size();
        std::vector<double> promise(n, INFINITY);
        for (Trial now = tried({here}, phase_, {-1})[0]; !passes(now);) {
            std::vector<char> fresh(n, 0);
            std::size_t best = n;
            for (;;) {
                std::vector<std::size_t> order;
                for (std::size_t v = 0; v < n; ++v)
                    if (here[v] < ceiling[v]) order.push_back(v);
                if (order.empty()) return here;
                std::stable_sort(order.begin(), order.end(),
                                 [&](std::size_t a, std::size_t b) { return promise[a] > promise[b]; });
                best = order.front();
                if (fresh[best]) break;
                std::vector<Lengths> vectors;
                std::vector<int> of;
                for (const std::size_t v : order)
                    if (!fresh[v] && vectors.size() < kTogether)
                        vectors.push_back(changed(here, v, 1)), of.push_back(static_cast<int>(v));
                const std::vector<Trial> trials = tried(vectors, phase_, of);
                for (std::size_t i = 0; i < of.size(); ++i) {
                    const auto v = static_cast<std::size_t>(of[i]);
                    promise[v] = worth(trials[i], now) * weights_[v], fresh[v] = 1;
                }
            }
            here = changed(here, best, 1);
            now = known_.at(here);
            promise[best] /= 4;  // each bit divides the penalty of rounding by four
        }
        return here;
    }

    // Lazily, too; a variable that cannot lose a bit now is asked again at the end.
    Lengths lowered(Lengths here) {
        const std::size_t n = here.size();
        std::vector<char> given_up(n, 0);
        std::vector<double> price(n, -INFINITY);  // penalty for what a bit saves
        for (bool moved = false;;) {
            const Trial now = known_.at(here);
            std::vector<char> fresh(n, 0);
            std::size_t best = n;
            for (;;) {
                std::vector<std::size_t> order;
                for (std::size_t v = 0; v < n; ++v)
                    if (here[v] > 0 && !given_up[v]) order.push_back(v);
                if (order.empty()) break;
                std::stable_sort(order.begin(), order.end(),
                                 [&](std::size_t a, std::size_t b) { return price[a] < price[b]; });
                if (fresh[order.front()]) {
                    best = order.front();
                    break;
                }
                std::vector<Lengths> vectors;
                std::vector<int> of;
                for (const std::size_t v : order)
                    if (!fresh[v] && vectors.size() < kTogether)
                        vectors.push_back(changed(here, v, -1)), of.push_back(static_cast<int>(v));
                const std::vector<Trial> trials = tried(vectors, Phase::lower, of);
                for (std::size_t i = 0; i < of.size(); ++i) {
                    const auto v = static_cast<std::size_t>(of[i]);
                    given_up[v] = !passes(trials[i]) || !cheaper(trials[i], now);
                    price[v] = worth(now, trials[i]) * weights_[v], fresh[v] = 1;
                }
            }
            if (best < n) {
                here = changed(here, best, -1), moved = true;
                price[best] *= 4;
            } else if (moved) {
                std::fill(given_up.begin(), given_up.end(), 0), moved = false;
            } else {
                return here;
            }
        }
    }

    const Problem& problem_;
    Random random_;
    Options options_;
    int restart_ = 0;
    Phase phase_ = Phase::raise;  // of what goes up
    std::vector<double> weights_;
    std::map<Lengths, Trial> known_;
};

}  // namespace

std::uint64_t Random::next() {
    std::uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

Found raise_lengths(const Problem& problem, const Lengths& from) {
    return Descent(problem, {}).back_off(from);
}

Found find_lengths(const Problem& problem, const Options& options) {
    return Descent(problem, options).run();
}

}  // namespace squint::search
