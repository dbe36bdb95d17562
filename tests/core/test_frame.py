from itertools import permutations

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.errors import InputError
from flyreg_core.frame import find_frame
from tests.shapes import box

TEMPLATES = ("JFRC2", "FCWB", "IS2", "T1", "JRC2018F", "JRC2018M", "FAFB14", "JRCFIB2022M_brain")


def test_a_brain_is_widest_from_left_to_right_and_thinnest_from_front_to_back():
    frame = find_frame(box((600.0, 300.0, 150.0))[0])
    assert (frame.left_right, frame.dorso_ventral, frame.antero_posterior) == (0, 1, 2)


def test_the_front_and_the_top_lie_where_coordinates_are_small():
    frame = find_frame(box((600.0, 300.0, 150.0))[0])
    assert frame.anterior.tolist() == [0, 0, -1]
    assert frame.dorsal.tolist() == [0, -1, 0]


@pytest.mark.parametrize("name", TEMPLATES)
def test_every_template_lies_as_its_images_do(name):
    frame = find_frame(read_brain(open_brain(name)).vertices)
    assert (frame.left_right, frame.dorso_ventral, frame.antero_posterior) == (0, 1, 2)


@pytest.mark.parametrize("size", [p for p in permutations((600, 300, 150)) if p != (600, 300, 150)])
def test_a_brain_that_lies_otherwise_is_refused_with_its_size_and_the_remedy(size):
    words = rf"the brain lies turned in its file: it measures {size[0]} x {size[1]} x {size[2]} um"
    with pytest.raises(InputError, match=words + r" along x, y and z; turn it so that x runs"):
        find_frame(box(size)[0] + np.array([1000.0, 0, 0]))
