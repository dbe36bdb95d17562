"""What is in image files of labels: NRRD, TIFF stacks and NIfTI, in the file's own unit and frame."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats
from flyreg_core.project import Unit

if TYPE_CHECKING:  # each library is loaded when a file of its kind is read
    import tifffile

T = TypeVar("T")
UNITS: Mapping[str, Unit] = {
    **dict.fromkeys(("nm", "nanometer", "nanometre"), "nm"),
    **dict.fromkeys(("um", "µm", "μm", "\\u00b5m", "micron", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("mm", "millimeter", "millimetre"), "mm"),
}
"""Words for units in these files, in the singular and in small letters."""
STACKED = "ZIQT"
"""Letters of a TIFF file's axes along which slices are stacked; pages without a meaning are I or Q."""


@dataclass(frozen=True, eq=False)
class VolumeHeader:
    """Where the voxels of a volume lie: number (i, j, k) is centred at origin + axes @ (i, j, k)."""

    shape: tuple[int, ...]  # voxels along the 3 axes, the fastest in the file first
    axes: Floats  # (3, 3), column a: from a voxel to the next one along axis a
    origin: Floats  # (3,)
    unit: Unit | None  # None: the file does not say
    has_voxel_size: bool = True  # False: axes have length 1, as the file does not say it

    @property
    def voxel_size(self) -> Floats:
        """(3,) edges of a voxel."""
        return np.asarray(np.linalg.norm(self.axes, axis=0))

    @property
    def extent(self) -> float:
        """Longest edge of the whole volume."""
        return float((self.voxel_size * self.shape).max())

    def with_voxel_size(self, size: Sequence[float]) -> VolumeHeader:
        """Return the header with voxels of another size, the first one as many voxels from 0."""
        factors = np.asarray(size) / self.voxel_size
        start = np.linalg.solve(self.axes, self.origin)
        axes = self.axes * factors
        return replace(self, axes=axes, origin=axes @ start, has_voxel_size=True)

    def scaled(self, factor: float) -> VolumeHeader:
        """Return the header in another unit."""
        return replace(self, axes=self.axes * factor, origin=self.origin * factor)


def is_volume(path: Path) -> bool:
    """Tell from the ending whether a file holds a volume."""
    return _ending(path) is not None


def files_of(path: Path) -> tuple[Path, ...]:
    """Return the files of a volume: one, or a header and the file that it names for the voxels."""
    if path.suffix.lower() != ".nhdr":
        return (path,)
    header = _decoded(path, _nrrd_fields)
    data = header.get("data file", header.get("datafile"))
    if data is None or str(data).startswith("LIST") or "%" in str(data):
        raise InputError(
            f"{path} does not name one file with its voxels; save the volume as one .nrrd file"
        )
    return path, path.parent / str(data)


def read_header(path: Path) -> VolumeHeader:
    """Return where the voxels of a volume lie, without reading them.

    Raises
    ------
    InputError
        The file is missing, of another kind, damaged, or holds no three-dimensional volume of one
        number per voxel.
    """
    ending = _ending(path)
    header = _decoded(path, _READERS[ending or ""][0])
    if len(header.shape) != 3 or min(header.shape) < 3:
        raise InputError(
            f"{path} has {_times(header.shape)} voxels, and a volume has three dimensions of at "
            "least 3; save the whole stack with one label per voxel in one file"
        )
    is_regular = np.isfinite(header.axes).all() and np.isfinite(header.origin).all()
    if not is_regular or abs(np.linalg.det(header.axes)) < 1e-9 * header.voxel_size.prod():
        raise InputError(
            f"{path} is damaged: its axes do not span space; save it again with a voxel size"
        )
    return header


def read_labels(path: Path) -> NDArray[Any]:
    """Return the voxels, the axis that is fastest in the file last: [k, j, i].

    Raises
    ------
    InputError
        The file is damaged, cut short, or holds no plain numbers.
    """
    header = read_header(path)
    labels = _decoded(path, _READERS[_ending(path) or ""][1])
    labels = labels.reshape(header.shape[::-1])
    if labels.dtype.kind not in "buif":
        raise InputError(
            f"{path} holds {labels.dtype} and not one number per voxel; save it as labels"
        )
    return labels


