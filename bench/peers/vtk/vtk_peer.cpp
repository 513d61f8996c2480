#include "bench/peers/vtk/vtk_peer.h"

#include "core/error.h"
#include "core/parallel.h"

#include <fmt/format.h>

#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkFixedPointRayCastImage.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkMultiThreader.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <chrono>
#include <cmath>
#include <limits>

namespace squint::bench {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A control point's value as the level that VTK sees; the next one must be greater.
class Levels {
  public:
    explicit Levels(const Volume& volume) : volume_(volume) {}
    double operator()(double value) {
        const double level = (value - volume_.value_offset) / volume_.value_scale;
        if (level <= last_)
            throw InputError(
                fmt::format("transfer_function: two points at {}, VTK takes one a value", value));
        return last_ = level;
    }

  private:
    const Volume& volume_;
    double last_ = -std::numeric_limits<double>::infinity();
};

/// The voxels in place, without a copy.
template <class Array>
void share_voxels(const Volume& volume, vtkImageData* image) {
    vtkNew<Array> array;
    array->SetArray(const_cast<typename Array::ValueType*>(
                        static_cast<const typename Array::ValueType*>(volume.data.get())),
                    volume.voxels(), 1);
    image->GetPointData()->SetScalars(array);
}

}  // namespace

struct VtkPeer::Parts {
    Plan plan;
    Camera camera;  // of the last frame
    vtkNew<vtkImageData> image;
    vtkNew<vtkVolumeProperty> property;
    vtkNew<vtkFixedPointVolumeRayCastMapper> mapper;
    vtkNew<vtkVolume> volume;
    vtkNew<vtkRenderer> renderer;
    vtkNew<vtkGenericOpenGLRenderWindow> window;  // holds a size; is never opened
    std::vector<vtkNew<vtkLight>> lights;

    explicit Parts(const Plan& p) : plan(p), lights(p.lit ? p.scene.lights.size() : 0) {}

    void set_volume() {
        const Volume& v = *plan.volume;
        image->SetDimensions(static_cast<int>(v.dims.x), static_cast<int>(v.dims.y),
                             static_cast<int>(v.dims.z));
        image->SetSpacing(v.spacing.x, v.spacing.y, v.spacing.z);
        image->SetOrigin(v.origin.x, v.origin.y, v.origin.z);
        if (v.type == ScalarType::u8)
            share_voxels<vtkUnsignedCharArray>(v, image);
        else
            share_voxels<vtkUnsignedShortArray>(v, image);
    }

    void set_property() {
        const TransferFunction function = resolve_transfer_function(plan.scene, *plan.volume);
        vtkNew<vtkColorTransferFunction> color;
        Levels color_level(*plan.volume), opacity_level(*plan.volume);
        for (const ColorPoint& p : function.color)
            color->AddRGBPoint(color_level(p.value), p.color.x, p.color.y, p.color.z);
        vtkNew<vtkPiecewiseFunction> opacity;
        for (const OpacityPoint& p : function.opacity) opacity->AddPoint(opacity_level(p.value), p.alpha);
        property->SetColor(color);
        property->SetScalarOpacity(opacity);
        property->SetScalarOpacityUnitDistance(function.unit_distance);
        property->SetInterpolationTypeToLinear();
        property->SetShade(plan.lit);
        const ShadingSettings& s = plan.scene.shading;
        property->SetAmbient(s.ka), property->SetDiffuse(s.kd), property->SetSpecular(s.ks);
        property->SetSpecularPower(s.exponent);
    }

    void aim(const Camera& c) {
        camera = c;
        const Vec3 low = plan.volume->origin,
                   high = plan.volume->grid_from_voxel(Vec3(plan.volume->dims - Index3(1)));
        const double diagonal = (high - low).length();
        // Parallel views stand off, so that the box lies well between the clipping planes.
        const bool parallel = c.projection == Projection::orthographic;
        const Vec3 eye = parallel ? c.center - c.view * (2 * diagonal) : c.eye;
        const double distance = (c.center - eye).length();
        vtkCamera* to = renderer->GetActiveCamera();
        to->SetParallelProjection(parallel);
        to->SetPosition(eye.x, eye.y, eye.z);
        to->SetFocalPoint(c.center.x, c.center.y, c.center.z);
        to->SetViewUp(c.up.x, c.up.y, c.up.z);
        if (parallel)
            to->SetParallelScale(c.half_height);
        else
            to->SetViewAngle(2 * std::atan(c.half_height) * 180 / std::acos(-1.0));
        to->SetClippingRange(std::max(distance - diagonal, diagonal / 1000), distance + diagonal);
        for (std::size_t i = 0; i < lights.size(); ++i) {
            const Light& light = plan.scene.lights[i];
            const Vec3 towards =
                light.headlight ? c.view * -1.0 : plan.volume->grid_from_world(light.direction.normalized());
            const Vec3 at = c.center + towards * distance;
            lights[i]->SetLightTypeToSceneLight();
            lights[i]->PositionalOff();
            lights[i]->SetFocalPoint(c.center.x, c.center.y, c.center.z);
            lights[i]->SetPosition(at.x, at.y, at.z);
            lights[i]->SetColor(light.color.x, light.color.y, light.color.z);
            // VTK adds ambient light once per light: ours counts it once
            const double ambient = i == 0 ? 1 : 0;
            lights[i]->SetAmbientColor(ambient, ambient, ambient);
        }
    }

