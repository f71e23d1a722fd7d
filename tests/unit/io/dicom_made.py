# SPDX-License-Identifier: Apache-2.0
"""DICOM files written by pydicom: series and segmentations as scanners and other programs write them."""
import pathlib

import numpy
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.uid import UID, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid

CT, ENHANCED_CT, SEG = (UID("1.2.840.10008.5.1.4.1.1." + end) for end in ("2", "2.1", "66.4"))

AXIAL = numpy.array([[0.7, 0, 0, -10], [0, 0.8, 0, -20], [0, 0, 1.5, 30], [0, 0, 0, 1.0]])


def turned(affine):
    """About two axes: oblique to all."""
    (c, s), (d, t) = ((numpy.cos(a), numpy.sin(a)) for a in (0.3, -0.5))
    out = numpy.eye(4)
    out[:3, :3] = numpy.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ numpy.array([[1, 0, 0], [0, d, -t], [0, t, d]])
    return out @ affine


def text(numbers):
    return [f"{x:.10g}" for x in numpy.ravel(numbers)]


def new_file(path, kind, syntax=ExplicitVRLittleEndian):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = kind, generate_uid()
    meta.TransferSyntaxUID = syntax
    out = FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
    out.is_little_endian = syntax != ExplicitVRBigEndian
    out.is_implicit_VR = syntax == ImplicitVRLittleEndian
    out.SOPClassUID, out.SOPInstanceUID = kind, meta.MediaStorageSOPInstanceUID
    out.PatientName, out.PatientID, out.PatientBirthDate, out.PatientSex = "Doe^Jane", "4711", "19700101", "F"
    out.StudyInstanceUID = "1.2.3.4"
    out.StudyDate, out.StudyTime, out.AccessionNumber, out.ReferringPhysicianName, out.StudyID = "20200101", "120000", "A1", "House", "1"
    return out


def set_pixels(data, array, signed, bits=16):
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.Rows, data.Columns = array.shape[-2:]
    data.BitsAllocated, data.BitsStored, data.HighBit = bits, bits, bits - 1
    data.PixelRepresentation = 1 if signed else 0
    data.PixelData = array.tobytes()
    data["PixelData"].VR = "OW" if bits > 8 else "OB"


def slice_of(path, plane, affine, k, series, syntax=ExplicitVRLittleEndian, signed=True):
    """`plane` is rows by columns, as stored; `affine` brings (column, row, slice) to LPS mm."""
    data = new_file(path, CT, syntax)
    data.Modality, data.SeriesInstanceUID, data.SeriesDescription = "CT", series, "Thorax 1.0"
    data.FrameOfReferenceUID = "1.2.3.4.9"
    data.SeriesNumber, data.InstanceNumber = 2, int(k) + 1
    data.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
    spacing = numpy.linalg.norm(affine[:3, :3], axis=0)
    data.PixelSpacing = text([spacing[1], spacing[0]])
    data.SliceThickness = text([spacing[2]])[0]
    data.ImageOrientationPatient = text(numpy.concatenate([affine[:3, 0] / spacing[0], affine[:3, 1] / spacing[1]]))
    data.ImagePositionPatient = text((affine @ [0, 0, k, 1])[:3])
    data.RescaleIntercept, data.RescaleSlope, data.RescaleType = 0, 1, "HU"
    data.KVP, data.Manufacturer = 120, "Acme"
    set_pixels(data, plane, signed)
    return data


def write_series(folder, volume, affine, series="1.2.3.4.5", syntax=ExplicitVRLittleEndian, change=None, names=None):
    """`volume` is (i, j, k), as stored, signed or not as its type is. Files are named in no order."""
    folder = pathlib.Path(folder)
    folder.mkdir(exist_ok=True, parents=True)
    names = names or [f"IM{(k * 7919) % 1009:04d}" for k in range(volume.shape[2])]
    for k in range(volume.shape[2]):
        plane = numpy.ascontiguousarray(volume[:, :, k].T)
        data = slice_of(folder / names[k], plane, affine, k, series, syntax, numpy.issubdtype(volume.dtype, numpy.signedinteger))
        if syntax == ExplicitVRBigEndian:
            data.PixelData = plane.byteswap().tobytes()
        if (change(data, k) if change else None) is not False:
            data.save_as(folder / names[k], write_like_original=False)
    return folder


def item(**values):
    out = Dataset()
    for key, value in values.items():
        setattr(out, key, value)
    return out


def code(value, meaning, scheme="SCT"):
    return item(CodeValue=value, CodingSchemeDesignator=scheme, CodeMeaning=meaning)


def segment(number, label, type_code, side=None, category=("91723000", "Anatomical Structure")):
    kind = code(*type_code)
    if side:
        kind.SegmentedPropertyTypeModifierCodeSequence = [code(*side)]
    return item(SegmentNumber=number, SegmentLabel=label, SegmentAlgorithmType="AUTOMATIC", SegmentAlgorithmName="made",
                SegmentedPropertyCategoryCodeSequence=[code(*category)], SegmentedPropertyTypeCodeSequence=[kind])


def write_segmentation(path, masks, segments, affine, kind="BINARY", series="1.2.3.4.8", change=None, most=255):
    """`masks`: number to (i, j, k) of 0 and 1, or of 0 to `most` where fractional; empty planes have no frame."""
    data = new_file(path, SEG)
    data.Modality, data.SeriesInstanceUID, data.SeriesDescription, data.SegmentationType = "SEG", series, "Bones", kind
    data.SegmentSequence = segments
    spacing = numpy.linalg.norm(affine[:3, :3], axis=0)
    ways = affine[:3, :3] / spacing
    data.SharedFunctionalGroupsSequence = [item(
        PixelMeasuresSequence=[item(PixelSpacing=text([spacing[1], spacing[0]]), SliceThickness=text(spacing[2])[0],
                                    SpacingBetweenSlices=text(spacing[2])[0])],
        PlaneOrientationSequence=[item(ImageOrientationPatient=text([ways[:, 0], ways[:, 1]]))])]
    frames, planes = [], []
    for number, mask in masks.items():
        for k in range(mask.shape[2]):
            if mask[:, :, k].any():
                planes.append(mask[:, :, k].T)
                frames.append(item(
                    PlanePositionSequence=[item(ImagePositionPatient=text((affine @ [0, 0, k, 1])[:3]))],
                    SegmentIdentificationSequence=[item(ReferencedSegmentNumber=number)]))
    data.PerFrameFunctionalGroupsSequence = frames
    data.NumberOfFrames = len(frames)
    array = numpy.stack(planes).astype("u1")
    set_pixels(data, array, False, 8)
    if kind == "BINARY":
        data.BitsAllocated = data.BitsStored = 1
        data.HighBit = 0
        bits = numpy.packbits(array.ravel(), bitorder="little").tobytes()
        data.PixelData = bits + b"\0" * (len(bits) % 2)
    else:
        data.MaximumFractionalValue, data.SegmentationFractionalType = most, "PROBABILITY"
    if change:
        change(data)
    data.save_as(path, write_like_original=False)
    return path
