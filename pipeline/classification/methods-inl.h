// The maths of every classification method, over any word; compiled once per SIMD target.
#include "pipeline/classification/methods.h"

#include "pipeline/classification/moments-inl.h"
#include "pipeline/classification/pc-inl.h"
#include "pipeline/classification/pi1d-inl.h"
#include "pipeline/classification/pi2d-inl.h"
#include "pipeline/classification/pips-inl.h"
