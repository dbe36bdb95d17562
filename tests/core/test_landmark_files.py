import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.brain_files import template_file
from flyreg_core.errors import InputError, LandmarkError
from flyreg_core.fiji_landmarks import NOT_IN_XML, write_fiji
from flyreg_core.landmark_files import (
    FORMATS,
    joined,
    read_landmark_pairs,
    to_landmark_pairs,
    to_named_pairs,
)
from flyreg_core.landmark_tables import write_bigwarp, write_opensim_pairs, write_opensim_points
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.named_pairs import NamedPair
from flyreg_core.slicer_landmarks import write_slicer

PAIR = NamedPair("peduncle", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
BIGWARP = '"Pt-0","true","1.0","2.0","3.0","4.0","5.0","6.0"\n'


def read(folder, text, name="landmarks.csv", **options):
    (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return read_landmark_pairs(folder / name, **options)


def slicer(*points, system="LPS"):
    markup = {"type": "Fiducial", "coordinateSystem": system, "controlPoints": points}
    return json.dumps({"@schema": "…", "markups": [markup]})


numbers = st.floats(allow_nan=False, allow_infinity=False)
points = st.none() | st.tuples(numbers, numbers, numbers)
names = st.text(min_size=1).map(str.strip).filter(bool)
pairs = st.lists(
    st.builds(NamedPair, names, points, points, st.booleans()),
    min_size=1,
    unique_by=lambda pair: pair.name,
).filter(lambda pairs: any(pair.source or pair.target for pair in pairs))


# Whatever is written is read again


@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.title)
@settings(deadline=None)
@given(pairs=pairs)
def test_what_a_file_can_hold_is_read_again_as_it_was_written(tmp_path_factory, kind, pairs):
    path = tmp_path_factory.mktemp("landmarks") / f"landmarks{kind.ending}"
    if any(NOT_IN_XML.search(pair.name) for pair in pairs) and kind.ending == ".points":
        with pytest.raises(LandmarkError, match="cannot hold; rename it"):
            kind.write(path, pairs)
        return
    kind.write(path, pairs)
    expected = tuple(as_held(pair, kind) for pair in pairs if kind.holds(pair))
    if any(pair.source or pair.target for pair in expected):
        assert read_landmark_pairs(path, kind.role or "source") == expected
    else:
        with pytest.raises(LandmarkError, match="holds no landmark that is placed"):
            read_landmark_pairs(path)


def as_held(pair, kind):
    """What a file tells of a landmark."""
    return NamedPair(
        pair.name,
        None if kind.role == "target" else pair.source,
        None if kind.role == "source" else pair.target,
        pair.is_active or not kind.has_flags,
    )


# BigWarp


@settings(deadline=None)
@given(pairs)
def test_bigwarp_files_round_trip(tmp_path_factory, pairs):
    path = tmp_path_factory.mktemp("bigwarp") / "landmarks.csv"
    write_bigwarp(path, pairs)
    assert read_landmark_pairs(path) == tuple(pairs)


def test_bigwarp_rows_are_quoted_without_header(tmp_path):
    write_bigwarp(tmp_path / "a.csv", [NamedPair("Pt-0", PAIR.source, None, is_active=False)])
    assert (tmp_path / "a.csv").read_text() == (
        '"Pt-0","false","1.0","2.0","3.0","Infinity","Infinity","Infinity"\n'
    )


def test_moving_is_the_source_and_fixed_the_target(tmp_path):
    assert read(tmp_path, BIGWARP) == (NamedPair("Pt-0", (1, 2, 3), (4, 5, 6)),)


def test_infinity_is_an_end_that_is_not_placed(tmp_path):
    row = BIGWARP.replace("4.0", "Infinity").replace("5.0", "Infinity").replace("6.0", "Infinity")
    assert read(tmp_path, row)[0].target is None


def test_inactive_landmarks_stay_inactive(tmp_path):
    assert not read(tmp_path, BIGWARP.replace("true", "false"))[0].is_active


def test_a_header_with_a_missing_quote_is_passed_over():
    path = template_file("JFRC2").parents[1] / "data" / "lm-em-landmarks_v14.csv"
    pairs = read_landmark_pairs(path)
    assert len(pairs) == 135
    assert pairs[0] == NamedPair(
        "Pt-1",
        (571.4000834257129, 38.85996261427087, 287.05954372673494),
        (452648.55251, 93139.92952, 92570.0),
    )


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\n\n", "\n,,,,,,,\n"])
def test_line_ends_and_blank_lines_do_not_matter(tmp_path, line_end):
    text = BIGWARP + BIGWARP.replace("Pt-0", "Pt-1")
    assert len(read(tmp_path, "\ufeff" + text.replace("\n", line_end))) == 2


def test_bigwarp_json_is_read(tmp_path):
    landmarks = {
        "type": "BigWarpLandmarks",
        "numDimensions": 3,
        "movingPoints": [[1, 2, 3], [1, 1, 1]],
        "fixedPoints": [[4, 5, 6], ["Infinity"] * 3],
        "active": [True, False],
        "names": ["a", "b"],
    }
    text = json.dumps({"type": "Thin Plate Spline", "landmarks": landmarks})
    assert read(tmp_path, text, "a.json") == (
        NamedPair("a", (1, 2, 3), (4, 5, 6)),
        NamedPair("b", (1, 1, 1), None, is_active=False),
    )


# Other programs


def test_pairs_of_opensim_creator_are_read(tmp_path):
    text = "name,source.x,source.y,source.z,dest.x,dest.y,dest.z\npeduncle,1,2,3,4,5,6\n"
    assert read(tmp_path, text) == (PAIR,)


def test_pairs_are_written_as_opensim_creator_writes_them(tmp_path):
    write_opensim_pairs(tmp_path / "a.csv", [PAIR, NamedPair("half made", (1, 1, 1), None)])
    assert (tmp_path / "a.csv").read_text() == (
        'name,source.x,source.y,source.z,dest.x,dest.y,dest.z\n"peduncle",1.0,2.0,3.0,4.0,5.0,6.0\n'
    )


def test_points_are_written_as_opensim_creator_writes_them(tmp_path):
    write_opensim_points(tmp_path / "a.csv", [PAIR], "target")
    assert (tmp_path / "a.csv").read_text() == 'name,x,y,z\n"peduncle",4.0,5.0,6.0\n'


@pytest.mark.parametrize("header", ["name,x,y,z\n", ""])
def test_points_of_opensim_creator_are_one_end(tmp_path, header):
    text = header + "peduncle,4,5,6\n"
    assert read(tmp_path, text, role="target") == (NamedPair("peduncle", None, (4, 5, 6)),)


def test_points_of_two_brains_are_joined_by_name():
    source = [NamedPair("a", (1, 1, 1), None), NamedPair("b", (2, 2, 2), None)]
    target = [NamedPair("c", None, (3, 3, 3)), NamedPair("a", None, (4, 4, 4), is_active=False)]
    assert joined(source, target) == (
        NamedPair("a", (1, 1, 1), (4, 4, 4), is_active=False),
        NamedPair("b", (2, 2, 2), None),
        NamedPair("c", None, (3, 3, 3)),
    )


@pytest.mark.parametrize(
    "name",
    ["FAFB14_mirror_landmarks", "FAFB14_maleCNS_landmarks", "MANC_FANC_landmarks_nm"],
)
def test_landmarks_of_flybrains_are_read(name):
    path = template_file("JFRC2").parents[1] / "data" / f"{name}.csv"
    pairs = read_landmark_pairs(path)
    assert len(pairs) == len(path.read_text().splitlines()) - 1
    assert pairs[0].name == "Pt-0"
    assert all(pair.source and pair.target for pair in pairs)


def test_landmarks_of_flybrains_with_blanks_are_refused_by_row():
    data = template_file("JFRC2").parents[1] / "data"
    with pytest.raises(LandmarkError, match="row 2: a coordinate is blank; fill it in or delete"):
        read_landmark_pairs(data / "FAFB14_symmetrize_landmarks_nm.csv")


# Slicer


@pytest.mark.parametrize("role", ["source", "target"])
def test_slicer_files_round_trip(tmp_path, role):
    other = "target" if role == "source" else "source"
    pairs = [NamedPair("a", (0.1, 2, 3), (4, 5, 6)), NamedPair("b", (1, 1, 1), (2, 2, 2), False)]
    write_slicer(tmp_path / "a.mrk.json", pairs, role)
    assert read_landmark_pairs(tmp_path / "a.mrk.json", role) == tuple(
        NamedPair(pair.name, is_active=pair.is_active, **{role: getattr(pair, role), other: None})
        for pair in pairs
    )


def test_an_end_that_is_not_placed_stays_so_in_slicer_files(tmp_path):
    write_slicer(tmp_path / "a.mrk.json", [PAIR, NamedPair("b", None, None)], "source")
    assert read_landmark_pairs(tmp_path / "a.mrk.json")[1] == NamedPair("b", None, None)


def test_points_saved_as_ras_are_turned_to_lps(tmp_path):
    text = slicer({"label": "a", "position": [1, 2, 3]}, system="RAS")
    assert read(tmp_path, text, "a.mrk.json")[0].source == (-1, -2, 3)


def test_points_saved_as_lps_stay_as_they_are(tmp_path):
    text = slicer({"label": "a", "position": [1, 2, 3]})
    assert read(tmp_path, text, "a.mrk.json")[0].source == (1, 2, 3)


@pytest.mark.parametrize("status", ["undefined", "preview", "missing"])
def test_slicer_points_that_are_not_defined_are_not_placed(tmp_path, status):
    text = slicer(
        {"label": "a", "position": [1, 2, 3]},
        {"label": "b", "positionStatus": status, "position": [0, 0, 0]},
    )
    assert read(tmp_path, text, "a.mrk.json")[1].source is None


FCSV = """# Markups fiducial file version = 4.13
# CoordinateSystem = %s
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,1.5,2.5,3.5,0,0,0,1,1,1,0,peduncle,,,2,0
2,4,5,6,0,0,0,1,1,0,0,"hole, upper",,
"""


@pytest.mark.parametrize("system", ["LPS", "1"])
def test_fcsv_files_are_read(tmp_path, system):
    assert read(tmp_path, FCSV % system, "a.fcsv") == (
        NamedPair("peduncle", (1.5, 2.5, 3.5), None),
        NamedPair("hole, upper", (4, 5, 6), None, is_active=False),
    )


@pytest.mark.parametrize("system", ["RAS", "0"])
def test_fcsv_points_saved_as_ras_are_turned_to_lps(tmp_path, system):
    assert read(tmp_path, FCSV % system, "a.fcsv")[0].source == (-1.5, -2.5, 3.5)


POINTS = """<?xml version="1.0" encoding="UTF-8"?>
<namedpointset version="1.0">
<pointworld set="true" name="SCLL" x="1.5" y="2.5" z="-3"/>
<pointworld set="false" name="SCLR"/>
</namedpointset>
"""


def test_points_of_fiji_are_one_end_and_may_be_still_to_be_placed(tmp_path):
    assert read(tmp_path, POINTS, "a.points") == (
        NamedPair("SCLL", (1.5, 2.5, -3), None),
        NamedPair("SCLR", None, None),
    )


def test_points_are_written_as_fiji_writes_them(tmp_path):
    write_fiji(tmp_path / "a.points", [PAIR, NamedPair("later", None, (1, 1, 1))], "source")
    text = (tmp_path / "a.points").read_text()
    assert text.startswith('<?xml version="1.0" encoding="UTF-8"?>\n<!DOCTYPE namedpointset [\n')
    assert '<pointworld set="true" name="peduncle" x="1.0" y="2.0" z="3.0" />' in text
    assert '<pointworld set="false" name="later" />' in text


@pytest.mark.parametrize("damaged", [POINTS[:-30], POINTS.replace('"2.5"', '"two"')])
def test_damaged_points_of_fiji_are_named(tmp_path, damaged):
    with pytest.raises(LandmarkError, match=r"a\.points"):
        read(tmp_path, damaged, "a.points")


# Into a project and out of it


def test_landmarks_become_interior_pairs_in_micrometres():
    assert to_landmark_pairs([PAIR], 1e-3, 1.0) == (
        LandmarkPair(
            id="user-peduncle",
            name="peduncle",
            kind="interior",
            half=None,
            source=(0.001, 0.002, 0.003),
            target=(4.0, 5.0, 6.0),
        ),
    )


def test_inactive_landmarks_have_weight_0():
    (pair,) = to_landmark_pairs([NamedPair("a", (1, 2, 3), (4, 5, 6), is_active=False)], 1, 1)
    assert pair.weight == 0


def test_half_made_pairs_stay_half_made():
    (pair,) = to_landmark_pairs([NamedPair("a", None, (4, 5, 6))], 1, 1)
    assert pair.source is None
    assert not pair.is_placed


def test_pairs_of_a_project_go_back_to_the_units_of_the_files():
    (pair,) = to_named_pairs(to_landmark_pairs([PAIR], 1e-3, 1e3), 1e-3, 1e3)
    assert pair.source == pytest.approx(PAIR.source)
    assert pair.target == pytest.approx(PAIR.target)


def test_boundary_pairs_are_not_in_landmark_files():
    pair = LandmarkPair("upper-1", "upper 1", "upper", None, 0.5, 0.5, origin="boundary")
    assert to_named_pairs([pair], 1, 1) == ()


# Bad rows, one sentence each


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("a,true,1,2,3,4,5", "row 2: 7 columns instead of 8; correct the row or delete it"),
        ("a,true,1,2,three,4,5,6", 'row 2: "three" is not a number; correct it or delete'),
        ("a,true,1,2,NaN,4,5,6", 'row 2: "NaN" is not a number; correct it or delete'),
        ("a,true,1,2,,4,5,6", "row 2: a coordinate is blank; fill it in or delete the row"),
        (",true,1,2,3,4,5,6", "row 2: the name is blank; give it one or delete the row"),
        ("a,yes,1,2,3,4,5,6", 'row 2: "yes" must be true or false'),
        ("a,true,1,2,Infinity,4,5,6", "row 2: only a part of a point is infinite"),
        ("Pt-0,true,1,2,3,4,5,6", "row 2: the name Pt-0 is used in row 1 already; rename one"),
    ],
)
def test_a_bad_row_is_named_with_its_number(tmp_path, row, sentence):
    with pytest.raises(LandmarkError, match=f"landmarks.csv, {sentence}"):
        read(tmp_path, BIGWARP + row + "\n")