def _ending(path: Path) -> str | None:
    return next((ending for ending in _READERS if path.name.lower().endswith(ending)), None)


def _decoded(path: Path, read: Callable[[Path], T]) -> T:
    if not path.is_file():
        raise InputError(f"there is no file {path}; check its name and folder")
    if not path.stat().st_size:
        raise InputError(f"{path} is empty (0 bytes); copy or export it again")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the libraries' remarks on odd headers
            return read(path)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{path} is too large for this computer's memory") from error
    except Exception as error:  # whatever a parser stumbles over in a broken file
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{path} is damaged, cut short or of another kind ({reason}); copy or export it again"
        ) from error


def _times(shape: Iterable[int]) -> str:
    return " x ".join(f"{length:,}" for length in shape)


def _unit(words: Iterable[object]) -> Unit | None:
    """Return the unit that all words name; None if they differ or name none."""
    found = {UNITS.get(str(word).strip().lower().removesuffix("s")) for word in words}
    return found.pop() if len(found) == 1 else None


def _nrrd_fields(path: Path) -> dict[str, Any]:
    import nrrd

    with path.open("rb") as file:
        return dict(nrrd.read_header(file))


def _nrrd_header(path: Path) -> VolumeHeader:
    fields = _nrrd_fields(path)
    sizes = [int(size) for size in fields["sizes"]]
    used = [axis for axis, size in enumerate(sizes) if size > 1]
    if len(used) != 3:
        return VolumeHeader(tuple(sizes), np.eye(3), np.zeros(3), None)
    axes, has_size = np.eye(3), True
    if "space directions" in fields:
        directions = np.array([fields["space directions"][axis] for axis in used], dtype=float)
        axes = directions.T
    elif "spacings" in fields:
        spacings = np.array([fields["spacings"][axis] for axis in used], dtype=float)
        has_size = bool(np.isfinite(spacings).all())
        axes = np.diag(spacings) if has_size else axes
    else:
        has_size = False
    if not has_size and np.isnan(axes).any():
        axes = np.eye(3)
    mins = fields.get("axis mins", fields.get("axismins"))
    start = np.zeros(3) if mins is None else np.nan_to_num([mins[axis] for axis in used])
    words = fields.get("space units") or [w for w in fields.get("units", ()) if w] or ()
    # the library drops what is not ASCII, so that the sign for micro is missing before a metre
    unit = _unit("um" if word == "m" else word for word in words)
    shape = (sizes[used[0]], sizes[used[1]], sizes[used[2]])
    origin = np.asarray(fields.get("space origin", start), dtype=float)
    return VolumeHeader(shape, axes, origin, unit, has_size)


def _nrrd_labels(path: Path) -> NDArray[Any]:
    import nrrd

    for file in files_of(path):
        if not file.is_file():
            raise InputError(f"{path} names the file {file}, which is missing; put it there")
    labels: NDArray[Any] = nrrd.read(str(path), index_order="C")[0]
    return labels


@contextmanager
def _failing_on_errors() -> Iterator[None]:
    """Raise what the TIFF library only writes to its log, such as that pages are missing."""
    errors: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        if record.levelno >= logging.ERROR:
            errors.append(record.getMessage())
        return False

    logger = logging.getLogger("tifffile")
    logger.addFilter(keep)
    try:
        yield
    finally:
        logger.removeFilter(keep)
    if errors:
        raise ValueError(errors[0])


def _tiff_header(path: Path) -> VolumeHeader:
    import tifffile

    with _failing_on_errors(), tifffile.TiffFile(path) as file:
        series = file.series[0]
        kept = [(a, n) for a, n in zip(series.axes, series.shape, strict=True) if n > 1]
        letters = "".join(letter for letter, _ in kept)
        sizes = tuple(size for _, size in reversed(kept))
        if "S" in letters or "C" in letters:
            raise InputError(
                f"{path} is a colour image of {_times(sizes)} values, not labels; save one label "
                "per voxel"
            )
        if len(letters) != 3 or letters[1:] != "YX" or letters[0] not in STACKED:
            sizes = (*sizes, 1, 1)[: max(2, len(sizes))]
            return VolumeHeader(sizes, np.eye(3), np.zeros(3), None)
        size, unit = _ome_size(file) or _imagej_size(file) or (None, None)
    axes = np.eye(3) if size is None else np.diag(size)
    return VolumeHeader(sizes, axes, np.zeros(3), unit, size is not None)


