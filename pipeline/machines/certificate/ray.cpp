#include "pipeline/machines/certificate/ray.h"

#include "pipeline/machines/certificate.h"
#include "pipeline/stages/shading/models-inl.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace squint {
namespace {

// One last bit of a wire, of 1.0.
double bit(int fraction) {
    return std::ldexp(1.0, -fraction);
}
// What a step of C and T is off by, of which nothing is left where doubles cannot tell.
double told(double x) {
    return std::abs(x) < 0x1p-46 ? 0 : std::abs(x);
}
// sup |(c - G) - (d - H)|, where G and c lie in intervals of neighbouring slabs.
double difference(const Reach& c, const Reach& g, const Reach& d, const Reach& h) {
    return std::max(c.high - g.low - d.low + h.high, d.high - h.low - c.low + g.high);
}

// The most light that matter of a colour sends: both sums of lights are limited to one.
double brightest_lit(const ShadingSettings& s, double color) {
    if (HWY_NAMESPACE::with_model(s.model, [](auto model) { return decltype(model)::kHeldToOpacity; }))
        return 1;
    return color * std::min(s.ka + s.kd, 1.0) + std::min(s.ks, 1.0);
}

}  // namespace

BoundedRay::BoundedRay(const Plan& plan, bool known) : s_(plan.compositing), known_(known) {
    const double alpha_bits = std::ldexp(1.0, -s_.alpha_fraction);
    alpha_unit_ = alpha_bits;
    const Wire color = plan.lit ? Wire::lit_color : s_.premultiplied ? Wire::slab_color : Wire::slab_ratio;
    color_unit_ = std::ldexp(1.0, -plan.specs[color].format.fraction_bits);
    for (const Entry& entry : plan.entries.entry)
        brightest_ = std::max({brightest_, entry.color.x, entry.color.y, entry.color.z});
    // Colours that nothing in the slab dims are held to its opacity alone.
    if (s_.premultiplied && plan.scene.classification.method != Method::pi2d) brightest_ = 1;
    if (plan.lit) brightest_ = brightest_lit(plan.scene.shading, brightest_);
}

void BoundedRay::composited(const Slab<Bounded>& slab, const Accumulated<Bounded>& before,
                            const Accumulated<Bounded>& after) {
    Seen seen{{}, in_double(slab.alpha.v) * alpha_unit_, clear(before), clear(after), {}};
    bool changed = seen.alpha != 0 || !slab.alpha.exact || seen.clear_before != seen.clear_after;
    const double unit = 1 / static_cast<double>(s_.color_unit());
    const bool divided = s_.form == CompositingForm::straight;  // C is, by its opacity
    const double of_before = unit * (divided ? 1 - seen.clear_before : 1),
                 of_after = unit * (divided ? 1 - seen.clear_after : 1);
    for (std::size_t c = 0; c < 3; ++c) {
        seen.color[c] = {in_double(slab.color[c].v) * color_unit_, in_double(before.color[c].v) * of_before,
                         in_double(after.color[c].v) * of_after,
                         within_light(slab.color[c].error, in_double(slab.color[c].v) * color_unit_)};
        changed = changed || before.color[c].v != after.color[c].v;
    }
    if (!changed) return;
    seen.alpha_error = slab.alpha.error.scaled(alpha_unit_);
    slabs_.push_back(seen);
}

std::array<Shares, 4> BoundedRay::bound(bool stopped) {
    std::array<Shares, 4> all;
    for (Seen& seen : slabs_) seen.alpha_off = seen.alpha_error.sum();
    if (s_.form == CompositingForm::back_to_front)
        from_the_front(all);
    else
        from_the_back(all, stopped);
    for (std::size_t c = 0; c < 4; ++c) {
        Shares& shares = all[c];
        shares[kDoublesPay] += 0x1p-36 + shares.sum() * 0x1p-20;
    }
    return all;
}
void BoundedRay::limit(std::array<Shares, 4>& all, const std::array<double, 4>& words, double brightest) {
    for (std::size_t c = 0; c < 4; ++c) {
        const double most = std::max(std::abs(words[c]), (c == 3 ? 1 : brightest) - words[c]),
                     sum = all[c].sum();
        if (!(sum <= most)) all[c] = std::isfinite(sum) ? all[c].scaled(most / sum) : Shares::one(-1, most);
    }
}

