"""Elements and attributes of a URDF joint that nobody reads: refused if they place a frame, else warned of."""

from __future__ import annotations

import numpy as np
import pytest
from chains import chain, pinocchio_pose

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.loading import load_arm

GOOD = chain(('one', 'revolute', {}), ('two', 'revolute', {}))
END = '</joint>'


def with_element(text: str) -> str:
    """Return the robot with an element added to joint 'one'."""
    return GOOD.replace(END, text + END, 1)


@pytest.mark.parametrize(
    ('known', 'misspelt'),
    [('origin', 'orgin'), ('origin', 'Origin'), ('origin', 'ORIGIN'), ('origin', 'origins'), ('axis', 'axes'),
     ('axis', 'Axis'), ('mimic', 'mimik')],
)  # fmt: skip
def test_a_misspelt_element_that_places_a_frame_is_refused_with_the_place_and_the_name_meant(known, misspelt):
    text = with_element('<mimic joint="two"/>') if known == 'mimic' else GOOD
    with pytest.raises(ModelError, match=f"'one': unknown element <{misspelt}>") as error:
        load_arm(text.replace(f'<{known} ', f'<{misspelt} ', 1))
    assert known in str(error.value)


def test_an_element_that_places_a_frame_is_refused_inside_another_one():
    text = GOOD.replace('<parent link="base"/>', '<parent link="base"><origin xyz="0 0 1"/></parent>')
    with pytest.raises(ModelError, match="'one': <origin> is inside <parent>; expected it directly inside <joint>"):
        load_arm(text)


@pytest.mark.parametrize(
    ('element', 'hint'),
    [('<dynamic damping="1"/>', 'did you mean dynamics'), ('<pose>0 0 1 0 0 0</pose>', 'known: '),
     ('<hardwareInterface>x</hardwareInterface>', 'known: '), ('<safety_controler/>', 'did you mean safety_')],
)  # fmt: skip
def test_another_unknown_element_is_ignored_with_a_warning(element, hint):
    arm = load_arm(with_element(element))
    tag = element[1:].partition('>')[0].partition(' ')[0].rstrip('/')
    (warning,) = arm.warnings
    assert warning.startswith(f"joint 'one': the unknown element <{tag}> is ignored; {hint}")


def test_of_an_element_that_appears_twice_the_first_one_counts_as_pinocchio_has_it():
    text = with_element('<origin xyz="0 0 5"/>')
    arm = load_arm(text)
    assert arm.warnings == ("joint 'one': <origin> appears 2 times; the first one counts",)
    expected = pinocchio_pose(text, arm.base_frame, arm.tip_frame, {'one': 0.3, 'two': -0.4})
    np.testing.assert_allclose(arm.forward([0.3, -0.4]), expected, atol=1e-12)


@pytest.mark.parametrize(('key', 'meant'), [('velocty', 'velocity'), ('lowr', 'lower'), ('uper', 'upper')])
def test_a_misspelt_attribute_of_a_limit_is_warned_of_with_the_name_meant(key, meant):
    if meant == 'upper':  # a missing upper limit counts as 0
        text = GOOD.replace('lower="-2.0" upper="2.0"', 'lower="-2.0" upper="2.0" uper="1.0"', 1)
    elif meant == 'lower':
        text = GOOD.replace('lower="', 'lowr="', 1)
    else:
        text = GOOD.replace('velocity="', 'velocty="', 1)
    (warning,) = load_arm(text).warnings
    assert warning == f"joint 'one': the unknown attribute {key!r} of <limit> is ignored; did you mean {meant}?"


def test_a_misspelt_soft_limit_is_warned_of():
    text = with_element('<safety_controller soft_lower_limit="-1" soft_uper_limit="1" soft_upper_limit="1"/>')
    (warning,) = load_arm(text).warnings
    assert "'soft_uper_limit' of <safety_controller> is ignored; did you mean soft_upper_limit" in warning


@pytest.mark.parametrize(
    'element', ['<gz:orgin/>', '<dynamics damping="1"/>', '<calibration rising="0"/>', '<!-- orgin -->']
)
def test_elements_of_urdf_and_of_other_programs_with_a_prefix_give_no_warning(element):
    assert load_arm(with_element(element)).warnings == ()
