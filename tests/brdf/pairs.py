"""Directions for tests of measured tables, and an isotropic pair from half and difference angles."""

from __future__ import annotations

import numpy as np


def uniform_directions(seed: int, count: int) -> np.ndarray:
    """Unit vectors uniform over the upper hemisphere, float64, `(count, 3)`."""
    rng = np.random.default_rng(seed)
    z, turn = rng.random(count), 2.0 * np.pi * rng.random(count)
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)


def turned(v: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """v turned about a unit axis (Rodrigues)."""
    along = axis * (axis @ v) * (1.0 - np.cos(angle))
    return v * np.cos(angle) + np.cross(axis, v) * np.sin(angle) + along


def half_difference_angles(wi: np.ndarray, wo: np.ndarray) -> tuple[float, float, float]:
    """theta_h, theta_d and phi_d in [0, pi), by turning the half vector to the pole (Rusinkiewicz 1998), in float64."""
    half = (wi + wo) / np.linalg.norm(wi + wo)
    theta_h, phi_h = np.arccos(min(half[2], 1.0)), np.arctan2(half[1], half[0])
    straight = turned(wi, np.array([0.0, 0.0, 1.0]), -phi_h)
    difference = turned(straight, np.array([0.0, 1.0, 0.0]), -theta_h)
    return theta_h, np.arccos(min(difference[2], 1.0)), np.arctan2(difference[1], difference[0]) % np.pi
