"""Compliant spheres by Drake's hydroelastic contact and by isocoat, in one run.

    drake_spheres.py path/to/coat_spheres

Needs the package drake. Prints two tables as CSV, each after a line with its name: `query` (one contact of two equal
spheres) and `scene` (ten spheres in a box, seconds of processor time for a simulated second).
"""

import logging
import math
import random
import statistics
import subprocess
import sys
import time

import numpy
from pydrake.all import (
    AddCompliantHydroelasticProperties,
    AddMultibodyPlant,
    AddRigidHydroelasticProperties,
    AngleAxis,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    HydroelasticContactRepresentation,
    MultibodyPlantConfig,
    ProximityProperties,
    RigidTransform,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    Sphere,
    UnitInertia,
)

RADIUS = 0.1
MASS = 1.0
MODULUS = 1e5
FRICTION = 0.5
HINTS = [2, 4, 8, 16, 32]
OVERLAPS = [0.05, 0.1, 0.2]
POSES = 6
# ISOCOAT_SCHEME_ values.
SCHEMES = {"default": 0, "polar": 2}
COAT_QUERIES = [("polar", 1e-1), ("polar", 1e-2), ("polar", 1e-3), ("polar", 3e-4), ("polar", 1e-4), ("default", 5e-3)]


def exact_force(distance):
    """Two equal spheres of pressure E (1 - r/R), by the pressure's integral over the surface in closed form."""
    half = 0.5 * distance
    return math.pi * MODULUS / (3 * RADIUS) * (RADIUS - half) ** 2 * (RADIUS + 2 * half)


def median_time(call, seconds=0.2, most=9):
    """Median processor time of a call, over as many as fit, one at least."""
    times = []
    while not times or (sum(times) < seconds and len(times) < most):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return statistics.median(times)


def new_plant(dt):
    config = MultibodyPlantConfig(time_step=dt, contact_model="hydroelastic", discrete_contact_approximation="sap")
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(config, builder)
    return builder, plant, scene_graph


def add_sphere(plant, name, hint):
    inertia = SpatialInertia(MASS, [0, 0, 0], UnitInertia.SolidSphere(RADIUS))
    body = plant.AddRigidBody(name, inertia)
    properties = ProximityProperties()
    properties.AddProperty("material", "coulomb_friction", CoulombFriction(FRICTION, FRICTION))
    AddCompliantHydroelasticProperties(RADIUS / hint, MODULUS, properties)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(RADIUS), name, properties)
    return body


