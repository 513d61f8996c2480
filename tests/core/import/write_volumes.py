#!/usr/bin/python3
"""write_volumes.py FOLDER [origin]: the same 20x16x12 voxels in every format, by other people's programs where there are
such (nibabel, pydicom, teem, ImageMagick, OpenImageIO), otherwise to the letter of the format; and series that no
volume can be made of.  With `origin` the first voxel lies at the world's origin, as in pictures, which state no place."""
import base64
import os
import struct
import subprocess
import sys
import zlib

import nibabel
import numpy
from pydicom.dataset import FileDataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, JPEG2000Lossless, RLELossless, generate_uid

NX, NY, NZ = 20, 16, 12
SPACING, ORIGIN = (0.5, 0.75, 1.25), (-10.0, 20.0, -30.0)


def voxels():
    """HU in LPS order, [z, y, x]: a ball in air, with a ramp that no turn leaves unnoticed."""
    z, y, x = numpy.mgrid[0:NZ, 0:NY, 0:NX]
    ball = numpy.sqrt((x - 9.5) ** 2 + ((y - 7.5) * 1.2) ** 2 + ((z - 5.5) * 1.6) ** 2) < 8
    return (ball * 1400 - 1000 + x * 7 + y * 3 + z * 5).astype(numpy.int16)


def turn():
    """25 degrees about (1, 2, 3): columns are the directions of x, y and z (Rodrigues)."""
    x, y, z = numpy.array([1, 2, 3]) / numpy.sqrt(14)
    across = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = numpy.radians(25)
    return numpy.eye(3) + numpy.sin(angle) * across + (1 - numpy.cos(angle)) * across @ across


def ras_from_lps(values):
    return values[:, ::-1, ::-1]


def write_nifti(folder, v):
    lps = numpy.diag([-SPACING[0], -SPACING[1], SPACING[2], 1.0])  # NIfTI's world is RAS
    lps[:3, 3] = [-ORIGIN[0], -ORIGIN[1], ORIGIN[2]]
    ras = numpy.diag([*SPACING, 1.0])
    ras[:3, 3] = [-(ORIGIN[0] + SPACING[0] * (NX - 1)), -(ORIGIN[1] + SPACING[1] * (NY - 1)), ORIGIN[2]]
    xyz = v.transpose(2, 1, 0)

    def save(name, values, affine, kind=nibabel.Nifti1Image):
        kind(values, affine).to_filename(f"{folder}/{name}")

    save("a.nii", xyz, lps)
    save("a.nii.gz", xyz, lps)
    save("ras.nii.gz", ras_from_lps(v).transpose(2, 1, 0), ras)
    save("two.nii", xyz, lps, nibabel.Nifti2Image)
    save("pair.img", xyz, lps, nibabel.Nifti1Pair)
    q_form = nibabel.Nifti1Image(xyz, None)
    q_form.header.set_zooms(SPACING)
    q_form.set_qform(lps, 1)
    q_form.set_sform(None, 0)
    q_form.to_filename(f"{folder}/q.nii")
    scaled = nibabel.Nifti1Image((xyz + 1000).astype(numpy.int16), lps)
    scaled.header.set_slope_inter(0.5, -3)
    scaled.to_filename(f"{folder}/scaled.nii")

    save("times.nii.gz", numpy.stack([xyz, xyz + 10, xyz + 20], -1).astype(numpy.int16), lps)
    save("float.nii", xyz.astype(numpy.float32), lps)
    holed = xyz.astype(numpy.float32)
    holed[5, 4, 3] = numpy.nan
    save("nan.nii", holed, lps)
    turned = numpy.eye(4)
    turned[:3, :3] = numpy.diag([-1, -1, 1]) @ turn() @ numpy.diag([-1, -1, 1])
    save("turned.nii", xyz, turned @ lps)
    sheared = nibabel.Nifti1Image(xyz, None)
    affine = lps.copy()
    affine[0, 2] = SPACING[2] * numpy.tan(numpy.radians(15))
    sheared.set_sform(affine, 1)
    sheared.to_filename(f"{folder}/sheared.nii")


