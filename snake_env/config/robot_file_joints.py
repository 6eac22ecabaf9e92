"""What files in MJCF or URDF say of joints, gains and friction; :mod:`snake_env.config.robot_file` reads the chain."""

from __future__ import annotations

import statistics
from collections.abc import Collection
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env.config.motor import Motor
from snake_env.config.robot import LOCK_STIFFNESS

Array = NDArray[np.float64]

JOINTS = (0, 1)
"""Types of transmission to a joint: mjTRN_JOINT, mjTRN_JOINTINPARENT."""


class Actuation:
    """Drives and friction of a chain in a compiled model of MuJoCo; ``joints`` are the hinges of each of its joints."""

    def __init__(self, library: Any, model: Any, joints: list[list[int]]) -> None:
        self.library, self.model, self.joints = library, model, joints
        self.hinges = [hinge for joint in joints for hinge in joint]
        self.locked = self._joints(np.flatnonzero(model.jnt_stiffness >= LOCK_STIFFNESS))
        self.limp = self._limp()

    def motors(self) -> dict[str, Any]:
        """The motor of all joints, or of each, where there is any."""
        if not any(map(np.any, self._passive.values())):
            return {}
        columns = zip(*(column.tolist() for column in self._passive.values()), strict=True)
        motors = [Motor(**dict(zip(self._passive, values, strict=True))) for values in columns]
        return {"motor": motors[0] if len(set(motors)) == 1 else self._by_joint(motors, Motor())}

    def gains(self) -> dict[str, Any]:
        """Gains of servos, one at every joint with a motor, and torque limits, where they differ between joints."""
        model, library = self.model, self.library
        servo = {int(model.actuator_trnid[k, 0]): k for k in np.flatnonzero(np.isin(model.actuator_trntype, JOINTS))}
        limits = _largest(model.jnt_actfrclimited[self.driven], model.jnt_actfrcrange[self.driven])
        columns = {}
        if self.driven and len(servo) == model.nu and set(self.driven) <= set(servo):
            chosen = [servo[hinge] for hinge in self.driven]
            gain, bias = model.actuator_gainprm[chosen, 0], model.actuator_biasprm[chosen]
            is_affine = model.actuator_biastype[chosen] == library.mjtBias.mjBIAS_AFFINE
            if (is_affine & (bias[:, 1] == -gain) & (model.actuator_gear[chosen, 0] == 1.0)).all():
                columns = {"kp": gain, "kd": -bias[:, 2]}
                own = _largest(model.actuator_forcelimited[chosen], model.actuator_forcerange[chosen])
                limits = np.minimum(limits, own)
        if (limits > 0.0).all():
            columns["torque_limit"] = limits
        found = {}
        for name, column in columns.items():
            if len(set(column.tolist())) > 1:
                found[name] = self._by_joint(column.tolist(), np.inf if name == "torque_limit" else 0.0)
        return found

    def friction(self, links: list[int]) -> dict[str, Any]:
        """Coefficients of sliding between the ground and each link, whose geom is listed, over that in the middle of
        their order, where they differ.
        """
        model, kinds = self.model, self.library.mjtGeom
        grounds = np.isin(model.geom_type, (kinds.mjGEOM_PLANE, kinds.mjGEOM_HFIELD))
        ground = next((geom for geom in np.flatnonzero(grounds).tolist() if geom not in links), None)
        of_links = [self._sliding(geom, ground) for geom in links]
        middle = statistics.median_low([mu for mu in of_links if mu] or [1.0])
        return {} if len(set(of_links)) == 1 else {"friction_factor": tuple(mu / middle for mu in of_links)}

    def _sliding(self, geom: int, ground: int | None) -> float:
        """Coefficient between two geoms: that of their pair, or as MuJoCo mixes theirs; without ground the geom's."""
        model = self.model
        for pair in range(model.npair):
            if {geom, ground} == {int(model.pair_geom1[pair]), int(model.pair_geom2[pair])}:
                return float(model.pair_friction[pair, 0]) if model.pair_dim[pair] > 1 else 0.0
        both = [geom] if ground is None else [geom, ground]
        first = model.geom_priority[both].max()
        rule = [one for one in both if model.geom_priority[one] == first]
        return float(model.geom_friction[rule, 0].max()) if model.geom_condim[rule].max() > 1 else 0.0

    @cached_property
    def driven(self) -> list[int]:
        """Hinges of the joints that are neither locked nor limp."""
        broken = (*self.locked, *self.limp)
        return [hinge for joint, hinges in enumerate(self.joints) for hinge in hinges if joint not in broken]

    def _joints(self, hinges: Collection[int]) -> tuple[int, ...]:
        """Joints of which all hinges are among these."""
        return tuple(joint for joint, own in enumerate(self.joints) if set(own) <= set(hinges))

    def undriven(self) -> list[int]:
        """Hinges that no actuator drives, where one drives another."""
        model = self.model
        driven = model.actuator_trnid[np.isin(model.actuator_trntype, JOINTS), 0]
        undriven = [hinge for hinge in self.hinges if hinge not in driven]
        return undriven if len(undriven) < len(self.hinges) else []

    def _limp(self) -> tuple[int, ...]:
        """Joints that are not locked and that nothing drives; none where actuators drive more than joints."""
        if not np.isin(self.model.actuator_trntype, JOINTS).all():
            return ()
        return tuple(joint for joint in self._joints(self.undriven()) if joint not in self.locked)

    def is_off(self, flag: str) -> bool:
        """Whether the file's option ``flag`` disables a part of the model."""
        return bool(self.model.opt.disableflags & getattr(self.library.mjtDisableBit, f"mjDSBL_{flag}"))

    @cached_property
    def _passive(self) -> dict[str, Array]:
        """Fields of the motors: armature, friction and damping of each hinge in :attr:`driven`."""
        model = self.model
        dofs = model.jnt_dofadr[self.driven]
        damping = model.dof_damping[dofs] + self._of_actuators(model.actuator_damping)
        return {
            "rotor_inertia": model.dof_armature[dofs] + self._of_actuators(model.actuator_armature),
            "gear_friction": model.dof_frictionloss[dofs] * (not self.is_off("FRICTIONLOSS")),
            "gear_damping": damping * (not self.is_off("DAMPER")),
        }

    def _by_joint(self, of_driven: list[Any], unused: Any) -> tuple[Any, ...]:
        """Values of the hinges in :attr:`driven`, joint by joint."""
        of_hinge = dict(zip(self.driven, of_driven, strict=True))
        joints = [tuple(of_hinge.get(hinge, unused) for hinge in hinges) for hinges in self.joints]
        return tuple(joint[0] if len(set(joint)) == 1 else joint for joint in joints)

    def _of_actuators(self, values: Array) -> Array:
        """What actuators add at the joints with a motor, times the squares of their gears."""
        model = self.model
        sums = np.zeros(model.njnt)
        for k in np.flatnonzero(np.isin(model.actuator_trntype, JOINTS)):
            sums[model.actuator_trnid[k, 0]] += values[k] * model.actuator_gear[k, 0] ** 2
        return sums[self.driven]


def _largest(is_limited: Array, force: Array) -> Array:
    """Largest forces to both sides."""
    return np.where(is_limited, np.minimum(-force[:, 0], force[:, 1]), np.inf)