@pytest.mark.parametrize("text", ["1,2,3\n", "a,true,1,2,3,4,5,6,0.5\n"])
def test_other_numbers_of_columns_are_answered_with_the_known_ones(tmp_path, text):
    with pytest.raises(LandmarkError, match=r"row 1: \d columns are not expected; .* or 4: name"):
        read(tmp_path, text)


def test_two_dimensional_bigwarp_files_are_refused(tmp_path):
    with pytest.raises(LandmarkError, match="two-dimensional BigWarp landmarks are not read"):
        read(tmp_path, '"Pt-0","true","1","2","3","4"\n')


@pytest.mark.parametrize("text", ["name,x,y,z\n", "\n\n", "a,true" + ",Infinity" * 6])
def test_a_file_without_a_placed_landmark_is_refused(tmp_path, text):
    with pytest.raises(LandmarkError, match="holds no landmark that is placed"):
        read(tmp_path, text)


def test_an_unknown_ending_is_answered_with_the_known_ones(tmp_path):
    with pytest.raises(LandmarkError, match=r"ending \.pts; landmarks are read from \.csv, \.txt"):
        read(tmp_path, "text", "a.pts")


def test_a_missing_landmark_file_is_named():
    with pytest.raises(InputError, match=r"there is no file nowhere\.csv"):
        read_landmark_pairs(Path("nowhere.csv"))


