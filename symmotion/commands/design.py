"""`symmotion design`: one optimal motion through your keyframes."""

import argparse

from symmotion import checks
from symmotion.answers import Exploration, auto_knots, explore
from symmotion.commands.inputs import add_reading, progress, recording_of
from symmotion.commands.objectives import objective_by_name
from symmotion.commands.outputs import check_outputs, write_outputs
from symmotion.commands.parsing import (
    Commands,
    add_command,
    add_format_options,
    add_input,
    add_outputs,
    add_spline,
    at_fault,
    check_spline,
    say,
)
from symmotion.commands.wording import note
from symmotion.constraints import MotionConstraint, Periodic, Tolerance
from symmotion.design import affine_program, free_times_program
from symmotion.design.spans import MOST_KNOTS
from symmotion.energies import Energy, Rigidity
from symmotion.errors import InputError, SolveError
from symmotion.files.formats import rows
from symmotion.files.table import FORMATS
from symmotion.motions import Keyframes
from symmotion.program import Program
from symmotion.smoothing import is_rigid, rigid_objective
from symmotion.solvers import Solution, Solver, Status, solver_by_name
from symmotion.splines.interpolation import ENDS

EXAMPLE = """\
  symmotion design poses.tum -o motion.json motion.csv --objective rigidity+0.001*energy
  symmotion design walk.bvh --node LeftHand -o hand.glb hand.usda hand.gif"""
READ = rows(FORMATS, "read", "keyframes")
MOST_STARTS = 100_000
WRITTEN = rows(FORMATS, "write", "motion", "scene", "film")


def add(commands: Commands) -> None:
    """The command and its options."""
    parser = add_command(
        commands,
        "design",
        run,
        "one optimal motion through your keyframes",
        example=EXAMPLE,
        formats=(*READ, *WRITTEN),
    )
    add_input(parser, READ, "keyframes")
    add_outputs(parser, WRITTEN)
    parser.add_argument(
        "--objective",
        metavar="NAME",
        help="as for compare; default: rigidity, for rigid keyframes at given times with a little of how they bend",
    )
    parser.add_argument(
        "--solver", metavar="NAME", help="default: newton, and ipopt where that ends without a solution"
    )
    parser.add_argument("--periodic", action="store_true", help="close the motion with its derivatives")
    parser.add_argument("--tolerance", type=float, metavar="E", help="meet each entry of the A*ᵢ to within E only")
    parser.add_argument("--auto-knots", type=int, metavar="N", help="insert at most N knots, where they pay most")
    parser.add_argument("--explore", type=int, metavar="N", help="the lowest of the minima that N starts lead to")
    parser.add_argument("--free-times", action="store_true", help="choose the inner keyframe times too, order kept")
    parser.add_argument("--ends", default="natural", metavar="NAME", help="of the start: natural, not-a-knot, periodic")
    add_spline(parser)
    add_reading(parser, READ)
    add_format_options(parser, WRITTEN, "write", leave=["tolerance"])


def run(options: argparse.Namespace) -> None:
    """Design and write the motion."""
    _check(options)
    given = check_outputs(options, WRITTEN)
    recording = recording_of(options, READ)
    keyframes = recording.keyframes
    with at_fault("--objective"):
        objective = _objective(options, keyframes)
    try:
        with progress(options, f"{len(keyframes)} keyframes"):
            solution, found = _solve(options, keyframes, objective)
    except (InputError, SolveError) as error:
        raise type(error)(f"{options.file}: {error}") from error
    note(options, options.file, solution.notes)
    write_outputs(solution.motion, options, WRITTEN, {"up": recording.up, **given})
    say(options, solution if found is None else f"{solution}\n{found}")


def _check(options: argparse.Namespace) -> None:
    """Raise InputError for options with values that cannot be, or that do not go together."""
    check_spline(options)
    if options.tolerance is not None:
        checks.positive(options.tolerance, "--tolerance")
    if options.auto_knots is not None:
        checks.whole(options.auto_knots, 0, "--auto-knots", " of knots", most=MOST_KNOTS)
    checks.choice(options.ends, ENDS, "--ends")
    if options.solver is not None:
        with at_fault("--solver"):
            solver_by_name(options.solver)
    conditions = options.periodic or options.tolerance is not None
    if options.explore is not None:
        checks.whole(options.explore, 1, "--explore", " of starts", most=MOST_STARTS)
        if options.auto_knots is not None:
            raise InputError("--explore does not go with --auto-knots: leave one out")
    if options.auto_knots is not None and (conditions or options.free_times):
        raise InputError("--auto-knots does not go with --periodic, --tolerance or --free-times: leave one out")
    if options.free_times and conditions:
        raise InputError("--free-times does not go with --periodic or --tolerance: leave one out")


def _objective(options: argparse.Namespace, keyframes: Keyframes) -> Energy:
    """The objective that is asked for, or what suits the keyframes."""
    if options.objective is not None:
        return objective_by_name(options.objective, keyframes.dimension)
    # How they bend is weighed by the times between them.
    return rigid_objective(keyframes) if is_rigid(keyframes) and not options.free_times else Rigidity()


def _solve(options: argparse.Namespace, keyframes: Keyframes, objective: Energy) -> tuple[Solution, Exploration | None]:
    """The optimal motion that the options ask for, and what was explored for it."""
    solver = solver_by_name(options.solver or "newton")
    if options.auto_knots is not None:
        search = auto_knots(
            keyframes, degree=options.degree, objective=objective, budget=options.auto_knots, solver=solver
        )
        return search.solution, None
    program = _program(options, keyframes, objective)
    if options.explore is None:
        return _solved(program, solver, handed=options.solver is None), None
    found = explore(program, budget=options.explore, solver=solver)
    # Where no start led to a minimum, the own one says why.
    return (found.best if found.minima else _solved(program, solver, handed=options.solver is None)), found


def _program(options: argparse.Namespace, keyframes: Keyframes, objective: Energy) -> Program:
    """The program that the options ask for."""
    if options.free_times:
        return free_times_program(keyframes, degree=options.degree, refine=options.refine, objective=objective)
    constraints: list[MotionConstraint] = [Periodic()] if options.periodic else []
    if options.tolerance is not None:
        constraints.append(Tolerance(linear=options.tolerance))
    return affine_program(
        keyframes,
        degree=options.degree,
        refine=options.refine,
        objective=objective,
        constraints=constraints,
        ends=options.ends,
    )


def _solved(program: Program, solver: Solver, handed: bool) -> Solution:
    """The solution by a solver, or, `handed` on where it ends without one, by IPOPT, whose line then says so."""
    solution = solver.solve(program)
    if handed and solution.status not in (Status.SOLVED, Status.INFEASIBLE):
        other = solver_by_name("ipopt").solve(program)
        solution = other if other.status is Status.SOLVED else solution
    return solution.require()