    /// VTK's picture starts at the bottom and covers only the volume's bounding rectangle.
    Image picture() const {
        vtkFixedPointRayCastImage* from = mapper->GetRayCastImage();
        int size[2], origin[2], memory[2];
        from->GetImageInUseSize(size), from->GetImageOrigin(origin), from->GetImageMemorySize(memory);
        Image to;
        to.width = camera.width, to.height = camera.height;
        for (const char* name : {"R", "G", "B", "A"}) to.add_float(name);
        for (int y = 0; y < size[1]; ++y)
            for (int x = 0; x < size[0]; ++x) {
                const unsigned short* pixel =
                    from->GetImage() + 4 * (static_cast<std::ptrdiff_t>(y) * memory[0] + x);
                const int row = camera.height - 1 - (y + origin[1]), column = x + origin[0];
                for (std::size_t c = 0; c < 4; ++c)
                    to.channels[c].values[static_cast<std::size_t>(row * camera.width + column)] =
                        static_cast<float>(pixel[c] / VTKKW_FP_SCALE);
            }
        return to;
    }

    std::array<double, 4> pixel_in_double(int x, int y) const;
};

VtkPeer::VtkPeer(const Plan& plan, int threads) : parts_(std::make_unique<Parts>(plan)) {
    if (plan.lit && plan.camera.projection == Projection::perspective)
        throw InputError("camera.projection: VTK lights perspective views along the axis, not along rays");
    // The block structure is built by as many threads as cast rays.
    vtkMultiThreader::SetGlobalMaximumNumberOfThreads(threads);
    vtkMultiThreader::SetGlobalDefaultNumberOfThreads(threads);
    Parts& p = *parts_;
    p.set_volume();
    p.set_property();
    p.mapper->SetInputData(p.image);
    p.mapper->SetNumberOfThreads(threads);
    p.mapper->SetAutoAdjustSampleDistances(false);
    p.mapper->SetLockSampleDistanceToInputSpacing(false);
    p.mapper->SetSampleDistance(static_cast<float>(plan.step_world));
    p.mapper->SetInteractiveSampleDistance(static_cast<float>(plan.step_world));
    p.mapper->SetImageSampleDistance(1);
    p.mapper->SetIntermixIntersectingGeometry(false);
    p.mapper->SetBlendModeToComposite();
    p.volume->SetMapper(p.mapper);
    p.volume->SetProperty(p.property);
    p.window->SetSize(plan.camera.width, plan.camera.height);
    p.window->AddRenderer(p.renderer);
    p.renderer->SetTwoSidedLighting(plan.scene.shading.two_sided);
    p.renderer->AutomaticLightCreationOff();
    for (auto& light : p.lights) p.renderer->AddLight(light);
    p.renderer->AddVolume(p.volume);
}

VtkPeer::~VtkPeer() = default;

void VtkPeer::set_threads(int threads) {
    parts_->mapper->SetNumberOfThreads(threads);
}

VtkPeer::Frame VtkPeer::render(const Camera& camera) {
    Parts& p = *parts_;
    p.aim(camera);
    Frame frame;
    double none[3] = {0, 0, 0};
    int no_extent[6] = {0, 0, 0, 0, 0, 0};
    const auto start = Clock::now();
    p.mapper->PerImageInitialization(p.renderer, p.volume, 0, none, none, no_extent);
    p.mapper->PerVolumeInitialization(p.renderer, p.volume);
    p.mapper->PerSubVolumeInitialization(p.renderer, p.volume, 0);
    const auto cast = Clock::now();
    p.mapper->RenderSubVolume();
    frame.cast_ms = ms_since(cast);
    frame.whole_ms = ms_since(start);
    frame.image = p.picture();
    return frame;
}

