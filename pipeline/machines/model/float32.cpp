#include "pipeline/machines/model/rays_of.h"

namespace squint::model {

template void cast_tile<Real<float>>(const Plan&, const lanes::EmptySpace*, int, int, int, int, Image&,
                                     TileStatistics&);
template void cast_traced<Real<float>>(const Plan&, std::vector<TraceEvent>&, RayTrace&);

}  // namespace squint::model