class Coat:
    """The isocoat side: a program that answers lines."""

    def __init__(self, path):
        self.process = subprocess.Popen([path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        answer = self.process.stdout.readline().split()
        if not answer:
            raise RuntimeError("coat_spheres ended")
        return [float(word) for word in answer]


def pair_of_spheres(hint):
    """Two spheres: how to place them, how to ask for their contact, and its force."""
    builder, plant, scene_graph = new_plant(0.0)
    bodies = [add_sphere(plant, name, hint) for name in ("a", "b")]
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    graph_context = scene_graph.GetMyContextFromRoot(context)

    def place(turns, at):
        for body, turn, position in zip(bodies, turns, ([0.0, 0.0, 0.0], at)):
            plant.SetFreeBodyPose(plant_context, body, RigidTransform(turn, position))

    def query():
        asked = scene_graph.get_query_output_port().Eval(graph_context)
        return asked.ComputeContactSurfaces(HydroelasticContactRepresentation.kPolygon)

    def force():
        results = plant.get_contact_results_output_port().Eval(plant_context)
        each = (results.hydroelastic_contact_info(i) for i in range(results.num_hydroelastic_contacts()))
        return sum((info.F_Ac_W().translational() for info in each), start=numpy.zeros(3))

    return place, query, force


def direction(source):
    while True:
        v = numpy.array([source.uniform(-1, 1) for _ in range(3)])
        if 0.1 < numpy.linalg.norm(v) < 1:
            return v / numpy.linalg.norm(v)


def turn(source):
    return RotationMatrix(AngleAxis(source.uniform(0, math.pi), direction(source)))


def queries(coat):
    """Both sides at the same poses, one pose after the other."""
    pairs = {hint: pair_of_spheres(hint) for hint in HINTS}
    source = random.Random(5)
    for overlap in OVERLAPS:
        distance = 2 * RADIUS - overlap * RADIUS
        exact = exact_force(distance)
        rows = {}
        for _ in range(POSES):
            along = direction(source)
            turns = (turn(source), turn(source))
            for hint, (place, query, force) in pairs.items():
                place(turns, distance * along)
                taken = median_time(query)
                # Error as a vector, over the exact force; faces of the surface.
                error = numpy.linalg.norm(force() + exact * along) / exact
                faces = sum(surface.num_faces() for surface in query())
                rows.setdefault(("drake", f"R/{hint}"), []).append((error, taken, faces))
            for scheme, tolerance in COAT_QUERIES:
                got, taken, count = coat.ask("query", SCHEMES[scheme], tolerance, RADIUS, MODULUS, *(distance * along))
                rows.setdefault((scheme, tolerance), []).append((abs(got / exact - 1), taken, count))
        for (who, setting), each in rows.items():
            error = statistics.fmean(row[0] for row in each)
            taken = statistics.median(row[1] for row in each)
            count = statistics.fmean(row[2] for row in each)
            print(f"{overlap},{who},{setting},{error:.6e},{1e6 * taken:.3f},{count:.0f}", flush=True)


def starts():
    """Ten spheres above each other, a little off a line."""
    return [[0.05 * (i % 3) - 0.05, 0.06 * ((1.7 * i) % 2) - 0.06, 0.15 + 0.21 * i] for i in range(10)]


def drake_scene(hint, dt, seconds):
    builder, plant, _ = new_plant(dt)
    bodies = [add_sphere(plant, f"ball{i}", hint) for i in range(len(starts()))]
    properties = ProximityProperties()
    properties.AddProperty("material", "coulomb_friction", CoulombFriction(FRICTION, FRICTION))
    AddRigidHydroelasticProperties(properties)
    wall = 3 * RADIUS
    walls = [([0, 0, 1], 0)] + [(normal, -wall) for normal in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0])]
    for i, (normal, offset) in enumerate(walls):
        at = numpy.array(normal, dtype=float) * offset
        pose = HalfSpace.MakePose(numpy.array(normal, dtype=float), at)
        plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), f"wall{i}", properties)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for body, at in zip(bodies, starts()):
        plant.SetFreeBodyPose(context, body, RigidTransform(at))
    simulator.Initialize()
    begin = time.process_time()
    simulator.AdvanceTo(seconds)
    taken = time.process_time() - begin
    heights = [plant.EvalBodyPoseInWorld(context, body).translation()[2] for body in bodies]
    return taken, statistics.fmean(heights)


def scenes(coat, seconds=1.0):
    ends = [x for at in starts() for x in at]
    for dt, words, repeats in ((1 / 60, "1/60", 3), (1 / 240, "1/240", 1)):
        runs = {}
        for _ in range(repeats):
            for hint in (2, 4, 8):
                runs.setdefault(("drake", f"R/{hint}"), []).append(drake_scene(hint, dt, seconds))
            for scheme, tolerance in (("polar", 5e-2), ("polar", 5e-3), ("default", 5e-3)):
                figures = coat.ask("scene", SCHEMES[scheme], tolerance, RADIUS, MODULUS, MASS, FRICTION, dt, seconds,
                                   len(starts()), *ends)
                runs.setdefault((scheme, tolerance), []).append(figures)
        for (who, setting), each in runs.items():
            taken = statistics.median(run[0] for run in each) / seconds
            print(f"{words},{who},{setting},{taken:.6g},{each[0][1]:.6f}", flush=True)


def main():
    # What it says of half spaces concerns deformable bodies, of which there are none.
    logging.getLogger("drake").setLevel(logging.ERROR)
    coat = Coat(sys.argv[1])
    print("query\noverlap,who,setting,force_error,us_per_query,faces_or_evaluations", flush=True)
    queries(coat)
    print("scene\ndt,who,setting,seconds_per_second,mean_height", flush=True)
    scenes(coat)


if __name__ == "__main__":
    main()