def write_dicom(folder, slices, order=None, offset=1000, uid=None, number=3, shear=0.0, turned=numpy.eye(3), change=lambda ds, k: None):
    """Slices [z, y, x] in a shuffled order, by pydicom; `change` may spoil the k-th."""
    os.makedirs(folder, exist_ok=True)
    uid = uid or generate_uid()
    for n, k in enumerate(order if order is not None else range(len(slices))):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2"
        meta.MediaStorageSOPInstanceUID = generate_uid()
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        path = f"{folder}/IM{number}{n:03d}"
        ds = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
        ds.is_little_endian, ds.is_implicit_VR = True, False
        ds.SOPClassUID, ds.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        ds.PatientName, ds.PatientID = "Roe^Jane", "PID4711"
        ds.StudyDate, ds.PatientBirthDate, ds.AccessionNumber = "20190203", "19610708", "ACC0815"
        ds.InstitutionName, ds.SeriesDescription = "St Elsewhere", "Roe head"
        ds.Modality, ds.SeriesInstanceUID, ds.SeriesNumber, ds.InstanceNumber = "CT", uid, number, n + 1
        ds.Rows, ds.Columns = slices[k].shape
        ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
        ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.PixelRepresentation = 16, 12, 11, 0
        ds.RescaleSlope, ds.RescaleIntercept = "1", str(-offset)
        place = turned @ (ORIGIN[0] + shear * k, ORIGIN[1], ORIGIN[2] + SPACING[2] * k)
        ds.ImageOrientationPatient = [f"{x:.10f}" for x in (*turned[:, 0], *turned[:, 1])]
        ds.ImagePositionPatient = [f"{x:.10f}" for x in place]
        ds.PixelSpacing, ds.SliceThickness = [SPACING[1], SPACING[0]], "2"
        ds.PixelData = (slices[k] + offset).astype("<u2").tobytes()
        change(ds, k)
        ds.save_as(path)


def write_all_dicom(folder, v):
    order = list(range(NZ))
    numpy.random.default_rng(7).shuffle(order)
    write_dicom(f"{folder}/dicom", v, order)
    write_dicom(f"{folder}/rle", v, order, change=lambda ds, k: ds.compress(RLELossless))
    write_dicom(f"{folder}/gap", v, [k for k in order if k != 5])
    write_dicom(f"{folder}/tilted", v, order, shear=SPACING[2] * numpy.tan(numpy.radians(15)))
    write_dicom(f"{folder}/turned", v, order, turned=turn())
    write_dicom(f"{folder}/two_series", v, order)
    write_dicom(f"{folder}/two_series", v[:4] + 100, number=7)
    same = generate_uid()
    write_dicom(f"{folder}/mixed", v, order, uid=same)
    write_dicom(f"{folder}/mixed", v[:2, :8, :], uid=same, number=3001, change=lambda ds, k: setattr(ds, "SeriesNumber", 3))
    write_dicom(f"{folder}/times", v, uid=same)

    def later(ds, k):
        ds.SeriesNumber, ds.InstanceNumber = 3, 101 + k

    write_dicom(f"{folder}/times", v + 10, uid=same, number=3001, change=later)

    def jpeg2000(ds, _):
        ds.file_meta.TransferSyntaxUID = JPEG2000Lossless
        ds.PixelData = b"\xfe\xff\x00\xe0\0\0\0\0\xfe\xff\x00\xe0\4\0\0\0abcd\xfe\xff\xdd\xe0\0\0\0\0"
        ds["PixelData"].VR, ds["PixelData"].is_undefined_length = "OB", True

    write_dicom(f"{folder}/jpeg2000", v, order, change=jpeg2000)
    for name, key, value in [("colour", "SamplesPerPixel", 3), ("frames", "NumberOfFrames", "4")]:
        write_dicom(f"{folder}/{name}", v, order, change=lambda ds, _, key=key, value=value: setattr(ds, key, value))
    write_dicom(f"{folder}/slopes", v, order, change=lambda ds, k: setattr(ds, "RescaleSlope", str(1 + 0.25 * k)))


