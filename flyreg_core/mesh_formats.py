"""What is in mesh files: bytes to vertices and faces, and back, in the unit of the file."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core import amira_format, vtk_format
from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats, Integers

Geometry = tuple[Floats, Integers]
"""Vertices (n, 3) in the file's own unit, and faces (m, 3), counter-clockwise seen from outside."""
Properties = Mapping[str, NDArray[Any]]
"""Numbers by name, one for each vertex."""

STL_HEADER, STL_FACE = 84, 50
"""Bytes of a binary STL file before the first face, and of each face."""
WRITTEN = (".ply", ".obj", ".stl", ".off", ".glb", ".vtk")
SIGNATURES = {
    ".ply": rb"ply\s",
    ".off": rb"\s*(#.*\s*)*(ST)?C?N?OFF\s",
    ".glb": rb"glTF",
    ".gltf": rb"\s*\{",
    ".vtk": rb"# vtk DataFile",
    ".surf": rb"#\s*(?i:HyperSurface)",
    ".obj": rb"(?s).*?(^|\n)\s*v\s",
}


def decode(content: bytes, path: Path) -> Geometry:
    """Return the geometry in a mesh file, all its parts together, polygons cut into triangles.

    Parameters
    ----------
    content : bytes
        The whole file.
    path : Path
        Its place, for the suffix, one of `ENDINGS`, for files that a glTF file refers to, and for
        messages.

    Raises
    ------
    InputError
        The content is of another kind, damaged or cut short, or a face uses
        a vertex that does not exist. Whether there are faces, and numbers, is not looked at.
    """
    suffix = path.suffix.lower()
    if not re.match(SIGNATURES.get(suffix, b""), content):
        raise InputError(
            f"{path} is not a mesh: its content is not what the ending {suffix} promises; "
            "export it again or correct the ending"
        )
    try:
        vertices, faces = _READERS[suffix](content, path)
    except InputError:
        raise
    except Exception as error:  # whatever a parser stumbles over in a broken file
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"{path} is damaged or cut short ({reason}); copy or export it again"
        ) from error
    _check_indices(faces, len(vertices), path)
    return vertices, faces


def decode_parts(content: bytes, path: Path) -> Mapping[str, Geometry]:
    """Return the named parts of a mesh file; one that names none is one part, named as the file.

    Parts are the groups and objects of .obj, the meshes of .gltf and .glb, the regions of .surf.

    Raises
    ------
    InputError
        As `decode` does.
    """
    whole = decode(content, path)  # tells what is wrong with the file
    match path.suffix.lower():
        case ".surf":
            vertices, regions = amira_format.decode_regions(content)
            parts = {name: (vertices, faces) for name, faces in regions.items()}
        case ".gltf" | ".glb":
            parts = {name: _merged(*_arrays(part)) for name, part in _named_meshes(content, path)}
        case ".obj":
            vertices, polygons, names = _read_obj(content, path)
            parts = {
                name: (vertices, vtk_format.triangles(itertools.compress(polygons, own)))
                for name in dict.fromkeys(names)
                if (own := [other == name for other in names])
            }
        case _:
            parts = {}
    is_named = any(name for name in parts)
    return parts if is_named else {path.stem: whole}


def check_writable(suffix: str) -> None:
    """Tell whether meshes can be written with a suffix.

    Raises
    ------
    InputError
        No format that can be written has this suffix.
    """
    if suffix.lower() not in WRITTEN:
        raise InputError(
            f"meshes cannot be written as {suffix or 'a file without ending'}; "
            f"choose one of {', '.join(WRITTEN)}"
        )


def encode(suffix: str, vertices: Floats, faces: Integers, properties: Properties) -> bytes:
    """Return the content of a mesh file; equal geometry gives equal bytes.

    PLY and VTK take the properties and keep coordinates exactly; OBJ and OFF keep coordinates
    exactly; STL and GLB round them to single precision.

    Raises
    ------
    InputError
        No format that can be written has this suffix.
    """
    check_writable(suffix)
    match suffix.lower():
        case ".ply":
            return _encode_ply(vertices, faces, properties)
        case ".vtk":
            return vtk_format.encode(vertices, faces, properties)
        case ".obj":
            return _encode_obj(vertices, faces)
        case ".off":
            return _encode_off(vertices, faces)
    import trimesh  # takes long, and few formats need it

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    content: Any = mesh.export(file_type=suffix.lower().lstrip("."))
    return bytes(content)