std::array<double, 4> VtkPeer::Parts::pixel_in_double(int x, int y) const {
    unsigned int start[3], direction[3], steps = 0;
    mapper->ComputeRayInfo(x, y, start, direction, &steps);
    std::array<double, 4> color{0, 0, 0, 0};
    if (steps == 0) return color;

    int origin[2];
    mapper->GetRayCastImage()->GetImageOrigin(origin);
    const Volume& v = *plan.volume;
    const Ray ray = camera.ray(x + origin[0], camera.height - 1 - (y + origin[1]));
    const Vec3 first(start[0] / VTKKW_FP_SCALE, start[1] / VTKKW_FP_SCALE, start[2] / VTKKW_FP_SCALE);
    const double entry = (v.grid_from_voxel(first) - ray.origin).dot(ray.direction);
    const Entries& e = plan.entries;
    const unsigned short *diffuse = mapper->GetDiffuseShadingTable(0),
                         *specular = mapper->GetSpecularShadingTable(0);
    unsigned short** normals = mapper->GetGradientNormal();

    double T = 1;
    for (unsigned int k = 0; k < steps && T >= 255 / VTKKW_FP_SCALE; ++k) {
        const Vec3 at = v.voxel_from_grid(ray.origin + ray.direction * (entry + k * plan.step_world));
        std::int64_t cell[3];
        double weight[3];
        for (int a = 0; a < 3; ++a) {
            cell[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at[a])), 0,
                                               std::max<std::int64_t>(0, v.dims[a] - 2));
            weight[a] = std::clamp(at[a] - static_cast<double>(cell[a]), 0.0, 1.0);
        }
        double scalar = 0, corner_weight[8];
        for (int i = 0; i < 8; ++i) {
            corner_weight[i] = ((i & 1) ? weight[0] : 1 - weight[0]) * ((i & 2) ? weight[1] : 1 - weight[1]) *
                               ((i & 4) ? weight[2] : 1 - weight[2]);
            scalar += corner_weight[i] * v.at(cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2));
        }
        const double u = std::clamp(e.coordinate(scalar), 0.0, e.size() - 1.0);
        const auto below = static_cast<std::size_t>(std::min(u, e.size() - 2.0));
        const Entry &low = e.entry[below], &high = e.entry[below + 1];
        const double f = u - static_cast<double>(below);
        const bool opaque = (low.opaque && (f == 0 || high.opaque)) || (high.opaque && f == 1);
        const double tau = low.extinction + f * (high.extinction - low.extinction);
        if (!opaque && tau == 0) continue;
        const double alpha = opaque ? 1 : -std::expm1(-tau * plan.step_world);
        double shade[6] = {1, 1, 1, 0, 0, 0};
        if (plan.lit) {
            std::fill(shade, shade + 6, 0);
            for (int i = 0; i < 8; ++i) {
                const std::size_t normal =
                    normals[cell[2] + (i >> 2)][(cell[1] + (i >> 1 & 1)) * v.dims.x + cell[0] + (i & 1)];
                for (std::size_t c = 0; c < 3; ++c) {
                    shade[c] += corner_weight[i] * diffuse[3 * normal + c] / VTKKW_FP_SCALE;
                    shade[3 + c] += corner_weight[i] * specular[3 * normal + c] / VTKKW_FP_SCALE;
                }
            }
        }
        for (int c = 0; c < 3; ++c) {
            const double plain = low.color[c] + f * (high.color[c] - low.color[c]);
            color[static_cast<std::size_t>(c)] += T * alpha * (plain * shade[c] + shade[3 + c]);
        }
        T *= 1 - alpha;
    }
    color[3] = 1 - T;
    return color;
}

Image VtkPeer::in_double(int every) const {
    const Parts& p = *parts_;
    int size[2], origin[2];
    p.mapper->GetRayCastImage()->GetImageInUseSize(size);
    p.mapper->GetRayCastImage()->GetImageOrigin(origin);
    const int* bounds = p.mapper->GetRowBounds();  // VTK casts no ray outside them, nor do we
    Image image;
    image.width = p.camera.width, image.height = p.camera.height;
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    in_parallel((image.height - every / 2 + every - 1) / every, [&](int i) {
        const int row = i * every + every / 2, y = image.height - 1 - row - origin[1];
        if (y < 0 || y >= size[1]) return;
        for (int column = every / 2; column < image.width; column += every) {
            const int x = column - origin[0];
            if (x < std::max(0, bounds[2 * y]) || x > std::min(bounds[2 * y + 1], size[0] - 1)) continue;
            const std::array<double, 4> color = p.pixel_in_double(x, y);
            for (std::size_t c = 0; c < 4; ++c)
                image.channels[c].values[static_cast<std::size_t>(row * image.width + column)] =
                    static_cast<float>(color[c]);
        }
    });
    return image;
}

}  // namespace squint::bench
