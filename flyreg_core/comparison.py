"""flyreg beside other methods on the same pair of brains: the paper's Table 2."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flyreg_core.affine import AffineMap, best_affine
from flyreg_core.apart import Done, Limits, run_apart
from flyreg_core.cache import open_cache
from flyreg_core.errors import Cancelled, FlyregError
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import Booleans, Floats, SurfaceMesh
from flyreg_core.pipeline import Pipeline
from flyreg_core.point_files import PointPairs
from flyreg_core.progress import Report, ignore, within
from flyreg_core.project import Project
from flyreg_core.rivals.table import RIVAL_OF
from flyreg_core.surface_distance import Distances, measure_distances
from flyreg_core.surface_places import find_places
from flyreg_core.transform import carry

FLYREG = "flyreg"
METHODS = (*RIVAL_OF, FLYREG)
TITLES = {**{name: rival.title for name, rival in RIVAL_OF.items()}, FLYREG: FLYREG}
"""What people read instead of the names that stand in commands and files."""
AFTER_PREPARATION = (
    "boundary landmarks",
    "landmarks",
    "locators",
    "live splines",
    "spline",
    "lift",
)
"""Stages of the engine that are the registration itself, once both brains lie flat."""
OWN = "this program, from the files to the registered surface"
CANCELLED = "cancelled"
"""Status of a method that was not done when the comparison was cancelled."""
UNLIMITED = Limits(None, None)


@dataclass(frozen=True, eq=False)
class Row:
    """What one method came to; None where it came to nothing."""

    method: str
    description: str
    status: str  # "done", or a sentence that tells why not
    seconds: float | None
    peak_memory_mb: float | None
    surface: SurfaceMesh | None = None  # the moved source, in the target's frame
    distances: Distances | None = None  # a: the moved source, b: the target
    folded_share: float | None = None  # see `folded_share`
    errors_um: Floats | None = None  # (k,) of the truth's points that were carried


@dataclass(frozen=True, eq=False)
class Comparison:
    """What all methods came to on one pair of brains."""

    source: SurfaceMesh  # prepared, as the file lies
    target: SurfaceMesh
    frame: BrainFrame  # of the target
    rows: tuple[Row, ...]
    preparation_seconds: float | None  # of flyreg's time; the others are given prepared brains
    points_outside: int  # of the truth, too far from the main brain to be carried

    @property
    def is_complete(self) -> bool:
        """Tell whether nobody cancelled it before all methods were done."""
        return all(row.status != CANCELLED for row in self.rows)


def find_methods(names: Sequence[str]) -> tuple[str, ...]:
    """Return the methods of some names, in the order of `METHODS`; "icp" stands for all ICPs.

    Raises
    ------
    FlyregError
        There is no such method.
    """
    chosen: set[str] = set()
    for name in names:
        found = [each for each in METHODS if each == name or each.startswith(f"{name}-")]
        if not found:
            raise FlyregError(f"there is no method {name}; there are {', '.join(METHODS)}")
        chosen.update(found)
    return tuple(name for name in METHODS if name in chosen)


def compare(
    project: Project,
    methods: Sequence[str] = METHODS,
    truth: PointPairs | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    report: Report = ignore,
    tell: Callable[[Row], None] = lambda row: None,
) -> Comparison:
    """Return what methods come to on the brains of a project, each in a process of its own.

    flyreg prepares the brains and registers them, from nothing if it is among the methods, else
    with what the cache knows. The others get the prepared brains, the source where flyreg's affine
    alignment puts it ("none": where it lies). Whatever a rival cannot do is a row that says so; so
    is what there was no time for, if `report` raises `Cancelled` once flyreg has registered.

    Parameters
    ----------
    truth : PointPairs, optional
        Points of the source and where they belong in the target, micrometres.
    limits : Limits
        Of each rival; flyreg has none.
    tell : function of a Row
        Called with each row as soon as it is known, flyreg's first.

    Raises
    ------
    FlyregError
        flyreg itself cannot register the pair, or see `find_methods`.
    Cancelled
        `report` said so before flyreg had registered; no process is left.
    """
    methods = find_methods(methods)
    points = np.zeros((0, 3)) if truth is None else truth.source
    ends = np.zeros((0, 3)) if truth is None else truth.target
    share = 0.4 if FLYREG in methods else 0.2
    own = run_apart(
        Registering(project, points, FLYREG not in methods),
        *(UNLIMITED, within(report, 0.0, share), "registering with flyreg"),
    )
    prepared = own.value
    if not isinstance(prepared, Registered):
        raise FlyregError(own.sentence)
    inside = prepared.is_mapped
    judge = _Judge(prepared.source, prepared.target, ends[inside])
    contest = _Contest(prepared, own, points[inside], limits, judge)
    rows: dict[str, Row] = {}
    order = sorted(methods, key=lambda name: name != FLYREG)  # what is there already comes first
    try:
        for number, name in enumerate(order):
            start, end = (share + (1 - share) * n / len(order) for n in (number, number + 1))
            rows[name] = contest.row(name, within(report, start, end))
            tell(rows[name])
    except Cancelled:
        for name in (each for each in order if each not in rows):
            rows[name] = Row(name, _description(name), CANCELLED, None, None)
            tell(rows[name])
    return Comparison(
        prepared.source,
        prepared.target,
        prepared.frame,
        tuple(rows[name] for name in methods),
        prepared.preparation_seconds,
        int((~inside).sum()),
    )


def _description(name: str) -> str:
    return OWN if name == FLYREG else RIVAL_OF[name].description


@dataclass(frozen=True, eq=False)
class Registered:
    """What a comparison needs of flyreg's registration."""

    source: SurfaceMesh  # prepared
    target: SurfaceMesh
    frame: BrainFrame  # of the target
    to_target: AffineMap  # the alignment
    registered: Floats  # (n, 3), the source's vertices on the target
    points: Floats  # (k, 3), the truth's points, carried
    is_mapped: Booleans  # (k,)
    preparation_seconds: float


