"""Wrong types, swapped arguments, units as text, NaN, empty lists: each ends in a named error, not in Python's own."""

import re

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.calibration.joint_model import JointModel
from limitmason.capacity import Steps
from limitmason.diagnosis import Noise, Study
from limitmason.diagnosis.simulate import several
from limitmason.errors import InputError
from limitmason.geometry import box

J, STIFF = lm.Joint(33.0), lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=5e8)
W = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=J)
L = lm.Loads.horizontal(W)
NAN = float("nan")
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
PATH = "path must be the name of a file, got (None|3|5)$"
SITE = lm.codes.GroundSpectrum(0.15, 2.45, 0.28)
TIE = lm.Tie(1, W.centroids[1], None, (0.0, 0.0, -0.1), yield_force=1.0)
DRAWN = lm.study.Random(lm.study.uniform(1.0, 2.0))
ONE = lm.Parameter("x", 1.0, (0.5, 2.0))
HOLD = dem.Hold(3)
PLATE, JACK = dem.Drive({1: {"x": 1.0}}), dem.Servo(5e3)
PAIR = W.with_supports([lm.Support(1, dofs=("x",))])
TURN = lm.SupportMotion(rotation=(0, 1, 0))
MODES = lm.modes(lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=2, joint=STIFF))
TOLD = "progress must be a function of a line of text, got 3: print is one"
UNIT = {"unit": (0.4, 0.2, 0.2), "joint": J}


def BUILD(specimen):
    return W, L


def faces_with(number):
    """A cube with one number of a vertex in place of another."""
    cube = box((0, 0, 0), (1, 1, 1))
    return lm.Assembly.from_polyhedra([(cube.vertices, [(0, 3, 2, number), *cube.faces[1:]])], joint=J)


@pytest.fixture(scope="module")
def a():
    return lm.limit_analysis(W, L)