def write_meta_image(folder, v):
    raw = v.astype("<i2").tobytes()
    packed = zlib.compress(raw)

    def save(name, more, data, where="LOCAL", turned=numpy.eye(3)):
        first = turned @ ORIGIN
        header = (
            f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n{more}"
            f"TransformMatrix = {' '.join(map(repr, map(float, turned.T.ravel())))}\n"
            f"Offset = {first[0]} {first[1]} {first[2]}\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = RAI\n"
            f"ElementSpacing = {SPACING[0]} {SPACING[1]} {SPACING[2]}\nDimSize = {NX} {NY} {NZ}\n"
            f"ElementType = MET_SHORT\nElementDataFile = {where}\n"
        )
        with open(f"{folder}/{name}", "wb") as file:
            file.write(header.encode() + data)

    save("a.mha", "CompressedData = False\n", raw)
    save("packed.mha", f"CompressedData = True\nCompressedDataSize = {len(packed)}\n", packed)
    save("turned.mha", "", raw, turned=turn())
    save("a.mhd", "", b"", "a.raw")
    with open(f"{folder}/a.raw", "wb") as file:
        file.write(raw)


def write_nrrd(folder, name, v, space, origin, turned=numpy.eye(3)):
    steps = " ".join("(%r,%r,%r)" % tuple(map(float, turned[:, axis] * SPACING[axis])) for axis in range(3))
    origin = [float(x) for x in origin]
    with open(f"{folder}/{name}", "wb") as file:
        file.write(
            (
                f"NRRD0004\ntype: short\ndimension: 3\nspace: {space}\nsizes: {NX} {NY} {NZ}\n"
                f"space directions: {steps}\n"
                f"endian: little\nencoding: raw\nspace origin: ({origin[0]},{origin[1]},{origin[2]})\n\n"
            ).encode()
            + v.astype("<i2").tobytes()
        )


def write_by_teem(folder):
    """The voxels of a.raw in gzip."""
    steps = "(%g,0,0) (0,%g,0) (0,0,%g)" % SPACING
    subprocess.run(
        ["teem-unu", "make", "-i", f"{folder}/a.raw", "-t", "short", "-s", str(NX), str(NY), str(NZ), "-en", "little", "-spc", "LPS",
         "-orig", "(%g,%g,%g)" % ORIGIN, "-dirs", steps, "-e", "gzip", "-o", f"{folder}/teem.nrrd"], check=True)


def write_vti(folder, v):
    raw = v.astype("<i2").tobytes()
    count = struct.pack("<I", len(raw))
    blocks = [raw[i : i + 1000] for i in range(0, len(raw), 1000)]
    packed = [zlib.compress(block) for block in blocks]
    table = struct.pack(f"<{3 + len(blocks)}I", len(blocks), 1000, len(raw) % 1000, *map(len, packed))

    def save(name, kind, inside, compressor="", after=b"", turned=numpy.eye(3)):
        first = turned @ ORIGIN
        direction = " ".join(map(repr, map(float, turned.ravel())))
        extent = f"0 {NX - 1} 0 {NY - 1} 0 {NZ - 1}"
        place = 'offset="0" ' if kind == "appended" else ""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" '
            f'header_type="UInt32"{compressor}>\n<ImageData WholeExtent="{extent}" '
            f'Origin="{first[0]} {first[1]} {first[2]}" Spacing="{SPACING[0]} {SPACING[1]} {SPACING[2]}" '
            f'Direction="{direction}">\n'
            f'<Piece Extent="{extent}"><PointData Scalars="s"><DataArray type="Int16" Name="s" {place}format="{kind}">'
        )
        with open(f"{folder}/{name}", "wb") as file:
            file.write(head.encode() + inside)
            file.write(b"</DataArray></PointData></Piece></ImageData>" + after + b"</VTKFile>")

    save("text.vti", "ascii", " ".join(map(str, v.ravel())).encode())
    save("turned.vti", "ascii", " ".join(map(str, v.ravel())).encode(), turned=turn())
    save("base64.vti", "binary", base64.b64encode(count + raw))
    save("packed.vti", "binary", base64.b64encode(table) + base64.b64encode(b"".join(packed)),
         ' compressor="vtkZLibDataCompressor"')
    save("raw.vti", "appended", b"", after=b'<AppendedData encoding="raw">_' + count + raw + b"</AppendedData>")


