#include "pipeline/classification/methods.h"

#include "core/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <type_traits>
#include <utility>

namespace squint {
namespace {

template <class... M>
ClassificationMethod build_first_of(const std::variant<M...>*, const ClassificationInputs& inputs) {
    std::optional<ClassificationMethod> built;
    const auto build = [&]<class One>(std::type_identity<One>) {
        if (One::serves(inputs.settings)) built = One::build(inputs);
        return built.has_value();
    };
    if ((build(std::type_identity<M>{}) || ...)) return *std::move(built);
    throw InputError(fmt::format("classification.method: {} is not known", name_of(inputs.settings.method)));
}

}  // namespace

ClassificationMethod build_method(const ClassificationInputs& inputs) {
    return build_first_of(static_cast<const ClassificationMethod*>(nullptr), inputs);
}

namespace {

struct CollectTables {
    std::vector<Table*>& tables;
    void operator()(Table& t) const { tables.push_back(&t); }
    void operator()(CellTable&) const {}  // fills in its own, when asked
    void operator()(Rescale&) const {}
};
template <class M>
std::vector<Table*> tables_of(M& method) {
    std::vector<Table*> tables;
    method.visit(CollectTables{tables});
    return tables;
}
template <class M, class N>
void share_tables(M& method, N&& built) {
    const std::vector<Table*> to = tables_of(method), from = tables_of(built);
    for (std::size_t i = 0; i < from.size(); ++i) to[i]->share(*from[i]);
}

template <class M>
void take_exact(M& method, const M& built) {
    M from = built;
    share_tables(method, from);
    if constexpr (requires { method.exact; }) method.exact = built.exact;
}

}  // namespace

void need_exact(ClassificationMethod& method, ClassificationInputs inputs) {
    inputs.keeps_exact = true;
    const auto build = [&](auto& m) {
        const std::vector<Table*> tables = tables_of(m);
        if (std::all_of(tables.begin(), tables.end(), [](const Table* t) { return t->has_exact(); })) return;
        using M = std::decay_t<decltype(m)>;
        if constexpr (std::is_same_v<M, PreIntegrated2D>)
            share_tables(m.prefix, build_prefix_lookup(inputs));
        else
            take_exact(m, std::get<M>(build_method(inputs)));
    };
    std::visit(build, method);
}

namespace {
struct MakeFloats {
    void operator()(const Table& t) const { t.need_floats(); }
    void operator()(const CellTable& t) const { t.need_floats(); }
    void operator()(const Rescale&) const {}
};
}  // namespace

void need_floats(ClassificationMethod& method) {
    std::visit([](auto& m) { m.visit(MakeFloats{}); }, method);
    if (auto* series = std::get_if<PowerSeriesOfOrder1>(&method)) {
        const Table &depth = series->prefix.depth, &moment = series->moment;
        const auto n = static_cast<std::size_t>(moment.rows()),
                   stride = static_cast<std::size_t>(depth.columns());
        std::vector<float> rows(4 * n);
        for (std::size_t i = 0; i < n; ++i) {
            rows[4 * i] = depth.floats()[stride * i];
            std::copy_n(moment.floats() + 3 * i, 3, rows.begin() + static_cast<std::ptrdiff_t>(4 * i + 1));
        }
        series->float_rows = std::make_shared<const std::vector<float>>(std::move(rows));
    }
}

}  // namespace squint
