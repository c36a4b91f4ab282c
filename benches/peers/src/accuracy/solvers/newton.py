"""Newton's XPBD and VBD for one process, controlled by lines of text.

    build JSON       answers with a number for the model
    advance N TICKS  answers with the processor time of these ticks [s]
    place N HEX      moves the movable particles, without velocity
    drop N           forgets the model

Answers begin with `ok` or `error`, and end with the positions as hexadecimal `float32`.
"""

import json
import sys
import time

import numpy as np
import warp as wp

answers = sys.stdout
sys.stdout = sys.stderr  # Warp prints to the standard output, which is for answers only.
wp.config.log_level = wp.LOG_ERROR

import newton  # noqa: E402  (after Warp was set to be quiet)

# Substeps of a graph at most: capturing takes as long as stepping without one.
SUBSTEPS_OF_A_GRAPH = 16


def colors(count, elements):
    """Groups of particles of which no two share an element, greedily. Newton's own coloring omits springs."""
    neighbors = [set() for _ in range(count)]
    for element in elements:
        for particle in element:
            neighbors[particle].update(element)
    color = [-1] * count
    for particle in range(count):
        taken = {color[other] for other in neighbors[particle]}
        color[particle] = next(c for c in range(count) if c not in taken)
    color = np.array(color)
    return [np.flatnonzero(color == c) for c in range(color.max() + 1)]


class Model:
    """A body in a solver, with a setting."""

    def __init__(self, scene):
        builder = newton.ModelBuilder(
            gravity=(0.0, scene["gravity"], 0.0), up_axis=newton.Axis.Y
        )
        for x, weight in zip(scene["vertices"], scene["inverse_masses"]):
            mass = 1.0 / weight if weight > 0 else 0.0
            builder.add_particle(wp.vec3(*x), wp.vec3(0.0), mass, radius=0.0)
        for a, b in scene["edges"]:
            builder.add_spring(a, b, scene["edge_stiffness"], 0.0, 0.0)
        mu, lame = scene["k_mu"], scene["k_lambda"]
        for corners in scene["tetrahedra"]:
            builder.add_tetrahedron(*corners, k_mu=mu, k_lambda=lame, k_damp=0.0)
        elements = scene["edges"] + scene["tetrahedra"]
        builder.set_coloring(colors(len(scene["vertices"]), elements))
        self.model = builder.finalize(device="cpu")
        iterations = scene["iterations"]
        if scene["solver"] == "vbd":
            self.solver = newton.solvers.SolverVBD(
                self.model, iterations=iterations, particle_enable_self_contact=False
            )
        else:
            self.solver = newton.solvers.SolverXPBD(
                self.model,
                iterations=iterations,
                soft_body_relaxation=scene["relaxation"],
            )
        self.movable = np.array(scene["inverse_masses"]) > 0
        self.capture(scene["substeps"])

    def capture(self, substeps):
        """Records the substeps of a tick; an odd number of them ends in the other state."""
        self.states = [self.model.state(), self.model.state()]
        control = self.model.control()
        h = 1.0 / (60.0 * substeps)
        # Warp compiles its kernels when they are first used, which cannot be recorded.
        self.solver.step(self.model.state(), self.model.state(), control, None, h)
        length = min(substeps, SUBSTEPS_OF_A_GRAPH)
        self.launches = substeps // length
        self.graphs = []
        for _ in range(1 + length % 2):
            with wp.ScopedCapture(device="cpu") as recorded:
                for _ in range(length):
                    self.solver.step(*self.states, control, None, h)
                    self.states.reverse()
            self.graphs.append(recorded.graph)

    def advance(self, ticks):
        """Steps, and returns the processor time [s]."""
        turn = len(self.graphs) == 2
        start = time.process_time()
        for _ in range(ticks * self.launches):
            wp.capture_launch(self.graphs[0])
            if turn:
                self.graphs.reverse()
                self.states.reverse()
        return time.process_time() - start

    def place(self, text):
        """Moves the movable particles, without velocity."""
        state = self.states[0]
        positions = state.particle_q.numpy()
        moved = np.frombuffer(bytes.fromhex(text), dtype="<f4").reshape(-1, 3)
        positions[self.movable] = moved[self.movable]
        state.particle_q.assign(positions)
        state.particle_qd.zero_()

    def positions(self):
        """The positions as text."""
        return self.states[0].particle_q.numpy().astype("<f4").tobytes().hex()


def answer(models, line):
    """Does what a line says."""
    action, _, rest = line.strip().partition(" ")
    if action == "build":
        number = max(models, default=0) + 1
        models[number] = model = Model(json.loads(rest))
        counts = f"{model.model.spring_count} {model.model.tet_count}"
        return f"{number} {counts} {model.positions()}"
    number, _, rest = rest.partition(" ")
    model = models[int(number)]
    if action == "advance":
        seconds = model.advance(int(rest))
        return f"{seconds!r} {model.positions()}"
    if action == "place":
        model.place(rest)
        return model.positions()
    del models[int(number)]
    return ""


def main():
    models = {}
    for line in sys.stdin:
        try:
            text = f"ok {answer(models, line)}"
        except Exception as error:  # The peer reports it; other models go on.
            text = f"error {type(error).__name__}: {error}".replace("\n", " ")
        answers.write(text + "\n")
        answers.flush()


main()
