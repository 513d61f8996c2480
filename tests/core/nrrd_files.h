// NRRD files of 24 voxels, for the tests of what is read and of what is refused.
#pragma once

#include "tests/core/volume_files.h"

namespace squint {

/// A header of 4x3x2 voxels, to be changed line by line.
struct Header {
    std::string type = "uchar", sizes = "4 3 2", encoding = "raw", more = "";
    std::string text() const {
        return "NRRD0004\n# a comment\ntype: " + type + "\ndimension: 3\nsizes: " + sizes +
               "\nencoding: " + encoding + "\nendian: little\n" + more + "\n";
    }
};
inline const std::string k24Bytes = bytes_of_values(counting<std::uint8_t>(24));

class Nrrd : public VolumeFiles {};

}  // namespace squint