// Of a slab's colour in [0, brightest]: no further off than that lets it be.
Shares BoundedRay::within_light(const Shares& error, double value) const {
    const Shares off = error.scaled(color_unit_);
    const double sum = off.sum(), most = std::max(value, brightest_ - value);
    if (sum <= most) return off;
    return std::isfinite(sum) ? off.scaled(most / sum) : Shares::one(-1, most);
}
double BoundedRay::clear(const Accumulated<Bounded>& pixel) const {
    const auto unit = static_cast<double>(s_.unit());
    const double t = in_double(pixel.transparency.v) / unit;
    return s_.form == CompositingForm::alpha ? 1 - t : t;
}
Reach BoundedRay::opacities(const Seen& k) {
    return {std::max(k.alpha - k.alpha_off, 0.0), std::min(k.alpha + k.alpha_off, 1.0)};
}
Reach BoundedRay::colors(const Seen& k, std::size_t c) const {
    if (c == 3) return {1, 1};
    const double off = k.color[c].error.sum();
    return {std::max(k.color[c].value - off, 0.0), std::min(k.color[c].value + off, brightest_)};
}
// Whether a channel's slabs bring c alpha, and not c.
bool BoundedRay::is_premultiplied(std::size_t c) const {
    return s_.premultiplied && c < 3;
}
// G_k from G_(k+1): G is linear in alpha, and rises with c and what lies behind.
Reach BoundedRay::gathered(const Seen& k, std::size_t c, const Reach& behind) const {
    const Reach alpha = opacities(k), color = colors(k, c);
    if (is_premultiplied(c))
        return {color.low + (1 - alpha.high) * behind.low,
                std::min(color.high + (1 - alpha.low) * behind.high, brightest_)};
    const auto at = [](double a, double color_, double g) { return g + a * (color_ - g); };
    return {std::min(at(alpha.low, color.low, behind.low), at(alpha.high, color.low, behind.low)),
            std::max(at(alpha.low, color.high, behind.high), at(alpha.high, color.high, behind.high))};
}

// Whether what w rounds is carried on to the next slab, and T loses w itself.
bool BoundedRay::carries() const {
    return s_.form == CompositingForm::w_carry && s_.to_transparency.shift <= 0;
}
// What a step takes, by who may take it.
void BoundedRay::add_step_shares(Shares& shares, double known,
                                 std::initializer_list<std::pair<int, double>> usual) const {
    double all = 0;
    for (const auto& item : usual) all += item.second;
    if (!known_ || all <= known) return add_local(shares, known, usual);
    for (const auto& [who, error] : usual) shares[who] += error / all * known;
}
// kappa + lambda G, G what lies behind: in w lambda = -rho and kappa = rho c + sigma.  Where the remainder is
// carried rho is left out, and returned.
double BoundedRay::add_step(Shares& shares, const Seen& k, std::size_t c, const Reach& behind,
                            double apart) const {
    const bool is_color = c < 3;
    const double value = is_color ? k.color[c].value : 1;
    const double gained = is_color ? k.color[c].after - k.color[c].before : k.clear_before - k.clear_after;
    double lambda = k.clear_after - k.clear_before * (1 - k.alpha);
    const bool premultiplied = is_premultiplied(c);
    double kappa = gained - k.clear_before * (premultiplied ? 1 : k.alpha) * value, carried = 0;
    if (carries()) carried = -lambda, kappa -= premultiplied ? 0 : carried * value, lambda = 0;
    const double known = std::max(told(kappa + lambda * behind.low), told(kappa + lambda * behind.high));
    const double of_color = is_color ? unit_of(s_.to_color) * bit(s_.sum_fraction) : 0,
                 of_clear =
                     told(lambda) > 0 ? unit_of(s_.to_transparency) * bit(s_.transparency_fraction) : 0;
    if (s_.takes_from_transparency()) {
        const double of_w =
            told(lambda) > 0 ? unit_of(s_.to_contribution) * bit(s_.contribution_fraction) : 0;
        add_step_shares(shares, known,
                        {{index_of(Wire::contribution), of_w * apart},
                         {index_of(Wire::transparency), of_clear * behind.high},
                         {index_of(Wire::color), of_color}});
    } else {
        const double of_product = is_color ? unit_of(s_.to_slab_color) * bit(s_.color_fraction) : 0;
        add_step_shares(shares, known,
                        {{index_of(Wire::slab_color), of_product * k.clear_before},
                         {index_of(Wire::transparency), of_clear * (is_color ? behind.high : apart)},
                         {index_of(Wire::color), of_color}});
    }
    return carried;
}

