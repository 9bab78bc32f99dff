"""Stiffness of blocks by the compiled sum over contact points, against the sum written out."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.kernels.block_contact_stiffness import RUN, _pairwise
from dem.model.stable_step import block_stiffness, owners, point_motions, point_stiffness, scaled_masses

WALL = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.1), joint=lm.Joint(30.0, normal_stiffness=1e9))


def turned(state, angle):
    """Rotations of all blocks about axes of their own."""
    random = np.random.default_rng(3)
    axis = random.normal(size=(len(state.bodies.mass), 3))
    x = np.zeros((len(axis), 3, 3))
    x[:, 0, 1], x[:, 0, 2], x[:, 1, 2] = (axis / np.linalg.norm(axis, axis=1)[:, None]).T
    x -= x.transpose(0, 2, 1)
    return np.eye(3) + np.sin(angle) * x + (1.0 - np.cos(angle)) * x @ x


@pytest.mark.parametrize("grid", [(2, 2), (4, 8), (15, 15)])
def test_the_stiffness_of_a_block_is_the_sum_over_its_points_to_the_last_bit(grid):
    state = dem.initial_state(WALL, lm.Loads.weight(WALL), contact_points=grid)
    points, joints, turn = state.points, state.joints, turned(state, 0.3)
    seen = joints.frame @ np.swapaxes(turn[joints.block_a], 1, 2) @ turn[joints.block_b]
    expected = np.zeros((WALL.n_blocks, 6, 6))
    stiff = point_stiffness(points, joints)
    for block, arm, frame in (
        (joints.block_a, joints.arm_a, joints.frame), (joints.block_b, joints.arm_b, seen)
    ):
        g = point_motions(points, joints, arm, frame)
        part = np.einsum("mk,mki,mkj->mij", stiff, g, g)
        np.add.at(expected, block, np.add.reduceat(part, joints.start[:-1], axis=0))
    assert len(owners(joints)) == len(joints.block_a) * np.prod(grid)
    assert np.array_equal(block_stiffness(points, joints, WALL.n_blocks, turn), expected)
    wanted = np.arange(WALL.n_blocks) % 3 == 1
    part = block_stiffness(points, joints, WALL.n_blocks, turn, wanted=wanted)
    assert np.array_equal(part[wanted], expected[wanted])
    assert not part[~wanted].any()


@pytest.mark.parametrize("count", [1, 7, 8, RUN, RUN + 1, 2 * RUN + 9, 3000])
def test_rows_are_summed_in_the_order_of_numpy(count):
    rows, out = np.random.default_rng(count).normal(size=(count + 2, 5)), np.empty(5)
    _pairwise(rows, 2, count, out)
    assert out.tolist() == [np.ascontiguousarray(rows[2:, k]).sum() for k in range(5)]


def test_scaled_masses_make_every_block_as_fast_as_the_step_allows():
    # w^2 = 2 lambda(M^-1 K) is 4 safety^2 / dt^2 for each block by itself, from the definition
    state = dem.initial_state(WALL, lm.Loads.weight(WALL), contact_points=(2, 2))
    stiffness = block_stiffness(state.points, state.joints, WALL.n_blocks)
    mass, inertia = scaled_masses(stiffness, 0.5, 0.65)
    for k, m, j in zip(stiffness, mass, inertia, strict=True):
        matrix = np.zeros((6, 6))
        matrix[:3, :3], matrix[3:, 3:] = m * np.eye(3), j
        top = np.linalg.eigvals(np.linalg.solve(matrix, k)).real.max()
        assert 2.0 * top == pytest.approx(4.0 * 0.65**2 / 0.5**2, rel=1e-9)
