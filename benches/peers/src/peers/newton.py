"""Newton's XPBD, controlled by lines of text: a scene as JSON, then `tick` and `report`."""

import json
import sys

import numpy as np
import warp as wp

answers = sys.stdout
sys.stdout = sys.stderr  # Warp prints to the standard output, which is for answers only.
wp.config.log_level = wp.LOG_ERROR

import newton  # noqa: E402  (after Warp was set to be quiet)

# Jacobi iterations add the corrections of all elements of a particle. Elements are softened for
# this number of them per particle, so that the sum does not overshoot.
EDGES_OF_A_PARTICLE = 12.0
TETRAHEDRA_OF_A_PARTICLE = 24.0


def modulus(vertices, tetrahedra, weight, h):
    """Lamé parameters [Pa] at which a regular tetrahedron of the mean volume is soft enough."""
    corners = vertices[np.array(tetrahedra)]
    volume = float(np.mean(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))) / 6.0)
    side_squared = (6.0 * np.sqrt(2.0) * volume) ** (2.0 / 3.0)
    # The sum of w|∇C|² of C = tr FᵀF − 3 is four times that of the squared inverse heights.
    stiffness_of_rest = weight * 24.0 / side_squared
    return 1.0 / (volume * h * h * TETRAHEDRA_OF_A_PARTICLE * stiffness_of_rest)


def build(scene):
    """A model with all bodies of the scene."""
    h = scene["step"]
    weights = np.array(scene["inverse_masses"])
    mean_weight = float(np.mean(weights[weights > 0]))
    stiffness = 1.0 / (EDGES_OF_A_PARTICLE * mean_weight * h * h)
    builder = newton.ModelBuilder(
        gravity=(0.0, scene["gravity"], 0.0), up_axis=newton.Axis.Y
    )
    vertices = np.array(scene["vertices"])
    tetrahedra = scene["tetrahedra"]
    k = modulus(vertices, tetrahedra, mean_weight, h) if tetrahedra else 0.0
    for offset in scene["offsets"]:
        first = builder.particle_count
        for x, weight in zip(vertices + np.array(offset), weights):
            mass = 1.0 / weight if weight > 0 else 0.0
            builder.add_particle(wp.vec3(*x), wp.vec3(0.0), mass, radius=0.0)
        for a, b in scene["edges"]:
            builder.add_spring(first + a, first + b, stiffness, 0.0, 0.0)
        for corners in tetrahedra:
            moved = [first + corner for corner in corners]
            builder.add_tetrahedron(*moved, k_mu=k, k_lambda=k, k_damp=0.0)
    return builder.finalize(device="cpu")


def main():
    scene = json.loads(sys.stdin.readline())
    model = build(scene)
    solver = newton.solvers.SolverXPBD(model, iterations=1)
    control = model.control()
    # Warp compiles its kernels when they are first used.
    solver.step(model.state(), model.state(), control, None, scene["step"])
    # As Newton's examples do: the substeps of a tick are recorded, and replayed without Python.
    states = [model.state(), model.state()]
    with wp.ScopedCapture(device="cpu") as recorded:
        for _ in range(scene["substeps"]):
            states[0].clear_forces()
            solver.step(states[0], states[1], control, None, scene["step"])
            states.reverse()
    answers.write("built\n")
    answers.flush()
    for line in sys.stdin:
        if line.strip() == "tick":
            wp.capture_launch(recorded.graph)
            answers.write("done\n")
        else:
            positions = states[0].particle_q.numpy().astype(float)
            finite = np.isfinite(positions)
            report = {
                "edges": int(model.spring_count),
                "tetrahedra": int(model.tet_count),
                "positions": [
                    [float(x) if ok else None for x, ok in zip(row, mask)]
                    for row, mask in zip(positions, finite)
                ],
            }
            answers.write(json.dumps(report) + "\n")
        answers.flush()


main()