WRONG = {
    "swapped, limit": (lambda _: lm.limit_analysis(L, W), "assembly must be an Assembly"),
    "swapped, pushover": (lambda _: lm.pushover(L, W, to=0.01), "assembly must be an Assembly"),
    "swapped, simulate": (lambda _: dem.simulate(dem.Settle(), W), "must be an Assembly"),
    "swapped, mechanism": (lambda a: lm.figures.mechanism(a, W), "model must be an Assembly"),
    "swapped, view": (lambda a: lm.view(a, W), "must be an Assembly"),
    "no prediction": (lambda _: lm.figures.mechanism(W, None), "prediction must be a Prediction"),
    "loads for prediction": (lambda _: lm.figures.contact_forces(W, L), "prediction must be a Prediction"),
    "frames as text": (lambda a: lm.view(W, a, frames="many"), "frames must be a finite number, got 'many'"),
    "negative scale": (lambda a: lm.view(W, a, scale=-1), "scale must be positive"),
    "file for answer": (lambda _: lm.view(W, "wall.html"), "a file to write is path="),
    "prediction for a table": (lambda a: lm.figures.side_by_side(a), r"result must be a SideBySide \(of lm.compare\)"),
    "assembly for answer": (lambda _: lm.force_table(W), "answer must be a Prediction"),
    "mode by name": (lambda _: lm.modes(W).plot("first"), "mode must lie between 1 and 3, got 'first'"),
    "modes of loads": (lambda _: lm.modes(L), "a Loads has no vibration"),
    "count of modes": (lambda _: lm.modes(W, 2.5), "count must lie between"),
    "half a vertex": (lambda _: faces_with(1.4), "'block-0': expected .* faces must be whole numbers"),
    "endless vertex": (lambda _: faces_with(np.inf), "'block-0': expected"),
    "length as text, push": (lambda _: dem.push(W, dem.Drive({1: {"x": 1.0}}), to="1mm"), r"to \[m\] must be numbers"),
    "length as text, pushover": (lambda _: lm.pushover(W, L, to="5mm"), "to"),
    "length as text, wall": (lambda _: lm.build.wall(length="2 m", courses=3, **UNIT), "length"),
    "length as text, gap": (lambda _: lm.formats.clean([SQUARE], "3mm"), "gap must be a finite number, got '3mm'"),
    "length as text, opening": (lambda _: lm.build.Opening("1", 0.6, 0.8, 0.8), r"opening: x \[m\]"),
    "seconds as text": (lambda _: lm.proven_range(W, L, time_limit="10 s"), "time_limit must be a finite number"),
    "angle as text": (lambda _: lm.Joint("33 deg"), "friction_angle_deg must be a number, got '33 deg'"),
    "no angle": (lambda _: lm.Joint(None), "friction_angle_deg must be a number, got None"),
    "NaN, angle": (lambda _: lm.Joint(NAN), "friction_angle_deg is NaN"),
    "NaN, radius": (lambda _: lm.build.arch(radius=NAN, thickness=0.1, width=1, voussoirs=9, joint=J), "radius"),
    "NaN, record": (lambda _: dem.BaseMotion((0.0, NAN, 1.0), 0.01), "samples that are not finite"),
    "NaN, measured": (lambda _: lm.compare(W, L, ("associative",), NAN), "measured must be a finite number"),
    "measured as text": (lambda _: lm.compare(W, L, ("associative",), ["0.3"]), "measured must be a finite number"),
    "no methods": (lambda _: lm.compare(W, L, []), "methods: name at least one"),
    "no outlines": (lambda _: lm.formats.clean([]), "outlines: give at least one closed polygon"),
    "no stages": (lambda _: dem.simulate(W, []), "stages: give at least one"),
    "None for stages": (lambda _: dem.simulate(W, None), "stages must be a list of Stage, got None"),
    "no layers": (lambda _: lm.formats.outlines.named_layers([]), "layers: name at least one"),
    "layers by number": (lambda _: lm.formats.outlines.named_layers(3), "layers must be a list of str, got 3"),
    "None for fixed": (lambda _: lm.Assembly.from_polygons([SQUARE], thickness=1, joint=J, fixed=None), r"fixed=\[\]"),
    "file for outlines": (lambda _: lm.Assembly.from_polygons("w.json", thickness=1, joint=J), "outlines must be a"),
    "file for a record": (lambda _: dem.BaseMotion("record.csv", 0.01), r"BaseMotion.from_csv\('record.csv'\)"),
    "drive without axis": (lambda _: dem.Drive({"x": 0.005}), "moves of block 'x' must read"),
    "supports by name": (lambda _: W.with_supports(["base"]), r"supports\[0\] must be a Support, got 'base'"),
    "ties by number": (lambda _: W.with_ties(3), "ties must be a list of Tie, got 3"),
    "one case": (lambda _: lm.load_region(W, L, L), r"cases must be a list: write \[case\]"),
    "loads of text": (lambda _: lm.Loads.horizontal("wall"), "loads are made of an Assembly, got str"),
    "bounds before start": (lambda _: lm.Parameter("a", (0.1, 5.0), 0.5), "stand behind the start"),
    "curve of text": (lambda _: lm.Curve("a", "b"), "displacement must be numbers, got 'a'"),
    "answer as loads": (lambda a: lm.formats.write("a.json", W, a), "loads must be a Loads, got Prediction"),
    "loads as an answer": (lambda _: lm.formats.write_vtu("a.vtu", W, L), "prediction must be a Prediction, got Loads"),
    "loads as a model": (lambda _: lm.formats.write_json("a.json", L), "assembly must be an Assembly, got Loads"),
    "drawn NaN far": (lambda a: lm.formats.write_vtu("a.vtu", W, a, amplitude=NAN), "amplitude must be a finite"),
    "row without b": (
        lambda _: lm.formats.write_measured("no.csv", {"a": "m", "b": "m"}, [{"a": 1.0}]), r"rows\[0\] has no 'b'"),
    "path behind": (lambda _: lm.formats.write(W, "a.json"), r"write\(path, assembly\)"),
    "shapes missing": (lambda _: lm.mac(lm.modes(W), None), "b must be Modes"),
    "loads times text": (lambda _: L.scaled(live="a"), "live must be a finite number, got 'a'"),
    "curve at text": (lambda _: lm.Curve([0, 1], [0, 1]).at("a"), "displacement must be numbers, got 'a'"),
    "no record": (lambda _: dem.BaseMotion([]), "two samples"),
    "no sensors": (lambda _: lm.vibration.ModalTest(None, [1.0], [[1.0]]), "sensors must be a list"),
    "sensor without direction": (lambda _: lm.vibration.ModalTest([((0, 0, 1), (0, 0, 0))], [1.0], [[1.0]]), "zero"),
    "report of nothing": (lambda _: lm.figures.structure_report(W, L, None, "a.html"), "must be a SideBySide"),
    "no file, report": (lambda _: lm.figures.assessment_report(lm.assess(W, L, SITE), None), PATH),
    "no file, drawing": (lambda _: lm.formats.read_drawing(None), PATH),
    "no file, svg": (lambda _: lm.formats.read_svg(None, scale=1.0), PATH),
    "no file, read": (lambda _: lm.formats.read(3), PATH),
    "no file, model": (lambda _: lm.formats.write_json(None, W), PATH),
    "no file, template": (lambda _: lm.formats.write_model_template(None), PATH),
    "no file, table": (lambda a: lm.force_table(a, W).to_csv(None), PATH),
    "no file, scene": (lambda a: lm.view(W, a).save(None), PATH),
    "no folder": (lambda _: lm.compare(W, L, ("associative",), store=5), PATH),
    "scene as a picture": (lambda a: lm.view(W, a, "wall.png"), "a scene is a page, its name ends in .html"),
    "template as a text": (lambda _: lm.formats.write_model_template("w.doc"), "ends in .json, a model, or in .svg"),
    "noise as text": (lambda _: Noise("5%"), "noise must be numbers, got '5%'"),
    "no loads to draw": (lambda _: lm.study.monte_carlo(W, 3, joints={}), r"build must be a pair \(assembly, loads\)"),
    "drawn, swapped": (lambda _: lm.study.sobol((L, W), 4, joints={}), r"build must be a pair \(assembly, loads\)"),
    "samples as text": (lambda _: lm.study.monte_carlo((W, L), "9", joints={"cohesion": DRAWN}), "samples must be"),
    "half a worker": (lambda _: lm.study.sweep(abs, {"a": [1]}, workers=1.5), "and a whole number, got 1.5"),
    "workers as text": (lambda _: lm.study.sweep(abs, {"a": [1]}, workers="two"), "and a whole number, got 'two'"),
    "no rule": (lambda _: lm.study.monte_carlo((W, L), 2, joints={"cohesion": DRAWN}, stop=3), "stop must be a Stop"),
    "no workers": (lambda _: lm.study.sweep(abs, {"a": [1]}, workers=0), "workers must be at least 1"),
    "words fail": (lambda _: lm.study.fragility(lm.study.sweep(dict, {"a": [1], "b": ["x"]}), "a", "b"), "column 'b'"),
    "one value to sweep": (lambda _: lm.study.sweep(abs, {"a": 3}), r"parameter 'a' must be a list of values, \[3\]"),
    "text to sweep": (lambda _: lm.study.sweep(abs, {"a": "bc"}), "parameter 'a' must be a list of values"),
    "several of nothing": (lambda _: several(BUILD, {})({}), r"name a method, \{'peak': 'limit'\}"),
    "several by a list": (lambda _: several(BUILD, ["limit"]), "answers must read {'peak': 'limit'}"),
    "several, swapped": (lambda _: several({"peak": "limit"}, BUILD), "build must be a function"),
    "no law of a crack": (lambda _: lm.build.with_potential_cracks(W, {}, 40), "joint must be a Joint, got 40"),
    "cracks in a list": (lambda _: lm.build.with_potential_cracks(W, [3], J), r"planes must read {'block': \(point"),
    "angles": (lambda _: lm.Joint(np.array([33.0, 30.0])), "friction_angle_deg must be a number"),
    "no terms": (lambda _: lm.Joint(33.0, terms=None), r"terms must be a list of terms of the law, got None"),
    "way of the ground": (lambda _: dem.BaseMotion([0, 1], direction=(1, 0)), "direction must be three finite numbers"),
    "force as text": (lambda _: L.with_point_load(W, 1, "5 kN"), "force on block 1 must be numbers, got '5 kN'"),
    "jack as text": (lambda _: L.with_precompression(W, "5 kN", block=1), "precompression force must be a finite"),
    "one opening": (lambda _: lm.build.wall(length=2, courses=4, openings={"x": 1}, **UNIT), "openings must be a list"),
    "control by number": (lambda _: lm.pushover(W, L, control=1), r"control must be 'live' or \(block, 'x' or"),
    "control, no axis": (lambda _: lm.pushover(W, L, control=()), "control must be 'live' or"),
    "gaps as text": (lambda _: lm.pushover(W, L, gaps="none"), r"gaps \[m\] must be numbers, got 'none'"),
    "endless gaps": (lambda _: lm.pushover(W, L, grid=(2, 2), gaps=[np.inf] * 24), "gaps must be .* finite and not"),
    "steps by number": (lambda _: lm.pushover(W, L, steps=100), "steps must be a Steps, got 100"),
    "no steps": (lambda _: lm.pushover(W, L, steps={}), "steps must be a Steps, got dict"),
    "half a try": (lambda _: Steps(most=2.5), "steps: most must be a whole number"),
    "start of numbers": (lambda _: lm.pushover(W, L, start=3), "start must be a PushoverCurve, got 3"),
    "initial of numbers": (lambda _: lm.pushover(W, L, initial=3), "initial must be a Prediction, got 3"),
    "settings by number": (lambda _: dem.collapse(W, L, 0.01), "settings must be a DemSettings, got 0.01"),
    "settings of a push": (lambda _: dem.collapse(W, L, dem.PushSettings()), "must be a DemSettings, got PushSettings"),
    "settings in a list": (lambda _: dem.push(W, PLATE, to=1e-3, settings={}), "settings must be a PushSettings"),
    "no checks": (lambda _: dem.DemSettings(error_budget=None), r"error_budget must be several .*, or \(\) for none"),
    "points of corners": (lambda _: dem.collapse(W, L, contact_points=(2, 2), contact_model="vertices"),
                          r"contact_points=\(2, 2\) are not used by contact_model='vertices'"),
    "points of corners, run": (lambda _: dem.simulate(W, HOLD, contact_points=(2, 2), contact_model="vertices"),
                               r"contact_points=\(2, 2\) are not used"),
    "way in way": (lambda _: dem.push(W, PLATE, to=[[1e-3]]), r"to must be a displacement \[m\] or a path"),
    "hold to settle": (lambda _: dem.PushSettings(settle=HOLD), "settle must be a Settle, got Hold"),
    "check as text": (lambda _: dem.PushSettings(rate_check="no"), "rate_check must be one of True, False, got 'no'"),
    "no file of a push": (lambda _: dem.push(W, PLATE, to=1e-3, checkpoint=3), PATH),
    "damped twice": (lambda _: dem.push(W, dem.Drive({1: {"x": 1.0}}, damping=dem.Damping(0.7)), to=1e-3,
                                        damping=dem.Damping(0.2)), "damping is .* in the drive and .* in the settings"),
    "calm twice": (lambda _: dem.push(W, dem.Drive({1: {"x": 1.0}}, calm=1e-3), to=1e-3, calm=1e-2),
                   "calm is 0.001 in the drive and 0.01 in the settings"),
    "driven twice": (lambda _: dem.push(W, dem.Drive({1: {"x": 1.0}, W.blocks[1].name: {"z": 1.0}}), to=1e-3),
                     "a Drive names block '.*' twice"),
    "two jacks": (lambda _: dem.simulate(W, dem.Hold(3, servo={1: JACK, W.blocks[1].name: JACK})), "has one already"),
    "resumed number": (lambda _: dem.resume(3, HOLD), "history must be a History, got 3"),
    "damping by number": (lambda _: dem.simulate(W, HOLD, damping=0.5), "damping must be a Damping, got 0.5"),
    "damping of a stage": (lambda _: dem.simulate(W, dem.Hold(3, damping=0.5)), r"stage 0 \(Hold\): damping must be"),
    "steps as text": (lambda _: dem.simulate(W, dem.Hold("3")), r"stage 0 \(Hold\): steps must be a finite number"),
    "servo by number": (lambda _: dem.simulate(W, dem.Hold(3, servo={1: 5e3})), "servo of block 1 must be a Servo"),
    "moved as text": (lambda _: dem.simulate(W, dem.Hold(3, stop_when_moved="1mm")), "stop_when_moved must be"),
    "half a step": (lambda _: dem.simulate(W, dem.Hold(10.5)), r"steps must be a whole number of at least 1, got 10.5"),
    "half a step, settle": (lambda _: dem.Settle(max_steps=10.5), "Settle: max_steps must be a whole number"),
    "half a step, gently": (lambda _: dem.Settle(gently=10.5), "Settle: gently must be a whole number"),
    "servos in a list": (lambda _: dem.simulate(W, dem.Hold(3, servo=[5e3])), "servo must be a mapping"),
    "push as text": (lambda _: dem.Servo("5 kN"), "Servo: force must be a finite number, got '5 kN'"),
    "damping as text": (lambda _: dem.Damping(local="much"), "Damping: local must be a finite number"),
    "endless damping": (lambda _: dem.Damping(adaptive=np.inf), "Damping: adaptive must be a finite number"),
    "drive in a list": (lambda _: dem.Drive([1], steps=3), "Drive: displacement must be a mapping"),
    "calm as text": (lambda _: dem.Drive({1: {"x": 1.0}}, steps=3, calm="yes"), "Drive: calm must be a finite number"),
    "ramp of nothing": (lambda _: dem.simulate(W, dem.Ramp(1.0, 3)), "scales live loads, and there are none"),
    "factor NaN": (lambda _: dem.simulate(W, HOLD, factors=(1, 1, NAN, 0, 0)), "factors: each must be a finite number"),
    "searches": (lambda _: dem.simulate(W, HOLD, detect_every=2.5), "detect_every must be a whole number"),
    "checkpoints": (lambda _: dem.simulate(W, HOLD, checkpoint_every=1.5), "checkpoint_every must be a whole number"),
    "back in time": (lambda _: dem.simulate(W, dem.Hold(duration=1), mode="dynamic", dt=-1e-4), "dt must be positive"),
    "no time": (lambda _: dem.simulate(W, dem.Hold(duration=1), mode="dynamic", dt=0.0), "dt must be positive"),
    "table, angle": (lambda _: dem.tilt_test(W, to_deg="45"), "to_deg must be a finite number, got '45'"),
    "table, steps": (lambda _: dem.tilt_test(W, steps="many"), "steps must be a finite number, got 'many'"),
    "table, halvings": (lambda _: dem.tilt_test(W, halvings=2.5), "halvings must be a whole number of at least 0"),
    "table, samples": (lambda _: dem.tilt_test(W, sample=0), "sample must be a whole number of at least 1, got 0"),
    "table, moved": (lambda _: dem.tilt_test(W, moved_limit=-1.0), "moved_limit must be positive, got -1.0"),
    "load, moved": (lambda _: dem.collapse(W, L, moved_limit=-1.0), "moved_limit must be positive, got -1.0"),
    "load, steps": (lambda _: dem.collapse(W, L, max_steps=0), "max_steps must be a whole number of at least 1"),
    "load, rest": (lambda _: dem.collapse(W, L, equilibrium=0.0), "equilibrium must be positive, got 0.0"),
    "load, step": (lambda _: dem.collapse(W, L, first_increment=NAN), "first_increment must be a finite number"),
    "load, damping": (lambda _: dem.collapse(W, L, damping=0.5), "damping must be a Damping, got 0.5"),
    "load, joints": (lambda _: dem.collapse(W, L, joint_options=3), "joint_options must be a JointOptions, got 3"),
    "push, steps": (lambda _: dem.PushSettings(steps=1000.5), "steps must be a whole number of at least 1, got 1000.5"),
    "push, longest": (lambda _: dem.PushSettings(longest="1 h"), "longest must be a finite number, got '1 h'"),
    "tolerance below zero": (lambda _: dem.Settle(tolerance=-1.0), "Settle: tolerance must not be negative"),
    "axis in the plane": (lambda _: dem.Tilt(5.0, steps=3, axis=(1, 0)), "Tilt: axis must be three finite numbers"),
    "factors as text": (lambda _: dem.simulate(W, HOLD, factors="dead"), "factors must be numbers, got 'dead'"),
    "store by number": (lambda _: dem.simulate(W, HOLD, store=3), "store must be a Store"),
    "one parameter": (lambda _: lm.calibrate(abs, {"a": lm.Target(1, 0.1)}, ONE), r"write \[parameter\]"),
    "report for a model": (lambda _: lm.figures.contact_report(W.contact_report()), "model must be an Assembly"),
    "path for a report": (
        lambda _: lm.figures.contact_report(W, "contacts.png"), "report must be a ContactReport, got 'contacts.png'"),
    "kind that is none": (lambda _: W.with_joints(J, kinds=["beds"]), "kinds must be one of .*got 'beds'"),
    "law by a number": (lambda _: W.with_joints(lambda joint: 3), r"joints\(joint\) must be a Joint, got 3"),
    "no material": (lambda _: W.with_material(None), "material must be a limitmason.Material"),
    "cases in a list": (lambda _: lm.predict_cases(W, [L]), "cases must be a mapping of loads by name, got list"),
    "a block around a hole": (
        lambda _: lm.Assembly.from_polygons([SQUARE, [(0.2, 0.2), (0.8, 0.2), (0.8, 0.8)]], thickness=1.0, joint=J),
        "one lies in the other: .* draw a block around a hole in two parts"),
    "density as text": (lambda _: lm.build.column(
        width=1, depth=1, unit_height=1, courses=1, joint=J, density="2000"), "density must be a finite number"),
    "densities as text": (lambda _: lm.Assembly.from_polygons([SQUARE], thickness=1.0, joint=J, density=["2000"]),
                          "density must be a number"),
    "no row": (lambda _: lm.build.layout([None], **UNIT), r"rows\[0\] must be numbers with spaces between"),
    "half a course": (lambda _: lm.mechanisms.stack(width=1, course_height=1, courses=2.5, friction=1), "courses must"),
    "no course": (lambda _: lm.mechanisms.sloping_crack_limit(0.6, 1.0, 0), "courses must be a whole number"),
    "half a tie": (lambda _: lm.strengthen(W, L, [TIE], most=1.5), "most must be a whole number of at least 1"),
    "plane as text": (lambda _: lm.limit_analysis(W, L, in_plane="no"), "in_plane must be True or False, got 'no'"),
    "dead check": (lambda _: lm.limit_analysis(W, L, check_dead_load="no"), "check_dead_load must be True or False"),
    "verbose as text": (lambda _: lm.limit_analysis(W, L, verbose="no"), "verbose must be True or False"),
    "proof as text": (lambda _: lm.limit_analysis(W, L, "non-associative", prove="no"), "prove must be True or False"),
    "path as text": (lambda _: lm.stability(W, path="no"), "path must be True or False"),
    "soil as list": (lambda _: lm.codes.GroundSpectrum(0.1, 2.5, 0.3, soil=[1]), "soil must be one of"),
    "sample outside": (lambda _: lm.Curve([0, 1], [0, 1]).point(7), "number of a sample, 0 to 1, got 7"),
    "sample by name": (lambda _: lm.Curve([0, 1], [0, 1]).point("x"), "number of a sample, 0 to 1, got 'x'"),
    "no column": (lambda _: lm.study.Table(({"a": 1},))["x"], "no column 'x'; columns: a"),
    "no column, where": (lambda _: lm.study.Table(({"a": 1},)).where(x=1), "no column 'x'; columns: a"),
    "width as text": (lambda _: lm.figures.print_style("a").__enter__(), "width must be a finite number, got 'a'"),
    "load on nothing": (lambda _: L.with_point_load(None, 1, (1, 0, 0)), "loads are made of an Assembly, got None"),
    "block outside": (lambda _: L.of_blocks([99]), "order must be numbers of blocks, 0 to 5"),
    "block from the end": (lambda _: L.of_blocks([-1]), "order must be numbers of blocks"),
    "half a block": (lambda _: L.of_blocks([1.5]), "order must be numbers of blocks"),
    "blocks as marks": (lambda _: L.of_blocks([True, False]), "order must be numbers of blocks"),
    "freedom by number": (lambda _: lm.Support(0, dofs=3), "block 0: dofs must be names out of"),
    "held as text": (lambda _: lm.Support(0, translations="no"), "translations must be True or False"),
    "method of a model": (lambda _: JointModel(W, "foo", L), "unknown method 'foo'"),
    "progress as text": (lambda _: dem.simulate(W, HOLD, progress="x"), "progress must be a function"),
    "option of a thrust": (lambda _: lm.thrust(W, 0, direction=(1, 0, 0), torsion_limit=True), "'torsion_limit' is no"),
    "option of a settlement": (lambda _: lm.settlement_analysis(W, 0, check_dead_load=True), "'check_dead_load' is no"),
    "option of a turn": (lambda _: lm.settlement_analysis(PAIR, 0, direction=TURN, verbose=True), "'verbose' is no"),
    "a joint twice": (lambda _: lm.thrust(W, cut=W.joint_names[:1] * 2), "cut: a joint is named twice"),
    "ties that may harm": (lambda _: lm.strengthen(W, L, [TIE], flow_rule="non-associative"), "associative flow rule"),
    "proof in words": (lambda _: lm.strengthen(W, L, [TIE], proof="all"), "proof must be a finite number"),
    "one axle": (lambda _: lm.axle_envelope(W, lm.Loads.weight(W), 3, level=1.0), "axles must be a list, got 3"),
    "rows of places": (lambda _: lm.axle_envelope(W, lm.Loads.weight(W), [(0, 1)], level=1, positions=[[0, 1]]),
                       "positions must be finite numbers"),
    "no place": (lambda _: lm.axle_envelope(W, lm.Loads.weight(W), [(0, 1)], level=1, positions=[NAN]), "positions"),
    "inputs in a list": (lambda _: Study([{}] * 2, BUILD, [1, 2], Noise(0.1), nuisance=["a"]), "nuisance must be"),
    "true metres": (lambda _: lm.build.wall(length=True, courses=2, **UNIT), "length must be a finite number"),
    "ragged box": (lambda _: lm.build.wall(length=2, courses=2, plan="box", return_length=1, ends="ragged", **UNIT),
                   "closed plan has no free end"),
    "ragged in words": (lambda _: lm.build.layout(["1 1"], ragged="no", **UNIT), "ragged must be True or False"),
    "dense in words": (lambda _: lm.build.layout(["1"], top_beam=0.1, beam_density="a", **UNIT), "of block 'beam'"),
    "floor on nothing": (lambda _: lm.build.with_floor(None, mass=1.0, joint=J), "assembly must be an Assembly"),
    "cracks in nothing": (lambda _: lm.build.with_potential_cracks(None, {}, J), "assembly must be an Assembly"),
    "ring through the axis": (lambda _: lm.build.dome(radius=1, thickness=1.5, courses=3, lunes=6, joint=J), "no room"),
    "loads of another wall": (lambda _: L + L.of_blocks([0]), "loads for 6 blocks and loads for 1 have no sum"),
    "rows of no case": (lambda _: L.rows("x"), "case must be one of 'dead', 'live'"),
    "kinds in a list": (lambda _: W.with_joints(J, kinds=[["bed"]]), "kinds must be one of"),
    "flag for an angle": (lambda _: lm.Joint(np.True_), "friction_angle_deg must be a number"),
    "angle without end": (lambda _: lm.Joint(10**400), "friction_angle_deg must be finite"),
    "endless metres": (lambda _: lm.build.wall(length=10**400, courses=2, **UNIT), "length must be a finite number"),
    "metres in bytes": (lambda _: lm.build.wall(length=b"2", courses=2, **UNIT), "length must be a finite number"),
    "angle in words": (lambda _: W.contact_report(angle_deg="x"), "angle_deg must be a finite number"),
    "beam on nothing": (lambda _: lm.ring_beam(None, [(0, 0, 0)] * 2, yield_force=1), "assembly must be a Blockwork"),
    "polygon in words": (lambda _: lm.Interface(0, 1, "x", (0, 0, 1), J, "bed"), "polygon of an interface must be"),
    "flat normal": (lambda _: lm.Interface(0, 1, SQUARE, (0, 0, 1), J, "bed"), r"polygon of an interface must have"),
    "points in words": (lambda _: lm.limit_analysis(W, L, contact_model="grid", grid=("a", 3)), "must be numbers, got"),
    "progress, pushover": (lambda _: lm.pushover(W, L, to=1e-3, progress=3), TOLD),
    "progress, search": (lambda _: lm.limit_analysis(W, L, flow_rule="non-associative", progress=3), "of a trial"),
    "progress, compare": (lambda _: lm.compare(W, L, ("associative",), progress=3), TOLD),
    "progress, sweep": (lambda _: lm.study.sweep(abs, {"x": [1.0]}, progress=3), TOLD),
    "progress, table": (lambda _: lm.comparison.table(source="ferris-tin-loi-2001", progress=3), TOLD),
    "progress, collapse": (lambda _: dem.collapse(W, L, progress=3), "progress must be a function of a multiplier"),
    "progress, push": (lambda _: dem.push(W, PLATE, to=1e-3, progress=3), "progress must be a function of a sample"),
    "names, MAC": (lambda _: lm.figures.mac_matrix(lm.mac(MODES, MODES), names=("x",)), r"names are two, .*'x'"),
    "settlement of nothing": (lambda _: lm.settlement_analysis(W, None), "support"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_end_in_an_error_that_names_them(name, a):
    call, message = WRONG[name]
    with pytest.raises(InputError) as said:
        call(a)
    text = str(said.value)
    assert re.search(message, text), text
    assert not re.search("NoneType|has no attribute|ufunc|unpack|could not convert|<.* object at", text), text


@pytest.mark.exact
def test_a_wrong_law_in_a_file_is_called_a_joint_once(tmp_path):
    path = tmp_path / "wall.json"
    lm.formats.write_model_template(path)
    text = path.read_text(encoding="utf-8").replace('"friction_angle_deg": 33.0', '"friction_angle_deg": -33.0')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as said:
        lm.formats.read_json(path)
    assert str(said.value) == f"{path}: joint: friction_angle_deg = -33.0 must not be negative"


@pytest.mark.exact
def test_numbers_come_through_the_checks_as_they_are():
    curve = lm.Curve([0, 1, 2], np.array([0, 1, 1]))
    assert curve.load.tolist() == [0.0, 1.0, 1.0]
    assert lm.comparison.comparing.measured_range((1, 3)) == (1.0, 2.0, 3.0)


def test_an_answer_that_holds_a_prediction_is_told_which_field_to_give():
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=5, joint=lm.Joint(45.0))
    thrust, stands = lm.thrust(arch, "base-right"), lm.stability(arch, tilts=())
    for answer, field in ((thrust, r"\.states\[0\]"), (stands, r"\.state$")):
        with pytest.raises(InputError, match=f"must be a Prediction .*: give its {field}"):
            lm.force_table(answer)
