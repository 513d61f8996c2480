// The readers of squint-read, one for each kind of file.
#pragma once

#include "core/import/handover.h"

#include <cstdint>
#include <string>

namespace squint::read {

/// What the library asks a reader for.
struct Request {
    std::string path;
    LoadLimits limits;
    int series = 0;      // of DICOM, from 1; 0: the only one
    int component = -1;  // of DICOM with several slices at each place; -1: none was named
};

/// Allocates the voxels of `stored` in the memory file.  Throws InputError beyond the limits.
unsigned char* room_for(const StoredVolume& stored, const LoadLimits& limits);

/// Each returns the header and writes the voxels into room_for() it.  Throws InputError.
Handover read_dicom(const Request& request);
Handover read_nifti(const Request& request);
Handover read_vti(const Request& request);
Handover read_pictures(const Request& request);

}  // namespace squint::read