def _check_indices(faces: Integers, n_vertices: int, path: Path) -> None:
    wrong = ((faces < 0) | (faces >= n_vertices)).any(axis=1)
    if wrong.any():
        raise InputError(
            f"{path} is damaged: {wrong.sum():,} of {len(faces):,} faces use vertices that do not "
            f"exist (it has {n_vertices:,}); export it again"
        )


def _decode_ply(content: bytes, path: Path) -> Geometry:
    header = content.partition(b"end_header")[0]
    promised = {name: int(count) for name, count in re.findall(rb"element (\w+) (\d+)", header)}
    vertices, faces = _decode_with_trimesh(content, path)
    _check_count("vertices", len(vertices), promised.get(b"vertex", 0), path)
    _check_count("faces", len(faces), promised.get(b"face", 0), path)
    return vertices, faces


def _check_count(things: str, found: int, promised: int, path: Path) -> None:
    if found < promised:
        raise InputError(
            f"{path} is cut short: it promises {promised:,} {things} and holds {found:,}; "
            "copy or export it again"
        )


def _decode_stl(content: bytes, path: Path) -> Geometry:
    if content.lstrip().startswith(b"solid") and b"facet" in content:
        if not content.rstrip().splitlines()[-1].lstrip().startswith(b"endsolid"):
            raise InputError(f"{path} is cut short: its last line is not endsolid; copy it again")
    elif len(content) < STL_HEADER:
        raise InputError(f"{path} is not a mesh: {len(content)} bytes are too few for an STL file")
    else:
        promised = int.from_bytes(content[STL_HEADER - 4 : STL_HEADER], "little")
        _check_count("faces", (len(content) - STL_HEADER) // STL_FACE, promised, path)
    return _merged(*_decode_with_trimesh(content, path))


def _decode_gltf(content: bytes, path: Path) -> Geometry:
    return _merged(*_decode_with_trimesh(content, path))


def _merged(vertices: Floats, faces: Integers) -> Geometry:
    """Join vertices at the very same place: STL and glTF repeat them for each face or crease."""
    _, first, number = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.argsort(order, kind="stable")
    return vertices[first[order]], rank[number.reshape(-1)][faces]


def _decode_with_trimesh(content: bytes, path: Path) -> Geometry:
    vertices, faces = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)]
    for _, geometry in _named_meshes(content, path):
        start = sum(map(len, vertices))
        points, part = _arrays(geometry)
        vertices.append(points)
        faces.append(part + start)
    return np.concatenate(vertices), np.concatenate(faces)


def _named_meshes(content: bytes, path: Path) -> list[tuple[str, Any]]:
    """Return the parts of a file, each where the scene's transforms put it, with their names."""
    import trimesh

    scene = trimesh.load_scene(
        io.BytesIO(content),
        file_type=path.suffix.lower().lstrip("."),
        resolver=trimesh.resolvers.FilePathResolver(str(path)),
        process=False,
    )
    return [(str(part.metadata.get("name", "")), part) for part in scene.dump()]


def _arrays(geometry: Any) -> Geometry:
    faces = np.asarray(getattr(geometry, "faces", ()), dtype=np.int64).reshape(-1, 3)
    return np.asarray(geometry.vertices, dtype=np.float64).reshape(-1, 3), faces


def _decode_obj(content: bytes, path: Path) -> Geometry:
    vertices, polygons, _ = _read_obj(content, path)
    return vertices, vtk_format.triangles(polygons)


