// VTK's software ray caster (vtkFixedPointVolumeRayCastMapper: 15 bits, scalar code) on a squint scene: the
// same volume in memory, transfer function, camera, light and step, without a window or a display.
#pragma once

#include "core/camera.h"
#include "core/image.h"
#include "pipeline/plan/plan.h"

#include <memory>

namespace squint::bench {

class VtkPeer {
  public:
    /// Takes from the plan all that VTK can be told: volume, transfer function (colours as they are), unit
    /// distance, step, light, picture size.  VTK's own space leaping and early termination are on.  Throws
    /// InputError for what VTK cannot be told (two points at one value, per-ray lights in perspective views).
    VtkPeer(const Plan& plan, int threads);
    ~VtkPeer();
    VtkPeer(const VtkPeer&) = delete;
    VtkPeer& operator=(const VtkPeer&) = delete;

    struct Frame {
        Image image;         // R G B A, premultiplied: VTK's 15-bit words over 32767
        double cast_ms = 0;  // the ray cast alone
        double whole_ms =
            0;  // with what precedes it: tables, gradients, block structure (first frame), matrices
    };
    Frame render(const Camera& camera);
    void set_threads(int threads);  // of the ray cast

    /// The last frame without rounding: VTK's own samples (phase and number), end at T < 255/32767 and shades
    /// of encoded normals, but positions, interpolation, classification and compositing in doubles.  Only
    /// pixels every * i + every / 2 in both directions; the others stay empty.
    Image in_double(int every = 1) const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace squint::bench
