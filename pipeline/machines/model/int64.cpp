#include "pipeline/machines/model/rays_of.h"

namespace squint::model {

template void cast_tile<std::int64_t>(const Plan&, const lanes::EmptySpace*, int, int, int, int, Image&,
                                      TileStatistics&);

}  // namespace squint::model
