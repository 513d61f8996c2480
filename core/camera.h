// Cameras and rays in world space (docs/conventions.md#space-and-rays).
#pragma once

#include "core/vector.h"
#include "core/volume.h"

#include <array>
#include <optional>

namespace squint {

enum class Projection { orthographic, perspective };

/// A scene's camera settings.  Those that are absent are chosen so that the picture shows the whole volume.
struct CameraSettings {
    Projection projection = Projection::orthographic;
    std::optional<Vec3> eye;       // overrides azimuth and elevation
    std::optional<Vec3> center;    // default: the middle of the volume
    std::optional<Vec3> up;        // default: z, or y where the view is along z
    double azimuth = 30;           // degrees about z, 0 looks along +y (at the front)
    double elevation = 15;         // degrees above the horizon
    std::optional<double> height;  // orthographic: world units from the bottom to the top of the picture
    double fov_y = 30;             // perspective: degrees, vertical
    int turntable = 1;             // pictures in a full turn about `up` through `center`
};

struct Ray {
    Vec3 origin;
    Vec3 direction;  // unit length
};

/// A camera with all settings decided, in world or in grid space.  ray() uses only + - * / and sqrt: the same bits
/// on every CPU.
struct Camera {
    Projection projection = Projection::orthographic;
    Vec3 eye, center;
    Vec3 view, right, up;       // unit and orthogonal; view points into the picture
    double half_height = 1;     // orthographic: world units; perspective: tan(fov_y / 2)
    int width = 1, height = 1;  // pixels

    Ray ray(int column, int row) const;  // through the pixel's centre; row 0 is the top
};

/// In world space.  Throws InputError: eye equals center, up is parallel to the view, height or fov_y is out of
/// range.
Camera make_camera(const CameraSettings& settings, const Volume& volume, int width, int height,
                   int frame = 0);
/// The same camera in a volume's grid space.
Camera in_grid_space(const Camera& world, const Volume& volume);

/// The part of a ray inside a box [low, high], as distances along the ray.  It is empty when first >= last; a
/// chord of length zero is empty.
struct Interval {
    double first = 0, last = 0;
    bool empty() const { return !(first < last); }
};
Interval intersect(const Ray& ray, const Vec3& low, const Vec3& high);

/// A box along axes of its own: unit vectors in the space of the rays that it cuts, and two of its corners, by
/// distances along them.
struct TurnedBox {
    std::array<Vec3, 3> axes;
    Vec3 low, high;
};
Interval intersect(const Ray& ray, const TurnedBox& box);
Interval common(const Interval& a, const Interval& b);

}  // namespace squint