def write_stacks(folder, v):
    """By ImageMagick: a TIFF of several pages, and folders of PNG and TIFF; one of the slices by OpenImageIO."""
    (v + 1000).astype("<u2").tofile(f"{folder}/stack.gray")
    pages = f"{folder}/pages.tif"
    for name in ("pngs", "tifs", "colours", "unlike"):
        os.makedirs(f"{folder}/{name}", exist_ok=True)

    def run(*words):
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)

    run("convert", "-depth", "16", "-endian", "LSB", "-size", f"{NX}x{NY}", f"gray:{folder}/stack.gray", "-alpha", "off",
        "-compress", "LZW", pages)
    run("convert", pages, "-define", "png:bit-depth=16", "-define", "png:color-type=0", f"{folder}/pngs/slice%d.png")
    run("convert", pages, "+adjoin", f"{folder}/tifs/slice%d.tif")  # slice9 before slice10
    run("oiiotool", pages, "--subimage", "3", "-d", "uint16", "-o", f"{folder}/tifs/slice3.tif")
    run("convert", "-size", "4x3", "gradient:red-blue", f"{folder}/colours/a.png")
    run("convert", "-size", "4x3", "-colorspace", "gray", "gradient:", f"{folder}/unlike/a.png")
    run("convert", "-size", "5x3", "-colorspace", "gray", "gradient:", f"{folder}/unlike/b.png")


def main(folder):
    os.makedirs(folder, exist_ok=True)
    v = voxels()
    write_nifti(folder, v)
    write_all_dicom(folder, v)
    write_meta_image(folder, v)
    write_nrrd(folder, "a.nrrd", v, "left-posterior-superior", ORIGIN)
    last = (-(ORIGIN[0] + SPACING[0] * (NX - 1)), -(ORIGIN[1] + SPACING[1] * (NY - 1)), ORIGIN[2])
    write_nrrd(folder, "ras.nrrd", ras_from_lps(v), "right-anterior-superior", last)
    write_nrrd(folder, "turned.nrrd", v, "left-posterior-superior", turn() @ ORIGIN, turn())
    half_turn = numpy.diag([-1, -1, 1])  # RAS from LPS
    write_nrrd(folder, "turned_ras.nrrd", v, "right-anterior-superior", half_turn @ turn() @ ORIGIN, half_turn @ turn())
    quarter = numpy.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    write_nrrd(folder, "quarter.nrrd", v, "left-posterior-superior", quarter @ ORIGIN, quarter)
    rounding = 6.123e-17 * numpy.array([[1, 0, 0], [0, 1, 0], [0, 0, 0]])  # cos(90 degrees) in doubles
    write_nrrd(folder, "rounded.nrrd", v, "left-posterior-superior", quarter @ ORIGIN, quarter + rounding)
    write_by_teem(folder)
    write_vti(folder, v)
    write_stacks(folder, v)


if __name__ == "__main__":
    if "origin" in sys.argv[2:]:
        ORIGIN = (0.0, 0.0, 0.0)
    main(sys.argv[1])