def _read_obj(content: bytes, path: Path) -> tuple[Floats, list[list[int]], list[str]]:
    """Return vertices, polygons as they are, and the group or object of each.

    Trimesh would drop, reorder and repeat vertices.
    """
    vertices: list[list[float]] = []
    polygons: list[list[int]] = []
    groups: list[str] = []
    group = ""
    text = content.decode("utf-8", "replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        keyword, *words = line.split() or [""]
        if keyword in ("g", "o"):
            group = " ".join(words)
        if keyword not in ("v", "f"):
            continue
        if len(words) < 3:
            raise InputError(
                f"{path} is damaged or cut short: line {number} has {len(words)} of at least 3 "
                "numbers; copy or export it again"
            )
        if keyword == "v":
            vertices.append([float(word) for word in words[:3]])
        else:
            indices = (int(word.partition("/")[0]) for word in words)
            polygons.append([_from_zero(index, len(vertices)) for index in indices])
            groups.append(group)
    return np.array(vertices, dtype=np.float64).reshape(-1, 3), polygons, groups


def _from_zero(index: int, n_vertices: int) -> int:
    """Return an OBJ index, where 1 is the first and -1 the newest vertex, counted from 0."""
    if index > 0:
        return index - 1
    return n_vertices + index if -n_vertices <= index < 0 else -1


def _decode_off(content: bytes, path: Path) -> Geometry:
    lines = (line.partition("#")[0].split() for line in content.decode("utf-8").splitlines())
    rows = [line for line in lines if line]
    rest = rows.pop(0)[1:]
    n_vertices, n_faces = (int(word) for word in (rest or rows.pop(0))[:2])
    _check_count("vertices", min(len(rows), n_vertices), n_vertices, path)
    _check_count("faces", len(rows) - n_vertices, n_faces, path)
    vertices = np.array([[float(word) for word in row[:3]] for row in rows[:n_vertices]])
    polygons = [_counted(row) for row in rows[n_vertices : n_vertices + n_faces]]
    return vertices.reshape(-1, 3), vtk_format.triangles(polygons)


def _counted(row: Sequence[str]) -> list[int]:
    count = int(row[0])
    if len(row) <= count:
        raise ValueError(f"a face promises {count} vertices and has {len(row) - 1}")
    return [int(word) for word in row[1 : count + 1]]


_READERS: Mapping[str, Callable[[bytes, Path], Geometry]] = {
    ".ply": _decode_ply,
    ".obj": _decode_obj,
    ".stl": _decode_stl,
    ".off": _decode_off,
    ".gltf": _decode_gltf,
    ".glb": _decode_gltf,
    ".vtk": vtk_format.decode,
    ".surf": amira_format.decode,
}

ENDINGS = tuple(_READERS)
"""Endings of the files that can be read."""


def _encode_ply(vertices: Floats, faces: Integers, properties: Properties) -> bytes:
    """Binary, coordinates in double precision, which trimesh's own writer halves."""
    columns = {axis: vertices[:, i] for i, axis in enumerate("xyz")}
    columns |= {name: _ply_values(values) for name, values in properties.items()}
    table = np.zeros(len(vertices), dtype=[(name, v.dtype) for name, v in columns.items()])
    for name, values in columns.items():
        table[name] = values
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("index", "<i4", 3)])
    rows["count"], rows["index"] = 3, faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property {_ply_type(values)} {name}" for name, values in columns.items()),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return "\n".join([*header, ""]).encode("ascii") + table.tobytes() + rows.tobytes()


def _ply_values(values: NDArray[Any]) -> NDArray[Any]:
    kind = "<f8" if values.dtype.kind == "f" else "u1" if values.dtype.kind == "b" else "<i4"
    return values.astype(kind)


def _ply_type(values: NDArray[Any]) -> str:
    return {"f": "double", "u": "uchar", "i": "int"}[values.dtype.kind]


def _encode_obj(vertices: Floats, faces: Integers) -> bytes:
    return _lines([*_rows("v", vertices), *_rows("f", faces + 1)])


def _encode_off(vertices: Floats, faces: Integers) -> bytes:
    counts = f"{len(vertices)} {len(faces)} 0"
    coordinates = (" ".join(map(repr, row)) for row in vertices.tolist())
    return _lines(["OFF", counts, *coordinates, *_rows("3", faces)])


def _rows(keyword: str, values: Floats | Integers) -> Iterable[str]:
    return (" ".join([keyword, *map(repr, row)]) for row in values.tolist())


def _lines(lines: Iterable[str]) -> bytes:
    return "\n".join([*lines, ""]).encode("ascii")
