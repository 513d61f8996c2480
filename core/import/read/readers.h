// The readers of squint-read, one a kind of file.
#pragma once

#include "core/import/handover.h"

#include <cstdint>
#include <string>

namespace squint::read {

/// What was asked for.
struct Request {
    std::string path;
    LoadLimits limits;
    int series = 0;      // of DICOM, from 1; 0: the only one
    int component = -1;  // of DICOM with several slices at each place; -1: none was named
};

/// Room for the voxels of `stored` in the memory file.  Throws InputError beyond the limits.
unsigned char* room_for(const StoredVolume& stored, const LoadLimits& limits);

/// Each fills in the header and writes the voxels into room_for() it.  Throws InputError.
Handover read_dicom(const Request& request);
Handover read_nifti(const Request& request);
Handover read_vti(const Request& request);
Handover read_pictures(const Request& request);

}  // namespace squint::read