def test_damaged_json_is_named(tmp_path):
    with pytest.raises(LandmarkError, match=r"a\.mrk\.json is damaged \(Expecting .*export it"):
        read(tmp_path, slicer()[:-4], "a.mrk.json")


@pytest.mark.parametrize(
    "text",
    ["[]", "{}", '{"markups": 1}', '{"markups": [{}]}', slicer({"label": "a"}), slicer(1)],
)
def test_other_json_is_no_landmark_file(tmp_path, text):
    with pytest.raises(LandmarkError, match="is neither a Slicer markups file nor a BigWarp"):
        read(tmp_path, text, "a.json")


@pytest.mark.parametrize("position", [["x", 0, 0], [None, 0, 0], [math.nan, 0, 0]])
def test_a_bad_slicer_point_is_named_with_its_number(tmp_path, position):
    with pytest.raises(LandmarkError, match=r"a\.json, point 1: "):
        read(tmp_path, slicer({"label": "a", "position": position}), "a.json")


def test_a_bad_fcsv_row_is_named_with_its_number(tmp_path):
    with pytest.raises(LandmarkError, match=r'a\.fcsv, row 5: "q" is not a number'):
        read(tmp_path, (FCSV % "LPS").replace("2,4,5,6", "2,4,q,6"), "a.fcsv")


def test_two_dimensional_bigwarp_json_is_refused(tmp_path):
    text = json.dumps({"type": "BigWarpLandmarks", "numDimensions": 2})
    with pytest.raises(LandmarkError, match="holds landmarks in 2 dimensions, not 3"):
        read(tmp_path, text, "a.json")