def _ome_size(file: tifffile.TiffFile) -> tuple[list[float], Unit | None] | None:
    """Return the (x, y, z) voxel size that OME metadata state; the unit may be left to its default."""
    if file.ome_metadata is None:
        return None
    elements = ElementTree.fromstring(file.ome_metadata).iter()
    pixels = next(element for element in elements if element.tag.endswith("Pixels"))
    names = [f"PhysicalSize{axis}" for axis in "XYZ"]
    if any(name not in pixels.attrib for name in names):
        return None
    units = [pixels.attrib.get(f"{name}Unit", "um") for name in names]
    return [float(pixels.attrib[name]) for name in names], _unit(units)


def _imagej_size(file: tifffile.TiffFile) -> tuple[list[float], Unit | None] | None:
    """Return the (x, y, z) voxel size of a stack that ImageJ saved, if it was calibrated."""
    about = file.imagej_metadata
    tags = file.pages.first.tags
    if about is None or "spacing" not in about or "XResolution" not in tags:
        return None
    unit = _unit([about.get("unit", "")])
    if unit is None and str(about.get("unit", "pixel")) in ("pixel", "pixels"):
        return None
    voxels_per_unit = [tags[name].value for name in ("XResolution", "YResolution")]
    in_plane = [below / above for above, below in voxels_per_unit]
    return [*in_plane, float(about["spacing"])], unit


def _tiff_labels(path: Path) -> NDArray[Any]:
    import tifffile

    with _failing_on_errors(), tifffile.TiffFile(path) as file:
        compression: Any = file.pages.first.compression
        try:
            labels: NDArray[Any] = file.series[0].asarray()
        except (ValueError, ImportError) as error:
            if "imagecodecs" not in str(error):
                raise
            raise InputError(
                f"{path} is compressed by {compression.name}, which flyreg cannot read; save it "
                "uncompressed or by deflate"
            ) from error
    return labels


def _nifti_header(path: Path) -> VolumeHeader:
    import nibabel

    image: Any = nibabel.load(path)
    shape = list(image.header.get_data_shape())
    while len(shape) > 3 and shape[-1] == 1:
        shape.pop()
    if len(shape) != 3:
        return VolumeHeader(tuple(shape), np.eye(3), np.zeros(3), None)
    affine = image.affine
    if not (image.header["sform_code"] or image.header["qform_code"]):
        # the standard's method 1: nothing but voxel sizes; the library would mirror the first axis
        affine = np.diag([*image.header.get_zooms()[:3], 1.0])
    unit = _unit([image.header.get_xyzt_units()[0]])
    return VolumeHeader(
        (shape[0], shape[1], shape[2]), affine[:3, :3].astype(float), affine[:3, 3], unit
    )


def _nifti_labels(path: Path) -> NDArray[Any]:
    import nibabel

    image: Any = nibabel.load(path)
    scale = image.dataobj.slope, image.dataobj.inter
    # scaling would turn labels into floating-point numbers of eight times the size
    labels = image.dataobj.get_unscaled() if scale == (1, 0) else np.asarray(image.dataobj)
    return np.asarray(labels).T


_READERS: Mapping[str, tuple[Callable[[Path], VolumeHeader], Callable[[Path], NDArray[Any]]]] = {
    ".nrrd": (_nrrd_header, _nrrd_labels),
    ".nhdr": (_nrrd_header, _nrrd_labels),
    ".tif": (_tiff_header, _tiff_labels),
    ".tiff": (_tiff_header, _tiff_labels),
    ".nii": (_nifti_header, _nifti_labels),
    ".nii.gz": (_nifti_header, _nifti_labels),
}

ENDINGS = tuple(_READERS)
"""Endings of the files that can be read."""