@dataclass(frozen=True, eq=False)
class Registering:
    """The task of registering a project by flyreg."""

    project: Project
    points: Floats  # (k, 3), of the source, micrometres
    is_cached: bool

    def run(self) -> Registered:
        """Return what follows from the project."""
        pipeline = Pipeline(open_cache() if self.is_cached else None)
        results = pipeline.run(self.project, measure=False)
        carried = carry(self.points, results)
        return Registered(
            results.source.surface,
            results.target.surface,
            results.target.frame,
            results.alignment.to_target,
            results.registration.surface.vertices,
            carried.points,
            carried.is_mapped,
            sum(s for stage, s in results.seconds.items() if stage not in AFTER_PREPARATION),
        )


@dataclass(frozen=True, eq=False)
class MovedSource:
    """Where a method puts the source's vertices and the truth's points."""

    vertices: Floats  # (n, 3)
    points: Floats  # (k, 3)


@dataclass(frozen=True, eq=False)
class Rivalling:
    """The task of one rival."""

    name: str
    source: SurfaceMesh
    target: SurfaceMesh
    start: AffineMap
    points: Floats  # (k, 3), of the source

    def run(self) -> MovedSource:
        """Return where the rival puts everything."""
        faces = self.source.faces[:, ::-1] if self.start.is_mirroring else self.source.faces
        source = SurfaceMesh(self.start(self.source.vertices), faces)
        moved = RIVAL_OF[self.name].run(source, self.target, ignore)
        points = moved.carry(self.start(self.points)) if len(self.points) else self.points
        return MovedSource(moved.vertices, points)


@dataclass(frozen=True, eq=False)
class _Judge:
    """Measures all methods alike."""

    source: SurfaceMesh
    target: SurfaceMesh
    ends: Floats  # (k, 3), where the truth's points belong

    def row(
        self, name: str, description: str, done: Done, moved: MovedSource | None, report: Report
    ) -> Row:
        """Return what a method came to."""
        if moved is None or not np.isfinite(moved.vertices).all():
            status = done.sentence if moved is None else "put vertices at no finite place"
            return Row(name, description, status, None, done.peak_memory_mb)
        surface = facing_outwards(self.source, moved.vertices)
        return Row(
            *(name, description, done.sentence, done.seconds, done.peak_memory_mb, surface),
            measure_distances(surface, self.target, report),
            folded_share(self.source, surface, self.target),
            np.linalg.norm(moved.points - self.ends, axis=1),
        )


@dataclass(frozen=True, eq=False)
class _Contest:
    """Runs and measures one method after the other."""

    prepared: Registered
    own: Done  # flyreg's
    points: Floats  # (k, 3), of the truth, in the source
    limits: Limits
    judge: _Judge

    def row(self, name: str, report: Report) -> Row:
        """Return what a method came to."""
        prepared, inside = self.prepared, self.prepared.is_mapped
        if name == FLYREG:
            done = self.own
            moved: MovedSource | None = MovedSource(prepared.registered, prepared.points[inside])
        else:
            still = AffineMap(np.eye(3), np.zeros(3))
            start = prepared.to_target if RIVAL_OF[name].is_aligned else still
            task = Rivalling(name, prepared.source, prepared.target, start, self.points)
            done = run_apart(task, self.limits, within(report, 0.0, 0.8), f"running {TITLES[name]}")
            moved = done.value if isinstance(done.value, MovedSource) else None
        return self.judge.row(name, _description(name), done, moved, within(report, 0.8, 1.0))


def facing_outwards(source: SurfaceMesh, vertices: Floats) -> SurfaceMesh:
    """Return a source with moved vertices, its faces turned if that mirrored it as a whole."""
    is_mirrored = best_affine(source, vertices).is_mirroring
    return SurfaceMesh(vertices, source.faces[:, ::-1] if is_mirrored else source.faces)


def folded_share(source: SurfaceMesh, moved: SurfaceMesh, target: SurfaceMesh) -> float:
    """Return which share of the source's area a method has folded over.

    That is the area of faces whose normal points against that of the target at the nearest place to their
    middle, and which were turned there: by more than a right angle from where the affine map
    nearest to the whole movement takes their normal. The first alone would count what merely lies
    badly, which a rigid move cannot help; the second alone, faces that rightly follow the target
    into a furrow. So rigid and affine methods have none, whatever the brains.

    Parameters
    ----------
    source, moved : SurfaceMesh
        With the same faces, or all of them turned if `moved` is mirrored: both seen from outside.
    """
    overall = best_affine(source, moved.vertices)
    expected = source.face_normals @ np.linalg.inv(overall.matrix)
    is_turned = np.einsum("ij,ij->i", moved.face_normals, expected) < 0
    turned = np.flatnonzero(is_turned)
    middles = moved.vertices[moved.faces[turned]].mean(axis=1)
    below = target.face_normals[find_places(middles, target).face]
    is_against = np.einsum("ij,ij->i", moved.face_normals[turned], below) < 0
    return float(source.face_areas[turned[is_against]].sum() / source.face_areas.sum())