void BoundedRay::from_the_back(std::array<Shares, 4>& all, bool stopped) {
    const double threshold = s_.threshold_exact;
    const double carry_bit = bit(s_.contribution_fraction);
    double off = 0;
    for (Seen& k : slabs_) {  // T' - T = (T' - T)(1 - alpha) - T' dalpha + lambda
        const double lambda = std::abs(k.clear_after - k.clear_before * (1 - k.alpha));
        off = off * (1 - opacities(k).low) + k.clear_before * k.alpha_off + (carries() ? 0 : lambda);
        k.clear_off = off + (carries() ? carry_bit : 0) + 0x1p-40;
    }
    const bool may_go_on =
        stopped && !slabs_.empty() && slabs_.back().clear_after + slabs_.back().clear_off >= threshold;
    for (std::size_t c = 0; c < 4; ++c) {
        Shares& shares = all[c];
        Reach behind{0, 0};
        double ended =
            may_go_on ? (slabs_.back().clear_after + slabs_.back().clear_off) * (c == 3 ? 1 : brightest_) : 0;
        // Of the carried remainder, r - 1/2 within a half: sum (r_k - r_(k+1)) f_k with f = c - G is, by parts,
        // at most half a bit of |f| at the hindmost and of how f varies.
        double each = 0, varies = 0, hindmost = 0;
        std::optional<std::pair<Reach, Reach>> farther;
        for (std::size_t i = slabs_.size(); i-- > 0;) {
            const Seen& k = slabs_[i];
            // What an error of alpha brings in place of what lies behind: nothing, where colours have it in them.
            const bool premultiplied = is_premultiplied(c);
            const Reach color = premultiplied ? Reach{} : colors(k, c);
            const double apart = std::max(color.high - behind.low, behind.high - color.low);
            // The ray without rounding may have ended here, this one went on.
            if (threshold > 0 && k.clear_after - k.clear_off < threshold && k.clear_after >= threshold)
                ended = std::max(ended, threshold * behind.high);
            shares.add(k.alpha_error, k.clear_before * apart);
            if (c < 3) shares.add(k.color[c].error, k.clear_before * (premultiplied ? 1 : k.alpha));
            if (const double carried = add_step(shares, k, c, behind, apart); carried != 0) {
                each += std::abs(carried) * apart;
                if (farther)
                    varies += difference(color, behind, farther->first, farther->second);
                else
                    hindmost = apart;
                farther.emplace(color, behind);
            }
            behind = gathered(k, c, behind);
        }
        shares[index_of(Wire::contribution)] += std::min(each, carry_bit / 2 * (hindmost + varies));
        shares[kTerminationPays] += ended;
    }
}

// Back to front: C_k = C_(k+1) (1 - alpha_k) + c_k alpha_k.  What slab k errs by is dimmed by what lies in front:
//     E_k = dalpha (c_k - C'_(k+1)) + alpha' dc + kappa + (1 - alpha_k) E_(k+1)
void BoundedRay::from_the_front(std::array<Shares, 4>& all) {
    double in_front = 1;
    for (std::size_t i = slabs_.size(); i-- > 0;) {  // slabs_ begins with the hindmost
        const Seen& k = slabs_[i];
        for (std::size_t c = 0; c < 4; ++c) {
            const double before = c == 3 ? 1 - k.clear_before : k.color[c].before,
                         after = c == 3 ? 1 - k.clear_after : k.color[c].after,
                         value = c == 3 ? 1 : k.color[c].value;
            const bool premultiplied = is_premultiplied(c);
            const Reach color = premultiplied ? Reach{} : colors(k, c);
            Shares& shares = all[c];
            shares.add(k.alpha_error,
                       in_front * std::max(std::abs(color.high - before), std::abs(color.low - before)));
            if (c < 3) shares.add(k.color[c].error, in_front * (premultiplied ? 1 : k.alpha));
            const double kappa = after - before * (1 - k.alpha) - value * (premultiplied ? 1 : k.alpha);
            if (std::abs(kappa) >= 0x1p-46)
                add_local(shares, in_front * std::abs(kappa),
                          {{c == 3 ? index_of(Wire::transparency) : index_of(Wire::color), 0.0}});
        }
        in_front *= 1 - opacities(k).low;
    }
}

}  // namespace squint
