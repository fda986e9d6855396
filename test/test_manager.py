"""The fake manager's rules, as read from ROBOTIS' controller."""
from __future__ import annotations

import math

import pytest

from dr_eureka.simulation.joints import ALL_JOINTS
from dr_eureka.simulation.manager import DIRECT_CONTROL_MODE, MODULE_JOINTS, RefusalCode, RobotisManager


def codes(refusals):
    return [refusal.code for refusal in refusals]


@pytest.fixture
def manager():
    return RobotisManager()


def test_the_manager_knows_31_joints_in_alphabetical_order_and_frees_all_at_start(manager):
    modules = manager.joint_modules()
    assert len(modules) == 31 and list(modules) == sorted(modules)
    assert list(modules)[:4] == ["head_p", "head_y", "l_arm_el_y", "l_arm_grip"] and list(modules)[-1] == "torso_y"
    assert set(modules.values()) == {"none"}
    assert not any(name.endswith("grip_1") for name in modules)


def test_a_free_joint_takes_its_goal(manager):
    assert manager.set_joint_states(["head_p", "l_arm_grip"], [0.5, 1.15]) == ({"head_p": 0.5, "l_arm_grip": 1.15}, [])


@pytest.mark.parametrize("names, positions, code", [
    (["head_p", "l_arm_grip_1"], [0.5, 0.5], RefusalCode.UNKNOWN_JOINT),
    (["head_p", "head_y"], [0.5], RefusalCode.UNEQUAL_LENGTHS),
    (["head_p", "head_y"], [0.5, math.nan], RefusalCode.NOT_FINITE),
    (["head_p", "head_y"], [math.inf, 0.0], RefusalCode.NOT_FINITE),
])
def test_a_malformed_command_moves_nothing_and_is_refused_by_name(manager, names, positions, code):
    goals, refusals = manager.set_joint_states(names, positions)
    assert goals == {} and codes(refusals) == [code]


def test_a_refusal_names_what_was_wrong_and_what_was_expected(manager):
    _, (refusal,) = manager.set_joint_states(["l_arm_thumb_y"], [0.0])
    assert "'l_arm_thumb_y'" in str(refusal) and "r_arm_wr_y" in str(refusal) and "\n" not in str(refusal)


def test_joints_of_a_module_do_not_obey_directly_but_the_others_do(manager):
    manager.enable_ctrl_module("head_control_module")
    goals, refusals = manager.set_joint_states(["head_p", "l_arm_grip"], [0.5, 1.0])
    assert goals == {"l_arm_grip": 1.0} and codes(refusals) == [RefusalCode.OWNED_BY_MODULE]


def test_enabling_a_module_takes_all_of_its_joints_and_no_other(manager):
    manager.enable_ctrl_module("manipulation_module")
    modules = manager.joint_modules()
    assert {name for name, module in modules.items() if module == "manipulation_module"} == MODULE_JOINTS["manipulation_module"]
    assert len(MODULE_JOINTS["manipulation_module"]) == 15 and len(MODULE_JOINTS["walking_module"]) == 12
    manager.enable_ctrl_module("base_module")
    assert set(manager.joint_modules().values()) == {"base_module"}


@pytest.mark.parametrize("none", ["none", ""])
def test_none_frees_every_joint(manager, none):
    manager.enable_ctrl_module("action_module")
    assert manager.enable_ctrl_module(none) == []
    assert set(manager.joint_modules().values()) == {"none"} and manager.enabled_modules == frozenset()


def test_an_unknown_module_changes_nothing(manager):
    manager.enable_ctrl_module("gripper_module")
    before = manager.joint_modules()
    assert codes(manager.enable_ctrl_module("Gripper_Module")) == [RefusalCode.UNKNOWN_MODULE]
    assert manager.joint_modules() == before


def test_joints_are_assigned_one_by_one_and_impossible_ones_refused(manager):
    refusals = manager.set_joint_ctrl_modules(
        ["head_y", "l_arm_grip", "l_leg_kn_p", "no_joint", "torso_y"],
        ["head_control_module", "head_control_module", "sitting_module", "base_module", "base_module"])
    assert codes(refusals) == [RefusalCode.UNKNOWN_JOINT, RefusalCode.JOINT_NOT_IN_MODULE, RefusalCode.UNKNOWN_MODULE]
    modules = manager.joint_modules()
    assert (modules["head_y"], modules["l_arm_grip"], modules["torso_y"]) == ("head_control_module", "none", "base_module")


def test_unequal_lists_assign_nothing(manager):
    assert codes(manager.set_joint_ctrl_modules(["head_y"], [])) == [RefusalCode.UNEQUAL_LENGTHS]
    assert set(manager.joint_modules().values()) == {"none"}


def test_a_module_that_loses_a_joint_is_switched_off_for_its_others_too(manager):
    manager.enable_ctrl_module("head_control_module")
    manager.set_joint_ctrl_modules(["head_y"], ["none"])
    assert manager.joint_modules()["head_p"] == "head_control_module"
    assert "head_control_module" not in manager.enabled_modules
    assert codes(manager.set_joint_states(["head_p"], [0.1])[1]) == [RefusalCode.OWNED_BY_MODULE]


def test_direct_control_mode_moves_nothing_and_other_words_are_refused(manager):
    assert manager.set_control_mode(DIRECT_CONTROL_MODE) == []
    goals, refusals = manager.set_joint_states(["head_p"], [0.5])
    assert goals == {} and codes(refusals) == [RefusalCode.DIRECT_CONTROL]
    assert codes(manager.set_control_mode("direct")) == [RefusalCode.UNKNOWN_MODE]
    assert manager.control_mode == DIRECT_CONTROL_MODE
    manager.set_control_mode("MotionModuleMode")
    assert manager.set_joint_states(["head_p"], [0.5])[0] == {"head_p": 0.5}


def test_repeated_commands_change_nothing_more(manager):
    for _ in range(4):
        manager.enable_ctrl_module("gripper_module")
    assert sum(module == "gripper_module" for module in manager.joint_modules().values()) == 2
    assert manager.enabled_modules == {"gripper_module"}
    assert set(ALL_JOINTS) == set(manager.joint_modules())
